"""Sequences for tracking: smooth, of constant length, the same in any order, and what their names say."""

import pickle

import cv2
import numpy as np
import pytest
from scipy.spatial import cKDTree

from dloftbs.errors import InputError
from dloftbs_lab.synthetic import TRACKING_FAMILIES, TrackingSequence, known_occluders, tracking
from dloftbs_lab.synthetic.tracking_scenes import MAX_HIDDEN

SIZE = (360, 640)
SCALE = 0.5  # of an HD image
CASTS = [(family, cables) for family, counts in TRACKING_FAMILIES.items() for cables in counts]


def shown_shares(sequence, step=1):
    """The share of each cable that shows, shape (frames, cables)."""
    return np.array(
        [
            [sum(high - low for low, high in spans) for spans in sequence.truth(index).shown_spans]
            for index in range(0, len(sequence), step)
        ]
    )


def curves_of(sequence, step=1):
    """The true curves, without the masks that `truth` draws."""
    strands = (sequence._play.strands(index / len(sequence)) for index in range(0, len(sequence), step))
    return [tuple(strand.curve() for strand in moment) for moment in strands]


@pytest.mark.parametrize(("family", "cables"), CASTS)
def test_cables_keep_id_direction_and_length_and_move_smoothly(family, cables):
    for number in (0, 1):
        sequence = TrackingSequence(family, cables, number, size=SIZE, seed=3)
        frames = curves_of(sequence)
        assert len(frames) == 60
        assert frames[7] == sequence.truth(7).curves
        assert {truth.ids for truth in map(sequence.truth, (0, 30, 59))} == {tuple(range(cables))}
        points = np.array([[curve.sample(60) for curve in curves] for curves in frames])
        steps = np.linalg.norm(np.diff(points, axis=0), axis=3)
        # A turned cable would move by its length.
        assert steps.max() < 22.0 * SCALE
        lengths = np.array([[curve.length for curve in curves] for curves in frames])
        np.testing.assert_allclose(lengths, np.broadcast_to(lengths[0], lengths.shape), rtol=2e-3)


@pytest.mark.parametrize(("family", "cables"), CASTS)
def test_masks_are_where_the_curves_are_and_nothing_is_where_they_are_covered(family, cables):
    sequence = TrackingSequence(family, cables, 1, size=SIZE, seed=5)
    for index in (0, 21, 33):
        frame, truth, covered = sequence.frame(index), sequence.truth(index), sequence.covered(index)
        np.testing.assert_array_equal(frame.mask, np.logical_or.reduce(truth.visible_masks))
        assert not (frame.mask & covered).any()
        rows, columns = np.nonzero(frame.mask)
        dense = np.concatenate([curve.sample(2000) for curve in truth.curves])
        if len(rows):
            off = cKDTree(dense).query(np.column_stack((columns, rows)))[0]
            assert off.max() < 0.55 * sequence.width_px
        for curve, spans in zip(truth.curves, truth.shown_spans, strict=True):
            for low, high in spans:
                x, y = np.rint(curve((low + high) / 2.0)).astype(int)
                assert frame.mask[y, x]


def test_occluders_move_and_hide_some_of_a_cable_but_not_more_than_they_may():
    for cables in (1, 3):
        for number in range(3):
            shares = shown_shares(TrackingSequence("occluded", cables, number, size=SIZE), 3)
            assert (1.0 - shares).max() < MAX_HIDDEN + 0.05
            assert (1.0 - shares).max() > 0.1
            assert shares[0].min() > 0.95


def test_a_hidden_cable_is_hidden_as_a_whole_for_a_while_and_comes_back():
    for cables in (1, 3):
        shares = shown_shares(TrackingSequence("hidden", cables, 0, size=SIZE))
        dark = (shares == 0.0).sum(axis=0).max()
        assert 5 <= dark <= 16
        assert shares[0].min() > 0.99
        assert shares[-1].min() > 0.99


def test_cables_leave_in_part_and_wholly_and_come_back():
    least = []
    for number in range(6):
        shares = shown_shares(TrackingSequence("leaving", 1, number, size=SIZE), 2)
        assert shares[0].min() > 0.99
        assert shares[-1].min() > 0.99
        least.append(shares.min())
    assert min(least) == 0.0
    assert any(0.2 < share < 0.9 for share in least)


def test_cables_touch_side_by_side_and_part_again():
    for number in range(3):
        sequence = TrackingSequence("touching", 2, number, size=SIZE)
        width = sequence.width_px
        beside = []
        for one, other in curves_of(sequence, 3):
            off = cKDTree(one.sample(800)).query(other.sample(800))[0]
            beside.append((off < 1.15 * width).mean() * other.length)
            assert off.min() > 0.6 * width
        assert beside[0] == beside[-1] == 0.0
        assert max(beside) > 5.0 * width


def test_ends_pass_each_other_without_a_touch():
    for number in range(4):
        sequence = TrackingSequence("ends pass", 1, number, size=SIZE)
        gaps, angles = [], []
        for (curve,) in curves_of(sequence, 2):
            points = curve.sample(400)
            gaps.append(cKDTree(points[:150]).query(points[250:])[0].min())
            middle = points.mean(axis=0)
            first, last = points[0] - middle, points[-1] - middle
            angles.append(first[0] * last[1] - first[1] * last[0])
        assert 1.3 * sequence.width_px < min(gaps) < 4.0 * sequence.width_px
        # Seen from the middle, one end comes from one side of the other and gets to its other side.
        assert np.ptp(np.sign(angles)) == 2.0


def test_a_loop_opens():
    opened = 0
    for number in range(4):
        sequence = TrackingSequence("loop opens", 1, number, size=SIZE)
        crossing = []
        for (curve,) in curves_of(sequence, 6):
            points = curve.sample(300)
            apart = np.abs(np.subtract.outer(np.arange(300), np.arange(300))) > 30
            distance = np.linalg.norm(points[:, None] - points[None], axis=2)
            crossing.append((distance[apart] < 4.0).any())
        assert crossing[0]
        opened += not crossing[-1]
    assert opened == 4


def test_cables_cross():
    crossed = 0
    for number in range(3):
        for one, *_, other in curves_of(TrackingSequence("crossing", 3, number, size=SIZE), 6):
            crossed += cKDTree(one.sample(300)).query(other.sample(300))[0].min() < 1.0
    assert crossed > 5


@pytest.mark.parametrize(("family", "cables"), [("occluded", 3), ("leaving", 3), ("touching", 2), ("ends pass", 1)])
def test_frames_are_the_same_bit_for_bit_in_any_order_and_after_pickling(family, cables):
    one = TrackingSequence(family, cables, 2, size=SIZE)
    other = pickle.loads(pickle.dumps(TrackingSequence(family, cables, 2, size=SIZE)))
    other.truth(40)
    for index in (17, 3):
        np.testing.assert_array_equal(one.frame(index).mask, other.frame(index).mask)
        assert one.truth(index).curves == other.truth(index).curves
    for unlike in (
        TrackingSequence(family, cables, 3, size=SIZE),
        TrackingSequence(family, cables, 2, size=SIZE, seed=1),
    ):
        assert (unlike.frame(3).mask != one.frame(3).mask).any()


def test_the_suite_has_all_families_and_scales_by_sequences():
    small = tracking(0.01, 0, SIZE)
    assert [(one.family, one.cables) for one in small] == CASTS
    assert all(len(one) == 60 for one in small)
    whole = tracking()
    assert sum(one.cables == 1 for one in whole) > 60
    assert len({one.name for one in whole}) == len(whole)
    assert small[0].name == "crossing, 1 cable, 0"


@pytest.mark.parametrize(("family", "cables"), [cast for cast in CASTS if cast[1] < 5])
@pytest.mark.parametrize(("size", "width_px"), [((240, 320), 2.0), ((720, 1280), 20.0), ((1080, 1920), None)])
def test_all_sizes_and_widths_can_be_drawn(family, cables, size, width_px):
    sequence = TrackingSequence(family, cables, 0, size=size, width_px=width_px)
    truth = sequence.truth(4)
    length = sum(curve.length for curve in truth.curves)
    assert truth.mask.sum() == pytest.approx(length * sequence.width_px, rel=0.15)


@pytest.mark.parametrize("evidence", [("occluders",), ("depth",), ("occluders", "depth")])
def test_evidence_tells_of_the_covers_and_changes_nothing_else(evidence):
    plain = TrackingSequence("occluded", 3, 0, size=SIZE)
    told = TrackingSequence("occluded", 3, 0, size=SIZE, evidence=evidence)
    for index in (0, 30, 55):
        frame, covered = told.frame(index), plain.covered(index)
        np.testing.assert_array_equal(frame.mask, plain.frame(index).mask)
        assert (frame.occluders is None) == ("occluders" not in evidence)
        if frame.occluders is not None:
            np.testing.assert_array_equal(frame.occluders, covered)
        assert (frame.depth is None) == (frame.camera is None) == ("depth" not in evidence)
        if frame.depth is not None:
            bare = ~(frame.mask | covered)
            for place, metres in ((covered, 0.7), (frame.mask, 0.88), (bare, 1.0)):
                if place.any():
                    known = frame.depth[place & (frame.depth > 0.0)]
                    assert np.median(known) == pytest.approx(metres, abs=0.025)


def test_the_suite_of_known_occluders_is_that_of_tracking_with_evidence():
    made = known_occluders(0.01, 0, SIZE)
    few = [cast for cast in CASTS if cast[0] in ("occluded", "hidden", "hands") and cast[1] <= 3]
    assert [(one.family, one.cables) for one in made] == few
    assert all(one.frame(30).occluders is not None and one.frame(30).depth is not None for one in made)
    assert len({one.name for one in known_occluders()}) == len(known_occluders())
    seen = known_occluders(0.01, 0, SIZE, ["image"])
    assert [one.name for one in seen] == [one.name for one in made]
    assert all((frame.image is None, frame.occluders) == (False, None) for frame in (one.frame(30) for one in seen))


@pytest.mark.parametrize("family", ["occluded", "hands"])
def test_an_image_shows_ground_cables_and_covers(family):
    sequence = TrackingSequence(family, 1, 0, size=SIZE, evidence=("image",))
    frame, covered = sequence.frame(30), sequence.covered(30)
    assert covered.any()
    core = cv2.erode(frame.mask.astype(np.uint8), np.ones((3, 3))) > 0
    blue, green, red = np.median(frame.image[core], axis=0)
    assert blue > green > red
    inner = cv2.erode(covered.astype(np.uint8), np.ones((5, 5))) > 0
    assert frame.image[inner].std(axis=0).max() < 25.0
    np.testing.assert_array_equal(frame.image, sequence.frame(30).image)


def test_hands_have_fingers_and_hide_no_more_than_half():
    for number in range(3):
        sequence = TrackingSequence("hands", 1, number, size=SIZE)
        shown = [sum(high - low for low, high in sequence.truth(index).shown_spans[0]) for index in range(0, 60, 3)]
        assert 0.4 < min(shown) < 0.95
        assert max(shown) > 0.99


def test_what_cannot_be_is_refused():
    with pytest.raises(InputError, match=r"'crossing' with \(1, 3, 5\); .* got 'crossing' with 2"):
        TrackingSequence("crossing", 2)
    with pytest.raises(InputError, match="got 'knots' with 1"):
        TrackingSequence("knots", 1)
    with pytest.raises(InputError, match="number must not be negative"):
        TrackingSequence("hidden", 1, -1)
    with pytest.raises(InputError, match=r"width_px must be in 1\.\.10 here"):
        TrackingSequence("hidden", 1, size=SIZE, width_px=30.0)
    with pytest.raises(InputError, match="scale must be positive"):
        tracking(0.0)
