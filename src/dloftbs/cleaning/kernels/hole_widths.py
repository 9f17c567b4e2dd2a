"""Width of the holes in a mask, told from that of the cables around them.

The ground comes as runs, see `dloftbs.cleaning.kernels.ground_runs`.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import int64, uint64

from dloftbs.kernels.compiler import helper, inlined, kernel, read
from dloftbs.kernels.shared.bitmask_layout import WORD_BITS
from dloftbs.kernels.shared.popcount import count_ones

_Words = npt.NDArray[np.uint64]
_Ints = npt.NDArray[np.int64]
_Bools = npt.NDArray[np.bool_]

_WIDEST = 2.0
"""Width of a hole over the mask's mean width: a hole of half a cable's width leaves a quarter on either side."""


@inlined
def _get(bitmask: _Words, row: int, column: int) -> bool:
    """Tell whether a pixel is set; there may be one column more on either side."""
    return (bitmask[(column + WORD_BITS) >> 6, row] >> np.uint64(column & 63)) & np.uint64(1) != 0


@helper
def _measure(bitmask: _Words, rows: int) -> tuple[int, int]:
    """Return the area of a mask and the length of all its outlines, in pixels as often as these pass them.

    An outline passes a pixel once for each stretch of ground around it that holds one of its sides.
    """
    one, last = np.uint64(1), np.uint64(WORD_BITS - 1)
    area, length = np.uint64(0), np.uint64(0)
    for k in range(1, len(bitmask) - 1):
        for r in range(1, rows - 1):
            here = bitmask[k, r]
            if here == 0:
                continue
            n, s = bitmask[k, r - 1], bitmask[k, r + 1]
            e, w = (here >> one) | (bitmask[k + 1, r] << last), (here << one) | (bitmask[k - 1, r] >> last)
            area += count_ones(here)
            if here & ~(n & s & e & w) == 0:
                continue
            ne, nw = (n >> one) | (bitmask[k + 1, r - 1] << last), (n << one) | (bitmask[k - 1, r - 1] >> last)
            se, sw = (s >> one) | (bitmask[k + 1, r + 1] << last), (s << one) | (bitmask[k - 1, r + 1] >> last)
            length += count_ones(here & ~e & (ne | n)) + count_ones(here & ~n & (nw | w))
            length += count_ones(here & ~w & (sw | s)) + count_ones(here & ~s & (se | e))
            length += count_ones(here & ~(n | s | e | w | ne | nw | se | sw))
    return np.int64(area), np.int64(length)


@helper
def _measure_outline(bitmask: _Words, r: int, start: int, end: int) -> int:
    """Return how often outlines pass foreground along a run of ground, counted where their stretch of ground ends."""
    length = 0
    if _get(bitmask, r - 1, start) or _get(bitmask, r - 1, start - 1):
        length += 1
    if _get(bitmask, r + 1, end - 1) or _get(bitmask, r + 1, end):
        length += 1
    for c in range(start, end):
        length += _get(bitmask, r - 1, c) and (_get(bitmask, r, c + 1) or _get(bitmask, r - 1, c + 1))
        length += _get(bitmask, r + 1, c) and (_get(bitmask, r, c - 1) or _get(bitmask, r + 1, c - 1))
    return length


@kernel(
    read(uint64, 2, "C"),
    int64,
    read(int64, 1, "C"),
    read(int64, 1, "C"),
    read(int64, 1, "C"),
    read(int64, 1, "C"),
    read(int64, 1, "C"),
    read(int64, 1, "C"),
)
def find_narrow(
    bitmask: _Words, rows: int, first: _Ints, start: _Ints, end: _Ints, part: _Ints, pixels: _Ints, sides: _Ints
) -> tuple[_Bools, float]:
    """Find the holes that may be narrow enough to lie within a cable, and the width of the cables without these.

    A width is twice the area over the length of the outlines; the largest circle in a hole is at least as wide.

    Parameters
    ----------
    bitmask : (n, R) uint64
    rows : int
        Rows of the mask, its margin included.
    first, start, end, part, pixels, sides
        As `ground_runs.find_ground` returns them.

    Returns
    -------
    narrow : (parts,) bool
    width : float
        px; 0 where no hole is narrow.
    """
    parts = len(pixels)
    narrow = np.zeros(parts, dtype=np.bool_)
    area, length = _measure(bitmask, rows)
    for k in range(1, parts):  # an outline passes a pixel for one of its sides at least
        narrow[k] = pixels[k] * length < _WIDEST * area * sides[k]
    if not narrow.any():
        return narrow, 0.0
    outline = np.zeros(parts, dtype=np.int64)
    for r in range(1, rows - 1):
        for i in range(first[r], first[r + 1]):
            if narrow[part[i]]:
                outline[part[i]] += _measure_outline(bitmask, r, start[i], end[i])
    filled, left = area, length
    for k in range(1, parts):
        narrow[k] = narrow[k] and pixels[k] * length < _WIDEST * area * outline[k]
        if narrow[k]:
            filled += pixels[k]
            left -= outline[k]
    return narrow, 2.0 * filled / max(left, 1)
