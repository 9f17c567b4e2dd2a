"""One cubic B-spline in space through curves in several views, by Gauss's and Newton's method.

Each observation is a point of a curve in a view with the normal of the curve there; its residual is how far the
projection of the spline's point lies beside the curve. Where the point lies along the curve is found anew in each step.
What the observations leave open, along epipolar lines and where a view shows nothing, is decided by the prior: second
derivatives by arc length are white noise, as of a smoothing spline. The normal equations have bands of twelve.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from numba import boolean, float64, int64

from dloftbs.kernels.compiler import helper, kernel, read, write

ORDER = 4
"""Number of basis functions of a cubic that are not zero in a knot span.

Source: by definition.
"""

BAND = 3 * ORDER
"""Number of bands of the normal equations: three coordinates of each.

Source: by definition.
"""

_GAUGE = 0.1
"""Weight of a point's motion along the spline, as a share of that across it.

Source: numerics; such motion changes no residual, so that any weight keeps the equations regular.
"""

_FARTHEST_STEP = 0.5
"""Largest step of an observation along the spline, knot spans.

Source: numerics; steps are right to first order within a span.
"""

_WIDER = 2.0
"""Excess of a width over the object's median from which it is that of several passes, standard deviations.

Source: by hand; 1.25 times as wide, where two equal strands overlap by three quarters.
"""

_Floats = npt.NDArray[np.float64]
_Ints = npt.NDArray[np.int64]
_Four = tuple[float, float, float, float]


@helper
def _span_of(n: int, t: float) -> int:
    """Return the knot span that a parameter lies in, of evenly spaced knots."""
    return ORDER - 1 + min(max(int(t * (n - ORDER + 1)), 0), n - ORDER)


@helper
def _basis_and_slopes(knots: _Floats, span: int, t: float) -> tuple[_Four, _Four]:
    """Return the four basis functions of a span and their derivatives."""
    a, b, c = knots[span - 2], knots[span - 1], knots[span]
    d, e, f = knots[span + 1], knots[span + 2], knots[span + 3]
    line = 1.0 / (d - c)
    second, first = (t - c) * line, (d - t) * line
    share = first / (d - b)
    quadratic_0, carry = (d - t) * share, (t - b) * share
    share = second / (e - c)
    quadratic_1, quadratic_2 = carry + (e - t) * share, (t - c) * share
    left, middle, right = quadratic_0 / (d - a), quadratic_1 / (e - b), quadratic_2 / (f - c)
    values = (
        (d - t) * left,
        (t - a) * left + (e - t) * middle,
        (t - b) * middle + (f - t) * right,
        (t - c) * right,
    )
    return values, (-3.0 * left, 3.0 * (left - middle), 3.0 * (middle - right), 3.0 * right)


@helper
def _factor(band: _Floats) -> bool:
    """Replace a matrix by its Cholesky factor; band[i, k] is the entry at (i + k, i). False if it is not positive."""
    n = len(band)
    for i in range(n):
        if not band[i, 0] > 0.0:
            return False
        pivot = math.sqrt(band[i, 0])
        band[i, 0] = pivot
        reach = min(BAND, n - i)
        for k in range(1, reach):
            band[i, k] /= pivot
        for k in range(1, reach):
            value = band[i, k]
            if value != 0.0:
                for j in range(k, reach):
                    band[i + k, j - k] -= value * band[i, j]
    return True


@helper
def _solve(factor: _Floats, right: _Floats) -> None:
    """Replace the right side (n,) by the solution."""
    n = len(right)
    for i in range(n):
        right[i] /= factor[i, 0]
        for k in range(1, min(BAND, n - i)):
            right[i + k] -= factor[i, k] * right[i]
    for i in range(n - 1, -1, -1):
        for k in range(1, min(BAND, n - i)):
            right[i] -= factor[i, k] * right[i + k]
        right[i] /= factor[i, 0]


@helper
def _add_prior(band: _Floats, right: _Floats, control: _Floats, roughness: _Floats, weight: float) -> None:
    """Add the prior to the normal equations."""
    n = len(control)
    for i in range(n):
        for k in range(min(ORDER, n - i)):
            value = weight * roughness[i, k]
            for d in range(3):
                band[3 * i + d, 3 * k] += value
                right[3 * i + d] -= value * control[i + k, d]
                if k > 0:
                    right[3 * (i + k) + d] -= value * control[i, d]


@helper
def _add_square(band: _Floats, low: int, basis: _Four, square: tuple[float, float, float, float, float, float]) -> None:
    """Add a symmetric matrix (xx, xy, xz, yy, yz, zz), times the products of four basis functions, to the equations."""
    xx, xy, xz, yy, yz, zz = square
    for r in range(ORDER):
        row = 3 * (low + r)
        own = basis[r] * basis[r]
        band[row, 0] += own * xx
        band[row, 1] += own * xy
        band[row, 2] += own * xz
        band[row + 1, 0] += own * yy
        band[row + 1, 1] += own * yz
        band[row + 2, 0] += own * zz
        for s in range(r + 1, ORDER):
            both, k = basis[r] * basis[s], 3 * (s - r)
            band[row, k] += both * xx
            band[row, k + 1] += both * xy
            band[row, k + 2] += both * xz
            band[row + 1, k - 1] += both * xy
            band[row + 1, k] += both * yy
            band[row + 1, k + 1] += both * yz
            band[row + 2, k - 2] += both * xz
            band[row + 2, k - 1] += both * yz
            band[row + 2, k] += both * zz


@helper
def _fit_points(points: _Floats, weights: _Floats, knots: _Floats, roughness: _Floats, prior: float) -> _Floats:
    """Fit a smooth spline to points at even parameters, and return its control points (n, 3)."""
    n, m = len(knots) - ORDER, len(points)
    band, right, control = np.zeros((3 * n, BAND)), np.zeros(3 * n), np.zeros((n, 3))
    _add_prior(band, right, control, roughness, prior)
    for i in range(m):
        at = i / (m - 1)
        span = _span_of(n, at)
        basis, _ = _basis_and_slopes(knots, span, at)
        low = span - ORDER + 1
        for r in range(ORDER):
            for d in range(3):
                value = weights[i] * basis[r]
                right[3 * (low + r) + d] += value * points[i, d]
                for s in range(r, ORDER):
                    band[3 * (low + r) + d, 3 * (s - r)] += value * basis[s]
    if _factor(band):
        _solve(band, right)
    return right.reshape(n, 3)


@kernel(
    read(float64, 2, "C"), read(float64, 1, "C"), read(float64, 1, "C"), float64, float64, float64,
    read(float64, 1, "C"), read(float64, 2, "C"), read(float64, 1, "C"), read(float64, 2, "C"),
)  # fmt: skip
def start_curve(
    nodes: _Floats,
    inverse_depths: _Floats,
    weights: _Floats,
    scale: float,
    bending: float,
    least_share: float,
    depth_knots: _Floats,
    depth_roughness: _Floats,
    knots: _Floats,
    roughness: _Floats,
) -> tuple[_Floats, float]:
    """Fit a spline in space to points on rays, at depths whose inverses are made smooth first.

    Parameters
    ----------
    nodes : (m, 2) float64
        Rays (x, y, 1), evenly spaced along the curve.
    inverse_depths, weights : (m,) float64
        As `triangulate_path` returns them.
    scale : float
        Factor of the weights.
    bending : float
        Spectral density of the second derivative by arc length, 1 / m.
    least_share : float
        Least inverse depth, as a share of the mean.
    depth_knots, depth_roughness, knots, roughness
        Knots of the inverse depth and of the spline, each end four times, else evenly spaced, and the integrals of the
        products of their basis functions' second derivatives, by bands.

    Returns
    -------
    control : (n, 3) float64
    length : float
        Of the polygon through the points, metres; 0 where they lie behind the camera.
    """
    m, n = len(nodes), len(depth_knots) - ORDER
    total = mean = length = 0.0
    for i in range(m):
        total += weights[i]
        mean += weights[i] * inverse_depths[i]
        if i > 0:
            length += math.hypot(nodes[i, 0] - nodes[i - 1, 0], nodes[i, 1] - nodes[i - 1, 1])
    if not (total > 0.0 and mean > 0.0 and length > 0.0):
        return np.zeros((len(knots) - ORDER, 3)), 0.0
    mean /= total
    columns, scaled = np.zeros((m, 3)), weights * scale
    columns[:, 0] = inverse_depths
    # What bends in space bends as much in depth, whose inverse falls with the square; a length has the depth in it.
    smooth = _fit_points(columns, scaled, depth_knots, depth_roughness, 1.0 / (bending * length**3 * mean))
    length = 0.0
    for i in range(m):
        at = i / (m - 1)
        span = _span_of(n, at)
        basis, _ = _basis_and_slopes(depth_knots, span, at)
        inverse = 0.0
        for r in range(ORDER):
            inverse += basis[r] * smooth[span - ORDER + 1 + r, 0]
        depth = 1.0 / max(inverse, least_share * mean)
        columns[i, 0], columns[i, 1], columns[i, 2] = nodes[i, 0] * depth, nodes[i, 1] * depth, depth
        if i > 0:
            dx, dy, dz = columns[i, 0] - columns[i - 1, 0], columns[i, 1] - columns[i - 1, 1], depth - columns[i - 1, 2]
            length += math.sqrt(dx * dx + dy * dy + dz * dz)
    # A rough point is as uncertain as half the distance to the next.
    scaled[:] = (2.0 * m / length) ** 2
    return _fit_points(columns, scaled, knots, roughness, 1.0 / (bending * length**3)), length


@kernel(
    write(float64, 2, "C"), read(float64, 1, "C"), write(float64, 1, "C"), read(float64, 2, "C"),
    read(int64, 1, "C"), read(float64, 3, "C"), read(float64, 2, "C"),
    read(float64, 2, "C"), float64, float64, int64,
    write(float64, 1, "C"), write(float64, 1, "C"), write(float64, 2, "C"),
)  # fmt: skip
def fit_views(
    control: _Floats,
    knots: _Floats,
    t: _Floats,
    rows: _Floats,
    views: _Ints,
    rotations: _Floats,
    shifts: _Floats,
    roughness: _Floats,
    prior: float,
    most: float,
    iterations: int,
    residuals: _Floats,
    depths: _Floats,
    band: _Floats,
) -> bool:
    """Fit a spline in space to curves in several views, from a spline nearby.

    Parameters
    ----------
    control : (n, 3) float64
        Comes with the start and is overwritten, in the frame that the poses are in.
    knots : (n + 4,) float64
        As for `start_curve`.
    t : (m,) float64
        Place of each observation on the spline; comes with the start and is overwritten.
    rows : (m, k) float64
        The observations: ray x and y without the lens, the unit normal of the curve there, and one over the variance
        across it, of rays.
    views : (m,) int64
        The view of each.
    rotations : (k, 3, 3) float64
    shifts : (k, 3) float64
        To the frames of the views.
    roughness : (n, 4) float64
        As for `start_curve`.
    prior : float
        Weight of the roughness.
    most : float
        Largest residual that counts in full, of rays; larger ones count as their root (Huber).
    iterations : int
    residuals : (m,) float64
        Written: those before the last step, of rays.
    depths : (m,) float64
        Written: along z of each observation's view, metres, before the last step.
    band : (3 n, 12) float64
        Written: the Cholesky factor of the normal matrix.

    Returns
    -------
    bool
        False if the spline leads behind a camera, or the equations have no solution.
    """
    n, m = len(control), len(t)
    right = np.empty(3 * n)
    farthest = _FARTHEST_STEP / (n - ORDER + 1)
    for _ in range(iterations):
        band[:] = 0.0
        right[:] = 0.0
        _add_prior(band, right, control, roughness, prior)
        for i in range(m):
            span = _span_of(n, t[i])
            basis, slopes = _basis_and_slopes(knots, span, t[i])
            low = span - ORDER + 1
            x = y = z = tx = ty = tz = 0.0
            for r in range(ORDER):
                cx, cy, cz = control[low + r, 0], control[low + r, 1], control[low + r, 2]
                x, y, z = x + basis[r] * cx, y + basis[r] * cy, z + basis[r] * cz
                tx, ty, tz = tx + slopes[r] * cx, ty + slopes[r] * cy, tz + slopes[r] * cz
            view = views[i]
            turn, shift = rotations[view], shifts[view]
            seen_z = turn[2, 0] * x + turn[2, 1] * y + turn[2, 2] * z + shift[2]
            if not seen_z > 0.0:
                return False
            depths[i] = seen_z
            inverse = 1.0 / seen_z
            seen_x = (turn[0, 0] * x + turn[0, 1] * y + turn[0, 2] * z + shift[0]) * inverse
            seen_y = (turn[1, 0] * x + turn[1, 1] * y + turn[1, 2] * z + shift[1]) * inverse
            slope_z = turn[2, 0] * tx + turn[2, 1] * ty + turn[2, 2] * tz
            slope_x = (turn[0, 0] * tx + turn[0, 1] * ty + turn[0, 2] * tz - seen_x * slope_z) * inverse
            slope_y = (turn[1, 0] * tx + turn[1, 1] * ty + turn[1, 2] * tz - seen_y * slope_z) * inverse
            off_x, off_y = seen_x - rows[i, 0], seen_y - rows[i, 1]
            nx, ny = rows[i, 2], rows[i, 3]
            residual = nx * off_x + ny * off_y
            residuals[i] = residual
            weight = rows[i, 4]
            if abs(residual) > most:
                weight *= most / abs(residual)
            along = nx * seen_x + ny * seen_y
            gx = (nx * turn[0, 0] + ny * turn[1, 0] - along * turn[2, 0]) * inverse
            gy = (nx * turn[0, 1] + ny * turn[1, 1] - along * turn[2, 1]) * inverse
            gz = (nx * turn[0, 2] + ny * turn[1, 2] - along * turn[2, 2]) * inverse
            speed = tx * tx + ty * ty + tz * tz
            gauge = _GAUGE * weight * inverse * inverse / speed if speed > 0.0 else 0.0
            square = (
                weight * gx * gx + gauge * tx * tx,
                weight * gx * gy + gauge * tx * ty,
                weight * gx * gz + gauge * tx * tz,
                weight * gy * gy + gauge * ty * ty,
                weight * gy * gz + gauge * ty * tz,
                weight * gz * gz + gauge * tz * tz,
            )
            _add_square(band, low, basis, square)
            for r in range(ORDER):
                value = weight * residual * basis[r]
                right[3 * (low + r)] -= value * gx
                right[3 * (low + r) + 1] -= value * gy
                right[3 * (low + r) + 2] -= value * gz
            squared = slope_x * slope_x + slope_y * slope_y
            if squared > 0.0:
                step = -(off_x * slope_x + off_y * slope_y) / squared
                t[i] = min(max(t[i] + min(max(step, -farthest), farthest), 0.0), 1.0)
        if not _factor(band):
            return False
        _solve(band, right)
        for i in range(n):
            for d in range(3):
                control[i, d] += right[3 * i + d]
    return True


@kernel(
    read(float64, 2, "C"), read(float64, 1, "C"), read(float64, 1, "C"), read(float64, 2, "C"),
    read(int64, 1, "C"), read(float64, 3, "C"), read(float64, 2, "C"), read(float64, 1, "C"),
    float64, read(float64, 2, "C"), int64,
)  # fmt: skip
def deviations(
    control: _Floats,
    knots: _Floats,
    t: _Floats,
    rows: _Floats,
    views: _Ints,
    rotations: _Floats,
    shifts: _Floats,
    pixel_std: _Floats,
    rotation_std: float,
    factor: _Floats,
    count: int,
) -> _Floats:
    """Return the standard deviation of a spline across itself at evenly spaced parameters, shape (count,).

    It is the root of the trace of the covariance across the spline, of the observations' noise and of a rig's errors.

    Parameters
    ----------
    control, knots, t, rows, views, rotations, shifts
        As `fit_views` left them.
    pixel_std : (k,) float64
        Standard deviation of each view's principal point, of rays.
    rotation_std : float
        Standard deviation of each view's rotation but the first one's, about each axis, radians.
    factor : (3 n, 12) float64
        As `fit_views` wrote it.
    count : int
    """
    n, m = len(control), len(t)
    size = 3 * n
    # Takahashi's recursion: the entries of the inverse within the bands.
    inverse = np.zeros((size, BAND))
    for j in range(size - 1, -1, -1):
        reach = min(BAND, size - j)
        for k in range(reach - 1, -1, -1):
            total = 1.0 / factor[j, 0] if k == 0 else 0.0
            for other in range(1, reach):
                low, high = min(k, other), max(k, other)
                total -= factor[j, other] * inverse[j + low, high - low]
            inverse[j, k] = total / factor[j, 0]
    view_count = len(rotations)
    errors = 5 * view_count
    moved = np.zeros((errors, size))
    for i in range(m):
        view = views[i]
        turned = view > 0 and rotation_std > 0.0
        if not (turned or pixel_std[view] > 0.0):
            continue
        span = _span_of(n, t[i])
        basis, _ = _basis_and_slopes(knots, span, t[i])
        low = span - ORDER + 1
        x = y = z = 0.0
        for r in range(ORDER):
            x, y, z = (
                x + basis[r] * control[low + r, 0],
                y + basis[r] * control[low + r, 1],
                z + basis[r] * control[low + r, 2],
            )
        turn, shift = rotations[view], shifts[view]
        inverse_z = 1.0 / (turn[2, 0] * x + turn[2, 1] * y + turn[2, 2] * z + shift[2])
        seen_x = (turn[0, 0] * x + turn[0, 1] * y + turn[0, 2] * z + shift[0]) * inverse_z
        seen_y = (turn[1, 0] * x + turn[1, 1] * y + turn[1, 2] * z + shift[1]) * inverse_z
        nx, ny = rows[i, 2], rows[i, 3]
        along = nx * seen_x + ny * seen_y
        gx = (nx * turn[0, 0] + ny * turn[1, 0] - along * turn[2, 0]) * inverse_z
        gy = (nx * turn[0, 1] + ny * turn[1, 1] - along * turn[2, 1]) * inverse_z
        gz = (nx * turn[0, 2] + ny * turn[1, 2] - along * turn[2, 2]) * inverse_z
        # A small turn about x, y and z moves the ray (x, y, 1) by these, seen across the curve.
        about_x = -nx * seen_x * seen_y - ny * (1.0 + seen_y * seen_y)
        about_y = nx * (1.0 + seen_x * seen_x) + ny * seen_x * seen_y
        about_z = -nx * seen_y + ny * seen_x
        turning = rotation_std if turned else 0.0
        sizes = (
            nx * pixel_std[view],
            ny * pixel_std[view],
            turning * about_x,
            turning * about_y,
            turning * about_z,
        )
        for e in range(5):
            for r in range(ORDER):
                value = rows[i, 4] * sizes[e] * basis[r]
                row = 3 * (low + r)
                moved[5 * view + e, row] += value * gx
                moved[5 * view + e, row + 1] += value * gy
                moved[5 * view + e, row + 2] += value * gz
    for e in range(errors):
        if pixel_std[e // 5] > 0.0 or rotation_std > 0.0:
            _solve(factor, moved[e])
    found = np.empty(count)
    covariance = np.empty((3, 3))
    for k in range(count):
        at = k / (count - 1)
        span = _span_of(n, at)
        basis, slopes = _basis_and_slopes(knots, span, at)
        low = span - ORDER + 1
        covariance[:] = 0.0
        for r in range(ORDER):
            for s in range(ORDER):
                product = basis[r] * basis[s]
                for d in range(3):
                    for e in range(3):
                        i, j = 3 * (low + r) + d, 3 * (low + s) + e
                        covariance[d, e] += product * inverse[min(i, j), abs(i - j)]
        for error in range(errors):
            x = y = z = 0.0
            for r in range(ORDER):
                row = 3 * (low + r)
                x += basis[r] * moved[error, row]
                y += basis[r] * moved[error, row + 1]
                z += basis[r] * moved[error, row + 2]
            step = (x, y, z)
            for d in range(3):
                for e in range(3):
                    covariance[d, e] += step[d] * step[e]
        tx = ty = tz = 0.0
        for r in range(ORDER):
            tx += slopes[r] * control[low + r, 0]
            ty += slopes[r] * control[low + r, 1]
            tz += slopes[r] * control[low + r, 2]
        tangent = (tx, ty, tz)
        speed = tx * tx + ty * ty + tz * tz
        total = covariance[0, 0] + covariance[1, 1] + covariance[2, 2]
        along = 0.0
        for d in range(3):
            for e in range(3):
                along += tangent[d] * covariance[d, e] * tangent[e]
        if speed > 0.0:
            total -= along / speed
        found[k] = math.sqrt(max(total, 0.0))
    return found


@kernel(
    read(float64, 1, "C"), write(float64, 2, "C"), read(float64, 1, "C"), read(int64, 1, "C"),
    read(float64, 1, "C"), int64, float64, float64, float64, write(boolean, 1, "C"),
)  # fmt: skip
def compare_widths(
    t: _Floats,
    rows: _Floats,
    depths: _Floats,
    views: _Ints,
    focals_px: _Floats,
    spans: int,
    width_std: float,
    radius_std_px: float,
    most: float,
    shown: npt.NDArray[np.bool_],
) -> tuple[int, float]:
    """Find where the widths in two views, in metres, contradict each other: one of them shows something else there.

    Where an object is wider than elsewhere, its mask has merged with that of another pass, which counts as well.

    Parameters
    ----------
    t, depths, views
        As `fit_views` left them.
    rows : (m, 7) float64
        Column 5 is half the width, of rays, and 6 whether an observation is clear. What is contradicted is no longer
        clear then, and may be as far off as the cable is wide.
    focals_px : (k,) float64
        Of the views.
    spans : int
        Number of equal parts of the curve in which views are compared.
    width_std : float
        Standard deviation of the logarithm of a width.
    radius_std_px : float
        Standard deviation of half a width, px.
    most : float
        Difference that is a contradiction, standard deviations.
    shown : (spans,) bool
        Written: whether at least two views have clear observations there.

    Returns
    -------
    found : int
        Number of observations that are contradicted.
    width_m : float
        Width of the object, the geometric mean of what is clear; 0 where nothing is.
    """
    m, k = len(t), len(focals_px)
    sums, counts = np.zeros((k, spans)), np.zeros((k, spans))
    for i in range(m):
        if rows[i, 6] > 0.0:
            span = min(int(t[i] * spans), spans - 1)
            sums[views[i], span] += math.log(rows[i, 5] * depths[i])
            counts[views[i], span] += 1.0
    usual = np.log(np.median(rows[:, 5] * depths))
    found = 0
    for i in range(m):
        if rows[i, 6] == 0.0:
            continue
        span, own = min(int(t[i] * spans), spans - 1), math.log(rows[i, 5] * depths[i])
        std = math.hypot(width_std, radius_std_px / (focals_px[views[i]] * rows[i, 5]))
        if own - usual > _WIDER * std:
            rows[i, 4], rows[i, 6] = 0.25 / (rows[i, 5] * rows[i, 5]), 0.0
            found += 1
        for view in range(k):
            if view == views[i] or counts[view, span] == 0.0:
                continue
            if rows[i, 6] > 0.0 and abs(own - sums[view, span] / counts[view, span]) > most * std:
                rows[i, 4], rows[i, 6] = 0.25 / (rows[i, 5] * rows[i, 5]), 0.0
                found += 1
    counts[:] = 0.0
    total = number = 0.0
    for i in range(m):
        if rows[i, 6] > 0.0:
            counts[views[i], min(int(t[i] * spans), spans - 1)] = 1.0
            total += math.log(rows[i, 5] * depths[i])
            number += 1.0
    for span in range(spans):
        shown[span] = counts[:, span].sum() >= 2.0
    return found, 2.0 * math.exp(total / number) if number > 0.0 else 0.0
