"""Thinning to a skeleton one pixel wide, over a list of border pixels, with a table of the 256 neighbourhoods.

The neighbours of a pixel are numbered clockwise from the north: bit 0 N, 1 NE, 2 E, 3 SE, 4 S, 5 SW, 6 W, 7 NW.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import int32, int64, uint8, uint64

from dloftbs.kernels._compile import helper, kernel, read, write

NORTH, EAST, SOUTH, WEST = 0, 2, 4, 6
"""Bits of the four sides from which pixels are peeled."""

_ALIVE, _RESTING, _LISTED = 1, 2, 16  # a pixel's bits while it is thinned; `_LISTED << s`: on the list of side 2 s


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


@kernel(read(uint64, 2, "C"))
def find_border(words: npt.NDArray[np.uint64]) -> tuple[npt.NDArray[np.int32], int]:
    """List the foreground pixels that have a background pixel on one of their four sides.

    Not checked: the outermost rows and columns of the mask are 0, it has fewer than 2**31 pixels, and the machine puts
    the lowest byte of a word first.

    Parameters
    ----------
    words : (H, W / 8) uint64
        The mask (H, W) of 0 and 1, eight pixels a word.

    Returns
    -------
    border : (n,) int32
        Flat indices, ascending.
    area : int
        Number of foreground pixels.
    """
    rows, columns = words.shape[0], 8 * words.shape[1]
    ones = np.uint64(0x0101010101010101)
    area = 0
    for row in range(rows):
        for k in range(words.shape[1]):
            area += np.int64((words[row, k] * ones) >> np.uint64(56))  # the sum of the eight bytes
    border = np.empty(area, dtype=np.int32)
    count = 0
    for row in range(1, rows - 1):
        before = np.uint64(0)
        for k in range(words.shape[1]):
            word = words[row, k]
            if word != 0:
                after = words[row, k + 1] if k + 1 < words.shape[1] else np.uint64(0)
                # The lowest byte is the leftmost pixel: shifting up by a byte moves the left neighbours into place.
                left = (word << np.uint64(8)) | (before >> np.uint64(56))
                right = (word >> np.uint64(8)) | (after << np.uint64(56))
                edge = word & ~(left & right & words[row - 1, k] & words[row + 1, k])
                p = row * columns + 8 * k
                while edge != 0:
                    if edge & np.uint64(1):
                        border[count] = p
                        count += 1
                    edge >>= np.uint64(8)
                    p += 1
            before = word
    return border[:count].copy(), area


@helper
def _neighbourhood(flat: npt.NDArray[np.uint8], p: int, columns: int) -> int:
    """Return the code of a pixel's eight neighbours, as the table wants it."""
    one = np.uint64(1)
    north, south = p - columns, p + columns
    code = flat[north] & _ALIVE
    code |= (flat[north + one] & _ALIVE) << 1
    code |= (flat[p + one] & _ALIVE) << 2
    code |= (flat[south + one] & _ALIVE) << 3
    code |= (flat[south] & _ALIVE) << 4
    code |= (flat[south - one] & _ALIVE) << 5
    code |= (flat[p - one] & _ALIVE) << 6
    code |= (flat[north - one] & _ALIVE) << 7
    return code


@helper
def _list(
    p: int, s: int, flat: npt.NDArray[np.uint8], open_to: npt.NDArray[np.uint64], counts: npt.NDArray[np.int64]
) -> None:
    """Put a pixel on the list of a side, if it is foreground and not on it already."""
    if flat[p] != 0 and flat[p] & (_LISTED << s) == 0:
        flat[p] |= _LISTED << s
        open_to[s, counts[s]] = p
        counts[s] += 1


@helper
def _wake(
    p: int, columns: int, flat: npt.NDArray[np.uint8], open_to: npt.NDArray[np.uint64], counts: npt.NDArray[np.int64]
) -> None:
    """Put a pixel that rests back on the lists of the sides to which it is open."""
    if flat[p] & _RESTING:
        flat[p] &= ~np.uint8(_RESTING)
        one = np.uint64(1)
        if flat[p - columns] == 0:
            _list(p, 0, flat, open_to, counts)
        if flat[p + one] == 0:
            _list(p, 1, flat, open_to, counts)
        if flat[p + columns] == 0:
            _list(p, 2, flat, open_to, counts)
        if flat[p - one] == 0:
            _list(p, 3, flat, open_to, counts)


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
    side has a list of the pixels that are open to it. A pixel that may not go from any side leaves the lists and rests
    until one of its neighbours goes, so that what is thin costs nothing while a thick place is still being peeled.

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
    columns = np.uint64(state.shape[1])  # unsigned indices spare numba's test for negative ones
    flat = state.ravel()
    open_to = np.empty((4, area), dtype=np.uint64)  # the work lists, by side // 2
    counts = np.zeros(4, dtype=np.int64)
    leaving = np.empty(area, dtype=np.uint64)
    one = np.uint64(1)
    for pixel in border:
        flat[pixel] |= _RESTING
    for pixel in border:
        _wake(np.uint64(pixel), columns, flat, open_to, counts)

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
                sides_open = table[_neighbourhood(flat, p, columns)]
                if sides_open == 0:
                    flat[p] = (flat[p] | _RESTING) & ~np.uint8(_LISTED << s)
                elif sides_open >> s & 1:
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
                p = leaving[i]
                north, south, west, east = p - columns, p + columns, p - one, p + one
                _list(north, 2, flat, open_to, counts)  # its southern neighbour is gone, and so on
                _list(south, 0, flat, open_to, counts)
                _list(west, 1, flat, open_to, counts)
                _list(east, 3, flat, open_to, counts)
                beside = flat[north] | flat[south] | flat[west] | flat[east]
                corners = flat[north - one] | flat[north + one] | flat[south - one] | flat[south + one]
                if (beside | corners) & _RESTING:
                    for row in (north, p, south):
                        for q in (row - one, row, row + one):
                            _wake(q, columns, flat, open_to, counts)
    for i in range(flat.size):
        flat[i] &= _ALIVE
