"""Thinning to a skeleton one pixel wide, over a list of border pixels, with a table of the 256 neighbourhoods.

The neighbours of a pixel are numbered clockwise from the north: bit 0 N, 1 NE, 2 E, 3 SE, 4 S, 5 SW, 6 W, 7 NW.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import int32, int64, uint8, uint64

from dloftbs.kernels._compile import kernel, read, write

NORTH, EAST, SOUTH, WEST = 0, 2, 4, 6
"""Bits of the four sides from which pixels are peeled."""


def deletion_table() -> npt.NDArray[np.uint8]:
    """Return, for each neighbourhood, the sides from which a pixel with it may be peeled off.

    A pixel may go from one side if it is background on that side, has two neighbours or more (it is no end), and is
    simple: deleting it neither splits nor joins anything, which for 8-connected objects means that Yokoi's number
    (Yokoi, Toriwaki, Fukumura 1975) is 1. Deleting all such pixels of one side at once keeps the topology (Rosenfeld
    1975).

    Returns
    -------
    numpy.ndarray, shape (256,), uint8
        Bit ``side // 2`` is set where a pixel may be peeled off from that side.
    """
    table = np.zeros(256, dtype=np.uint8)
    for code in range(256):
        background = [1 - (code >> bit & 1) for bit in range(8)]
        yokoi = sum(
            background[k] - background[k] * background[(k + 1) % 8] * background[(k + 2) % 8]
            for k in (NORTH, EAST, SOUTH, WEST)
        )
        if yokoi == 1 and sum(background) <= 6:
            for side in (NORTH, EAST, SOUTH, WEST):
                table[code] |= background[side] << (side // 2)
    return table


DELETION_TABLE = deletion_table()


@kernel(read(uint8, 2, "C"), read(uint64, 2, "C"))
def find_border(mask: npt.NDArray[np.uint8], words: npt.NDArray[np.uint64]) -> tuple[npt.NDArray[np.int32], int]:
    """List the foreground pixels that have a background pixel on one of their four sides.

    Not checked: the mask is C-contiguous, its width is a multiple of 8, its outermost rows and columns are 0, and it
    has fewer than 2**31 pixels.

    Parameters
    ----------
    mask : (H, W) uint8
        0 and 1.
    words : (H, W / 8) uint64
        The same memory: eight pixels a word, since most words are empty or full and need no look at their pixels.

    Returns
    -------
    border : (n,) int32
        Flat indices, ascending.
    area : int
        Number of foreground pixels.
    """
    rows, columns = mask.shape
    flat = mask.ravel()
    full = np.uint64(0x0101010101010101)
    area = 0
    for row in range(rows):
        for k in range(words.shape[1]):
            area += np.int64((words[row, k] * full) >> np.uint64(56))  # the sum of the eight bytes
    border = np.empty(area, dtype=np.int32)
    count = 0
    for row in range(1, rows - 1):
        for k in range(words.shape[1]):
            word = words[row, k]
            if word == 0:
                continue
            first = row * columns + 8 * k
            inside = word == full and words[row - 1, k] == full and words[row + 1, k] == full
            if inside and flat[first - 1] & flat[first + 8]:
                continue
            for p in range(first, first + 8):
                surrounded = flat[p - 1] & flat[p + 1] & flat[p - columns] & flat[p + columns]
                if flat[p] != 0 and surrounded == 0:
                    border[count] = p
                    count += 1
    return border[:count].copy(), area


@kernel(write(uint8, 2, "C"), read(int32, 1), int64, read(uint8, 1), read(uint8, 1))
def thin(
    state: npt.NDArray[np.uint8],
    border: npt.NDArray[np.int32],
    area: int,
    sides: npt.NDArray[np.uint8],
    table: npt.NDArray[np.uint8],
) -> None:
    """Peel the foreground from four sides in turn, in place, until nothing can go.

    In each turn all pixels that may go from its side go at once, so the order of the work lists does not matter. Each
    side has a list of the pixels that are open to it; a pixel comes onto it when its neighbour on that side goes.

    Not checked: as `find_border`, whose results `border` and `area` are.

    Parameters
    ----------
    state : (H, W) uint8
        0 and 1; what remains is the skeleton.
    border : (n,) int32
    area : int
    sides : (4,) uint8
        The order of the turns: a permutation of `NORTH`, `EAST`, `SOUTH`, `WEST`.
    table : (256,) uint8
        `DELETION_TABLE`.
    """
    columns = state.shape[1]
    flat = state.ravel()
    offsets = np.array([-columns, -columns + 1, 1, columns + 1, columns, columns - 1, -1, -columns - 1], dtype=np.int32)
    open_to = np.empty((4, area), dtype=np.int32)  # the work lists, by side // 2
    counts = np.zeros(4, dtype=np.int64)
    leaving = np.empty(area, dtype=np.int32)
    for p in border:
        for s in range(4):
            if flat[p + offsets[2 * s]] == 0:
                open_to[s, counts[s]] = p
                counts[s] += 1

    going = True
    while going:
        going = False
        for side in sides:
            s = side >> 1
            n_kept = 0
            n_leaving = 0
            for i in range(counts[s]):
                p = open_to[s, i]
                if flat[p] == 0:
                    continue
                code = 0
                for k in range(8):
                    code |= flat[p + offsets[k]] << k
                if table[code] >> s & 1:
                    leaving[n_leaving] = p
                    n_leaving += 1
                else:
                    open_to[s, n_kept] = p
                    n_kept += 1
            counts[s] = n_kept
            going |= n_leaving > 0
            for i in range(n_leaving):
                flat[leaving[i]] = 0
            for i in range(n_leaving):
                for t in range(4):
                    q = leaving[i] - offsets[2 * t]  # its neighbour on side t is gone
                    if flat[q] != 0:
                        open_to[t, counts[t]] = q
                        counts[t] += 1
