"""Distances between the points of curves and the sides of others at equal arc lengths: the sums of criterion L3."""

from __future__ import annotations

import math

import numpy as np
from numba import float64

from dloftbs.kernels.compiler import Floats, helper, kernel, read, write

_TINY = np.finfo(np.float64).tiny


@helper
def _distance_to_side(x: Floats, i: int, y: Floats, k: int) -> float:
    """Return the distance of the point `i` of x (n, d) from the segment of y (n, d) that begins at `k`."""
    squared = along = total = 0.0
    for axis in range(x.shape[1]):
        side = y[k + 1, axis] - y[k, axis]
        squared += side * side
        along += (x[i, axis] - y[k, axis]) * side
    part = min(max(along / squared, 0.0), 1.0) if squared > _TINY else 0.0
    for axis in range(x.shape[1]):
        off = (x[i, axis] - y[k, axis]) - part * (y[k + 1, axis] - y[k, axis])
        total += off * off
    return math.sqrt(total)


@kernel(read(float64, 4, "C"), read(float64, 3, "C"), write(float64, 5, "C"))
def measure_pairs(found: Floats, true: Floats, distances: Floats) -> None:
    """Measure every found curve, run both ways, against every true one.

    Not checked: shapes agree, and curves have two points or more.

    Parameters
    ----------
    found : (f, 2, n, d) float64
        Points at equal arc lengths, from either end on.
    true : (t, n, d) float64
    distances : (t, f, 2, 2, n) float64
        Is set, for each direction, to the distances of the found points from the true segments that begin at the same
        arc length (for the last point, that end there), and to those of the true points from the found segments.
    """
    n = true.shape[1]
    for t in range(len(true)):
        for f in range(len(found)):
            for way in range(2):
                x, y, out = found[f, way], true[t], distances[t, f, way]
                for i in range(n):
                    k = min(i, n - 2)
                    out[0, i] = _distance_to_side(x, i, y, k)
                    out[1, i] = _distance_to_side(y, i, x, k)
