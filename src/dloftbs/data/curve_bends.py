"""Bends of a curve without the waves that only its noise has: where it bends most, and by which radius.

A fitted curve follows the pixels' noise as closely as its knots let it, and the second derivative is most of all that
noise. So short waves are taken from it first: from even points along it by least squares, with a penalty on the change
of the curvature along the curve, which leaves lines, circles and helices as they are.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.interpolate import BSpline, make_interp_spline
from scipy.linalg import solveh_banded

from dloftbs.data.curve_like import CurveLike
from dloftbs.data.spline_geometry import bends
from dloftbs.support.arrays import LARGEST, FloatArray
from dloftbs.support.values import check_number

_KNOTS_PER_WAVE = 2.0
"""Length of the waves that are noise where nothing else is stated, distances between knots.

Source: by definition; knots carry no shorter ones (Nyquist).
"""

WIDTHS_PER_WAVE = 8.0
"""Least length of the waves of an object of known width that are no noise, widths.

Source: measured; two thirds of the shortest wave of bends of three widths' radius, two half circles. Of 6, 8, 9 and 10,
the one with which radii are right to 2 % in clean scenes and to 6 % in noisy ones.
"""

_STEPS = 24
"""Number of points in a wave.

Source: numerics; more change radii by less than 0.001 of them.
"""

_DIFFERENCES = np.array([-1.0, 3.0, -3.0, 1.0])
"""Third derivative by points, the change of the curvature.

Source: by definition.
"""


def bend_radius(curve: CurveLike, u: npt.ArrayLike, over: float | None) -> FloatArray:
    """Return the radii at `u` (...) of a curve without waves that are shorter than `over`."""
    curvature = _curvature(curve, over)
    t = curve.t_at(u)  # whether it is on the curve
    return _radius(curve.curvature(u) if curvature is None else curvature(curve.u_at(t)))


def tightest_bend(curve: CurveLike, over: float | None) -> tuple[float, float]:
    """Return the place where a curve without short waves bends most, and the radius there."""
    curvature = _curvature(curve, over) or curve.curvature
    breaks = curve.breaks
    t = np.append((breaks[:-1, None] + np.diff(breaks)[:, None] * (np.arange(_STEPS) / _STEPS)).ravel(), 1.0)
    u = curve.u_at(t)
    most = int(np.argmax(curvature(u)))
    nearby = np.linspace(u[max(most - 1, 0)], u[min(most + 1, len(u) - 1)], 2 * _STEPS + 1)
    near = curvature(nearby)
    best = int(near.argmax())
    return float(nearby[best]), float(_radius(near)[best])


class _Curvature:
    """The curvature of a smoothed curve, by the ``u`` of the curve that it was made of."""

    def __init__(self, spline: BSpline) -> None:
        self._spline = spline

    def __call__(self, u: FloatArray) -> FloatArray:
        return np.linalg.norm(bends(self._spline, u), axis=-1)


def _curvature(curve: CurveLike, over: float | None) -> _Curvature | None:
    """Return the curvature without waves shorter than `over`, or None where there are none to take away."""
    wave = wave_of_knots(curve) if over is None else check_number("over", over, 0.0, LARGEST)
    if not (wave > 0.0 and curve.length > 0.0):
        return None
    wave = min(wave, curve.length)
    points = curve.sample(int(np.ceil(_STEPS * curve.length / wave)) + 1)
    if not curve.closed:
        smooth = _smoothed(points)
        return _Curvature(make_interp_spline(np.linspace(0.0, 1.0, len(points)), smooth, 3))
    around = _smoothed(np.tile(points[:-1], (3, 1)))[len(points) - 1 : 2 * len(points) - 1]
    around[-1] = around[0]
    return _Curvature(make_interp_spline(np.linspace(0.0, 1.0, len(points)), around, 3, bc_type="periodic"))


def wave_of_knots(curve: CurveLike) -> float:
    """Return the length of the shortest waves that the knots of a curve carry, in its unit."""
    return _KNOTS_PER_WAVE * curve.length / (len(curve.breaks) - 1)


def _smoothed(points: FloatArray) -> FloatArray:
    """Return points (n, d) without waves of fewer than `_STEPS` points, of which half of the height is left."""
    n, order = len(points), len(_DIFFERENCES) - 1
    weight = (_STEPS / (2.0 * np.pi)) ** (2 * order)
    bands = np.zeros((order + 1, n))
    bands[-1] = 1.0
    for apart in range(order + 1):
        for k in range(order + 1 - apart):
            bands[order - apart, k + apart : k + apart + n - order] += (
                weight * _DIFFERENCES[k] * _DIFFERENCES[k + apart]
            )
    result: FloatArray = solveh_banded(bands, points)
    return result


def _radius(curvature: FloatArray) -> FloatArray:
    return np.divide(1.0, curvature, out=np.full(np.shape(curvature), np.inf), where=curvature > 0.0)
