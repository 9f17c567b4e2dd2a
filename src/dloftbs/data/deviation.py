"""The standard deviation of each point of a curve across it, from what its detection holds.

Computed when it is asked for. The weights are fitted on sources of many kinds, each also left out, by
``python -m benchmarks.fit_deviation`` (docs/deviation.md).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from dloftbs.data.centerline import Centerline, JointKind
from dloftbs.data.curve import BSplineCurve
from dloftbs.data.spans import Spans
from dloftbs.support.arrays import FloatArray

if TYPE_CHECKING:
    from collections.abc import Sequence

    from dloftbs.data.centerline import Joint

WEIGHTS = np.array([0.061, 1.0, 0.534, 0.004, 0.052])
"""Factors of the terms in the image: a pixel's grid, misfit, roughness, ends and crossings, inferred parts.

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

_ROUGHNESS_WIDTHS = 6.0
"""Length over which the local radii are compared, widths.

Source: by definition; twice as long, since a radius is the mean of two edges' places.
"""


def terms_in_image(
    curve: BSplineCurve, line: Centerline, joints: Sequence[Joint], inferred: Spans, u: FloatArray
) -> FloatArray:
    """Return the terms (n, 5), px, whose squares, with `WEIGHTS`, sum up to the variance at `u` (n,)."""
    width, length = line.width_px, curve.length
    off = line.points - curve.spline(line.u)
    along = curve.spline(line.u, nu=1)
    across = (along[:, 0] * off[:, 1] - along[:, 1] * off[:, 0]) / np.maximum(np.linalg.norm(along, axis=1), 1e-12)
    places, at = curve.u_at(line.u) * length, u * length
    misfit = np.sqrt(_mean_near(places, across**2, at, _MISFIT_WIDTHS * width))
    radius = line.radius - np.median(line.radius)
    level = _mean_near(places, radius, at, _ROUGHNESS_WIDTHS * width)
    square = _mean_near(places, radius**2, at, _ROUGHNESS_WIDTHS * width)
    roughness = np.sqrt(np.maximum(square - level**2, 0.0))
    crossings = [joint.u for joint in joints if joint.kind is JointKind.CROSSING]
    ends = () if curve.closed else ((0.0, 0.0), (1.0, 1.0))
    near = np.zeros(len(u))
    for low, high in (*crossings, *ends):
        away = np.maximum(np.maximum(low - u, u - high), 0.0) * length
        near = np.maximum(near, np.maximum(width - away, 0.0))
    hidden = depth_inside(u, inferred) * length
    hidden[hidden > 0.0] += 0.5 * width
    return np.stack((np.ones(len(u)), misfit, roughness, near, hidden), axis=1)


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


def deviation_at(std: FloatArray, curve: BSplineCurve, u: npt.ArrayLike) -> FloatArray:
    """Return deviations (n,), given at even parameters of a curve's spline, at places on it, in the shape of these."""
    t = curve.t_at(u)
    found: FloatArray = np.interp(np.mod(t, 1.0) if curve.closed else t, np.linspace(0.0, 1.0, len(std)), std)
    return found


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
