"""Lens distortion there and back, and depth as another camera sees it.

Normalised points are pixels without the camera matrix: (x - cx) / fx and (y - cy) / fy; with undone distortion they are
rays (x, y, 1). What lies outside of a lens's field, where distortion cannot be inverted, becomes NaN.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from numba import float32, float64, int64

from dloftbs.kernels.compiler import Floats, helper, kernel, read, write

NO_LENS, POLYNOMIAL, FISHEYE = 0, 1, 2
MARGIN_PX = 0.25
"""Margin of a footprint on each side: between two footprints, a slanted surface comes apart by less than this."""

_MAX_STEPS = 60
_MAX_HALVINGS = 30
_ENOUGH = 1e-24  # squared residual at which the search ends: 5e-9 px at a focal length of 5000 px
_CONVERGED = 1e-22  # squared residual that counts as found where it cannot be made less


@helper
def _radial(s: float, k: Floats) -> tuple[float, float]:
    """Return by what a squared radius scales the point, and one over the denominator of that."""
    inverse = 1.0 / (1.0 + s * (k[5] + s * (k[6] + s * k[7])))
    return (1.0 + s * (k[0] + s * (k[1] + s * k[4]))) * inverse, inverse


@helper
def _moved(x: float, y: float, s: float, scale: float, k: Floats) -> tuple[float, float]:
    """Return where radial, tangential and prism distortion take a point."""
    p1, p2, xy2 = k[2], k[3], 2.0 * x * y
    return (
        x * scale + p1 * xy2 + p2 * (s + 2.0 * x * x) + s * (k[8] + s * k[9]),
        y * scale + p1 * (s + 2.0 * y * y) + p2 * xy2 + s * (k[10] + s * k[11]),
    )


@helper
def _bent(x: float, y: float, k: Floats) -> tuple[float, float, float, float, float, float]:
    """Return where distortion takes a point, without tilt, and the four derivatives of that."""
    s = x * x + y * y
    scale, inverse = _radial(s, k)
    bent_x, bent_y = _moved(x, y, s, scale, k)
    slope = (k[0] + s * (2.0 * k[1] + s * 3.0 * k[4])) - scale * (k[5] + s * (2.0 * k[6] + s * 3.0 * k[7]))
    slope *= inverse
    p1, p2 = k[2], k[3]
    prism_x, prism_y = 2.0 * (k[8] + 2.0 * s * k[9]), 2.0 * (k[10] + 2.0 * s * k[11])
    mixed = 2.0 * (x * y * slope + p1 * x + p2 * y)
    xx = scale + 2.0 * x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x + x * prism_x
    xy = mixed + y * prism_x
    yx = mixed + x * prism_y
    yy = scale + 2.0 * y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x + y * prism_y
    return bent_x, bent_y, xx, xy, yx, yy


@helper
def _tilted(x: float, y: float, tilt: Floats) -> tuple[float, float]:
    w = 1.0 / (tilt[2, 0] * x + tilt[2, 1] * y + tilt[2, 2])
    return (tilt[0, 0] * x + tilt[0, 1] * y + tilt[0, 2]) * w, (tilt[1, 0] * x + tilt[1, 1] * y + tilt[1, 2]) * w


@helper
def _through_polynomial(x: float, y: float, k: Floats, tilt: Floats, field: float) -> tuple[float, float]:
    if not x * x + y * y < field:
        return math.nan, math.nan
    bent_x, bent_y, xx, xy, yx, yy = _bent(x, y, k)
    if not xx * yy - xy * yx > 0.0:
        return math.nan, math.nan
    return _tilted(bent_x, bent_y, tilt)


@helper
def _through_fisheye(x: float, y: float, k: Floats, field: float) -> tuple[float, float]:
    radius = math.sqrt(x * x + y * y)
    angle = math.atan(radius)
    if not angle < field:
        return math.nan, math.nan
    if radius == 0.0:
        return x, y
    s = angle * angle
    scale = angle * (1.0 + s * (k[0] + s * (k[1] + s * (k[2] + s * k[3])))) / radius
    return x * scale, y * scale


@kernel(
    read(float64, 2, "C"), int64, read(float64, 1, "C"), read(float64, 2, "C"), float64, write(float64, 2, "C")
)  # fmt: skip
def distort(points: Floats, model: int, k: Floats, tilt: Floats, field: float, out: Floats) -> None:
    """Distort rays as a lens does.

    Parameters
    ----------
    points : (n, 2) float64
        Normalised, without distortion.
    model : int
        `POLYNOMIAL` or `FISHEYE`.
    k : (12,) float64
        OpenCV's order: k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4, or the four of the fisheye.
    tilt : (3, 3) float64
        Homography of a tilted sensor, of the polynomial model.
    field : float
        Limit of the lens's field: the squared radius of the polynomial, the angle of the fisheye, radians.
    out : (n, 2) float64
        Written: normalised, with distortion; NaN outside of the field.
    """
    for i in range(len(points)):
        if model == FISHEYE:
            out[i, 0], out[i, 1] = _through_fisheye(points[i, 0], points[i, 1], k, field)
        else:
            out[i, 0], out[i, 1] = _through_polynomial(points[i, 0], points[i, 1], k, tilt, field)


@helper
def _unbent(target_x: float, target_y: float, k: Floats, field: float) -> tuple[float, float]:
    """Invert `_bent` by Newton's steps, halved where one leads out of the field or farther off."""
    x, y = target_x, target_y
    s = x * x + y * y
    if not s < field:
        inside = math.sqrt(0.9 * field / s)
        x, y = x * inside, y * inside
    bent_x, bent_y, xx, xy, yx, yy = _bent(x, y, k)
    off_x, off_y = target_x - bent_x, target_y - bent_y
    off = off_x * off_x + off_y * off_y
    determinant = xx * yy - xy * yx
    for _ in range(_MAX_STEPS):
        if not (off > _ENOUGH and determinant != 0.0):
            break
        step_x = (yy * off_x - xy * off_y) / determinant
        step_y = (xx * off_y - yx * off_x) / determinant
        better = False
        for _ in range(_MAX_HALVINGS):
            next_x, next_y = x + step_x, y + step_y
            if next_x * next_x + next_y * next_y < field:
                bent_x, bent_y, xx, xy, yx, yy = _bent(next_x, next_y, k)
                off_x, off_y = target_x - bent_x, target_y - bent_y
                next_off = off_x * off_x + off_y * off_y
                better = next_off < off
                if better:
                    x, y, off, determinant = next_x, next_y, next_off, xx * yy - xy * yx
                    break
            step_x, step_y = 0.5 * step_x, 0.5 * step_y
        if not better:
            break
    if off < _CONVERGED and determinant > 0.0:
        return x, y
    return math.nan, math.nan


@helper
def _unfisheyed(target_x: float, target_y: float, k: Floats, field: float) -> tuple[float, float]:
    """Invert `_through_fisheye`: Newton's steps for the angle, within a bracket that closes."""
    target = math.sqrt(target_x * target_x + target_y * target_y)
    s = field * field
    if not target < field * (1.0 + s * (k[0] + s * (k[1] + s * (k[2] + s * k[3])))):
        return math.nan, math.nan
    if target == 0.0:
        return target_x, target_y
    low, high = 0.0, field
    angle = min(target, 0.5 * field)
    for _ in range(_MAX_STEPS):
        s = angle * angle
        off = target - angle * (1.0 + s * (k[0] + s * (k[1] + s * (k[2] + s * k[3]))))
        if off > 0.0:
            low = angle
        else:
            high = angle
        if off * off < _ENOUGH:
            break
        slope = 1.0 + s * (3.0 * k[0] + s * (5.0 * k[1] + s * (7.0 * k[2] + s * 9.0 * k[3])))
        guess = angle + off / slope if slope > 0.0 else low
        angle = guess if low < guess < high else 0.5 * (low + high)
    scale = math.tan(angle) / target
    return target_x * scale, target_y * scale


@kernel(
    read(float64, 2, "C"), int64, read(float64, 1, "C"), read(float64, 2, "C"), float64, write(float64, 2, "C")
)  # fmt: skip
def undistort(points: Floats, model: int, k: Floats, untilt: Floats, field: float, out: Floats) -> None:
    """Undo what `distort` does; the parameters are its own, but for the inverse of the homography in `untilt`."""
    for i in range(len(points)):
        if model == FISHEYE:
            out[i, 0], out[i, 1] = _unfisheyed(points[i, 0], points[i, 1], k, field)
        else:
            x, y = _tilted(points[i, 0], points[i, 1], untilt)
            out[i, 0], out[i, 1] = _unbent(x, y, k, field)


@kernel(
    read(float32, 1, "C"),
    read(float32, 2, "C"),
    read(float64, 1, "C"),
    read(float64, 1, "C"),
    int64,
    read(float64, 1, "C"),
    read(float64, 2, "C"),
    float64,
    write(float32, 2, "C"),
)
def splat_depth(
    depth: npt.NDArray[np.float32],
    table: npt.NDArray[np.float32],
    shift: Floats,
    intrinsics: Floats,
    model: int,
    k: Floats,
    tilt: Floats,
    field: float,
    out: npt.NDArray[np.float32],
) -> None:
    """Draw every pixel of a depth image into another camera's image, the nearest in front.

    A pixel covers the upright box of its footprint there, widened by `MARGIN_PX`, and the nearest pixel at least.

    Not checked: the shapes agree.

    Parameters
    ----------
    depth : (n,) float32
        Metres, pixel after pixel; values that are not positive and finite are missing.
    table : (n, 5) float32
        The pixel's ray (x, y, z) for a depth of 1, turned into the other camera's frame, and half the width and height
        of its footprint there, px, at infinite range.
    shift : (3,) float64
        Position of the depth camera in the other camera's frame, metres.
    intrinsics : (4,) float64
        The other camera's fx, fy, cx, cy, px.
    model, k, tilt, field
        The other camera's lens as for `distort`, or `NO_LENS`.
    out : (H, W) float32
        Metres along z of the other camera; comes filled with infinity, and is lowered where a surface is nearer.
    """
    rows, columns = out.shape
    fx, fy, cx, cy = intrinsics[0], intrinsics[1], intrinsics[2], intrinsics[3]
    tilts = tilt[2, 0] != 0.0 or tilt[2, 1] != 0.0
    for i in range(len(depth)):
        metres = float(depth[i])
        if not 0.0 < metres < math.inf:
            continue
        far_z = float(table[i, 2])
        z = metres * far_z + shift[2]
        if not (z > 0.0 and far_z > 0.0):
            continue
        inverse = 1.0 / z
        x = (metres * float(table[i, 0]) + shift[0]) * inverse
        y = (metres * float(table[i, 1]) + shift[1]) * inverse
        if model == POLYNOMIAL:
            s = x * x + y * y
            if not s < field:
                continue
            scale, _ = _radial(s, k)
            x, y = _moved(x, y, s, scale, k)
            if tilts:
                x, y = _tilted(x, y, tilt)
        elif model == FISHEYE:
            x, y = _through_fisheye(x, y, k, field)
        column, row = fx * x + cx, fy * y + cy
        nearer = metres * far_z * inverse
        half_width = max(0.5, nearer * float(table[i, 3]) + MARGIN_PX)
        half_height = max(0.5, nearer * float(table[i, 4]) + MARGIN_PX)
        # Compared as floats first: far outside, or with NaN, there is no integer for them.
        inside = column + half_width >= 0.0 and column - half_width <= columns - 1.0
        if not (inside and row + half_height >= 0.0 and row - half_height <= rows - 1.0):
            continue
        # Unsigned indices spare a test for negative ones.
        left = np.uint64(math.ceil(max(column - half_width, 0.0)))
        right = np.uint64(math.floor(min(column + half_width, columns - 1.0)))
        top = np.uint64(math.ceil(max(row - half_height, 0.0)))
        bottom = np.uint64(math.floor(min(row + half_height, rows - 1.0)))
        surface = np.float32(z)
        for r in range(top, bottom + np.uint64(1)):
            for c in range(left, right + np.uint64(1)):
                out[r, c] = min(out[r, c], surface)
