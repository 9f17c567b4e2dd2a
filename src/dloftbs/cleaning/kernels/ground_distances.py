"""Distances to the ground: from the holes in a mask, and from the middle of its cables.

The ground comes as runs, see `dloftbs.cleaning.kernels.ground_runs`.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import boolean, float64, int64, uint64

from dloftbs.cleaning.kernels.ground_runs import fill
from dloftbs.kernels.compiler import helper, inlined, kernel, read
from dloftbs.kernels.shared.bitmask_layout import WORD_BITS
from dloftbs.kernels.shared.copying import longer
from dloftbs.kernels.shared.popcount import lowest_one
from dloftbs.kernels.shared.selection import nth_least

_Words = npt.NDArray[np.uint64]
_Ints = npt.NDArray[np.int64]
_Bools = npt.NDArray[np.bool_]

_SINGLE_SHARE = 0.15
"""Share of the cables' length that is narrower than what counts as the width of one, for the ends."""

_FIRST_RIDGE = 1024
"""Pixels of the ridge that there is room for at first."""


@inlined
def _edge_distance(squared: int) -> float:
    """Return how far a pixel is from an edge, px, whose next pixel beyond is so far away, px^2."""
    return np.sqrt(np.float32(squared)) - np.float32(0.5)


@helper
def _nearest(
    first: _Ints, start: _Ints, end: _Ints, part: _Ints, narrow: _Bools, r: int, c: int, most: int, enough: int
) -> int:
    """Return how far the nearest ground is that is no narrow hole, px^2; it need not be nearer than `enough`."""
    rows, best = len(first) - 1, most
    for step in range(rows):
        if step * step >= best or best <= enough:
            break
        for row in (r - step, r + step):
            if row < 0 or row >= rows:
                continue
            for i in range(first[row], first[row + 1]):
                if narrow[part[i]]:
                    continue
                across = max(start[i] - c, c - end[i] + 1, 0)
                best = min(best, step * step + across * across)
                if start[i] > c:
                    break
    return best


@kernel(
    read(int64, 1, "C"),
    read(int64, 1, "C"),
    read(int64, 1, "C"),
    read(int64, 1, "C"),
    read(boolean, 1, "C"),
    float64,
)
def measure_depths(
    first: _Ints, start: _Ints, end: _Ints, part: _Ints, narrow: _Bools, deepest: float
) -> npt.NDArray[np.float64]:
    """Measure how far the deepest pixel of each narrow hole is from the edge of the ground that is none.

    Parameters
    ----------
    first, start, end, part
        The runs of ground.
    narrow : (parts,) bool
    deepest : float
        Largest distance to measure, px.

    Returns
    -------
    (parts,) float64
        px, or something above the limit; 0 for other parts.
    """
    parts = len(narrow)
    squared = np.zeros(parts, dtype=np.int64)
    most = np.int64((deepest + 1.0) ** 2) + 2
    longest = np.full(parts, -1, dtype=np.int64)
    for i in range(len(part)):
        k = part[i]
        if narrow[k] and (longest[k] < 0 or end[i] - start[i] > end[longest[k]] - start[longest[k]]):
            longest[k] = i
    for only_middle in (True, False):  # of the longest run: most holes are soon seen to be too deep
        for r in range(len(first) - 1):
            for i in range(first[r], first[r + 1]):
                k = part[i]
                if not narrow[k] or (only_middle and i != longest[k]):
                    continue
                low, high = start[i], end[i]
                if only_middle:
                    low = (low + high) // 2
                    high = low + 1
                for c in range(low, high):
                    if _edge_distance(squared[k]) <= deepest:
                        squared[k] = max(squared[k], _nearest(first, start, end, part, narrow, r, c, most, squared[k]))
    depth = np.empty(parts)
    for k in range(parts):
        depth[k] = max(_edge_distance(squared[k]), 0.0)
    return depth


@helper
def _measure_away(bitmask: _Words, rows: int, columns: int) -> npt.NDArray[np.int64]:
    """Return how far each pixel is from the nearest one of the ground, px^2, in columns one higher."""
    one = np.uint64(1)
    above = np.zeros((rows, columns + 2), dtype=np.int32)  # in its column, px
    for r in range(1, rows - 1):
        for k in range(1, len(bitmask) - 1):
            word = bitmask[k, r]
            while word != 0:
                c = np.uint64(WORD_BITS * (k - 1) + lowest_one(word) + 1)
                word &= word - one
                above[r, c] = above[r - 1, c] + 1
    away = np.zeros((rows, columns + 2), dtype=np.int64)
    for r in range(rows - 2, 0, -1):
        for k in range(1, len(bitmask) - 1):
            word = bitmask[k, r]
            while word != 0:
                c = np.uint64(WORD_BITS * (k - 1) + lowest_one(word) + 1)
                word &= word - one
                above[r, c] = min(above[r, c], above[r + 1, c] + 1)
        for k in range(1, len(bitmask) - 1):
            word = bitmask[k, r]
            while word != 0:
                c = np.uint64(WORD_BITS * (k - 1) + lowest_one(word) + 1)
                word &= word - one
                best, across = np.int64(above[r, c]) ** 2, 1
                while across * across < best:
                    nearer = np.int64(min(above[r, c - np.uint64(across)], above[r, c + np.uint64(across)]))
                    best = min(best, nearer * nearer + across * across)
                    across += 1
                away[r, c] = best
    return away


@kernel(
    int64,
    int64,
    read(int64, 1, "C"),
    read(int64, 1, "C"),
    read(int64, 1, "C"),
    read(int64, 1, "C"),
    read(boolean, 1, "C"),
)
def measure_widths(
    rows: int, columns: int, first: _Ints, start: _Ints, end: _Ints, part: _Ints, chosen: _Bools
) -> npt.NDArray[np.float64]:
    """Measure the largest circle in each of some holes.

    Parameters
    ----------
    rows, columns : int
        Size of the mask, its margin included.
    first, start, end, part
        The runs of ground.
    chosen : (parts,) bool

    Returns
    -------
    (parts,) float64
        Its diameter, px, to the edges of the pixels; 0 for other parts.
    """
    empty = np.zeros(((columns + WORD_BITS - 1) // WORD_BITS + 2, rows), dtype=np.uint64)
    away = _measure_away(fill(empty, first, start, end, part, chosen), rows, columns)
    squared = np.zeros(len(chosen), dtype=np.int64)
    for r in range(len(first) - 1):
        for i in range(first[r], first[r + 1]):
            if chosen[part[i]]:
                for c in range(start[i] + 1, end[i] + 1):
                    squared[part[i]] = max(squared[part[i]], away[r, c])
    width = np.empty(len(chosen))
    for k in range(len(chosen)):
        width[k] = max(2.0 * _edge_distance(squared[k]), 0.0)
    return width


@inlined
def _is_ridge(away: _Ints, r: int, c: int) -> bool:
    """Tell whether no neighbour of a pixel is farther from the ground."""
    one = np.uint64(1)
    here = away[r, c]
    if here < max(away[r, c - one], away[r, c + one]) or here < max(away[r - one, c], away[r + one, c]):
        return False
    return here >= max(away[r - one, c - one], away[r - one, c + one], away[r + one, c - one], away[r + one, c + one])


@kernel(read(uint64, 2, "C"), int64, int64)
def single_width(bitmask: _Words, rows: int, columns: int) -> float:
    """Return the width of one cable where most lie in bundles, from the ridge of the distance to the ground.

    Parameters
    ----------
    bitmask : (n, R) uint64
        Framed, not empty.
    rows, columns : int
        Size of the mask, its margin included.

    Returns
    -------
    float
        px.
    """
    away = _measure_away(bitmask, rows, columns)
    ridge = np.empty(_FIRST_RIDGE, dtype=np.int64)
    count = 0
    for r in range(1, rows - 1):
        for k in range(1, len(bitmask) - 1):
            word = bitmask[k, r]
            while word != 0:
                c = np.uint64(WORD_BITS * (k - 1) + lowest_one(word) + 1)
                word &= word - np.uint64(1)
                if _is_ridge(away, np.uint64(r), c):
                    if count == len(ridge):
                        ridge = longer(ridge)
                    ridge[count] = away[r, c]
                    count += 1
    place = _SINGLE_SHARE * (count - 1)
    before = int(place)
    after = min(before + 1, count - 1)
    low = _edge_distance(nth_least(ridge[:count], before))
    high = _edge_distance(nth_least(ridge[:count], after))
    return 2.0 * (low + (place - before) * (high - low))
