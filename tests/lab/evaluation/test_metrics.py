import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from dloftbs.errors import InputError
from dloftbs_lab.evaluation import f_distance, l1, l2, l3, l3_undirected, mmd

coordinate = st.floats(-1e3, 1e3, allow_subnormal=False)


def clouds(least=1, dim=2):
    return st.integers(least, 12).flatmap(lambda n: arrays(np.float64, (n, dim), elements=coordinate))


def slow_mmd(x, y):
    return sum(min(math.dist(p, q) for q in y) for p in x) / len(x)


def slow_f(x, y):
    def arc(points):
        lengths = [math.dist(a, b) for a, b in pairwise(points)]
        total = sum(lengths)
        return [sum(lengths[:i]) / total for i in range(len(points))]

    arc_x, arc_y = arc(x), arc(y)
    k, total = 0, 0.0
    for point, s in zip(x, arc_x, strict=True):
        while k + 2 < len(y) and arc_y[k + 1] <= s:
            k += 1
        a, b = np.array(y[k]), np.array(y[k + 1])
        t = min(max(float((point - a) @ (b - a)) / float((b - a) @ (b - a)), 0.0), 1.0)
        total += math.dist(point, a + t * (b - a))
    return total / len(x)


@given(clouds(), clouds())
def test_mmd_is_what_its_formula_says(x, y):
    assert mmd(x, y) == pytest.approx(slow_mmd(x.tolist(), y.tolist()), abs=1e-9)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("seed", range(20))
def test_f_and_l3_are_what_their_formulas_say(seed, dim):
    rng = np.random.default_rng(seed)
    x, y = (rng.normal(size=(rng.integers(2, 30), dim)) for _ in range(2))
    assert f_distance(x, y) == pytest.approx(slow_f(x, y))
    assert l3(x, y) == pytest.approx((slow_f(x, y) + slow_f(y, x)) / 2)


@given(clouds(least=2, dim=3))
def test_everything_is_at_no_distance_from_itself(x):
    assert mmd(x, x) == l1(x, x) == l2(x, x) == 0.0
    # Where points coincide, rounding may put one on the segment beside its own, with which it shares an end.
    assert l3(x, x) == pytest.approx(0.0, abs=1e-6)


@given(clouds(least=2), clouds(least=2))
def test_l3_is_symmetric_and_the_undirected_one_is_never_larger(c, r):
    assert l3(c, r) == l3(r, c)
    assert l3_undirected(c, r) <= l3(c, r)
    assert l3_undirected(c, r) == l3_undirected(c, r[::-1])


@given(st.floats(-50.0, 50.0), st.integers(2, 40), st.integers(2, 40))
def test_a_shift_across_a_straight_line_is_what_l3_measures(shift, n, m):
    c = np.stack((np.linspace(0.0, 100.0, n), np.full(n, shift)), axis=1)
    r = np.stack((np.linspace(0.0, 100.0, m), np.zeros(m)), axis=1)
    assert l3(c, r) == pytest.approx(abs(shift), abs=1e-9)


def test_direction_matters_to_l3_alone():
    c = np.stack((np.linspace(0.0, 10.0, 11), np.zeros(11)), axis=1)
    # Ten segments; a point at s is compared with the one at 10 - s.
    assert l3(c, c[::-1]) == pytest.approx(slow_f(c, c[::-1]))
    assert l3(c, c[::-1]) > 4.0
    assert l3_undirected(c, c[::-1]) == 0.0


def test_l1_sees_what_is_missed_and_l2_what_is_invented():
    pixels = np.stack((np.arange(101.0), np.zeros(101)), axis=1)
    half = pixels[:51]
    longer = np.stack((np.arange(151.0), np.zeros(151)), axis=1)
    assert l1(pixels, half) == pytest.approx(sum(range(51)) / 101)
    assert l2(half, pixels) == 0.0
    assert l1(pixels, longer) == 0.0
    assert l2(longer, pixels) == pytest.approx(sum(range(51)) / 151)


def test_the_bracketing_follows_the_arc_and_not_the_nearest_point():
    # A hairpin: the end of the way back lies beside its start, yet is compared with the other curve's end.
    hairpin = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 1.0], [0.0, 1.0]])
    straight = np.array([[0.0, 0.0], [7.0, 0.0], [14.0, 0.0], [21.0, 0.0]])
    assert f_distance(hairpin, straight) == pytest.approx(slow_f(hairpin, straight))
    assert f_distance(hairpin, straight) > mmd(hairpin, straight)


def test_a_segment_too_short_to_square_counts_as_a_point():
    assert f_distance([[3.0, 4.0], [3.0, 4.0]], [[0.0, 0.0], [1e-162, 0.0]]) == pytest.approx(5.0)


def test_points_that_repeat_and_curves_of_no_length_have_a_distance():
    assert l3([[0, 0], [0, 0], [4, 0]], [[0, 3], [4, 3], [4, 3]]) == pytest.approx(3.0)
    assert l3([[1, 1], [1, 1]], [[1, 4], [1, 4]]) == pytest.approx(3.0)


@pytest.mark.parametrize("function", [mmd, l1, l2])
@pytest.mark.parametrize(
    ("x", "y", "message"),
    [
        (np.empty((0, 2)), [[0, 0]], "1 or more points, got 0"),
        ([[0, 0]], np.empty((0, 2)), "1 or more points, got 0"),
        ([0, 0], [[0, 0]], r"must have shape \(n, 2\) or \(n, 3\), got \(2,\)"),
        ([[0, 0]], [[0, 0, 0]], r"same dimension, got \(1, 2\) and \(1, 3\)"),
        ([[0, math.nan]], [[0, 0]], "must be finite"),
    ],
)
def test_sets_that_make_no_sense_are_refused(function, x, y, message):
    with pytest.raises(InputError, match=message):
        function(x, y)


@pytest.mark.parametrize("function", [f_distance, l3, l3_undirected])
def test_a_curve_needs_two_points(function):
    with pytest.raises(InputError, match="2 or more points, got 1"):
        function([[0, 0], [1, 1]], [[0, 0]])
