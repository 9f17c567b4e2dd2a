"""Correspondence of the points of two curves in two views: monotone paths by dynamic time warping.

Points are rays (x, y, 1) without the lens. The distance is Sampson's, of a pair from the epipolar constraint, to first
order the least motion of both points that fulfils it (Hartley and Zisserman, Multiple View Geometry, 2004, 11.4.3).
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from numba import float64

from dloftbs.kernels.compiler import Floats, Ints, helper, kernel, read

MOST_COST = 4.0
"""Largest cost of a pair of points, squared standard deviations: a wrong stretch is no worse than that.

Source: by hand; two standard deviations.
"""

OPEN_COST = 2.0
"""Cost of a point that the other view does not show, squared standard deviations.

Source: by hand; twice the mean of a right pair.
"""

_STRETCH_COST = 0.1
"""Cost of a step along one curve alone, squared standard deviations.

Source: by hand; it chooses among paths where the curve runs along epipolar lines.
"""

WIDTH_STD = 0.1
"""Standard deviation of the logarithm of a width in one view over that in another, of the same place.

Source: by hand; masks of real cables are so uneven.
"""

_DIAGONAL, _ALONG_A, _ALONG_B, _START = 0, 1, 2, 3
"""Codes of the last step of a path.

Source: by definition.
"""

_Three = tuple[float, float, float]


@helper
def _turned(matrix: Floats, x: float, y: float) -> _Three:
    """Return a matrix (3, 3) times (x, y, 1)."""
    return (
        matrix[0, 0] * x + matrix[0, 1] * y + matrix[0, 2],
        matrix[1, 0] * x + matrix[1, 1] * y + matrix[1, 2],
        matrix[2, 0] * x + matrix[2, 1] * y + matrix[2, 2],
    )


@helper
def _cost_table(
    a: Floats, b: Floats, widths_a: Floats, widths_b: Floats, rotation: Floats, shift: Floats, variance: float
) -> Floats:
    """Return the cost of each pair of points, (len(a), len(b)); a pair behind a camera has the largest.

    The second curve is taken to be straight to half-way to the next points, and is as near as its nearest place there.
    """
    n, m = len(a), len(b)
    costs = np.empty((n, m))
    lines_b, halves = np.empty((m, 2)), np.empty((m, 2))
    for j in range(m):
        low, high = max(j - 1, 0), min(j + 1, m - 1)
        for d in range(2):
            halves[j, d] = 0.5 * (b[high, d] - b[low, d]) / max(high - low, 1)
    tx, ty, tz = shift[0], shift[1], shift[2]
    for j in range(m):
        # E^T b = R^T (b x t), since E = [t]x R
        x, y = b[j, 0], b[j, 1]
        cx, cy, cz = y * tz - ty, tx - x * tz, x * ty - y * tx
        lines_b[j, 0] = rotation[0, 0] * cx + rotation[1, 0] * cy + rotation[2, 0] * cz
        lines_b[j, 1] = rotation[0, 1] * cx + rotation[1, 1] * cy + rotation[2, 1] * cz
    for i in range(n):
        rx, ry, rz = _turned(rotation, a[i, 0], a[i, 1])
        lx, ly, lz = ty * rz - tz * ry, tz * rx - tx * rz, tx * ry - ty * rx
        squared = lx * lx + ly * ly
        for j in range(m):
            x, y = b[j, 0], b[j, 1]
            off = max(abs(lx * x + ly * y + lz) - abs(lx * halves[j, 0] + ly * halves[j, 1]), 0.0)
            norm = squared + lines_b[j, 0] * lines_b[j, 0] + lines_b[j, 1] * lines_b[j, 1]
            cost = off * off / (norm * variance)
            if cost >= MOST_COST:
                costs[i, j] = MOST_COST
                continue
            # z_a (b x R a) = -(b x t)
            ux, uy, uz = y * rz - ry, rx - x * rz, x * ry - y * rx
            ahead = -((y * tz - ty) * ux + (tx - x * tz) * uy + (x * ty - y * tx) * uz)
            parallax = ux * ux + uy * uy + uz * uz
            if ahead < 0.0 and parallax > MOST_COST * variance:
                costs[i, j] = MOST_COST
                continue
            # The depth in the second view over that in the first.
            ratio = rz + tz * parallax / ahead if ahead > 0.0 else 1.0
            if ratio > 0.0:
                unlike = math.log(ratio * widths_b[j] / widths_a[i]) / WIDTH_STD
                cost += unlike * unlike
            costs[i, j] = min(cost, MOST_COST)
    return costs


@helper
def _best_path(costs: Floats, steps: npt.NDArray[np.int8]) -> tuple[float, int, int]:
    """Fill in the last step to each pair, and return the mean cost of the best path and where it ends.

    A path may leave out points at either end of either curve, each at `OPEN_COST`.
    """
    n, m = costs.shape
    total = np.empty((n, m))
    half_open, half_stretch = 0.5 * OPEN_COST, 0.5 * _STRETCH_COST
    for i in range(n):
        for j in range(m):
            cost = costs[i, j]
            best, step = half_open * (i + j) + cost, _START
            if i > 0 and j > 0 and total[i - 1, j - 1] + cost < best:
                best, step = total[i - 1, j - 1] + cost, _DIAGONAL
            if i > 0 and total[i - 1, j] + 0.5 * cost + half_stretch < best:
                best, step = total[i - 1, j] + 0.5 * cost + half_stretch, _ALONG_A
            if j > 0 and total[i, j - 1] + 0.5 * cost + half_stretch < best:
                best, step = total[i, j - 1] + 0.5 * cost + half_stretch, _ALONG_B
            total[i, j] = best
            steps[i, j] = step
    least, end_i, end_j = math.inf, n - 1, m - 1
    for i in range(n):
        value = total[i, m - 1] + half_open * (n - 1 - i)
        if value < least:
            least, end_i, end_j = value, i, m - 1
    for j in range(m):
        value = total[n - 1, j] + half_open * (m - 1 - j)
        if value < least:
            least, end_i, end_j = value, n - 1, j
    return least / (0.5 * (n + m)), end_i, end_j


@kernel(
    read(float64, 2, "C"), read(float64, 2, "C"), read(float64, 1, "C"), read(float64, 1, "C"),
    read(float64, 2, "C"), read(float64, 1, "C"), float64,
)  # fmt: skip
def path_costs(
    a: Floats, b: Floats, widths_a: Floats, widths_b: Floats, rotation: Floats, shift: Floats, variance: float
) -> tuple[float, float]:
    """Return the mean cost of the best path from point to point of two curves, and with the second one run backwards.

    Parameters
    ----------
    a, b : (n, 2) and (m, 2) float64
        Rays of evenly spaced points, the same distance on both.
    widths_a, widths_b : (n,) and (m,) float64
        Positive: of the object over its depth along z.
    rotation : (3, 3) float64
    shift : (3,) float64
        From the first camera's frame to the second's.
    variance : float
        Variance of the distance of a right pair from the epipolar constraint, of rays.

    Returns
    -------
    (float, float)
        Squared standard deviations a point.
    """
    steps = np.empty((len(a), len(b)), np.int8)
    costs = _cost_table(a, b, widths_a, widths_b, rotation, shift, variance)
    forward, _, _ = _best_path(costs, steps)
    backward, _, _ = _best_path(costs[:, ::-1], steps)
    return forward, backward


@kernel(
    read(float64, 2, "C"), read(float64, 2, "C"), read(float64, 1, "C"), read(float64, 1, "C"),
    read(float64, 2, "C"), read(float64, 1, "C"), float64,
)  # fmt: skip
def correspond(
    a: Floats, b: Floats, widths_a: Floats, widths_b: Floats, rotation: Floats, shift: Floats, variance: float
) -> tuple[int, Floats, Floats, Floats]:
    """Return one over the depth of each point of the first curve on the best path that `path_costs` prices.

    The partner is where the second curve, among the points that the path pairs with it, meets the epipolar line.

    Parameters
    ----------
    a, b, widths_a, widths_b, rotation, shift, variance
        As for `path_costs`.

    Returns
    -------
    start : int
        Number of points of the first curve before the path.
    inverse_depths : (p,) float64
        Along z of the first camera, 1 / m.
    weights : (p,) float64
        One over their variances, where a place across the second curve has a variance of 1, of rays.
    partners : (p,) float64
        Places on the second curve, in its points.
    """
    path = _find_path(_cost_table(a, b, widths_a, widths_b, rotation, shift, variance))
    first = path[0, 0]
    count = path[-1, 0] - first + 1
    inverse_depths, weights, partners = np.zeros(count), np.zeros(count), np.empty(count)
    k = 0
    for p in range(count):
        i = first + p
        low, high = len(b), -1
        while k < len(path) and path[k, 0] == i:
            low, high = min(low, path[k, 1]), max(high, path[k, 1])
            k += 1
        ray = _turned(rotation, a[i, 0], a[i, 1])
        line = _cross(shift[0], shift[1], shift[2], ray[0], ray[1], ray[2])
        place = _meeting(b, line, max(low - 1, 0), min(high + 1, len(b) - 1), 0.5 * (low + high))
        inverse_depths[p], weights[p] = _triangulate(b, place, ray, shift, line)
        partners[p] = place
    return first, inverse_depths, weights, partners


@helper
def _find_path(costs: Floats) -> Ints:
    """Return the best path as pairs of points, (k, 2)."""
    n, m = costs.shape
    steps = np.empty((n, m), np.int8)
    _, i, j = _best_path(costs, steps)
    path = np.empty((n + m, 2), np.int64)
    count = 0
    while True:
        path[count, 0], path[count, 1] = i, j
        count += 1
        step = steps[i, j]
        if step == _START:
            break
        if step != _ALONG_B:
            i -= 1
        if step != _ALONG_A:
            j -= 1
    return path[:count][::-1].copy()


@helper
def _cross(ax: float, ay: float, az: float, bx: float, by: float, bz: float) -> _Three:
    """Return the cross product."""
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


@helper
def _meeting(b: Floats, line: _Three, low: int, high: int, middle: float) -> float:
    """Return where a stretch of a curve meets a line, nearest to the middle, else its place nearest to the line."""
    place, least = middle, math.inf
    before = 0.0
    for j in range(low, high + 1):
        off = line[0] * b[j, 0] + line[1] * b[j, 1] + line[2]
        if j > low and before * off <= 0.0 and before != off:
            at = j - 1 + before / (before - off)
            if abs(at - middle) < least:
                place, least = at, abs(at - middle)
        before = off
    if least == math.inf:
        for j in range(low, high + 1):
            off = abs(line[0] * b[j, 0] + line[1] * b[j, 1] + line[2])
            if off < least:
                place, least = float(j), off
    return place


@helper
def _triangulate(b: Floats, place: float, ray: _Three, shift: Floats, line: _Three) -> tuple[float, float]:
    """Return one over the depth of a ray's point, whose partner is at a place of the second curve, and its weight."""
    j = min(int(place), len(b) - 2)
    dx, dy = b[j + 1, 0] - b[j, 0], b[j + 1, 1] - b[j, 1]
    x, y = b[j, 0] + (place - j) * dx, b[j, 1] + (place - j) * dy
    ux, uy, uz = _cross(x, y, 1.0, ray[0], ray[1], ray[2])
    vx, vy, vz = _cross(x, y, 1.0, shift[0], shift[1], shift[2])
    # z_a (b x R a) = -(b x t)
    against = vx * ux + vy * uy + vz * uz
    squared = vx * vx + vy * vy + vz * vz
    along = math.hypot(dx, dy) * math.hypot(line[0], line[1])
    if squared == 0.0 or along == 0.0:
        return 0.0, 0.0
    # A step across the curve is so much of one along the epipolar line, which the baseline turns into 1 / depth.
    return -against / squared, squared * ((dx * line[0] + dy * line[1]) / along) ** 2
