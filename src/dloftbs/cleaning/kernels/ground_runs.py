"""Ground of a mask, as runs: the stretches of a row between foreground, and the parts that hang together.

Masks are framed bitmasks, see `dloftbs.kernels.bitmask`; column 0 is the first one of the second word. The runs of
ground are

- first : (rows + 1,) int64, where the runs of each row start in the others;
- start, end : (n,) int64, the first column of each run, and the one after its last; -1 and one more than the columns at
  the margin;
- part : (n,) int64, the part of the ground that each run belongs to. Part 0 lies around the mask, all others are holes.

Pixel by pixel, the same takes ten times as long.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import boolean, int64, uint64

from dloftbs.kernels.compiler import helper, inlined, kernel, read
from dloftbs.kernels.shared.bitmask_layout import WORD_BITS
from dloftbs.kernels.shared.popcount import count_ones, lowest_one
from dloftbs.kernels.shared.union_find import find_root, unite

_Words = npt.NDArray[np.uint64]
_Ints = npt.NDArray[np.int64]
_Bools = npt.NDArray[np.bool_]


@inlined
def _changes(bitmask: _Words, k: int, r: int) -> int:
    """Return which pixels of a word differ from the one before."""
    word = bitmask[k, r]
    return word ^ ((word << np.uint64(1)) | (bitmask[k - 1, r] >> np.uint64(WORD_BITS - 1)))


@helper
def _list_runs(bitmask: _Words, rows: int, columns: int) -> tuple[_Ints, _Ints, _Ints]:
    """Return where the runs of ground start in each row, and their first columns and ends."""
    one = np.uint64(1)
    changes = np.uint64(0)
    for k in range(1, len(bitmask)):
        for r in range(rows):
            changes += count_ones(_changes(bitmask, k, r))
    first = np.zeros(rows + 1, dtype=np.int64)
    start = np.empty(np.int64(changes) // 2 + rows, dtype=np.int64)
    end = np.empty_like(start)
    count = np.uint64(0)  # unsigned indices spare a test for the sign
    for r in range(rows):
        first[r] = count
        start[count] = -1
        for k in range(1, len(bitmask)):
            change = _changes(bitmask, k, r)
            while change != 0:
                j = lowest_one(change)
                change &= change - one
                if (bitmask[k, r] >> np.uint64(j)) & one != 0:
                    end[count] = WORD_BITS * (k - 1) + j
                    count += one
                else:
                    start[count] = WORD_BITS * (k - 1) + j
        end[count] = columns + 1
        count += one
    first[rows] = count
    return first, start, end


@kernel(read(uint64, 2, "C"), int64, int64)
def find_ground(bitmask: _Words, rows: int, columns: int) -> tuple[_Ints, _Ints, _Ints, _Ints, _Ints]:
    """List the runs of ground, and find the parts of it that hang together by their sides.

    Parameters
    ----------
    bitmask : (n, R) uint64
    rows, columns : int
        Size of the mask, its margin included.

    Returns
    -------
    first, start, end, part
        The runs of ground.
    pixels : (parts,) int64
        Number of pixels of each part.
    """
    first, start, end = _list_runs(bitmask, rows, columns)
    count = len(start)
    parent = np.arange(count)
    for r in range(1, rows):
        i, j = first[r - 1], first[r]
        while i < first[r] and j < first[r + 1]:
            if min(end[i], end[j]) > max(start[i], start[j]):
                unite(parent, i, j)
            if end[i] < end[j]:
                i += 1
            else:
                j += 1
    part = np.empty(count, dtype=np.int64)
    parts = 0
    for i in range(count):
        if parent[i] == i:
            part[i] = parts
            parts += 1
        else:
            part[i] = part[find_root(parent, i)]
    pixels = np.zeros(parts, dtype=np.int64)
    for i in range(count):
        pixels[part[i]] += end[i] - start[i]
    return first, start, end, part, pixels


@kernel(
    read(uint64, 2, "C"),
    read(int64, 1, "C"),
    read(int64, 1, "C"),
    read(int64, 1, "C"),
    read(int64, 1, "C"),
    read(boolean, 1, "C"),
)
def fill(bitmask: _Words, first: _Ints, start: _Ints, end: _Ints, part: _Ints, chosen: _Bools) -> _Words:
    """Return a mask in which some parts of the ground are foreground.

    Parameters
    ----------
    bitmask : (n, R) uint64
    first, start, end, part
        The runs of ground.
    chosen : (parts,) bool

    Returns
    -------
    (n, R) uint64
    """
    filled = bitmask.copy()
    for r in range(len(first) - 1):
        for i in range(first[r], first[r + 1]):
            if chosen[part[i]]:
                for c in range(start[i], end[i]):
                    filled[(c >> 6) + 1, r] |= np.uint64(1) << np.uint64(c & 63)
    return filled
