"""Sequences in perspective with nothing hidden: smooth, inside the image, and what their kinds say."""

import pickle

import numpy as np
import pytest
from scipy.spatial import cKDTree

from dloftbs.errors import InputError
from dloftbs_lab.synthetic import PLAIN_SIGHT_KINDS, PlainSightSequence, plain_sight

SIZE = (240, 320)
SCALE = 0.25  # of an HD image
NUMBERS = range(3)


def lengths(sequence, step=4):
    return np.array([sequence.truth(i).curves[0].length for i in range(0, len(sequence), step)])


def steps(sequence, frames):
    """How far the fastest point of the first cable moves from frame to frame."""
    points = np.array([sequence.truth(i).curves[0].sample(40) for i in frames])
    return np.linalg.norm(np.diff(points, axis=0), axis=2).max(axis=1)


@pytest.mark.parametrize("kind", PLAIN_SIGHT_KINDS)
def test_cables_keep_id_and_direction_stay_inside_and_the_mask_shows_them(kind):
    for number in NUMBERS:
        sequence = PlainSightSequence(kind, number, size=SIZE)
        assert len(sequence) == 80
        most = {"swings": 85.0, "darts": 240.0, "drops": 45.0}.get(kind, 20.0)
        assert steps(sequence, range(0, 12)).max() < most * SCALE
        for index in (0, 25, 41, 79):
            frame, truth = sequence.frame(index), sequence.truth(index)
            np.testing.assert_array_equal(frame.mask, truth.mask)
            assert kind == "drops" or frame.stamp == pytest.approx(index / 30.0)
            points = np.concatenate([curve.sample(400) for curve in truth.curves])
            assert (points > 0.0).all()
            assert (points < np.array(SIZE[::-1]) - 1.0).all()
            rows, columns = np.nonzero(truth.mask)
            off = cKDTree(points).query(np.column_stack((columns, rows)))[0]
            assert off.max() < 3.0 * sequence.width_px  # twice as near, and frayed
            assert np.median(off) < 0.6 * sequence.width_px
            assert len(truth.shown_spans) == len(truth.curves)
            for spans in truth.shown_spans:
                assert sum(high - low for low, high in spans) > 0.99


def test_what_bends_gets_shorter_by_a_fifth_at_most():
    shorter = [1.0 - (of := lengths(PlainSightSequence("bends", n, size=SIZE))).min() / of.max() for n in range(8)]
    assert max(shorter) < 0.25
    assert max(shorter) > 0.08


def test_what_tilts_gets_much_shorter_and_comes_back():
    for number in NUMBERS:
        of = lengths(PlainSightSequence("tilts", number, size=SIZE))
        assert 0.35 < of.min() / of[0] < 0.85
        assert of[-1] == pytest.approx(of[0], rel=0.02)


def test_what_comes_nearer_by_a_half_gets_twice_as_large_and_thick():
    for number in NUMBERS:
        sequence = PlainSightSequence("approaches", number, size=SIZE, width_px=4.0)
        assert lengths(sequence, 1).max() / lengths(sequence)[0] == pytest.approx(2.0, abs=0.01)
        near, far = sequence.truth(40), sequence.truth(0)
        thick, thin = (truth.mask.sum() / truth.curves[0].length for truth in (near, far))
        assert thick / thin == pytest.approx(2.0, rel=0.15)


def test_what_swings_is_fast_from_the_first_frames_on():
    fastest = [steps(PlainSightSequence("swings", n, size=SIZE), range(30)) / SCALE for n in range(4)]
    assert all(35.0 < of_one.max() <= 80.5 for of_one in fastest)
    assert max(of_one[:2].max() for of_one in fastest) > 25.0


def test_what_darts_moves_by_a_fifth_to_a_third_of_its_length():
    for number in NUMBERS:
        sequence = PlainSightSequence("darts", number, size=SIZE)
        share = steps(sequence, range(40)).max() / sequence.truth(0).curves[0].length
        assert 0.15 < share < 0.34


def test_dropped_frames_leave_gaps_in_the_stamps_and_in_the_motion():
    for number in NUMBERS:
        sequence = PlainSightSequence("drops", number, size=SIZE)
        stamps = np.array([sequence.frame(index).stamp for index in range(80)])
        between = np.diff(stamps)
        assert stamps[0] == 0.0
        assert 0.014 < between.min() < 0.03
        assert 0.085 < between.max() < 0.12
        of = steps(sequence, range(80))
        assert np.corrcoef(of, between)[0, 1] > 0.3  # of a motion that is not even itself


def test_two_ends_come_together_at_an_angle_and_part_again():
    for number in NUMBERS:
        sequence = PlainSightSequence("ends meet", number, size=SIZE)
        apart = []
        for index in (0, 40, 79):
            one, other = (curve.sample(200) for curve in sequence.truth(index).curves)
            apart.append(np.linalg.norm(one[-1] - other[0]))
            first, second = one[-1] - one[-5], other[4] - other[0]
            assert first @ second < 0.95 * np.linalg.norm(first) * np.linalg.norm(second)
        assert apart[1] < 3.0
        assert min(apart[0], apart[2]) > 60.0 * SCALE


def test_one_is_cut_and_its_parts_move_away_from_each_other():
    sequence = PlainSightSequence("cut in two", 1, size=SIZE)
    truths = [sequence.truth(index) for index in range(len(sequence))]
    cut = next(index for index, truth in enumerate(truths) if len(truth.ids) == 2)
    assert [truth.ids for truth in truths] == [(0,)] * cut + [(0, 1)] * (len(truths) - cut)
    before, after, last = truths[cut - 1], truths[cut], truths[-1]
    lengths = [curve.length for curve in after.curves]
    assert sum(lengths) == pytest.approx(before.curves[0].length, rel=0.05)
    assert lengths[0] > lengths[1]
    gaps = [np.linalg.norm(truth.curves[0](1.0) - truth.curves[1](0.0)) for truth in (after, last)]
    assert gaps[0] < 5.0 < 20.0 < gaps[1]


def test_one_of_two_is_taken_away_and_a_third_comes_elsewhere():
    for number in NUMBERS:
        sequence = PlainSightSequence("exchange", number, size=SIZE)
        ids = [sequence.truth(index).ids for index in range(80)]
        assert list(dict.fromkeys(ids)) == [(0, 1), (0,), (0, 2)]
        gone, new = ids.index((0,)), ids.index((0, 2))
        old, fresh = (sequence.truth(at).curves[1].sample(50) for at in (gone - 1, new))
        assert np.linalg.norm(old.mean(axis=0) - fresh.mean(axis=0)) > 0.2 * SIZE[1]


def test_three_cross():
    crossed = 0
    for number in NUMBERS:
        first, second, third = (
            curve.sample(300) for curve in PlainSightSequence("three cross", number).truth(20).curves
        )
        for one, other in ((first, second), (second, third), (first, third)):
            crossed += cKDTree(one).query(other)[0].min() < 3.0
    assert crossed >= 6


def test_frames_are_the_same_bit_for_bit_in_any_order_and_after_pickling():
    one = PlainSightSequence("three cross", 2, size=SIZE)
    other = pickle.loads(pickle.dumps(PlainSightSequence("three cross", 2, size=SIZE)))
    other.truth(40)
    for index in (17, 3):
        np.testing.assert_array_equal(one.frame(index).mask, other.frame(index).mask)
        assert one.truth(index).curves == other.truth(index).curves
    for unlike in (
        PlainSightSequence("three cross", 1, size=SIZE),
        PlainSightSequence("three cross", 2, size=SIZE, seed=1),
    ):
        assert (unlike.frame(3).mask != one.frame(3).mask).any()


def test_the_suite_has_all_kinds_and_scales_by_sequences():
    small = plain_sight(0.01, 0, SIZE)
    assert [one.family for one in small] == list(PLAIN_SIGHT_KINDS)
    whole = plain_sight()
    assert len(whole) == len({one.name for one in whole}) == 20 * len(PLAIN_SIGHT_KINDS)
    assert len({one.width_px for one in whole}) == len(whole)


def test_what_cannot_be_is_refused():
    with pytest.raises(InputError, match=r"kind must be one of 'bends', .* got 'knots'"):
        PlainSightSequence("knots")
    with pytest.raises(InputError, match="number must not be negative"):
        PlainSightSequence("tilts", -1)
    with pytest.raises(InputError, match=r"width_px must be in 1\.\.8 here"):
        PlainSightSequence("tilts", size=SIZE, width_px=30.0)
