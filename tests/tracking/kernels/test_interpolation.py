"""Values between samples, places beyond the ends, and curves that move along with the velocities of their samples."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.tracking.kernels.interpolation import extend_ends, filter_velocity, interpolate, move_control_points

_DISTANCES = np.array([0.5, 1.0, 1.5])


@pytest.mark.parametrize("count", [2, 5, 63, 64, 127, 129])
@pytest.mark.parametrize("samples", [2, 3, 64])
def test_values_are_those_of_numpy_s_interpolation(samples: int, count: int) -> None:
    rng = np.random.default_rng(count)
    values = rng.normal(size=(samples, 3))
    u = np.concatenate((np.linspace(0.0, 1.0, count), rng.uniform(-0.5, 1.5, count), np.linspace(0.0, 1.0, samples)))
    expected = np.stack([np.interp(u, np.linspace(0.0, 1.0, samples), column) for column in values.T], axis=1)
    np.testing.assert_allclose(interpolate(values, u), expected, rtol=0.0, atol=1e-12)


def slow_move(
    knots: np.ndarray, control: np.ndarray, velocity: np.ndarray, seconds: float, degree: int, closed: bool
) -> np.ndarray:
    """Move control points by NumPy's interpolation."""
    n, places = len(control), np.cumsum(knots)
    greville = (places[degree : degree + n] - places[:n]) / degree
    at, even = greville % 1.0 if closed else greville, np.linspace(0.0, 1.0, len(velocity))
    return control + seconds * np.stack([np.interp(at, even, column) for column in velocity.T], axis=1)


def knots_of(rng: np.random.Generator, closed: bool, even: bool) -> np.ndarray:
    """Return the knots of a cubic with some spans, clamped or periodic."""
    spans = int(rng.integers(4, 40))
    steps = np.ones(spans) if even else rng.uniform(0.1, 1.0, spans)
    breaks = np.concatenate(([0.0], np.cumsum(steps) / steps.sum()))
    breaks[-1] = 1.0
    if closed:
        return np.concatenate((breaks[-4:-1] - 1.0, breaks, breaks[1:4] + 1.0))
    return np.concatenate(([0.0] * 3, breaks, [1.0] * 3))


@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize("even", [False, True])
@pytest.mark.parametrize("dims", [2, 3])
def test_control_points_move_as_by_interpolation(closed: bool, even: bool, dims: int) -> None:
    rng = np.random.default_rng(0)
    for _ in range(500):
        knots = knots_of(rng, closed, even)
        control, velocity = rng.normal(size=(len(knots) - 4, dims)), rng.normal(size=(65, dims))
        found = move_control_points(knots, control, velocity, 0.03, 3, closed)
        np.testing.assert_allclose(found, slow_move(knots, control, velocity, 0.03, 3, closed), rtol=0.0, atol=1e-12)


@given(st.integers(0, 10_000))
def test_places_beyond_ends_lie_straight_on_at_their_distances(seed: int) -> None:
    points = np.random.default_rng(seed).uniform(0.0, 100.0, (7, 2))
    places = extend_ends(points[::-1], _DISTANCES, 12.0).reshape(2, 3, 2)
    for side, (end, before) in enumerate(((points[6], points[5]), (points[0], points[1]))):
        direction = (end - before) / np.linalg.norm(end - before)
        np.testing.assert_allclose(places[side], end + 12.0 * _DISTANCES[:, None] * direction, atol=1e-9)


def test_an_end_without_a_direction_stands_for_what_is_beyond_it() -> None:
    points = np.array([(3.0, 4.0), (3.0, 4.0), (9.0, 4.0)])
    places = extend_ends(points, _DISTANCES, 10.0)
    np.testing.assert_allclose(places, [(3, 4)] * 3 + [(14, 4), (19, 4), (24, 4)])


@pytest.mark.parametrize("dims", [2, 3])
def test_a_velocity_is_that_of_the_step_with_a_share_of_the_former(dims: int) -> None:
    former, before, after = np.random.default_rng(dims).normal(size=(3, 64, dims))
    expected = 0.2 * former + 0.8 * (after - before) / 0.05
    np.testing.assert_allclose(filter_velocity(former, before, after, 0.05, 0.8), expected, rtol=1e-12, atol=1e-12)
