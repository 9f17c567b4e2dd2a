"""Thinning to a skeleton one pixel wide, 64 pixels at a time.

Masks are bitmasks, as `dloftbs.kernels.bitmask` frames them: bit j of word ``[k, r]`` is the pixel in column
``64 (k - 1) + j`` of row r. The neighbours of a pixel are numbered clockwise from the north, in eighths of a turn.
"""

from __future__ import annotations

import numpy as np
from numba import uint8, uint64

from dloftbs.kernels.compiler import Bytes, Words, inlined, kernel, read, write
from dloftbs.kernels.shared.bitmask_layout import TILE_ROWS

NORTH, EAST, SOUTH, WEST = 0, 2, 4, 6
"""Codes of the sides, the numbers of their neighbours.

Source: by definition.
"""


_TURNS = 4
"""Number of turns, one from each side, after which a tile rests that lost nothing.

Source: by definition.
"""


@inlined
def _may_go(here: int, a0: int, a1: int, a2: int, a3: int, a4: int, a5: int, a6: int, a7: int) -> int:
    """Return the pixels of a word that may be peeled off from a side, given their neighbours clockwise from there.

    A pixel may go from one side if it is background on that side, has two neighbours or more (it is no end), and is
    simple: deleting it neither splits nor joins anything, which for 8-connected objects means that Yokoi's number
    (Yokoi, Toriwaki, Fukumura 1975) is 1. Deleting all such pixels of one side at once keeps the topology (Rosenfeld
    1975).
    """
    # Yokoi's number counts these four; with a0 = 0 there is less to compute.
    y0, y2, y4, y6 = a1 | a2, ~a2 & (a3 | a4), ~a4 & (a5 | a6), ~a6 & a7
    is_one = ((y0 ^ y2) ^ (y4 ^ y6)) & ~((y0 & y2) | (y4 & y6))
    # The neighbours of a simple pixel hang together, so that of two or more some two touch.
    are_two = (a2 & (a1 | a3 | a4)) | (a4 & (a3 | a5 | a6)) | (a6 & (a5 | a7))
    return here & ~a0 & is_one & are_two


@inlined
def _around(words: Words, p: int, stride: int) -> tuple[int, int, int, int, int, int, int, int]:
    """Return the neighbours of each pixel of a word, clockwise from the north; `stride` is the number of rows."""
    one, last = np.uint64(1), np.uint64(63)
    up, down = p - one, p + one
    north, here, south = words[up], words[p], words[down]
    west, east = (here << one) | (words[p - stride] >> last), (here >> one) | (words[p + stride] << last)
    north_west = (north << one) | (words[up - stride] >> last)
    north_east = (north >> one) | (words[up + stride] << last)
    south_west = (south << one) | (words[down - stride] >> last)
    south_east = (south >> one) | (words[down + stride] << last)
    return north, north_east, east, south_east, south, south_west, west, north_west


@inlined
def _from_north(words: Words, first: int, stride: int, rows: int, gone: Words, at: int) -> None:
    """Write which pixels of some words below each other may go from the north."""
    for r in range(rows):
        n, ne, e, se, s, sw, w, nw = _around(words, first + r, stride)
        gone[at + r] = _may_go(words[first + r], n, ne, e, se, s, sw, w, nw)


@inlined
def _from_east(words: Words, first: int, stride: int, rows: int, gone: Words, at: int) -> None:
    for r in range(rows):
        n, ne, e, se, s, sw, w, nw = _around(words, first + r, stride)
        gone[at + r] = _may_go(words[first + r], e, se, s, sw, w, nw, n, ne)


@inlined
def _from_south(words: Words, first: int, stride: int, rows: int, gone: Words, at: int) -> None:
    for r in range(rows):
        n, ne, e, se, s, sw, w, nw = _around(words, first + r, stride)
        gone[at + r] = _may_go(words[first + r], s, sw, w, nw, n, ne, e, se)


@inlined
def _from_west(words: Words, first: int, stride: int, rows: int, gone: Words, at: int) -> None:
    for r in range(rows):
        n, ne, e, se, s, sw, w, nw = _around(words, first + r, stride)
        gone[at + r] = _may_go(words[first + r], w, nw, n, ne, e, se, s, sw)


@inlined
def _or_all(words: Words, first: int, rows: int) -> int:
    together = np.uint64(0)
    for r in range(rows):
        together |= words[first + r]
    return together


@kernel(write(uint64, 2, "C"), read(uint8, 1))
def thin(bitmask: Words, sides: Bytes) -> None:
    """Peel the foreground from four sides in turn, in place, until nothing can go.

    In each turn all pixels that may go from its side go at once. The bitmask is worked on in tiles, a word wide and
    `TILE_ROWS` high. A tile from which four turns took nothing rests until something goes that touches it. So thin
    lines cost nothing while a thick place is still being peeled, nor does the inside of a thick place before it is
    reached.

    Parameters
    ----------
    bitmask : (n, R) uint64
        Framed; what remains is the skeleton.
    sides : (4,) uint8
        The order of the turns: a permutation of `NORTH`, `EAST`, `SOUTH`, `WEST`.
    """
    n, rows = bitmask.shape
    words = bitmask.ravel()
    stride, height, one = np.uint64(rows), np.uint64(TILE_ROWS), np.uint64(1)
    tiles = n * ((rows - 2) // TILE_ROWS)
    due = np.zeros(len(words), dtype=np.uint8)  # turns to come, of the tile that starts at a word
    active = np.empty(tiles, dtype=np.uint64)
    count = 0
    for k in range(1, n - 1):
        for first in range(k * rows + 1, (k + 1) * rows - 1, TILE_ROWS):
            if _or_all(words, np.uint64(first), height) != 0:
                active[count] = first
                due[first] = _TURNS
                count += 1
    gone = np.empty(TILE_ROWS * tiles, dtype=np.uint64)
    touched = np.empty(tiles, dtype=np.uint64)
    while count > 0:
        for side in sides:
            changed = 0
            at = np.uint64(0)
            for i in range(count):
                tile = active[i]
                if side == NORTH:
                    _from_north(words, tile, stride, height, gone, at)
                elif side == EAST:
                    _from_east(words, tile, stride, height, gone, at)
                elif side == SOUTH:
                    _from_south(words, tile, stride, height, gone, at)
                else:
                    _from_west(words, tile, stride, height, gone, at)
                due[tile] -= np.uint8(1)
                if _or_all(gone, at, height) != 0:
                    touched[changed] = tile
                    changed += 1
                    at += height
            kept = 0
            for i in range(count):
                active[kept] = active[i]
                kept += due[active[i]] != 0
            count = kept
            for i in range(changed):  # and what touches it is looked at again, if it is not empty
                tile, at = touched[i], np.uint64(TILE_ROWS * i)
                for r in range(height):
                    words[tile + r] &= ~gone[at + r]
                took = _or_all(gone, at, height)
                row = np.int64(tile) % rows
                above, below = gone[at] != 0 and row > 1, gone[at + height - one] != 0 and row + TILE_ROWS < rows - 1
                for across in range(-np.int64(took & one), np.int64(took >> np.uint64(63)) + 1):
                    for along in range(-np.int64(above), np.int64(below) + 1):
                        other = np.int64(tile) + across * rows + along * TILE_ROWS
                        if due[other] == 0:
                            if _or_all(words, np.uint64(other), height) == 0:
                                continue
                            active[count] = other
                            count += 1
                        due[other] = _TURNS
