"""Cables whose ends differ: each style covers what it says, and the body is the same."""

import numpy as np
import pytest

from dloftbs_lab.synthetic import END_STYLES, FreeEnd, draw_cable_mask, draw_tube_mask
from dloftbs_lab.synthetic.space_axis import curve_through_samples

SIZE = (90, 160)
X = np.linspace(30.3, 120.6, 400)
BENT = np.column_stack((X, 40.0 + 12.0 * np.sin(X / 25.0)))
STRAIGHT = np.column_stack((X, np.full(400, 40.2)))


def drawn(style, width, points=BENT):
    rng = np.random.default_rng(3)
    return draw_cable_mask(points, np.full(400, width), SIZE, (FreeEnd.draw(rng, style), FreeEnd.draw(rng, style)))


@pytest.mark.parametrize("width", [2.0, 5.5, 12.0])
def test_a_round_end_is_that_of_a_tube(width):
    unlike = drawn("round", width) ^ draw_tube_mask(curve_through_samples(BENT), width, SIZE)
    assert unlike.sum() <= 3  # on the very border


@pytest.mark.parametrize("style", END_STYLES)
@pytest.mark.parametrize("width", [3.0, 8.0, 14.0])
def test_only_the_ends_differ(style, width):
    ends = np.zeros(SIZE, bool)
    for tip in BENT[[0, -1]]:
        rows, columns = np.indices(SIZE)
        ends |= np.hypot(columns - tip[0], rows - tip[1]) <= 2.6 * width
    unlike = drawn(style, width) != drawn("round", width)
    assert not (unlike & ~ends).any()
    assert unlike.any() == (style != "round")


def test_a_flat_end_stops_at_the_tip_over_the_whole_width():
    mask = drawn("flat", 9.0, STRAIGHT)
    columns = np.flatnonzero(mask.any(axis=0))
    assert (columns[0], columns[-1]) == (30, 121)
    assert set(mask.sum(axis=0)[30:122].tolist()) == {9}


def test_a_tapered_end_gets_thinner_towards_the_tip():
    widths = drawn("tapered", 12.0, STRAIGHT).sum(axis=0)[31:60]
    assert (np.diff(widths) >= 0).all()
    assert widths[0] <= 5
    assert widths[-1] == 12


def test_wires_stand_out_from_a_frayed_end():
    beyond = drawn("frayed", 12.0, STRAIGHT)[:, :30]
    assert beyond.any()
    assert max(len(np.flatnonzero(np.diff(column.astype(int)) == 1)) for column in beyond.T) >= 2
    assert beyond.any(axis=0).sum() <= 0.8 * 12.0 + 2.0


def test_a_cable_shorter_than_its_ends_is_round():
    short = STRAIGHT[:60]
    rng = np.random.default_rng(0)
    ends = FreeEnd.draw(rng, "flat"), FreeEnd.draw(rng, "flat")
    widths = np.full(60, 10.0)
    np.testing.assert_array_equal(draw_cable_mask(short, widths, SIZE, ends), draw_cable_mask(short, widths, SIZE))


def test_widths_may_change_and_the_cable_may_leave_the_image():
    points = np.column_stack((np.linspace(-50.0, 250.0, 600), np.full(600, 45.0)))
    tall = draw_cable_mask(points, np.linspace(4.0, 28.0, 600), SIZE).sum(axis=0)
    np.testing.assert_allclose(tall, np.interp(np.arange(160), points[:, 0], np.linspace(4.0, 28.0, 600)), atol=1.5)


def test_styles_are_drawn_with_equal_chances():
    rng = np.random.default_rng(1)
    styles = [FreeEnd.draw(rng).style for _ in range(400)]
    assert all(70 < styles.count(style) < 130 for style in END_STYLES)
