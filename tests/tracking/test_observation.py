"""Samples of curves, as tracking takes them."""

from __future__ import annotations

import numpy as np
import pytest
from builders import curve_through

from dloftbs.data.curve import BSplineCurve
from dloftbs.data.curve_samples import SAMPLES, U, sample_curve

CUBIC = curve_through(np.array([(10.0 + t, 40.0 + 20.0 * np.sin(t / 30.0)) for t in range(200)]))
QUADRATIC = BSplineCurve([0, 0, 0, 0.5, 1, 1, 1], [(0, 0), (10, 30), (40, 30), (50, 0)], degree=2)


@pytest.mark.parametrize("curve", [CUBIC, QUADRATIC])
@pytest.mark.parametrize("count", [2, SAMPLES, 200])
@pytest.mark.parametrize("span", [(0.0, 1.0), (0.0, 0.4), (0.3, 1.0)])
def test_samples_lie_on_the_curve_at_even_parameters(curve, span, count):
    for _ in range(2):  # those of the whole curve may have been kept
        points, length = sample_curve(curve, *span, count)
        np.testing.assert_allclose(points, curve.spline(np.linspace(*span, count)), atol=1e-9)
        assert length == pytest.approx(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())


@pytest.mark.parametrize("curve", [CUBIC, QUADRATIC])
def test_those_of_a_whole_curve_are_made_once_and_nobody_can_change_them(curve):
    points, _ = sample_curve(curve)
    assert sample_curve(curve)[0] is points
    with pytest.raises(ValueError, match="read-only"):
        points[0] = 0.0
    turned, _ = sample_curve(curve.reversed())
    np.testing.assert_allclose(turned, curve.spline(1.0 - U), atol=1e-9)
