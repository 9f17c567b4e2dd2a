"""Runs of samples, and hidden spans of a curve, moved and bent along with the visible parts beside them."""

from __future__ import annotations

import math

import numpy as np
from numba import boolean, float64, int64

from dloftbs.kernels.compiler import Bools, Floats, Ints, helper, kernel, read, write
from dloftbs.kernels.shared.copying import copy_rows_to

_MAX_ITERATIONS = 100
"""Number of steps of the search for a bend.

Source: bounds time.
"""

_MIN = 1e-300
"""Least length of a step by which is divided.

Source: numerics.
"""

_END_TOLERANCE = 1e-4
"""Distance of an end from where it should be at which that search is over, as a share of the hidden length.

Source: numerics; below what a curve is known to.
"""


@kernel(read(boolean, 1))
def find_runs(mask: Bools) -> Ints:
    """Find the runs of values that are True.

    Parameters
    ----------
    mask : (n,) bool

    Returns
    -------
    (k, 2) int64
        The first index of each, and the one after the last.
    """
    runs, count = np.empty((len(mask) // 2 + 1, 2), dtype=np.int64), 0
    for i in range(len(mask)):
        if mask[i]:
            if i == 0 or not mask[i - 1]:
                runs[count, 0] = i
                count += 1
            runs[count - 1, 1] = i + 1
    return runs[:count]


@helper
def _fit_rotation(old: Floats, new: Floats, noise: float) -> Floats:
    """Return the rotation (d, d) from points, known to `noise`, to where they are now (Kabsch, 1976).

    A short part shows little, and a straight one nothing about its own axis: what is not known is no rotation.
    """
    count, dims = old.shape
    before, after = old - old.sum(axis=0) / count, new - new.sum(axis=0) / count
    u, _, vt = np.linalg.svd(after.T @ before + count * noise * noise * np.eye(dims))
    u[:, dims - 1] *= math.copysign(1.0, np.linalg.det(u) * np.linalg.det(vt))
    return u @ vt


@helper
def _bend(old: Floats, new: Floats, left: int, right: int, by_left: Floats, by_right: Floats, scale: float) -> bool:
    """Bend a span between two points, so that its length is `scale` times as long and both sides continue smoothly.

    Its steps turn as the sides have turned, blended in between. What is missing at its end is shared out among them,
    most in the middle, and each gets its length back, until nothing is missing. False if they are too short for that,
    or one would turn by more than a right angle.
    """
    count, dims = right - left, old.shape[1]
    before, lengths, shares = np.zeros((count, dims)), np.empty(count), np.empty(count)
    for k in range(count):
        t, squared = (k + 0.5) / count, 0.0
        blend, shares[k] = t * t * (3.0 - 2.0 * t), math.sin(math.pi * t) ** 2
        for d in range(dims):
            step = old[left + k + 1, d] - old[left + k, d]
            squared += step * step
            for i in range(dims):
                before[k, i] += step * ((1.0 - blend) * by_left[i, d] + blend * by_right[i, d])
        lengths[k] = scale * math.sqrt(squared)
    shares /= shares.sum()
    missing, tolerance, chord = np.zeros(dims), _END_TOLERANCE * lengths.sum(), new[right] - new[left]
    if math.sqrt((chord * chord).sum()) > lengths.sum() + tolerance:
        return False
    steps = before.copy()
    for _ in range(_MAX_ITERATIONS):
        rest = chord.copy()
        for k in range(count):
            squared = 0.0
            for d in range(dims):
                steps[k, d] += shares[k] * missing[d]
                squared += steps[k, d] * steps[k, d]
            stretch = lengths[k] / max(math.sqrt(squared), _MIN)
            for d in range(dims):
                steps[k, d] *= stretch
                rest[d] -= steps[k, d]
        missing = rest
        if math.sqrt((missing * missing).sum()) < tolerance:
            if ((steps * before).sum(axis=1) < 0.0).any():
                return False
            for k in range(count - 1):
                new[left + k + 1] = new[left + k] + steps[k]
            return True
    return False


@kernel(read(float64, 2), write(float64, 2), read(int64, 2), int64, float64)
def fill_hidden(old: Floats, new: Floats, visible: Ints, window: int, length: float) -> None:
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
        former = old[first + 1 : last + 1] - old[first:last]
        before = np.sqrt((former * former).sum(axis=1)).sum()
        scale = (last - first) * step / before if before > 0.0 else 1.0
        steps = max(right - left, window)
        by_left, by_right = np.eye(old.shape[1]), np.eye(old.shape[1])
        if gap:
            first = max(left - steps, visible[gap - 1, 0])
            by_left = _fit_rotation(old[first : left + 1], new[first : left + 1], 0.5 * step)
        if gap < parts:
            last = min(right + steps, visible[gap, 1])
            by_right = _fit_rotation(old[right : last + 1], new[right : last + 1], 0.5 * step)
        if 0 < gap < parts and _bend(old, new, left, right, by_left, by_right, scale):
            continue
        inside = np.ascontiguousarray(old[left + 1 : right])
        edge = left if gap else right
        moved = new[edge] + scale * ((inside - old[edge]) @ (by_left if gap else by_right).T)
        if 0 < gap < parts:
            t = (np.arange(1, right - left) / (right - left)).reshape(-1, 1)
            other = new[right] + scale * ((inside - old[right]) @ by_right.T)
            moved += t * t * (3.0 - 2.0 * t) * (other - moved)
        copy_rows_to(new[left + 1 : right], moved)
