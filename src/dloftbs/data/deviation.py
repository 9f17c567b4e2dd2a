"""The standard deviation of each point of a curve across it, from what its detection holds.

Computed when it is asked for. The weights are fitted on sources of many kinds, each also left out, by
``python -m benchmarks.fit_deviation`` (docs/deviation.md).
"""

from __future__ import annotations

import numpy as np

from dloftbs.data.centerline import Centerline
from dloftbs.data.curve import BSplineCurve
from dloftbs.data.spans import Spans
from dloftbs.support.arrays import FloatArray

WEIGHTS = np.array([0.295, 1.37, 0.954, 0.498, 3.62, 0.0396])
"""Factors of the terms in the image: grid, misfit, roughness, bends, radii that were not measured, inferred parts.

Source: fitted by benchmarks.fit_deviation.
"""

WEIGHTS_3D = np.array([0.997, 0.451, 0.006, 0.029])
"""Factors of the terms in space: across the line of sight, noise of depth, the width, parts that no depth shows.

Source: fitted by benchmarks.fit_deviation.
"""

_MISFIT_WIDTHS = 3.0
"""Length over which the misfit of the pixels to the curve is averaged, widths.

Source: by definition; two distances between the densest knots.
"""

_ROUGHNESS_WIDTHS = 12.0
"""Length over which the local radii are compared, widths.

Source: by definition; two bends of the shortest waves that a cable of that width can have.
"""

_CUBIC_ERROR = 1.0 / 384.0
"""Largest error of a cubic spline over its fourth derivative and the fourth power of its step.

Source: by definition; C. A. Hall, W. W. Meyer, 1976, for half of a step.
"""


def terms_in_image(curve: BSplineCurve, line: Centerline, inferred: Spans, u: FloatArray) -> FloatArray:
    """Return the terms (n, 6), px, whose squares, with `WEIGHTS`, sum up to the variance at `u` (n,).

    A curve averages the noise of its pixels over the distance of its knots, the more the longer that is.
    """
    width, length, at = line.width_px, curve.length, u * curve.length
    knots = curve.u_at(curve.breaks) * length
    span = np.clip(np.searchsorted(knots, at) - 1, 0, len(knots) - 2)
    spacing = np.maximum(np.diff(knots)[span], width / _MISFIT_WIDTHS)
    averaged = np.sqrt(width / spacing)

    # Steps of an edge on the grid lie far apart where it runs along rows, columns or diagonals.
    sides = np.sort(np.abs(curve.tangent(u)), axis=1)
    slope = sides[:, 0] / sides[:, 1]
    grid = 1.0 / np.sqrt(spacing * (1.0 + spacing * np.minimum(slope, 1.0 - slope)))

    off = line.points - curve.spline(line.u)
    along = curve.spline(line.u, nu=1)
    across = (along[:, 0] * off[:, 1] - along[:, 1] * off[:, 0]) / np.maximum(np.linalg.norm(along, axis=1), 1e-12)
    places = curve.u_at(line.u) * length
    misfit = np.sqrt(_mean_near(places, across**2, at, _MISFIT_WIDTHS * width))
    # Radii that are equal to the last bit were laid along the line, as where cables run side by side.
    equal = np.append(np.diff(line.radius) == 0.0, [False])
    unmeasured = _mean_near(places, equal.astype(np.float64), at, _MISFIT_WIDTHS * width)
    roughness = _roughness(places, line.radius, at, _ROUGHNESS_WIDTHS * width)
    hidden = depth_inside(u, inferred) * length
    hidden[hidden > 0.0] += 0.5 * width
    columns = grid, misfit * averaged, roughness * averaged, _bends(curve)[span], unmeasured * misfit, hidden
    return np.stack(columns, axis=1)


def _bends(curve: BSplineCurve) -> FloatArray:
    """Return how far the true curve may bend away from each span of a spline, by the jumps of the third derivative."""
    steps = np.diff(curve.breaks)
    third = curve.spline(curve.breaks[:-1] + 0.5 * steps, nu=3)
    jumps = np.linalg.norm(np.diff(third, axis=0), axis=1)
    around = np.concatenate(([0.0], jumps, [0.0]))
    bends: FloatArray = _CUBIC_ERROR * steps**3 * np.maximum(around[:-1], around[1:])
    return bends


def _roughness(places: FloatArray, radius: FloatArray, at: FloatArray, window: float) -> FloatArray:
    """Return the deviation (m,) of radii (n,) around others' places from a straight line: perspective is no noise."""
    x, y = places - np.mean(places), radius - np.median(radius)
    x_mean, y_mean, xx, xy, yy = (_mean_near(places, values, at, window) for values in (x, y, x * x, x * y, y * y))
    xx, xy, yy = xx - x_mean**2, xy - x_mean * y_mean, yy - y_mean**2
    explained = np.divide(xy**2, xx, out=np.zeros(len(at)), where=xx > 1e-9)
    rough: FloatArray = np.sqrt(np.maximum(yy - explained, 0.0))
    return rough


def terms_in_space(
    curve_3d: BSplineCurve,
    inferred_3d: Spans,
    std_px: FloatArray,
    focal_px: float,
    width_px: float,
    noise_per_m: float,
    u_3d: FloatArray,
) -> FloatArray:
    """Return the terms (n, 4), metres, whose squares, with `WEIGHTS_3D`, sum up to the variance at `u_3d` (n,)."""
    depth = curve_3d(u_3d)[:, 2]
    hidden = depth_inside(u_3d, inferred_3d) * curve_3d.length
    width_m = width_px * depth / focal_px
    return np.stack((std_px * depth / focal_px, noise_per_m * depth**2, width_m, hidden), axis=1)


def deviation(terms: FloatArray, weights: FloatArray) -> FloatArray:
    """Return the standard deviation (n,) of independent terms (n, k)."""
    result: FloatArray = np.sqrt((terms**2) @ (weights**2))
    return result


def with_hidden(std: FloatArray, u: FloatArray, spans: Spans, length: float, margin: float) -> FloatArray:
    """Return deviations (n,) with what more a track is unsure of where it is hidden."""
    hidden = depth_inside(u, spans) * length
    hidden[hidden > 0.0] += margin
    result: FloatArray = np.hypot(std, WEIGHTS[-1] * hidden)
    return result


def depth_inside(u: FloatArray, spans: Spans) -> FloatArray:
    """Return how far places (n,) lie inside of intervals, from the nearer edge that is seen; 0 outside."""
    inside = np.zeros(len(u))
    for low, high in spans:
        before = u - low if low > 0.0 else np.full(len(u), np.inf)
        after = high - u if high < 1.0 else np.full(len(u), np.inf)
        nearer = np.minimum(before, after)
        inside = np.where((u >= low) & (u <= high) & np.isfinite(nearer), np.maximum(inside, nearer), inside)
    return inside


def _mean_near(places: FloatArray, values: FloatArray, at: FloatArray, window: float) -> FloatArray:
    """Return means (m,) of values (n,) at ascending places (n,), over a window around others (m,)."""
    sums = np.concatenate(([0.0], np.cumsum(values)))
    first = np.minimum(np.searchsorted(places, at - 0.5 * window), len(places) - 1)
    last = np.maximum(np.searchsorted(places, at + 0.5 * window, "right"), first + 1)
    mean: FloatArray = (sums[last] - sums[first]) / (last - first)
    # In a gap there are none: those beside it count.
    empty = (places[first] > at + 0.5 * window) | (places[last - 1] < at - 0.5 * window)
    if empty.any():
        mean[empty] = np.interp(at[empty], places, values)
    return mean
