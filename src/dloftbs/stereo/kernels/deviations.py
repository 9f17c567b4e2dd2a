"""Standard deviation of a spline in space across itself, of the observations' noise and of a rig's errors."""

from __future__ import annotations

import math

import numpy as np
from numba import float64, int64

from dloftbs.kernels.compiler import Floats, Ints, helper, kernel, read
from dloftbs.stereo.kernels.band_equations import BAND, ORDER, Four, add_row, basis_and_slopes, combine, solve, span_of
from dloftbs.stereo.kernels.observations import DEPTH, SHARED, WEIGHT, gradient_of, see

_ERRORS = 6
"""Number of errors of a view: its principal point's x and y, turns about three axes, and what its rows share.

Source: by definition.
"""


@kernel(
    read(float64, 2, "C"), read(float64, 1, "C"), read(float64, 1, "C"), read(float64, 2, "C"),
    read(int64, 1, "C"), read(float64, 1, "C"), read(float64, 3, "C"), read(float64, 2, "C"), read(float64, 1, "C"),
    float64, read(float64, 2, "C"), int64,
)  # fmt: skip
def deviations(
    control: Floats,
    knots: Floats,
    t: Floats,
    rows: Floats,
    views: Ints,
    residuals: Floats,
    rotations: Floats,
    shifts: Floats,
    pixel_std: Floats,
    rotation_std: float,
    factor: Floats,
    count: int,
) -> Floats:
    """Return the standard deviation of a spline across itself at evenly spaced parameters, shape (count,).

    It is the root of the trace of the covariance across the spline. Where residuals are larger than their noise, so is
    what is not known of the spline, by as much (Birge's ratio).

    Parameters
    ----------
    control, knots, t, rows, views, residuals, rotations, shifts
        As `fit_views` left them.
    pixel_std : (k,) float64
        Standard deviation of each view's principal point, of rays.
    rotation_std : float
        Standard deviation of each view's rotation but the first one's, about each axis, radians.
    factor : (3 n, 12) float64
        As `fit_views` wrote it.
    count : int
    """
    n = len(control)
    inverse = _inverse_of(factor)
    moved = _moved_by_rig(control, knots, t, rows, views, rotations, shifts, pixel_std, rotation_std, factor)
    excess = _excess(t, rows, residuals, n - ORDER + 1)
    found = np.empty(count)
    covariance = np.empty((3, 3))
    for k in range(count):
        at = k / (count - 1)
        span = span_of(n, at)
        basis, slopes = basis_and_slopes(knots, span, at)
        low = span - ORDER + 1
        _covariance_at(inverse, low, basis, excess[low], covariance)
        for error in range(len(moved)):
            step = combine(moved[error], low, basis)
            for d in range(3):
                for e in range(3):
                    covariance[d, e] += step[d] * step[e]
        tangent = combine(control, low, slopes)
        speed = tangent[0] * tangent[0] + tangent[1] * tangent[1] + tangent[2] * tangent[2]
        total = covariance[0, 0] + covariance[1, 1] + covariance[2, 2]
        along = 0.0
        for d in range(3):
            for e in range(3):
                along += tangent[d] * covariance[d, e] * tangent[e]
        if speed > 0.0:
            total -= along / speed
        found[k] = math.sqrt(max(total, 0.0))
    return found


@helper
def _inverse_of(factor: Floats) -> Floats:
    """Return the entries of the inverse within the bands, by Takahashi's recursion."""
    size = len(factor)
    inverse = np.zeros((size, BAND))
    for j in range(size - 1, -1, -1):
        reach = min(BAND, size - j)
        for k in range(reach - 1, -1, -1):
            total = 1.0 / factor[j, 0] if k == 0 else 0.0
            for other in range(1, reach):
                low, high = min(k, other), max(k, other)
                total -= factor[j, other] * inverse[j + low, high - low]
            inverse[j, k] = total / factor[j, 0]
    return inverse


@helper
def _moved_by_rig(
    control: Floats,
    knots: Floats,
    t: Floats,
    rows: Floats,
    views: Ints,
    rotations: Floats,
    shifts: Floats,
    pixel_std: Floats,
    rotation_std: float,
    factor: Floats,
) -> Floats:
    """Return how each error of the rig, of one standard deviation, moves the control points, (errors, n, 3)."""
    n = len(control)
    if rotation_std == 0.0 and not pixel_std.any() and not rows[:, SHARED].any():
        return np.zeros((0, n, 3))
    moved = np.zeros((_ERRORS * len(rotations), 3 * n))
    for i in range(len(t)):
        row, view = rows[i], views[i]
        if row[DEPTH] > 0.0:
            continue
        span = span_of(n, t[i])
        basis, _ = basis_and_slopes(knots, span, t[i])
        low = span - ORDER + 1
        seen = see(rotations[view], shifts[view], combine(control, low, basis))
        gradient = gradient_of(rotations[view], row, seen)
        x, y, nx, ny = seen[0], seen[1], row[2], row[3]
        turning = rotation_std if view > 0 else 0.0
        # A small turn about x, y and z moves the ray (x, y, 1) by these, seen across the curve.
        sizes = (
            nx * pixel_std[view],
            ny * pixel_std[view],
            turning * (-nx * x * y - ny * (1.0 + y * y)),
            turning * (nx * (1.0 + x * x) + ny * x * y),
            turning * (-nx * y + ny * x),
            row[SHARED],
        )
        for e in range(_ERRORS):
            add_row(moved[_ERRORS * view + e], low, basis, row[WEIGHT] * sizes[e], gradient)
    for e in range(len(moved)):
        solve(factor, moved[e])
    return moved.reshape(-1, n, 3)


@helper
def _excess(t: Floats, rows: Floats, residuals: Floats, spans: int) -> Floats:
    """Return by what factor the variance exceeds that of the noise in each knot span and its neighbours, at least 1."""
    sums, counts = np.zeros(spans + 2), np.zeros(spans + 2)
    for i in range(len(t)):
        span = 1 + min(int(t[i] * spans), spans - 1)
        sums[span] += rows[i, WEIGHT] * residuals[i] * residuals[i]
        counts[span] += 1.0
    found = np.empty(spans)
    for span in range(spans):
        count = counts[span] + counts[span + 1] + counts[span + 2]
        found[span] = max((sums[span] + sums[span + 1] + sums[span + 2]) / max(count, 1.0), 1.0)
    return found


@helper
def _covariance_at(inverse: Floats, low: int, basis: Four, scale: float, covariance: Floats) -> None:
    """Write the covariance of a point of the spline, (3, 3)."""
    covariance[:] = 0.0
    for r in range(ORDER):
        row = 3 * (low + r)
        own = scale * basis[r] * basis[r]
        for d in range(3):
            for e in range(3):
                covariance[d, e] += own * inverse[row + min(d, e), abs(d - e)]
        for s in range(r + 1, ORDER):
            both = scale * basis[r] * basis[s]
            for d in range(3):
                for e in range(3):
                    value = both * inverse[row + d, 3 * (s - r) + e - d]
                    covariance[d, e] += value
                    covariance[e, d] += value
