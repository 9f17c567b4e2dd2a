"""The standard deviation of each point of a curve across it, from what its detection holds.

Computed when it is asked for. The weights are fitted on sources of many kinds, each also left out, by
``python -m benchmarks.fit_deviation`` (docs/deviation.md).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from dloftbs.data.centerline import Centerline
from dloftbs.data.curve import BSplineCurve
from dloftbs.data.spans import Spans
from dloftbs.support.arrays import FloatArray

WEIGHTS = np.array([0.280, 1.386, 0.614, 0.487, 2.794, 0.037])
"""Factors of the terms in the image: grid, misfit, roughness, bends, radii that were not measured, inferred parts.

Source: fitted by benchmarks.fit_deviation.
"""

WEIGHTS_3D = np.array([1.001, 0.985, 0.010, 0.018])
"""Factors of the terms in space: across the line of sight, depth's noise, the width where it recedes, unseen parts.

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

_HADAMARD = 6.0
"""Variance of a second difference of independent values, over that of one of them.

Source: by definition; 1 + 4 + 1.
"""

_CUBIC_ERROR = 1.0 / 384.0
"""Largest error of a cubic spline over its fourth derivative and the fourth power of its step.

Source: by definition; C. A. Hall, W. W. Meyer, 1976, for half of a step.
"""


def terms_in_image(curve: BSplineCurve, line: Centerline, inferred: Spans, u: FloatArray) -> FloatArray:
    """Return the terms (n, 6), px, whose squares, with `WEIGHTS`, sum up to the variance at `u` (n,).

    A curve averages the noise of its pixels over the distance of its knots, the more the longer that is. Noise that
    goes together for so long stays: the radii show it, since edges that move apart are as frequent as edges that move
    to one side.
    """
    u = np.mod(u, 1.0) if curve.closed else u
    width, length, at = line.width_px, curve.length, u * curve.length
    spacing = np.maximum(_spacing(curve, u), width / _MISFIT_WIDTHS)
    averaged = np.sqrt(width / spacing)

    # Steps of an edge on the grid lie far apart where it runs along rows, columns or diagonals.
    sides = np.sort(np.abs(curve.tangent(u)), axis=1)
    slope = sides[:, 0] / sides[:, 1]
    grid = 1.0 / np.sqrt(spacing * (1.0 + spacing * np.minimum(slope, 1.0 - slope)))

    off = line.points - curve.spline(line.u)
    along = curve.spline(line.u, nu=1)
    across = (along[:, 0] * off[:, 1] - along[:, 1] * off[:, 0]) / np.maximum(np.linalg.norm(along, axis=1), 1e-12)
    places, squares, radius = curve.u_at(line.u) * length, across**2, line.radius
    # Three stretches have to fit, with room to move.
    stretches = np.minimum(np.maximum(_spacing(curve, curve.u_at(line.u)), width / _MISFIT_WIDTHS), 0.25 * length)
    if curve.closed:  # three times around, so that windows go on beyond the seam
        places = np.concatenate((places - length, places, places + length))
        squares, radius, stretches = np.tile((squares, radius, stretches), 3)
    misfit = np.sqrt(_mean_near(places, squares, at, _MISFIT_WIDTHS * width))
    # Radii that are equal to the last bit were laid along the line, as where cables run side by side.
    equal = np.convolve(np.diff(radius) == 0.0, (0.5, 0.5))  # of a pair, each of both points counts half
    unmeasured = _mean_near(places, equal, at, _MISFIT_WIDTHS * width)
    roughness = _roughness(places, radius, stretches, at, _ROUGHNESS_WIDTHS * width)
    hidden = depth_inside(u, inferred) * length
    hidden[hidden > 0.0] += 0.5 * width
    columns = (grid, misfit * averaged, roughness, _bends(curve)[_spans(curve, u)], unmeasured * misfit, hidden)
    return np.stack(columns, axis=1)


def _spans(curve: BSplineCurve, u: FloatArray) -> npt.NDArray[np.intp]:
    """Return the numbers (n,) of the spans between knots in which places lie."""
    spans: npt.NDArray[np.intp] = np.clip(np.searchsorted(curve.breaks, curve.t_at(u)) - 1, 0, len(curve.breaks) - 2)
    return spans


def _spacing(curve: BSplineCurve, u: FloatArray) -> FloatArray:
    """Return the lengths (n,) of the spans between knots in which places lie, in the curve's unit."""
    lengths: FloatArray = np.diff(curve.u_at(curve.breaks)) * curve.length
    return lengths[_spans(curve, u)]


def _bends(curve: BSplineCurve) -> FloatArray:
    """Return how far the true curve may bend away from each span of a spline, by the jumps of the third derivative."""
    steps = np.diff(curve.breaks)
    third = curve.spline(curve.breaks[:-1] + 0.5 * steps, nu=3)
    jumps = np.linalg.norm(np.diff(third, axis=0), axis=1)
    seam = np.linalg.norm(third[:1] - third[-1:], axis=1) if curve.closed else np.zeros(1)
    around = np.concatenate((seam, jumps, seam))
    bends: FloatArray = _CUBIC_ERROR * steps**3 * np.maximum(around[:-1], around[1:])
    return bends


def _roughness(
    places: FloatArray, radius: FloatArray, stretches: FloatArray, at: FloatArray, window: float
) -> FloatArray:
    """Return the noise (m,) of radii (n,) that is left in their averages over stretches (n,), around others' places.

    It is the Hadamard deviation, of second differences of the averages of three stretches in a row. Noise that a
    stretch averages out is not in it, nor is a width that grows along the cable, as perspective makes it.
    """
    before, here, after = (_mean_near(places, radius, places + n * stretches, stretches) for n in (-1.0, 0.0, 1.0))
    squares = (before - 2.0 * here + after) ** 2 / _HADAMARD
    whole = (places >= places[0] + 1.5 * stretches) & (places <= places[-1] - 1.5 * stretches)
    if not whole.any():
        whole[:] = True
    rough: FloatArray = np.sqrt(_mean_near(places[whole], squares[whole], at, window))
    return rough


def terms_in_space(
    curve_3d: BSplineCurve,
    inferred_3d: Spans,
    std_px: FloatArray,
    focal_px: float,
    width_px: float,
    std_per_m: float,
    u_3d: FloatArray,
) -> FloatArray:
    """Return the terms (n, 4), metres, whose squares, with `WEIGHTS_3D`, sum up to the variance at `u_3d` (n,)."""
    points = curve_3d(u_3d)
    px = points[:, 2] / focal_px
    noise = std_per_m * points[:, 2] ** 2
    rays = points / np.linalg.norm(points, axis=1, keepdims=True)
    recedes = np.abs((curve_3d.tangent(u_3d) * rays).sum(axis=1))
    hidden = depth_inside(u_3d, inferred_3d) * curve_3d.length
    return np.stack((std_px * px, noise, recedes * width_px * px, hidden), axis=1)


def deviation_at(std: FloatArray, curve: BSplineCurve, u: npt.ArrayLike) -> FloatArray:
    """Return deviations (n,), given at even parameters of a curve's spline, at places on it, in the shape of these."""
    t = curve.t_at(u)
    found: FloatArray = np.interp(np.mod(t, 1.0) if curve.closed else t, np.linspace(0.0, 1.0, len(std)), std)
    return found


def deviation(terms: FloatArray, weights: FloatArray) -> FloatArray:
    """Return the standard deviation (n,) of independent terms (n, k)."""
    result: FloatArray = np.sqrt((terms**2) @ (weights**2))
    return result


def with_hidden(
    std: FloatArray, u: FloatArray, spans: Spans, length: float, margin: float, weight: float = WEIGHTS[-1]
) -> FloatArray:
    """Return deviations (n,) with what more a track is unsure of where it is hidden: by default, in the image."""
    hidden = depth_inside(u, spans) * length
    hidden[hidden > 0.0] += margin
    result: FloatArray = np.hypot(std, weight * hidden)
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


def _mean_near(places: FloatArray, values: FloatArray, at: FloatArray, window: float | FloatArray) -> FloatArray:
    """Return means (m,) of values (n,) at ascending places (n,), over one window or windows (m,) around others (m,)."""
    sums = np.concatenate(([0.0], np.cumsum(values)))
    first = np.minimum(np.searchsorted(places, at - 0.5 * window), len(places) - 1)
    last = np.maximum(np.searchsorted(places, at + 0.5 * window, "right"), first + 1)
    mean: FloatArray = (sums[last] - sums[first]) / (last - first)
    # In a gap there are none: those beside it count.
    empty = (places[first] > at + 0.5 * window) | (places[last - 1] < at - 0.5 * window)
    if empty.any():
        mean[empty] = np.interp(at[empty], places, values)
    return mean
