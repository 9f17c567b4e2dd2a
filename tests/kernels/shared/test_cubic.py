"""Cubic B-splines against scipy's, to the last bit where the order of operations is the same."""

from __future__ import annotations

import numpy as np
import pytest
from numba import njit
from scipy.interpolate import BSpline

from dloftbs.kernels.shared.cubic import basis_functions, point_and_slope

basis_functions = njit(basis_functions)
point_and_slope = njit(point_and_slope)


def random_spline(seed: int) -> BSpline:
    """Return a plane cubic with uneven knots, both ends clamped."""
    rng = np.random.default_rng(seed)
    inner = np.sort(rng.uniform(0.05, 0.95, int(rng.integers(0, 6))))
    return BSpline(np.concatenate((np.zeros(4), inner, np.ones(4))), rng.uniform(0.0, 500.0, (4 + len(inner), 2)), 3)


def span_of(spline: BSpline, u: float) -> int:
    return int(np.searchsorted(spline.t[: len(spline.c)], u, side="right")) - 1


@pytest.mark.parametrize("seed", range(20))
def test_basis_functions_round_as_scipy_does(seed: int) -> None:
    spline = random_spline(seed)
    for u in np.linspace(0.0, 1.0, 41):
        span = span_of(spline, u)
        a, b, c, d = basis_functions(spline.t, span, u)
        p, q, r, s = spline.c[span - 3 : span + 1]
        np.testing.assert_array_equal(p * a + q * b + r * c + s * d, spline(u))


def test_a_span_without_length_has_no_basis_functions() -> None:
    knots = np.array([0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 2.0])
    assert basis_functions(knots, 4, 1.0) == (0.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize("seed", range(20))
def test_points_and_slopes_agree_with_scipy(seed: int) -> None:
    spline = random_spline(seed)
    for u in np.linspace(0.0, 1.0, 41):
        x, y, slope_x, slope_y = point_and_slope(spline.t, spline.c, span_of(spline, u), u)
        np.testing.assert_allclose((x, y), spline(u), rtol=1e-12)
        tangent, slope = spline.derivative()(u), np.array((slope_x, slope_y))
        np.testing.assert_allclose(slope / np.linalg.norm(slope), tangent / np.linalg.norm(tangent), atol=1e-9)
