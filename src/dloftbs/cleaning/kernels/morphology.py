"""Corrections of closing and opening: closing fills holes alone, and opening takes specks and fringe alone.

Masks are bitmasks, as `dloftbs.kernels.bitmask` cuts them out: bit j of word ``[k, r]`` is the pixel in column
``64 k + j`` of row r.
"""

from __future__ import annotations

import numpy as np
from numba import int64, uint64

from dloftbs.cleaning.kernels.bitmask_growth import DILATE, ERODE, grow_times
from dloftbs.cleaning.kernels.fringe import find_fringe
from dloftbs.cleaning.kernels.mask_pieces import (
    AROUND,
    FIRST_QUEUE,
    MAX_TOUCHED,
    clear_pixel,
    collect,
    is_set,
    joins_parts,
    left_of,
    non_zero,
    right_of,
    set_pixel,
    total_ones,
)
from dloftbs.cleaning.kernels.thin_parts import (
    any_within,
    find_cables,
    list_pieces,
    put_back,
    put_back_near,
    size_of_large,
)
from dloftbs.kernels.compiler import Ints, Words, helper, inlined, kernel, write
from dloftbs.kernels.shared.bitmask_layout import WORD_BITS
from dloftbs.kernels.shared.copying import longer
from dloftbs.kernels.shared.popcount import lowest_one

_NOTCH = 9  # pixels
_PEPPER = 4
"""Number of a mask's pixels, over those that a closing may add to them whatever the size of the image.

Source: geometry; of a thick cable, a fifth may be missing. To salt of any density that exceeds `most`, a closing adds
at least four fifths of its own pixels.
"""
_DENSEST = 8
"""Number of pixels taken, over the largest one of noise, from which on all are noise, whatever their pieces.

Source: geometry; then they are a quarter of the mask's box, as cables of 2 px are that lie 8 px apart. Salt hangs
together in pieces as large as cables where it is four tenths.
"""


@inlined
def _recede(seed: int, stride: int, added: Words, stack: Ints) -> Ints:
    """Take an added pixel away, and all that hang together with it by their sides; return the stack, as `collect`."""
    clear_pixel(added, seed)
    stack[0] = seed
    count = 1
    while count > 0:
        count -= 1
        p = stack[count]
        if count + AROUND > len(stack):
            stack = longer(stack)
        for q in (p - WORD_BITS, left_of(p, stride), right_of(p, stride), p + WORD_BITS):
            if is_set(added, q):
                clear_pixel(added, q)
                stack[count] = q
                count += 1
    return stack


@helper
def _holes(added: Words, closed: Words, rows: int) -> Words:
    """Return the pixels added by a closing that are no part of the background around them."""
    one, last = np.uint64(1), np.uint64(WORD_BITS - 1)
    holes = added.copy()
    stack = np.empty(FIRST_QUEUE, dtype=np.int64)
    for i in non_zero(added):
        word = closed[i]
        left = (word << one) | (closed[i - rows] >> last)
        right = (word >> one) | (closed[i + rows] << last)
        edge = added[i] & ~(left & right & closed[i - 1] & closed[i + 1])
        while edge != 0:
            p = WORD_BITS * i + lowest_one(edge)
            edge &= edge - one
            if is_set(holes, p):
                stack = _recede(p, WORD_BITS * rows, holes, stack)
    return holes


@kernel(write(uint64, 2, "C"), write(uint64, 1, "C"), int64, int64)
def close(bitmask: Words, inside: Words, reach: int, most: int) -> Words:
    """Close a mask by a square, and keep the added pixels that fill a whole hole or a small notch.

    A hole is background that hangs together by its sides, as goes with foreground that hangs together by its corners
    too: to fill one joins nothing but what it encloses, and leaves every other hole as it is. What touches the image's
    border is none. Of the rest, 8-connected pieces of a few pixels stay that touch a single set of pixels: so pepper at
    a cable's rim grows no branch, and a slit stays open, since it has two sides. Pieces do not touch each other, so
    their order does not matter. The cost grows with the pixels added, beside some looks at all words.

    Parameters
    ----------
    bitmask : (n, R) uint64
        With a margin that is wider than `reach`, and one empty word more to both sides of each row.
    inside : (n,) uint64
        The columns that lie in the image.
    reach : int
        The square's side is ``2 reach + 1``, px.
    most : int
        Largest number of added pixels, unless they are few to the mask's own; with more, the mask is noise and nothing
        is added.

    Returns
    -------
    (n, R) uint64
    """
    rows = bitmask.shape[1]
    grown = grow_times(bitmask, inside, reach, DILATE)
    closed = grow_times(grown, inside, reach, ERODE).ravel()
    result = bitmask.copy()
    mask = result.ravel()
    added = closed & ~mask
    count = total_ones(added)
    if count > most and _PEPPER * count > total_ones(mask):
        return result
    holes = _holes(added, closed, rows)
    mask |= holes
    pieces = added & ~holes
    queue = np.empty(FIRST_QUEUE, dtype=np.int64)
    touched = np.empty((MAX_TOUCHED, 2), dtype=np.int64)
    for i in non_zero(pieces):
        while pieces[i] != 0:
            size, _, queue = collect(WORD_BITS * i + lowest_one(pieces[i]), WORD_BITS * rows, pieces, mask, queue, 0)
            if size <= _NOTCH and not joins_parts(queue, 0, size, rows, mask, touched):
                for k in range(size):
                    set_pixel(mask, queue[k])
    return result


@kernel(write(uint64, 2, "C"), write(uint64, 1, "C"), int64, int64, int64)
def open_up(bitmask: Words, inside: Words, reach: int, least: int, most: int) -> Words:
    """Open a mask by a square, and put back the thin cables that it has lost.

    These are large 8-connected pieces, smaller ones that lie in line with others, and those that join parts of the
    rest: at 2.5 px a cable is wide enough for the square in some places only. Along much thicker parts, threads are
    their edge's fringe and do not come back. The cost grows with the pixels lost, beside some looks at all words.

    Parameters
    ----------
    bitmask : (n, R) uint64
        With a margin that is wider than `reach`.
    inside : (n,) uint64
        The columns that lie in the image.
    reach : int
        The square's side is ``2 reach + 1``, px.
    least : int
        Number of pixels of a thin cable at least; 0 puts nothing back.
    most : int
        Largest number of pixels taken that are in no large piece; with more, the mask is noise and nothing is put back.

    Returns
    -------
    (n, R) uint64
    """
    rows = bitmask.shape[1]
    eroded = grow_times(bitmask, inside, reach, ERODE)
    opened = grow_times(eroded, inside, reach, DILATE)
    if least == 0:
        return opened
    mask, kept = bitmask.ravel(), opened.ravel()
    lost = mask & ~kept
    taken = total_ones(lost)
    if taken > _DENSEST * most:
        return opened
    joined = kept.copy()
    pixels, ends = list_pieces(lost, mask, joined, rows, least)
    if taken - size_of_large(ends, least) > most:
        return opened
    kept[:] = joined
    found = find_cables(pixels, ends, rows, least)
    if not found.any():
        return opened
    edge, surroundings = find_fringe(eroded, inside, reach, least // 2)
    if len(edge) == 0 or not any_within(pixels, ends, found, surroundings.ravel()):
        put_back(pixels, ends, found, kept)
        return opened
    near = mask & ~kept & surroundings.ravel()
    lost = mask & ~kept & ~near
    pixels, ends = list_pieces(lost, mask, kept, rows, least)
    put_back(pixels, ends, find_cables(pixels, ends, rows, least), kept)
    put_back_near(near, edge.ravel(), kept & ~surroundings.ravel(), kept, rows, least)
    return opened
