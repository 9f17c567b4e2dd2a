"""Hidden spans of a curve, moved and bent along with the visible parts beside them."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from numba import float64, int64

from dloftbs.kernels.compiler import helper, kernel, read, write

_MIN_POINTS = 4
"""Least number of points of a visible part that determine a rotation.

Source: by hand; two do, without noise.
"""

_MAX_ITERATIONS = 20
"""Number of steps of the search for a wave of headings.

Source: bounds time.
"""

_END_TOLERANCE_PX = 0.05
"""Distance of an end from where it should be at which that search is over, px.

Source: numerics; below what a curve is known to.
"""

_MAX_TURN = 0.5 * math.pi
"""Largest turn of a wave of headings, rad.

Source: by hand; beyond a right angle the span winds up.
"""


@helper
def _fit_rotation(old: npt.NDArray[np.float64], new: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Return the rotation (d, d) from points to where they are now (Kabsch, 1976); none from too few."""
    count, dims = old.shape
    rotation = np.eye(dims)
    if count < _MIN_POINTS:
        return rotation
    moments = np.zeros((dims, dims))
    for a in range(dims):
        for b in range(dims):
            mean, moved = old[:, b].sum() / count, new[:, a].sum() / count
            for k in range(count):
                moments[a, b] += (new[k, a] - moved) * (old[k, b] - mean)
    if dims == 2:
        angle = math.atan2(moments[1, 0] - moments[0, 1], moments[0, 0] + moments[1, 1])
        c, s = math.cos(angle), math.sin(angle)
        rotation[0, 0], rotation[0, 1], rotation[1, 0], rotation[1, 1] = c, -s, s, c
        return rotation
    u, _, vt = np.linalg.svd(moments)
    u[:, dims - 1] *= math.copysign(1.0, np.linalg.det(u) * np.linalg.det(vt))
    return u @ vt


@helper
def _move_rigidly(
    old: npt.NDArray[np.float64],
    new: npt.NDArray[np.float64],
    rotation: npt.NDArray[np.float64],
    edge: int,
    left: int,
    right: int,
) -> npt.NDArray[np.float64]:
    """Return the points between two indices, rotated and shifted like the one at the edge."""
    moved = np.empty((right - left - 1, old.shape[1]))
    for k in range(len(moved)):
        for d in range(old.shape[1]):
            total = new[edge, d]
            for c in range(old.shape[1]):
                total += rotation[d, c] * (old[left + 1 + k, c] - old[edge, c])
            moved[k, d] = total
    return moved


@helper
def _bend(
    old: npt.NDArray[np.float64], new: npt.NDArray[np.float64], left: int, right: int, turn: float, other_turn: float
) -> bool:
    """Bend a span of a plane curve between two points, so that its length is kept and both sides continue smoothly.

    The headings turn as the sides have turned, blended in between, and by two sine waves that bring the end to its
    place. False if that would need more than a quarter turn.
    """
    count = right - left
    length, turned, waves = np.empty(count), np.empty(count), np.empty((2, count))
    other_turn -= 2.0 * math.pi * np.rint((other_turn - turn) / (2.0 * math.pi))  # the shorter way round
    for k in range(count):
        dx, dy = old[left + k + 1, 0] - old[left + k, 0], old[left + k + 1, 1] - old[left + k, 1]
        t = (k + 0.5) / count
        weight = t * t * (3.0 - 2.0 * t)
        length[k] = math.sqrt(dx * dx + dy * dy)
        turned[k] = math.atan2(dy, dx) + (1.0 - weight) * turn + weight * other_turn
        waves[0, k], waves[1, k] = math.sin(math.pi * t), math.sin(2.0 * math.pi * t)
    gain, other_gain = 0.0, 0.0
    for _ in range(_MAX_ITERATIONS):
        a, b, c, d = 0.0, 0.0, 0.0, 0.0
        missing_x, missing_y = new[right, 0] - new[left, 0], new[right, 1] - new[left, 1]
        for k in range(count):
            angle = turned[k] + gain * waves[0, k] + other_gain * waves[1, k]
            dx, dy = length[k] * math.cos(angle), length[k] * math.sin(angle)
            missing_x, missing_y = missing_x - dx, missing_y - dy
            a, b = a - dy * waves[0, k], b - dy * waves[1, k]
            c, d = c + dx * waves[0, k], d + dx * waves[1, k]
            if k < count - 1:
                new[left + k + 1, 0], new[left + k + 1, 1] = new[left + k, 0] + dx, new[left + k, 1] + dy
        if missing_x * missing_x + missing_y * missing_y < _END_TOLERANCE_PX * _END_TOLERANCE_PX:
            return True
        determinant = a * d - b * c
        if abs(determinant) < 1e-9:
            return False
        step, limit = (d * missing_x - b * missing_y) / determinant, _MAX_TURN / 3.0
        gain += min(max(step, -limit), limit)
        other_gain += min(max((a * missing_y - c * missing_x) / determinant, -limit), limit)
        if max(abs(gain), abs(other_gain)) > _MAX_TURN:
            return False
    return False


@kernel(read(float64, 2), write(float64, 2), read(int64, 2), int64)
def fill_hidden(
    old: npt.NDArray[np.float64], new: npt.NDArray[np.float64], visible: npt.NDArray[np.int64], window: int
) -> None:
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
    """
    parts = len(visible)
    for gap in range(parts + 1):
        left = visible[gap - 1, 1] if gap else -1
        right = visible[gap, 0] if gap < parts else len(old)
        if right - left < 2:
            continue
        steps = max(right - left, window)
        by_left, by_right = np.eye(old.shape[1]), np.eye(old.shape[1])
        if gap:
            first = max(left - steps, visible[gap - 1, 0])
            by_left = _fit_rotation(old[first : left + 1], new[first : left + 1])
        if gap < parts:
            last = min(right + steps, visible[gap, 1])
            by_right = _fit_rotation(old[right : last + 1], new[right : last + 1])
        if 0 < gap < parts:
            turns = math.atan2(by_left[1, 0], by_left[0, 0]), math.atan2(by_right[1, 0], by_right[0, 0])
            if old.shape[1] == 2 and _bend(old, new, left, right, turns[0], turns[1]):
                continue
            one = _move_rigidly(old, new, by_left, left, left, right)
            other = _move_rigidly(old, new, by_right, right, left, right)
            for k in range(right - left - 1):
                t = (k + 1.0) / (right - left)
                weight = t * t * (3.0 - 2.0 * t)
                for d in range(old.shape[1]):
                    new[left + 1 + k, d] = (1.0 - weight) * one[k, d] + weight * other[k, d]
        elif gap:
            new[left + 1 : right] = _move_rigidly(old, new, by_left, left, left, right)
        else:
            new[left + 1 : right] = _move_rigidly(old, new, by_right, right, left, right)
