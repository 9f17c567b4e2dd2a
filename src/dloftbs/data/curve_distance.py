"""The least distance between two curves, and between a curve and the pixels of a mask."""

from __future__ import annotations

import numpy as np
from scipy.optimize import minimize
from scipy.spatial import cKDTree

from dloftbs.data.curve_like import CurveLike
from dloftbs.support.arrays import AnyArray, FloatArray

_PER_SPAN = 16
"""Number of places in each knot span from which the nearest ones are looked for.

Source: numerics; between two of them a cubic is nearly straight.
"""

_REFINED = 8
"""Number of the nearest places that are looked at closely.

Source: numerics; the nearest one of the samples is nearly always the nearest one.
"""


def nearest_places(a: CurveLike, b: CurveLike) -> tuple[float, float, float]:
    """Return the places ``u`` on two curves that are nearest to each other, and their distance."""
    t_a, t_b = _places(a), _places(b)
    points_a = a.spline(t_a)
    distances, nearest = cKDTree(b.spline(t_b)).query(points_a)
    before, after = np.append(np.inf, distances[:-1]), np.append(distances[1:], np.inf)
    (lowest,) = np.nonzero((distances <= before) & (distances <= after))
    best = (np.inf, 0.0, 0.0)
    for i in lowest[np.argsort(distances[lowest], kind="stable")][:_REFINED]:
        best = min(best, _refined(a, b, *_around(a, t_a, int(i)), *_around(b, t_b, int(nearest[i]))))
    distance, at_a, at_b = best
    u_a, u_b = (float(one.u_at(at)) for one, at in ((a, at_a), (b, at_b)))
    return u_a % 1.0 if a.closed else u_a, u_b % 1.0 if b.closed else u_b, distance


def nearest_pixel(curve: CurveLike, mask: AnyArray) -> tuple[float, tuple[float, float], float] | None:
    """Return the place of a curve that is nearest to a set pixel, that pixel's ``(x, y)``, and the distance."""
    rows, columns = np.nonzero(mask)
    if not len(rows):
        return None
    pixels = np.column_stack((columns, rows)).astype(np.float64)
    distances, _ = cKDTree(curve.sample(spacing=1.0) if curve.length > 0.0 else curve.sample(2)).query(pixels)
    # A sample may be half a pixel away from the nearest place.
    near = pixels[distances <= distances.min() + 0.5]
    distance, u, number = min((*curve.nearest(pixel)[::-1], number) for number, pixel in enumerate(near))
    x, y = near[number].tolist()
    return u, (x, y), distance


def _places(curve: CurveLike) -> FloatArray:
    """Return parameters of the spline from 0 to 1, the same number in each knot span."""
    breaks = curve.breaks
    steps = np.arange(_PER_SPAN) / _PER_SPAN
    return np.append((breaks[:-1, None] + np.diff(breaks)[:, None] * steps).ravel(), 1.0)


def _around(curve: CurveLike, t: FloatArray, i: int) -> tuple[float, float, float]:
    """Return a parameter and the ones beside it; those of a loop go on beyond its seam."""
    low, high = t[max(i - 1, 0)], t[min(i + 1, len(t) - 1)]
    if curve.closed:
        low, high = min(low, t[i] - t[1]), max(high, t[i] + t[1])
    return float(t[i]), float(low), float(high)


def _refined(
    a: CurveLike, b: CurveLike, t: float, low: float, high: float, s: float, low_s: float, high_s: float
) -> tuple[float, float, float]:
    """Return the least distance within two intervals of the splines' parameters, and the two parameters."""
    start, widths = np.array([low, low_s]), np.array([high - low, high_s - low_s])
    unit = float(np.linalg.norm(a.spline(low) - a.spline(high)) + np.linalg.norm(b.spline(low_s) - b.spline(high_s)))

    def squared(y: FloatArray) -> tuple[float, FloatArray]:
        at = start + widths * y
        apart = (a.spline(at[0]) - b.spline(at[1])) / unit
        slopes = np.array([apart @ a.spline(at[0], nu=1), -apart @ b.spline(at[1], nu=1)]) / unit
        return float(apart @ apart), 2.0 * widths * slopes

    first = (np.array([t, s]) - start) / widths
    found = first
    if unit > 0.0:
        options = {"ftol": 0.0, "gtol": 1e-14}
        found = minimize(squared, first, jac=True, method="L-BFGS-B", bounds=[(0.0, 1.0)] * 2, options=options).x
    ends = [start + widths * y for y in (first, found)]
    return min((float(np.linalg.norm(a.spline(at[0]) - b.spline(at[1]))), *at.tolist()) for at in ends)
