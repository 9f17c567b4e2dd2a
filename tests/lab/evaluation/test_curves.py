"""What a curve scores against a truth that was shifted, reversed, cut or turned by a known amount."""

import itertools
import math

import numpy as np
import pytest
from builders import arc, curve_through, line, loop, part, random_curve, wave
from hypothesis import given
from hypothesis import strategies as st
from properties import few_examples

from dloftbs.errors import InputError
from dloftbs_lab.evaluation import curve_l3, endpoint_error, l3, length_error, point_error

LENGTH = 200.0
STRAIGHT = line((10.0, 20.0), (10.0 + LENGTH, 20.0))
SAMPLES = 101
STEP = LENGTH / (SAMPLES - 1)

seeds = st.integers(0, 2**32 - 1)
undirected = pytest.mark.parametrize("directed", [True, False])


def moved(curve, *offset):
    return curve.transformed(np.eye(curve.ndim), offset)


def at_arc_lengths(points, count):
    """Return points along a polyline one after the other, by walking it."""
    lengths = [math.dist(a, b) for a, b in itertools.pairwise(points)]
    result = []
    for i in range(count):
        rest, side = sum(lengths) * i / (count - 1), 0
        while rest > lengths[side] and side + 1 < len(lengths):
            rest -= lengths[side]
            side += 1
        t = min(rest / lengths[side], 1.0)
        result.append([p + t * (q - p) for p, q in zip(points[side], points[side + 1], strict=True)])
    return result


def slow_even_f(x, y):
    """Return the mean distance of each point from the segment that begins at its equal; the last has the last."""
    total = 0.0
    for i, point in enumerate(np.array(x)):
        a, b = np.array(y[min(i, len(y) - 2)]), np.array(y[min(i, len(y) - 2) + 1])
        t = min(max(float((point - a) @ (b - a)) / float((b - a) @ (b - a)), 0.0), 1.0)
        total += math.dist(point, a + t * (b - a))
    return total / len(x)


def steps(points):
    return max(math.dist(a, b) for a, b in itertools.pairwise(points))


def slow_point_errors(found, true, count):
    pairs = zip(at_arc_lengths(found, count), at_arc_lengths(true, count), strict=True)
    return [math.dist(p, q) for p, q in pairs]


@undirected
@pytest.mark.parametrize("ndim", [2, 3])
@pytest.mark.parametrize("closed", [False, True])
@few_examples
@given(seed=seeds)
def test_a_perfect_curve_scores_nothing(ndim, closed, directed, seed):
    curve = random_curve(seed, ndim, closed)
    error = point_error(curve, curve, directed=directed)
    assert curve_l3(curve, curve, directed=directed) == pytest.approx(0.0, abs=1e-9)
    assert (error.mean, error.max, error.forward) == (0.0, 0.0, True)
    assert length_error(curve, curve) == 0.0
    assert closed or endpoint_error(curve, curve, directed=directed) == 0.0


@given(seeds, st.sampled_from([2, 3]))
def test_a_reversed_curve_scores_nothing_but_by_its_direction(seed, ndim):
    curve = random_curve(seed, ndim)
    back = curve.reversed()
    assert curve_l3(back, curve, directed=False) == pytest.approx(0.0, abs=1e-9)
    assert point_error(back, curve, directed=False).max == pytest.approx(0.0, abs=1e-9)
    assert endpoint_error(back, curve, directed=False) == pytest.approx(0.0, abs=1e-9)
    assert length_error(back, curve) == pytest.approx(0.0, abs=1e-9)
    assert curve_l3(back, curve) > 1.0
    assert not point_error(back, curve, directed=False).forward
    assert point_error(back, curve).forward
    assert endpoint_error(back, curve) == pytest.approx(math.dist(curve(0.0), curve(1.0)))


@undirected
@given(shift=st.floats(-80.0, 80.0), angle=st.floats(0.0, 2 * math.pi))
def test_a_shift_across_a_straight_line_is_what_every_distance_measures(directed, shift, angle):
    along = np.array([math.cos(angle), math.sin(angle)])
    true = line((50.0, 60.0), tuple((50.0, 60.0) + LENGTH * along))
    found = moved(true, -shift * along[1], shift * along[0])
    error = point_error(found, true, directed=directed)
    assert curve_l3(found, true, directed=directed) == pytest.approx(abs(shift), abs=1e-9)
    assert (error.mean, error.max) == pytest.approx((abs(shift), abs(shift)), abs=1e-9)
    assert endpoint_error(found, true, directed=directed) == pytest.approx(abs(shift), abs=1e-9)
    assert length_error(found, true) == pytest.approx(0.0, abs=1e-9)


@given(st.floats(-30.0, 30.0), st.floats(-30.0, 30.0), st.floats(-30.0, 30.0))
def test_a_shift_of_any_curve_in_space_is_what_the_ordered_distances_measure(x, y, z):
    true = random_curve(5, ndim=3)
    error = point_error(moved(true, x, y, z), true)
    assert (error.mean, error.max) == pytest.approx((math.hypot(x, y, z),) * 2, abs=1e-9)
    assert endpoint_error(moved(true, x, y, z), true) == pytest.approx(math.hypot(x, y, z), abs=1e-9)


@undirected
@pytest.mark.parametrize("cut", [0.05, 0.1, 0.3])
def test_a_truncated_line_scores_the_arithmetic_of_its_missing_end(cut, directed):
    found = part(STRAIGHT, 0.0, 1.0 - cut)
    error = point_error(found, STRAIGHT, directed=directed, samples=SAMPLES)
    # Points at s are cut * s * length apart.
    assert error.mean == pytest.approx(cut * LENGTH / 2)
    assert error.max == pytest.approx(cut * LENGTH)
    assert endpoint_error(found, STRAIGHT, directed=directed) == pytest.approx(cut * LENGTH / 2)
    assert length_error(found, STRAIGHT) == pytest.approx(cut)
    assert curve_l3(found, STRAIGHT, directed=directed, samples=SAMPLES) == pytest.approx(l3_of_a_cut_line(cut))


def l3_of_a_cut_line(cut):
    """Return what L3 says when the point i lies `cut` of its way behind, and its segment may begin or end nearer."""
    behind = [cut * STEP * i for i in range(SAMPLES)]
    found_to_true = [*behind[:-1], abs(behind[-1] - STEP)]
    true_to_found = [*(max(d - (1.0 - cut) * STEP, 0.0) for d in behind[:-1]), behind[-1]]
    return (sum(found_to_true) + sum(true_to_found)) / (2 * SAMPLES)


def test_truncation_at_both_ends_leaves_the_middle_in_place():
    error = point_error(part(STRAIGHT, 0.1, 0.9), STRAIGHT, samples=SAMPLES)
    assert error.max == pytest.approx(0.1 * LENGTH)
    assert error.mean == pytest.approx(0.1 * LENGTH * np.abs(np.linspace(-1, 1, SAMPLES)).mean())


@given(seeds, st.sampled_from([2, 3]))
def test_ordered_distances_are_what_walking_along_both_curves_gives(seed, ndim):
    rng = np.random.default_rng(seed)
    found, true = (rng.normal(size=(rng.integers(2, 9), ndim)) for _ in range(2))
    expected = slow_point_errors(found.tolist(), true.tolist(), 23)
    error = point_error(found, true, samples=23)
    assert error.mean == pytest.approx(sum(expected) / 23)
    assert error.max == pytest.approx(max(expected))


@given(seeds)
def test_l3_of_curves_is_l3_of_their_evenly_spaced_points(seed):
    rng = np.random.default_rng(seed)
    found, true = (rng.normal(size=(rng.integers(2, 9), 2)) for _ in range(2))
    x, y = at_arc_lengths(found.tolist(), 23), at_arc_lengths(true.tolist(), 23)
    expected = (slow_even_f(x, y) + slow_even_f(y, x)) / 2
    back = (slow_even_f(x[::-1], y) + slow_even_f(y, x[::-1])) / 2
    assert curve_l3(found, true, samples=23) == pytest.approx(expected)
    assert curve_l3(found, true, directed=False, samples=23) == pytest.approx(min(expected, back))


@given(seeds)
def test_l3_of_curves_is_l3_of_plain_points_but_for_rounding(seed):
    rng = np.random.default_rng(seed)
    found, true = (np.cumsum(rng.normal(size=(6, 2)) * 10.0, axis=0) for _ in range(2))
    x, y = (np.array(at_arc_lengths(points.tolist(), 400)) for points in (found, true))
    assert curve_l3(found, true, samples=400) == pytest.approx(l3(x, y), abs=max(steps(x), steps(y)))


def test_the_uneven_parameter_of_a_curve_does_not_matter():
    knots = [0, 0, 0, 0, 1, 1, 1, 1]
    slow_start = type(STRAIGHT)(knots, [[10, 20], [11, 20], [12, 20], [210, 20]])
    assert point_error(slow_start, STRAIGHT).max == pytest.approx(0.0, abs=0.05)
    assert length_error(slow_start, STRAIGHT) == pytest.approx(0.0, abs=1e-9)


def test_a_slide_along_the_curve_counts_in_order_though_l3_hardly_sees_it():
    hairpin = curve_through(np.array([[0, 0], [50, 0], [100, 0], [105, 5], [100, 10], [50, 10], [0, 10]]))
    assert point_error(part(hairpin, 0.0, 0.9), hairpin).max > 15.0


def test_dense_enough_samples_no_longer_matter():
    found, true = wave((2.0, 3.0)), wave()
    assert curve_l3(found, true, samples=500) == pytest.approx(curve_l3(found, true, samples=4000), abs=0.55)
    assert point_error(found, true).mean == pytest.approx(math.hypot(2, 3), abs=1e-3)


@undirected
@pytest.mark.parametrize("backwards", [False, True])
@pytest.mark.parametrize("start", [0.3, 1.0, 2.5, 6.1])
def test_where_a_loop_begins_does_not_matter(start, backwards, directed):
    true, found = loop(100.0), loop(100.0, start=start)
    found = found.reversed() if backwards else found
    error = point_error(found, true, directed=directed)
    if backwards and directed:
        assert error.mean > 100.0
        assert curve_l3(found, true) > 50.0
        return
    assert error.forward is not backwards
    assert error.max == pytest.approx(0.0, abs=1e-3)
    assert curve_l3(found, true, directed=directed) == pytest.approx(0.0, abs=1e-3)


def test_a_larger_loop_is_as_far_as_its_radius_is_larger():
    error = point_error(loop(110.0, start=2.0), loop(100.0))
    assert (error.mean, error.max) == pytest.approx((10.0, 10.0), abs=0.01)
    assert curve_l3(loop(110.0, start=2.0), loop(100.0)) == pytest.approx(10.0, abs=0.05)
    assert length_error(loop(110.0), loop(100.0)) == pytest.approx(0.1, abs=1e-5)


def test_no_start_on_a_fine_grid_beats_the_one_that_was_chosen():
    found = curve_through(loop(60.0).sample(81)[:-1] * (1.0, 0.4) + (5.0, 3.0), closed=True).sample(2001)
    true = loop(50.0, start=0.7)
    x = np.array(at_arc_lengths(found.tolist(), SAMPLES))
    turned = [true((np.linspace(0, 1, SAMPLES) + shift / 400) % 1.0) for shift in range(400)]
    by_hand = [(slow_even_f(x, y) + slow_even_f(y, x)) / 2 for y in turned]
    mean_by_hand = [np.mean([math.dist(p, q) for p, q in zip(x, y, strict=True)]) for y in turned]
    assert min(by_hand) - 0.1 <= curve_l3(found, true, samples=SAMPLES) <= min(by_hand) + 1e-3
    assert min(mean_by_hand) - 0.1 <= point_error(found, true, samples=SAMPLES).mean <= min(mean_by_hand) + 1e-3


def test_an_open_curve_around_a_loop_and_a_loop_around_an_open_curve_are_the_same():
    opened = arc(100.0, 2 * math.pi)
    turned = loop(100.0, start=1.0)
    assert point_error(opened, turned).max == pytest.approx(0.0, abs=1e-3)
    assert point_error(turned, opened).max == pytest.approx(0.0, abs=1e-3)
    assert curve_l3(turned, opened) == pytest.approx(0.0, abs=1e-3)


def test_a_true_loop_has_no_ends_and_the_seam_of_a_found_one_counts_as_both():
    assert math.isnan(endpoint_error(arc(100.0, 3.0), loop(100.0)))
    assert math.isnan(endpoint_error(loop(100.0), loop(100.0)))
    half = arc(100.0, math.pi)
    assert endpoint_error(loop(100.0), half) == pytest.approx(100.0)


def test_points_in_order_are_as_good_as_a_curve():
    found, true = wave((0.0, 5.0)), wave()
    assert curve_l3(found.sample(3000), true) == pytest.approx(curve_l3(found, true), abs=0.5)
    assert point_error(found.sample(3000).tolist(), true).mean == pytest.approx(point_error(found, true).mean, abs=1e-2)
    assert length_error(found.sample(3000), true) == pytest.approx(0.0, abs=1e-5)
    assert endpoint_error(found.sample(3000), true) == endpoint_error(found, true)


def test_a_curve_shrunk_to_a_point_has_a_distance_but_is_no_truth_for_a_length():
    dot = [[0.0, 0.0], [0.0, 0.0]]
    side = [[3.0, 4.0], [3.0, 4.0]]
    assert curve_l3(dot, side) == point_error(dot, side).mean == endpoint_error(dot, side) == 5.0
    assert length_error(dot, STRAIGHT) == 1.0
    with pytest.raises(InputError, match="true must have a length"):
        length_error(STRAIGHT, dot)


@pytest.mark.parametrize("function", [curve_l3, point_error, endpoint_error, length_error])
@pytest.mark.parametrize(
    ("found", "message"),
    [
        (np.empty((0, 2)), "found must have 2 or more points, got 0"),
        ([[0, 0]], "found must have 2 or more points, got 1"),
        ([0, 0], r"found must have shape \(n, 2\) or \(n, 3\), got \(2,\)"),
        ([[0, 0, 0], [1, 1, 1]], "found and true must have the same dimension, got 3 and 2"),
        ([[0, 0], [1, math.nan]], "found must be finite"),
    ],
)
def test_curves_that_make_no_sense_are_refused(function, found, message):
    with pytest.raises(InputError, match=message):
        function(found, STRAIGHT)


@pytest.mark.parametrize("function", [curve_l3, point_error])
def test_a_comparison_needs_two_samples(function):
    with pytest.raises(InputError, match=r"samples must be an integer in 2\.\..*, got 1"):
        function(STRAIGHT, STRAIGHT, samples=1)
