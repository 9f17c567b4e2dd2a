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
from numba import int64, uint64

from dloftbs.kernels.compiler import Ints, Words, helper, inlined, kernel, read
from dloftbs.kernels.shared.bitmask_layout import WORD_BITS
from dloftbs.kernels.shared.popcount import count_ones, lowest_one
from dloftbs.kernels.shared.union_find import find_root, unite


@inlined
def _every_other(word: int) -> int:
    """Return the bits 0, 2, 4, ... of a word next to each other."""
    word &= np.uint64(0x5555555555555555)
    word = (word | (word >> np.uint64(1))) & np.uint64(0x3333333333333333)
    word = (word | (word >> np.uint64(2))) & np.uint64(0x0F0F0F0F0F0F0F0F)
    word = (word | (word >> np.uint64(4))) & np.uint64(0x00FF00FF00FF00FF)
    word = (word | (word >> np.uint64(8))) & np.uint64(0x0000FFFF0000FFFF)
    return (word | (word >> np.uint64(16))) & np.uint64(0x00000000FFFFFFFF)


@kernel(read(uint64, 2, "C"), int64, int64, int64)
def thin_out(bitmask: Words, rows: int, top: int, left: int) -> Words:
    """Return every other pixel of a mask, with an empty margin of its own.

    Parameters
    ----------
    bitmask : (n, R) uint64
    rows : int
        Rows of the mask, its margin included.
    top, left : int
        The first row and column to take, 0 or 1.

    Returns
    -------
    (m, S) uint64
    """
    n = len(bitmask) - 2
    height = (rows - top + 1) // 2
    result = np.zeros(((n + 1) // 2 + 2, height + 2), dtype=np.uint64)
    for k in range(n):
        for r in range(height):
            word = bitmask[k + 1, top + 2 * r]
            if word != 0:
                half = _every_other(word >> np.uint64(left))
                result[k // 2 + 1, r + 1] |= half << np.uint64(32 * (k % 2))
    return result


@inlined
def _changes(bitmask: Words, k: int, r: int) -> int:
    """Return which pixels of a word differ from the one before."""
    word = bitmask[k, r]
    return word ^ ((word << np.uint64(1)) | (bitmask[k - 1, r] >> np.uint64(WORD_BITS - 1)))


@helper
def _list_runs(bitmask: Words, rows: int, columns: int) -> tuple[Ints, Ints, Ints]:
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
def find_ground(bitmask: Words, rows: int, columns: int) -> tuple[Ints, Ints, Ints, Ints, Ints]:
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


@helper
def label_foreground(first: Ints, start: Ints, end: Ints) -> tuple[Ints, int]:
    """Return the piece of the foreground behind each run of ground, -1 where a row ends, and how many pieces there are.

    Pieces hang together by their sides and corners.
    """
    count = len(start)
    parent = np.arange(count)
    for r in range(1, len(first) - 1):
        i, j = first[r - 1], first[r]
        while i + 1 < first[r] and j + 1 < first[r + 1]:
            if end[i] <= start[j + 1] and end[j] <= start[i + 1]:
                unite(parent, i, j)
            if start[i + 1] < start[j + 1]:
                i += 1
            else:
                j += 1
    piece = np.full(count, -1, dtype=np.int64)
    pieces = 0
    for r in range(len(first) - 1):
        for i in range(first[r], first[r + 1] - 1):
            if parent[i] == i:
                piece[i] = pieces
                pieces += 1
            else:
                piece[i] = piece[find_root(parent, i)]
    return piece, pieces
