"""Pieces that an opening takes from a mask, and those among them that come back."""

from __future__ import annotations

import numpy as np

from dloftbs.cleaning.kernels.dashes import find_dashes
from dloftbs.cleaning.kernels.mask_pieces import (
    FIRST_QUEUE,
    MAX_TOUCHED,
    around,
    collect,
    is_set,
    joins_parts,
    non_zero,
    set_pixel,
    touches_any,
)
from dloftbs.kernels.compiler import Bools, Ints, Words, helper
from dloftbs.kernels.shared.bitmask_layout import WORD_BITS
from dloftbs.kernels.shared.copying import longer
from dloftbs.kernels.shared.popcount import lowest_one

_LONG_THREADS = 4
"""Number of pixels, over that of a thin cable, of what runs along a thick part as a cable and not as fringe.

Source: geometry; blocks of 8 and 16 px leave threads of one to three blocks, measured up to 79 px on drawn videos.
"""


@helper
def list_pieces(lost: Words, mask: Words, kept: Words, rows: int, least: int) -> tuple[Ints, Ints]:
    """List the pieces that an opening takes, and put back the small ones that join parts of the rest.

    Pieces do not touch each other, so their order does not matter.

    Parameters
    ----------
    lost : (n R,) uint64
        The pieces; empty afterwards.
    mask : (n R,) uint64
        All of the mask.
    kept : (n R,) uint64
        The rest of it; written.
    rows : int
        R.
    least : int
        Number of pixels of a large piece at least.

    Returns
    -------
    pixels : (k,) int64
        Of those that are no joints, piece after piece, without most single ones.
    ends : (m,) int64
        Where each piece ends.
    """
    pixels = np.empty(FIRST_QUEUE, dtype=np.int64)
    ends = np.empty(FIRST_QUEUE, dtype=np.int64)
    touched = np.empty((MAX_TOUCHED, 2), dtype=np.int64)
    one = np.uint64(1)
    count, start = 0, 0
    for i in non_zero(lost):
        if least > 1 and lost[i] & (lost[i] << one) == 0:
            lost[i] &= around(mask, i, rows)  # most salt is single pixels
        while lost[i] != 0:
            seed = WORD_BITS * i + lowest_one(lost[i])
            size, touches, pixels = collect(seed, WORD_BITS * rows, lost, kept, pixels, start)
            if size < least and touches > 1 and joins_parts(pixels, start, size, rows, kept, touched):
                for k in range(start, start + size):
                    set_pixel(kept, pixels[k])
                continue
            if count == len(ends):
                ends = longer(ends)
            start += size
            ends[count] = start
            count += 1
    return pixels[:start], ends[:count]


@helper
def size_of_large(ends: Ints, least: int) -> int:
    """Return the number of pixels in large pieces."""
    total, start = 0, 0
    for end in ends:
        total += (end - start) * (end - start >= least)
        start = end
    return total


@helper
def find_cables(pixels: Ints, ends: Ints, rows: int, least: int) -> Bools:
    """Return which pieces are large, or lie in line with others."""
    found = np.zeros(len(ends), dtype=np.bool_)
    large, start = 0, 0
    for piece in range(len(ends)):
        found[piece] = ends[piece] - start >= least
        large += found[piece]
        start = ends[piece]
    if large < len(ends) and least <= len(pixels):
        found |= find_dashes(pixels, ends, rows, least)
    return found


@helper
def any_within(pixels: Ints, ends: Ints, found: Bools, mask: Words) -> bool:
    """Return whether any of some pieces has a pixel in a mask."""
    start = 0
    for piece in range(len(ends)):
        if found[piece]:
            for k in range(start, ends[piece]):
                if is_set(mask, pixels[k]):
                    return True
        start = ends[piece]
    return False


@helper
def put_back(pixels: Ints, ends: Ints, found: Bools, kept: Words) -> None:
    """Put some of the pieces back."""
    start = 0
    for piece in range(len(ends)):
        if found[piece]:
            for k in range(start, ends[piece]):
                set_pixel(kept, pixels[k])
        start = ends[piece]


@helper
def put_back_near(lost: Words, edge: Words, thin: Words, kept: Words, rows: int, least: int) -> None:
    """Put back what is no fringe of that which lies around thick parts.

    That are small joints as elsewhere, what leads a thin cable on to a thick part, and what runs along one for long and
    not in its very edge.
    """
    queue = np.empty(FIRST_QUEUE, dtype=np.int64)
    touched = np.empty((MAX_TOUCHED, 2), dtype=np.int64)
    for i in non_zero(lost):
        while lost[i] != 0:
            seed = WORD_BITS * i + lowest_one(lost[i])
            size, touches, queue = collect(seed, WORD_BITS * rows, lost, kept, queue, 0)
            if size < _LONG_THREADS * least:
                cable = size < least or touches_any(queue, size, WORD_BITS * rows, thin)
                cable = cable and touches > 1 and joins_parts(queue, 0, size, rows, kept, touched)
            else:
                within = 0
                for k in range(size):
                    within += is_set(edge, queue[k])
                cable = 2 * within < size
            if cable:
                for k in range(size):
                    set_pixel(kept, queue[k])
