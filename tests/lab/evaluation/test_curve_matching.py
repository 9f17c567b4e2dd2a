"""Several curves: shuffled, reversed, dropped, doubled and strayed ones score what they should."""

import itertools
import math

import numpy as np
import pytest
from builders import line, loop, wave
from hypothesis import given
from hypothesis import strategies as st
from properties import few_examples

from dloftbs.errors import InputError
from dloftbs_lab.evaluation import CurveDistances, compare_curves, curve_l3, match_curves, match_distances

SAMPLES = 50
CABLES = [line((0.0, y), (200.0, y + 10.0)) for y in (0.0, 40.0, 90.0)]


def shifted(curve, y):
    return curve.transformed(np.eye(2), (0.0, y))


def distances(l3):
    l3 = np.asarray(l3, dtype=np.float64)
    return CurveDistances(l3, np.ones(l3.shape, dtype=bool))


def least_total(l3, gate):
    """Return the least sum of min(L3, gate) over all ways to pair rows with columns."""
    l3 = l3 if l3.shape[0] <= l3.shape[1] else l3.T
    ways = itertools.permutations(range(l3.shape[1]), l3.shape[0])
    return min(sum(min(l3[i, j], gate) for i, j in enumerate(way)) for way in ways)


@given(st.permutations(range(3)), st.lists(st.booleans(), min_size=3, max_size=3))
@few_examples
def test_a_shuffled_and_reversed_truth_is_perfect(order, backwards):
    found = [CABLES[i].reversed() if back else CABLES[i] for i, back in zip(order, backwards, strict=True)]
    result = match_curves(found, CABLES, samples=SAMPLES)
    assert [order[pair.found] for pair in result.pairs] == [pair.true for pair in result.pairs] == [0, 1, 2]
    assert [pair.forward for pair in result.pairs] == [not backwards[pair.found] for pair in result.pairs]
    assert result.l3 == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)
    assert (result.missing, result.redundant) == (0, 0)
    assert result.clean(limit_px=1e-9)


@pytest.mark.parametrize("dropped", range(3))
def test_a_dropped_curve_is_missing(dropped):
    found = [cable for i, cable in enumerate(CABLES) if i != dropped]
    result = match_curves(found, CABLES, samples=SAMPLES)
    assert (result.missing, result.redundant, result.unmatched_true) == (1, 0, (dropped,))
    assert result.mean_l3 == pytest.approx(0.0, abs=1e-9)
    assert not result.clean(limit_px=math.inf)


@pytest.mark.parametrize("doubled", range(3))
def test_a_doubled_curve_is_redundant(doubled):
    result = match_curves([*CABLES, shifted(CABLES[doubled], 1.0)], CABLES, samples=SAMPLES)
    assert (result.missing, result.redundant, result.unmatched_found) == (0, 1, (3,))
    assert result.mean_l3 == pytest.approx(0.0, abs=1e-9)
    assert not result.clean(limit_px=math.inf)


def test_shifted_curves_score_their_shifts():
    true = [line((0.0, y), (200.0, y)) for y in (0.0, 40.0, 90.0)]
    found = [shifted(curve, d) for curve, d in zip(true, (1.0, -2.0, 6.0), strict=True)]
    result = match_curves(found, true, samples=SAMPLES)
    assert result.l3 == pytest.approx((1.0, 2.0, 6.0))
    assert result.mean_l3 == pytest.approx(3.0)
    assert result.clean(limit_px=6.1)
    assert not result.clean(limit_px=5.9)


def test_a_pair_beyond_the_gate_is_one_missing_and_one_redundant():
    true = [line((0.0, 0.0), (200.0, 0.0))]
    found = [shifted(true[0], 20.0)]
    assert match_curves(found, true, samples=SAMPLES, gate_px=20.1).l3 == pytest.approx((20.0,))
    beyond = match_curves(found, true, samples=SAMPLES, gate_px=19.9)
    assert (beyond.pairs, beyond.missing, beyond.redundant) == ((), 1, 1)
    assert math.isnan(beyond.mean_l3)
    assert match_curves(found, true, samples=SAMPLES).missing == 0


def test_a_stray_curve_does_not_pull_the_others_off_theirs():
    l3 = [[0.0, 60.0], [60.0, 900.0]]
    assert match_distances(distances(l3)).l3 == (60.0, 60.0)
    gated = match_distances(distances(l3), gate_px=100.0)
    assert (gated.l3, gated.unmatched_true, gated.unmatched_found) == ((0.0,), (1,), (1,))


@given(st.integers(0, 4), st.integers(0, 4), st.integers(0, 2**32 - 1), st.sampled_from([None, 0.0, 3.0, 7.0]))
def test_no_other_assignment_has_a_smaller_total(rows, columns, seed, gate):
    l3 = np.random.default_rng(seed).uniform(0.0, 10.0, (rows, columns))
    result = match_distances(distances(l3), gate_px=gate)
    limit = math.inf if gate is None else gate
    broken = min(rows, columns) - len(result.pairs)
    assert sum(result.l3) + (broken * limit if broken else 0.0) == pytest.approx(least_total(l3, limit))
    assert all(pair.l3 == l3[pair.true, pair.found] <= limit for pair in result.pairs)
    assert {pair.true for pair in result.pairs} | {*result.unmatched_true} == {*range(rows)}
    assert {pair.found for pair in result.pairs} | {*result.unmatched_found} == {*range(columns)}
    assert (len(result.pairs) + result.missing, len(result.pairs) + result.redundant) == (rows, columns)


def test_curves_may_be_a_stack_of_points():
    stack = np.array([[(0.0, 0.0), (9.0, 0.0)], [(0.0, 5.0), (9.0, 5.0)]])
    assert compare_curves(stack, list(stack), samples=SAMPLES).l3 == pytest.approx(np.array([[0.0, 5.0], [5.0, 0.0]]))
    with pytest.raises(InputError, match="found must be a sequence of curves, got array"):
        compare_curves(np.array(5.0), stack)


def test_every_curve_is_compared_with_every_other():
    true = [*CABLES, wave()]
    found = [wave((0.0, 7.0)).reversed(), CABLES[1]]
    compared = compare_curves(found, true, samples=SAMPLES)
    for i, j in itertools.product(range(4), range(2)):
        one_way, other_way = (curve_l3(f, true[i], samples=SAMPLES) for f in (found[j], found[j].reversed()))
        assert compared.l3[i, j] == pytest.approx(min(one_way, other_way))
        assert compared.forward[i, j] == (one_way <= other_way)
    assert not compared.l3.flags.writeable
    assert not compared.forward.flags.writeable


def test_curves_in_space_and_loops_take_part():
    true = [line((0.0, 0.0, 1.0), (0.5, 0.0, 1.0)), line((0.0, 0.3, 1.0), (0.5, 0.3, 1.0))]
    found = [true[1].sample(40)[::-1], true[0].sample(40) + np.array([0.0, 0.0, 0.01])]
    assert match_curves(found, true, samples=SAMPLES).l3 == pytest.approx((0.01, 0.0))
    turned = match_curves([loop(50.0, start=1.3)], [loop(50.0)], samples=200)
    assert turned.clean(limit_px=1e-2)


@pytest.mark.parametrize(("found", "true"), [(0, 0), (0, 3), (2, 0)])
def test_where_nothing_is_nothing_vanishes(found, true):
    result = match_curves(CABLES[:found], CABLES[:true], samples=SAMPLES)
    assert (result.pairs, result.missing, result.redundant) == ((), true, found)
    assert math.isnan(result.mean_l3)
    assert result.clean(limit_px=1.0) == (found == true == 0)


@pytest.mark.parametrize("gate", [-1.0, math.nan])
def test_a_gate_that_makes_no_sense_is_refused(gate):
    with pytest.raises(InputError, match=r"gate_px must be a finite number in 0\.\."):
        match_curves(CABLES, CABLES, samples=SAMPLES, gate_px=gate)


def test_a_curve_that_makes_no_sense_is_named():
    with pytest.raises(InputError, match=r"found\[1\] must have 2 or more points, got 1"):
        match_curves([CABLES[0], [[0, 0]]], CABLES)
    with pytest.raises(InputError, match="same dimension, got 3 and 2"):
        match_curves([[[0, 0, 0], [1, 1, 1]]], CABLES)
