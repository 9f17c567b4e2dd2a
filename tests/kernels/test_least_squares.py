"""The banded fit against scipy's."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import BSpline, make_lsq_spline

from dloftbs.fitting.spline_fit import closed_knots
from dloftbs.kernels.least_squares import fit_closed, fit_open, is_ascending, misfit, open_knots


def walk(seed: int, n: int, dims: int) -> tuple[np.ndarray, np.ndarray]:
    """Return parameters and points of a random walk with some long gaps, as a centre line has them."""
    rng = np.random.default_rng(seed)
    steps = rng.choice([1.0, np.sqrt(2.0), 60.0], size=n - 1, p=[0.6, 0.38, 0.02])
    u = np.concatenate(([0.0], np.cumsum(steps)))
    return u / u[-1], rng.normal(size=(n, dims)).cumsum(axis=0)


@given(st.integers(0, 2**31), st.integers(4, 400), st.integers(2, 60), st.sampled_from([2, 3]))
def test_open_fit_agrees_with_scipy(seed: int, n: int, k: int, dims: int) -> None:
    u, points = walk(seed, n, dims)
    knots = open_knots(u, k)
    expected = make_lsq_spline(u, points, knots, 3).c
    np.testing.assert_allclose(fit_open(u, points, knots), expected, rtol=1e-6, atol=1e-6 * np.abs(points).max())


def dense_periodic_fit(u: np.ndarray, points: np.ndarray, knots: np.ndarray) -> np.ndarray:
    """Evaluate the periodic basis functions one by one and solve the least squares densely."""
    n = len(knots) - 7
    basis = np.empty((len(u), n))
    for i in range(n):
        control = np.zeros(n + 3)
        control[i] = 1.0
        control[n:] = control[:3]
        basis[:, i] = BSpline(knots, control, 3)(u)
    control = np.linalg.lstsq(basis, points, rcond=None)[0]
    return np.concatenate((control, control[:3]))


@given(st.integers(0, 2**31), st.integers(8, 300), st.integers(2, 40))
def test_closed_fit_agrees_with_a_dense_solution(seed: int, n: int, k: int) -> None:
    angle = np.arange(n) / n
    rng = np.random.default_rng(seed)
    points = 50 * np.stack((np.cos(2 * np.pi * angle), np.sin(2 * np.pi * angle)), axis=1) + rng.normal(size=(n, 2))
    knots = closed_knots(angle, k)
    np.testing.assert_allclose(
        fit_closed(angle, points, knots), dense_periodic_fit(angle, points, knots), rtol=1e-6, atol=1e-5
    )


def test_a_cubic_is_fitted_exactly() -> None:
    u = np.linspace(0.0, 1.0, 50)
    points = np.stack((u**3 - u, 2.0 - 3.0 * u**2), axis=1)
    knots = open_knots(u, 7)
    np.testing.assert_allclose(BSpline(knots, fit_open(u, points, knots), 3)(u), points, atol=1e-12)


@pytest.mark.parametrize("n", [4, 5, 6, 9, 10, 25, 26, 51, 52])
def test_few_points_give_finite_control_points(n: int) -> None:
    u = np.linspace(0.0, 1.0, n)
    control = fit_open(u, np.stack((u, u), axis=1), open_knots(u, 25))
    np.testing.assert_allclose(control[[0, -1]], [[0.0, 0.0], [1.0, 1.0]], atol=1e-9)


def literal_knots(u: np.ndarray, k: int) -> np.ndarray:
    """Every so-many-th parameter, the ends four times."""
    count = min(k, max(len(u) // 2, 2))
    breaks = u[np.rint(np.linspace(0, len(u) - 1, count)).astype(int)]
    return np.concatenate(([0.0] * 4, breaks[1:-1], [1.0] * 4))


@given(st.integers(0, 2**31), st.integers(2, 500), st.integers(2, 60))
def test_knots_agree_with_their_literal_twin(seed: int, n: int, k: int) -> None:
    u, _ = walk(seed, n, 2)
    np.testing.assert_array_equal(open_knots(u, k), literal_knots(u, k))


@given(st.integers(0, 2**31), st.integers(8, 300), st.integers(4, 30), st.integers(1, 20))
def test_the_misfit_agrees_with_scipy(seed: int, n: int, k: int, window: int) -> None:
    u, points = walk(seed, n, 2)
    knots = open_knots(u, k)
    control = fit_open(u, points, knots)
    whole = n - n % window
    residual = (points - BSpline(knots, control, 3)(u))[:whole].reshape(-1, window, 2).mean(axis=1)
    expected = np.linalg.norm(residual, axis=1).max(initial=0.0)
    np.testing.assert_allclose(misfit(u, points, knots, control, window), expected, rtol=1e-6, atol=1e-9)


@given(st.lists(st.integers(0, 9), max_size=8))
def test_parameters_ascend_where_each_is_larger_than_the_one_before(u: list[int]) -> None:
    given_ = np.array(u, dtype=np.float64)
    assert is_ascending(given_) == bool((np.diff(given_) > 0.0).all())
