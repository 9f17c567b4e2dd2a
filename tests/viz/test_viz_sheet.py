"""Contact sheets and styles."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dloftbs import viz
from dloftbs.errors import InputError
from dloftbs.viz.lettering import Text, wrapped
from dloftbs.viz.path import Path, complement, dashes


def plain(height, width, value=200):
    return np.full((height, width, 3), value, np.uint8)


@pytest.mark.parametrize(("count", "columns"), [(1, 4), (3, 4), (4, 4), (5, 4), (7, 2)])
def test_sheet_has_the_rows_and_columns(count, columns):
    sheet = viz.contact_sheet([plain(90, 160)] * count, columns=columns, tile_width=160)
    across, down = min(count, columns), math.ceil(count / columns)
    gutter = 4
    assert sheet.shape == (down * (90 + gutter) + gutter, across * (160 + gutter) + gutter, 3)
    assert (sheet == 200).all(axis=2).sum() == count * 90 * 160


def test_mixed_sizes_keep_their_aspect():
    pictures = [plain(100, 200, 250), plain(300, 100, 251), plain(2, 1, 252), np.ones((50, 50), bool)]
    sheet = viz.contact_sheet(pictures, columns=2, tile_width=100)
    for value, (height, width) in {250: (50, 100), 251: (100, 33), 252: (100, 50)}.items():
        y, x = np.nonzero((sheet == value).all(axis=2))
        assert (np.ptp(y) + 1, np.ptp(x) + 1) == (height, width)


def test_titles_add_bars_and_letters():
    pictures = [plain(90, 160, 100)] * 2
    bare = viz.contact_sheet(pictures, tile_width=160)
    titled = viz.contact_sheet(pictures, ["one", "a title that is much too long for so narrow a tile"], tile_width=160)
    assert titled.shape[0] > bare.shape[0]
    assert titled.shape[1] == bare.shape[1]
    assert (titled > 200).all(axis=2).sum() > 20


def test_pictures_are_left_alone():
    picture = np.random.default_rng(0).integers(0, 255, (40, 40, 3), dtype=np.uint8)
    before = picture.copy()
    viz.contact_sheet([picture], tile_width=40)[:] = 0
    assert np.array_equal(picture, before)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"pictures": []}, "at least one picture, got \\["),
        ({"titles": ["a", "b"]}, "as many as pictures, 1, got 2"),
        ({"columns": 0}, "columns must be an integer in 1.*, got 0"),
        ({"columns": 1.5}, "columns must be an integer in 1.*, got 1.5"),
        ({"tile_width": 3}, "tile_width must be an integer in 16.*, got 3"),
        ({"pictures": [np.zeros((3, 3, 3))]}, "uint8, got .*float64"),
        ({"pictures": [np.zeros((0, 3, 3), np.uint8)]}, "at least one pixel"),
    ],
)
def test_wrong_arguments_are_refused(arguments, message):
    with pytest.raises(InputError, match=message):
        viz.contact_sheet(**{"pictures": [plain(10, 10)], **arguments})


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"palette": ()}, "palette must be a tuple of one colour or more"),
        ({"palette": ((0, 0),)}, r"three integers in 0..255.*got \(0, 0\)"),
        ({"ink": (0, 0, 256)}, r"three integers in 0..255.*got \(0, 0, 256\)"),
        ({"line_px": 0.0}, "line_px must be a positive number, got 0.0"),
        ({"text_px": math.nan}, "text_px must be a positive number, got nan"),
        ({"panel_px": True}, "panel_px must be an integer in 1..1000000, got True"),
        ({"panel_px": 100.5}, "panel_px must be an integer in 1..1000000, got 100.5"),
        ({"halo_opacity": 1.5}, "halo_opacity must be a number in 0..1, got 1.5"),
    ],
)
def test_wrong_styles_are_refused(change, message):
    with pytest.raises(InputError, match=message):
        viz.Style(**change)


def test_colours_repeat_and_differ():
    style = viz.Style()
    n = len(style.palette)
    assert style.colour(n + 2) == style.colour(2)
    assert len(set(style.palette)) == n


def test_complement_is_what_is_left():
    assert complement([], 10.0) == [(0.0, 10.0)]
    assert complement([(6.0, 8.0), (2.0, 3.0)], 10.0) == [(0.0, 2.0), (3.0, 6.0), (8.0, 10.0)]
    assert complement([(-1.0, 4.0), (3.0, 12.0)], 10.0) == []


@pytest.mark.parametrize("length", [1.0, 10.0, 33.0, 500.0])
def test_dashes_fill_a_span_evenly(length):
    parts = dashes((5.0, 5.0 + length), 8.0, 6.0)
    spaces = np.diff([5.0, *(end for part in parts for end in part), 5.0 + length])[::2]
    assert parts
    assert np.allclose(spaces, spaces[0])
    assert all(high > low for low, high in parts)


def test_a_path_is_measured_by_arc_length():
    corner = Path(np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 30.0]]), np.array([0.0, 0.5, 1.0]))
    assert corner.length == 40.0
    assert corner.arc_at(0.75) == 25.0
    assert corner.point(25.0).tolist() == [10.0, 15.0]
    assert corner.piece((5.0, 15.0)).tolist() == [[5.0, 0.0], [10.0, 0.0], [10.0, 5.0]]
    assert corner.direction(20.0, 1.0).tolist() == [0.0, 1.0]


def test_text_is_cut_and_wrapped_to_fit():
    long = Text("a long line of text", 10.0)
    short = long.shortened(60)
    assert short.text.endswith("...")
    assert short.size[0] <= 60
    assert long.shortened(1).text == ""
    lines = wrapped("many words in many lines, one after the other", 10.0, 120)
    assert len(lines) > 1
    assert " ".join(line.text for line in lines) == "many words in many lines, one after the other"
