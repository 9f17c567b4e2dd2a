"""Faults of real footage, drawn small: what single frames and tracks make of each kind."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dloftbs import Frame, detect, track
from dloftbs_lab.evaluation import match_curves
from dloftbs_lab.synthetic import RealFootageSequence, draw_tube_mask
from dloftbs_lab.synthetic.space_axis import curve_through_samples

SIZE = (240, 640)
LINE = np.column_stack((np.arange(40.0, 600.0), 120.0 + 40.0 * np.sin(np.arange(560.0) / 120.0)))


def still_open(what):
    """Mark what is read wrongly today."""
    return pytest.mark.xfail(raises=AssertionError, strict=True, reason=what)


SPECKS = still_open("debris as wide as the worm, or as near as half of it, is joined")


def partly(numbers, wrong, mark):
    """Return numbers as parameters, of which some are marked."""
    return [pytest.param(number, marks=mark) if number in wrong else number for number in numbers]


def tube(width, points=LINE, size=SIZE):
    """The mask of a cable along points."""
    return draw_tube_mask(curve_through_samples(points), width, size)


def threads(mask, runs, off):
    """Add threads of 1 px, `off` px above the upper edge of a mask, over runs of columns; the slit below stays."""
    made = mask.copy()
    for start, stop in runs:
        for x in range(start, stop):
            made[int(np.nonzero(mask[:, x])[0].min()) - off, x] = True
    return made


def straight(y=120.0, start=40.0, stop=600.0):
    return np.column_stack((np.arange(start, stop), np.full(round(stop - start), y)))


def is_one(result, points, tolerance=5.0):
    return len(result) == 1 and match_curves([result[0].curve], [points]).l3[0] <= tolerance


@pytest.mark.parametrize("off", [2, 3])
@pytest.mark.parametrize("length", [25, 40, 90])
def test_threads_along_the_edge_of_a_thick_cable_are_no_cables(off, length):
    starts = range(60, 600 - length, length + 12)
    runs = [(start, start + length) for start in starts]
    result = detect(threads(tube(20.0), runs, off))
    assert is_one(result, LINE, 1.5)


def test_a_thin_cable_that_runs_beside_nothing_stays():
    line = straight()
    assert is_one(detect(tube(2.0, line)), line, 2.0)


@pytest.mark.parametrize(
    "width",
    [
        4.0,
        pytest.param(
            2.2,
            marks=pytest.mark.xfail(raises=AssertionError, reason="it is 3 px wide, and was found by a rounded edge"),
        ),
    ],
)
def test_a_thin_cable_joins_a_thick_one_at_its_end(width):
    thick, thin = straight(), np.column_stack((np.full(90, 300.0), np.arange(20.0, 110.0)))
    result = detect(tube(16.0, thick) | tube(width, thin))
    assert min(match_curves([d.curve for d in result], [thick, thin]).l3) < 5.0
    assert len(result) == 2


@pytest.mark.parametrize(
    ("family", "number", "size"),
    [("video edge", number, (360, 640)) for number in range(4)]
    + [("video crossing", number, (720, 1280)) for number in (0, 1, 4, 5)],
)
def test_cables_in_a_coded_video_keep_their_id_and_direction(family, number, size):
    sequence = RealFootageSequence(family, number, frames=4, size=size)
    ids = set()
    for index, result in enumerate(track(sequence)):
        truth = sequence.truth(index)
        assert match_curves([one.curve for one in result.tracks], truth.curves).clean(5.0)
        ids |= {one.id for one in result.tracks}
    assert len(ids) == sequence.cables


def slit(mask, points, half, span, offset=0.0):
    """Take a line along points (n, 2) out of a mask, over a span of their indices."""
    middle = points[span[0] : span[1]] + np.array((0.0, offset))
    return mask & ~tube(2.0 * half, middle, mask.shape)


@pytest.mark.parametrize("offset", [-4.0, 0.0, 4.0])
def test_a_highlight_that_the_border_opens_is_no_gap_between_two_cables(offset):
    line = straight(stop=680.0)
    result = detect(slit(tube(28.0, line), line, 3.0, (300, 640), offset))
    assert is_one(result, straight(stop=639.0), 3.0)


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_highlight_that_opens_to_a_side_is_no_gap_between_two_cables(side):
    line = straight()
    leaving = line[200:420] + np.column_stack((np.zeros(220), side * np.linspace(4.0, 17.0, 220)))
    result = detect(tube(28.0, line) & ~tube(5.0, leaving))
    assert is_one(result, line, 3.0)


def test_hundreds_of_pin_holes_elsewhere_do_not_matter():
    upper, lower = straight(60.0, 20.0, 620.0), straight(160.0, 60.0, 580.0)
    mask = slit(tube(26.0, upper), upper, 2.5, (100, 400))
    holey = tube(70.0, lower)
    rows, columns = np.nonzero(holey)
    cells = (rows % 6 == 1) & (columns % 6 == 1) & (np.abs(rows - 160) < 28)
    for y, x in zip(rows[cells], columns[cells], strict=True):
        holey[y - 1 : y + 2, x - 1 : x + 2] = False
    result = detect(mask | holey)
    assert match_curves([one.curve for one in result], [upper, lower]).clean(5.0)


def test_junk_at_the_other_side_of_the_picture_does_not_bring_rings_at_the_ends():
    line = LINE[:400]
    mask = tube(11.4, line)
    for place in (line[6], line[-7]):
        x, y = place.round().astype(int)
        mask[y - 2 : y + 3, x - 2 : x + 3] = False
    strip = mask.copy()
    strip[20:220:2, 636] = True
    strip[20:220, 637] = True
    for one in (mask, strip):
        near = [d for d in detect(one) if d.curve.sample(5)[2, 0] < 500.0]
        assert len(near) == 1
        assert near[0].curve.length == pytest.approx(curve_through_samples(line).length, abs=12.0)
        assert not detect(one).crossings


def dashes(rng, points, width=1.5):
    """Dashes of 3 to 15 px with gaps of 5 to 12 px along a line."""
    mask, at = np.zeros(SIZE, np.bool_), 0
    while at + 15 < len(points):
        stop = at + int(rng.integers(4, 16))
        mask |= tube(width, points[at:stop])
        at = stop + int(rng.integers(5, 13))
    return mask


@pytest.mark.parametrize("seed", partly(range(3), (0, 1), still_open("not all dashes come back")))
@pytest.mark.parametrize("salt", [0, 40])
def test_dashes_in_one_line_are_a_line_and_salt_is_not(seed, salt):
    rng = np.random.default_rng(seed)
    lines = [straight(60.0), LINE + np.array((0.0, 30.0))]
    mask = dashes(rng, lines[0]) | dashes(rng, lines[1])
    mask[rng.integers(0, SIZE[0], salt), rng.integers(0, SIZE[1], salt)] = True
    result = detect(mask)
    assert match_curves([one.curve for one in result], lines).clean(15.0)


def test_salt_alone_is_nothing():
    rng = np.random.default_rng(0)
    mask = np.zeros(SIZE, np.bool_)
    mask[rng.integers(0, SIZE[0], 200), rng.integers(0, SIZE[1], 200)] = True
    assert not detect(mask)


def long_ones(curves):
    return [curve for curve in curves if curve.length > 30.0]


@pytest.mark.parametrize("number", partly(range(6), (0, 2), SPECKS))
def test_specks_beside_a_worm_do_not_join_it(number):
    sequence = RealFootageSequence("specks", number, size=(128, 160))
    for index in range(0, 12, 3):
        found = long_ones([one.curve for one in detect(sequence.frame(index))])
        assert [curve.length for curve in found] == [
            pytest.approx(sequence.truth(index).curves[0].length + 6.0, abs=8.0)
        ]


@pytest.mark.parametrize("number", partly(range(4), (0, 2), SPECKS))
def test_one_object_beside_specks_is_the_worm(number):
    sequence = RealFootageSequence("specks", number, size=(128, 160))
    for index in range(0, 12, 3):
        result = detect(sequence.frame(index), objects=1)
        assert [d.curve.length for d in result] == [pytest.approx(65.0, abs=8.0)]


@pytest.mark.parametrize("number", partly(range(4), (0, 2), SPECKS))
def test_a_worm_beside_specks_keeps_its_id_and_its_length(number):
    sequence = RealFootageSequence("specks", number, size=(128, 160))
    ids = set()
    for result in track(sequence):
        found = [one for one in result.tracks if one.curve.length > 30.0]
        assert [one.curve.length for one in found] == [pytest.approx(65.0, abs=8.0)]
        ids |= {one.id for one in found}
    assert len(ids) == 1


@pytest.mark.parametrize(("length", "gap"), [(25.0, 40.0), (25.0, 80.0), (60.0, 70.0), (60.0, 100.0)])
def test_a_gap_longer_than_the_pieces_stays_open(length, gap):
    pieces = [
        straight(start=100.0, stop=100.0 + length),
        straight(start=100.0 + length + gap, stop=100.0 + gap + 2.0 * length),
    ]
    result = detect(tube(6.0, pieces[0]) | tube(6.0, pieces[1]))
    assert len(result) == 2


@pytest.mark.parametrize("number", range(4))
def test_a_lump_is_not_sure_of_its_course(number):
    sequence = RealFootageSequence("coils", number, size=(160, 200))
    for index in (9, 10, 11):
        assert all(one.confidence < 0.9 for one in detect(sequence.frame(index)))


@pytest.mark.parametrize("number", range(3))
def test_a_stretched_worm_is_sure(number):
    sequence = RealFootageSequence("coils", number, size=(160, 200))
    (found,) = detect(sequence.frame(0))
    assert found.confidence > 0.9


@pytest.mark.parametrize("number", range(8))
def test_rings_that_cross_others_close(number):
    sequence = RealFootageSequence("rings", number, size=(240, 320))
    for index in (0, 6):
        result, truth = detect(sequence.frame(index)), sequence.truth(index)
        assert match_curves([one.curve for one in result], truth.curves).clean(5.0)
        assert sorted(one.curve.closed for one in result) == sorted(curve.closed for curve in truth.curves)


@pytest.mark.parametrize("number", range(6))
def test_wires_of_two_colours_are_not_joined(number):
    sequence = RealFootageSequence("two colours", number, size=(240, 426))
    result = detect(sequence.frame(0))
    assert match_curves([one.curve for one in result], sequence.truth(0).curves).clean(5.0)


@pytest.mark.parametrize("number", [1, 3])
def test_a_wire_of_one_colour_under_a_patch_is_joined(number):
    sequence = RealFootageSequence("two colours", number, size=(240, 426))
    frame, truth = sequence.frame(0), sequence.truth(0)
    image = frame.image.copy()
    image[truth.visible_masks[0]] = image[truth.visible_masks[1]].mean(axis=0)
    image[truth.visible_masks[1]] = image[truth.visible_masks[1]].mean(axis=0)
    assert len(detect(replace(frame, image=image))) == 1


@pytest.mark.parametrize("number", range(4))
def test_edges_that_are_ragged_by_a_third_make_no_other_cable(number):
    sequence = RealFootageSequence("ragged edges", number, frames=6, size=(360, 640))
    ids = set()
    for index, result in enumerate(track(sequence)):
        truth = sequence.truth(index)
        assert match_curves([one.curve for one in result.tracks], truth.curves).clean(6.0)
        ids |= {one.id for one in result.tracks}
    assert len(ids) == 1


@pytest.mark.parametrize("frames", [1, 2, 4])
def test_threads_of_some_frames_do_not_reverse_a_steady_track(frames):
    clear = tube(20.0)
    frayed = threads(clear, [(60, 300), (320, 590)], 2)
    stream = [clear] * 12 + [frayed] * frames + [clear] * 6
    results = list(track([Frame(mask=one) for one in stream]))
    assert {one.id for result in results for one in result.tracks} == {1}
    starts = [result.tracks[0].curve.sample(2)[0, 0] for result in results]
    assert max(starts) - min(starts) < 20.0
