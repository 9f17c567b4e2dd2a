"""Hidden spans of a curve, moved and bent along with the visible parts beside them."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from numba import float64, int64

from dloftbs.kernels.compiler import helper, kernel, read, write
from dloftbs.kernels.shared.copying import copy_rows_to

_Floats = npt.NDArray[np.float64]
_Ints = npt.NDArray[np.int64]

_MAX_ITERATIONS = 100
"""Number of steps of the search for a bend.

Source: bounds time.
"""

_END_TOLERANCE = 1e-4
"""Distance of an end from where it should be at which that search is over, as a share of the hidden length.

Source: numerics; below what a curve is known to.
"""


@helper
def _determinant(a: _Floats) -> float:
    """Return the determinant of a matrix (3, 3)."""
    first = a[0, 0] * (a[1, 1] * a[2, 2] - a[1, 2] * a[2, 1])
    second = a[0, 1] * (a[1, 0] * a[2, 2] - a[1, 2] * a[2, 0])
    third = a[0, 2] * (a[1, 0] * a[2, 1] - a[1, 1] * a[2, 0])
    return first - second + third


@helper
def _fit_rotation(old: _Floats, new: _Floats, noise: float) -> _Floats:
    """Return the rotation (d, d) from points, known to `noise`, to where they are now (Kabsch, 1976).

    A short part tells little, and a straight one nothing about its own axis: what is not told is no rotation.
    """
    count, dims = old.shape
    moments = count * noise * noise * np.eye(dims)
    for a in range(dims):
        for b in range(dims):
            mean, moved = old[:, b].sum() / count, new[:, a].sum() / count
            for k in range(count):
                moments[a, b] += (new[k, a] - moved) * (old[k, b] - mean)
    if dims == 2:
        angle = math.atan2(moments[1, 0] - moments[0, 1], moments[0, 0] + moments[1, 1])
        return np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    u, _, vt = np.linalg.svd(moments)
    u[:, dims - 1] *= math.copysign(1.0, _determinant(u) * _determinant(vt))
    return u @ vt


@helper
def _move_rigidly(
    old: _Floats, new: _Floats, rotation: _Floats, edge: int, left: int, right: int, scale: float
) -> _Floats:
    """Return the points between two indices, rotated, scaled and shifted like the one at the edge."""
    moved = np.empty((right - left - 1, old.shape[1]))
    for k in range(len(moved)):
        for d in range(old.shape[1]):
            total = new[edge, d]
            for c in range(old.shape[1]):
                total += scale * rotation[d, c] * (old[left + 1 + k, c] - old[edge, c])
            moved[k, d] = total
    return moved


@helper
def _bend(old: _Floats, new: _Floats, left: int, right: int, by_left: _Floats, by_right: _Floats, scale: float) -> bool:
    """Bend a span between two points, so that its length is `scale` times as long and both sides continue smoothly.

    Its steps turn as the sides have turned, blended in between. What is missing at its end is shared out among them,
    most in the middle, and each gets its length back, until nothing is missing. False if they are too short for that,
    or one would turn by more than a right angle.
    """
    count, dims = right - left, old.shape[1]
    before, lengths, weights = np.empty((count, dims)), np.empty(count), np.empty(count)
    for k in range(count):
        t = (k + 0.5) / count
        blend, squared = t * t * (3.0 - 2.0 * t), 0.0
        for d in range(dims):
            turned = 0.0
            for c in range(dims):
                step = old[left + k + 1, c] - old[left + k, c]
                turned += ((1.0 - blend) * by_left[d, c] + blend * by_right[d, c]) * step
                squared += step * step if d == 0 else 0.0
            before[k, d] = turned
        lengths[k], weights[k] = scale * math.sqrt(squared), math.sin(math.pi * t) ** 2
    tolerance, total = _END_TOLERANCE * lengths.sum(), weights.sum()
    steps, missing = before.copy(), np.zeros(dims)
    for _ in range(_MAX_ITERATIONS):
        ends = new[right] - new[left]
        for k in range(count):
            squared = 0.0
            for d in range(dims):
                steps[k, d] += missing[d] * weights[k] / total
                squared += steps[k, d] * steps[k, d]
            scale = lengths[k] / math.sqrt(squared) if squared > 0.0 else 0.0
            for d in range(dims):
                steps[k, d] *= scale
                ends[d] -= steps[k, d]
        missing = ends
        if math.sqrt((missing * missing).sum()) < tolerance:
            for k in range(count):
                if (steps[k] * before[k]).sum() < 0.0:
                    return False
            for k in range(count - 1):
                for d in range(dims):
                    new[left + k + 1, d] = new[left + k, d] + steps[k, d]
            return True
    return False


@helper
def _length(points: _Floats, first: int, last: int) -> float:
    """Return the length of the polygon from one index to another."""
    total = 0.0
    for k in range(first, last):
        step = points[k + 1] - points[k]
        total += math.sqrt((step * step).sum())
    return total


@kernel(read(float64, 2), write(float64, 2), read(int64, 2), int64, float64)
def fill_hidden(old: _Floats, new: _Floats, visible: _Ints, window: int, length: float) -> None:
    """Move the hidden spans of a curve along with its visible parts: bent in between, rigidly where that fails.

    Parameters
    ----------
    old : (n, d) float64
        Points of the last shape; d is 2 or 3.
    new : (n, d) float64
        Those of the visible parts; the others are written.
    visible : (v, 2) int64
        First and last index of each visible part, ascending; one or more.
    window : int
        Least number of steps of a visible part that determine its motion, if it has as many.
    length : float
        Of the whole; a hidden span has the share that its number of steps has.
    """
    parts, step = len(visible), length / (len(old) - 1)
    for gap in range(parts + 1):
        left = visible[gap - 1, 1] if gap else -1
        right = visible[gap, 0] if gap < parts else len(old)
        if right - left < 2:
            continue
        first, last = max(left, 0), min(right, len(old) - 1)
        before = _length(old, first, last)
        scale = (last - first) * step / before if before > 0.0 else 1.0
        steps = max(right - left, window)
        by_left, by_right = np.eye(old.shape[1]), np.eye(old.shape[1])
        if gap:
            first = max(left - steps, visible[gap - 1, 0])
            by_left = _fit_rotation(old[first : left + 1], new[first : left + 1], 0.5 * step)
        if gap < parts:
            last = min(right + steps, visible[gap, 1])
            by_right = _fit_rotation(old[right : last + 1], new[right : last + 1], 0.5 * step)
        if 0 < gap < parts:
            if _bend(old, new, left, right, by_left, by_right, scale):
                continue
            one = _move_rigidly(old, new, by_left, left, left, right, scale)
            other = _move_rigidly(old, new, by_right, right, left, right, scale)
            for k in range(right - left - 1):
                t = (k + 1.0) / (right - left)
                weight = t * t * (3.0 - 2.0 * t)
                for d in range(old.shape[1]):
                    new[left + 1 + k, d] = (1.0 - weight) * one[k, d] + weight * other[k, d]
        elif gap:
            copy_rows_to(new[left + 1 : right], _move_rigidly(old, new, by_left, left, left, right, scale))
        else:
            copy_rows_to(new[left + 1 : right], _move_rigidly(old, new, by_right, right, left, right, scale))
