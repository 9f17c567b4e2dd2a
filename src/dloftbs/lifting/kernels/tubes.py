"""From the surface of a round object to its axis, and the sections that another pass occludes."""

from __future__ import annotations

import numpy as np
from numba import boolean, float64, int64

from dloftbs.kernels.compiler import Bools, Floats, helper, kernel, read, write
from dloftbs.kernels.shared.selection import median_of

_MIN_SINE = 0.2
"""Smallest sine of the angle between ray and axis by which a radius is divided.

Source: by hand; a tube that points at the camera shows its end, not its side.
"""


@helper
def _tangent(rays: Floats, depth: Floats, i: int, closed: bool, tangent: Floats) -> None:
    """Write the unit direction of the line through the points ``rays * depth`` at one of them."""
    n = len(rays)
    before, after = (i - 1) % n if closed else max(i - 1, 0), (i + 1) % n if closed else min(i + 1, n - 1)
    squared = 0.0
    for axis in range(3):
        tangent[axis] = rays[after, axis] * depth[after] - rays[before, axis] * depth[before]
        squared += tangent[axis] ** 2
    norm = np.sqrt(squared)
    for axis in range(3):
        tangent[axis] = tangent[axis] / norm if norm > 0.0 else 0.0


@helper
def _cross(a: Floats, b: Floats, result: Floats) -> float:
    """Write the cross product and return its length."""
    result[0] = a[1] * b[2] - a[2] * b[1]
    result[1] = a[2] * b[0] - a[0] * b[2]
    result[2] = a[0] * b[1] - a[1] * b[0]
    return float(np.sqrt(result[0] ** 2 + result[1] ** 2 + result[2] ** 2))


@kernel(read(float64, 3), read(float64, 1), float64, read(boolean, 1), boolean)
def surface_to_axis(
    bundles: Floats, inverse: Floats, shift: float, seen: Bools, closed: bool
) -> tuple[Floats, Floats, float]:
    """Move the middle line of a round object's surface to its axis: away from the camera, along each ray.

    A ray that meets the axis under the angle ``a`` meets the surface ``radius / sin(a)`` before it. The radius is the
    distance of the axis from the rays along the object's borders: one for the whole object, the median.

    Parameters
    ----------
    bundles : (3, n, 3) float64
        Rays through the middle line and the two borders of sections, with z = 1; two or more, no two the same.
    inverse : (n,) float64
        1 / depth of the surface along the middle line, 1 / m.
    shift : float
        Share of the radius by which the surface was moved towards the camera, seen at a right angle, see
        `find_surface`.
    seen : (n,) bool
        Sections that show the radius; one or more.
    closed : bool
        Whether the last section is next to the first.

    Returns
    -------
    points_m : (n, 3) float64
        On the axis.
    u : (n,) float64
        Their normalised arc length; on a loop, the way back to the first counts.
    radius_m : float
    """
    rays, left, right = bundles[0], bundles[1], bundles[2]
    n = len(rays)
    depth_m = 1.0 / inverse
    tangent, normal = np.empty(3), np.empty(3)
    sines = np.empty(n)
    radii = np.empty(n)
    count = 0
    for i in range(n):
        _tangent(rays, depth_m, i, closed, tangent)
        length = np.sqrt(rays[i, 0] ** 2 + rays[i, 1] ** 2 + rays[i, 2] ** 2)
        sines[i] = max(_cross(rays[i], tangent, normal) / length, _MIN_SINE)
        if not seen[i]:
            continue
        share = 0.0  # distance of the rays at the borders, for each metre of depth
        for border in (left, right):
            norm = _cross(border[i], tangent, normal)
            if norm > 0.0:
                along = rays[i, 0] * normal[0] + rays[i, 1] * normal[1] + rays[i, 2] * normal[2]
                share += 0.5 * abs(along) / norm
        # The axis lies the radius farther than the surface: r = share * (depth + r / sine / length).
        radii[count] = share * depth_m[i] / (1.0 - share / (sines[i] * length))
        count += 1
    radius = median_of(radii[:count])
    points = np.empty((n, 3))
    for i in range(n):
        length = np.sqrt(rays[i, 0] ** 2 + rays[i, 1] ** 2 + rays[i, 2] ** 2)
        depth = depth_m[i] + radius * (1.0 / sines[i] - shift * (1.0 / sines[i] - 1.0)) / length
        for axis in range(3):
            points[i, axis] = rays[i, axis] * depth
    u = np.empty(n)
    total = 0.0
    for i in range(n + closed):
        if i > 0:
            squared = 0.0
            for axis in range(3):
                squared += (points[i % n, axis] - points[i - 1, axis]) ** 2
            total += np.sqrt(squared)
        if i < n:
            u[i] = total
    if total > 0.0:
        for i in range(n):
            u[i] /= total
    return points, u, radius


@helper
def _nearest(points: Floats, start: int, closed: bool, x: float, y: float) -> tuple[int, float]:
    """Go along points as long as they come nearer, and return where that ends, and the distance there."""
    n = len(points)
    here, least = start, np.hypot(points[start, 0] - x, points[start, 1] - y)
    for step in (-1, 1):
        while True:
            k = here + step
            if closed:
                k %= n
            elif k < 0 or k >= n:
                break
            distance = np.hypot(points[k, 0] - x, points[k, 1] - y)
            if not distance < least:
                break
            here, least = k, distance
    return here, least


@kernel(write(boolean, 1), read(float64, 2), boolean, int64, read(float64, 2), boolean, int64, float64)
def mask_occluded(
    used: Bools,
    points: Floats,
    closed: bool,
    at: int,
    others: Floats,
    others_closed: bool,
    others_at: int,
    reach_px: float,
) -> None:
    """Strike off the sections of a pass around a crossing that lie on the other pass.

    Parameters
    ----------
    used : (n,) bool
        Is set to False there.
    points : (n, 2) float64
        Places of the sections.
    closed : bool
        Whether the last is next to the first.
    at : int
        The one nearest to the crossing.
    others, others_closed, others_at
        The same of the other pass, which may be another part of the same curve.
    reach_px : float
        Distance from the other's axis that counts as on it.
    """
    n = len(points)
    for step in (-1, 1):
        i, k = at, others_at
        for _ in range(n):
            k, distance = _nearest(others, k, others_closed, points[i, 0], points[i, 1])
            if distance > reach_px and i != at:
                break
            used[i] = False
            i += step
            if closed:
                i %= n
            elif i < 0 or i >= n:
                break
