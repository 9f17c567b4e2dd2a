"""Surroundings of the thick parts of a mask, in which their edges leave fringe: threads along a thick cable.

A picture of a video has one colour for two by two pixels, and an edge that is spread over several: a threshold takes a
thread off the edge, with a slit between them. The blocks of a codec, and highlights, do so farther away.
"""

from __future__ import annotations

import numpy as np
from numba import int64, uint64

from dloftbs.cleaning.kernels.bitmask_growth import DILATE, ERODE, grow_times
from dloftbs.cleaning.kernels.mask_pieces import FIRST_QUEUE, clear_pixel, collect, is_set, non_zero, set_pixel
from dloftbs.kernels.compiler import Words, helper, kernel, write
from dloftbs.kernels.shared.bitmask_layout import WORD_BITS
from dloftbs.kernels.shared.popcount import lowest_one

_BLOCK_PX = 9
"""Largest distance of fringe from a thick part, px.

Source: geometry; JPEG and H.264 transform blocks of up to 8 px, and there is a slit of one.
"""


_THIN = 6
"""Pixels of an eroded mask, over those of its core, from which it is thin but for crossings.

Source: geometry; 3 along the thinnest cable in which the square fits, and twice that where it fits half of the way.
"""


@helper
def _drop_crossings(core: Words, eroded: Words, least: int) -> None:
    """Take the small 8-connected pieces of a core out of it that lie in an otherwise thin mask."""
    core_words, rows = core.ravel(), core.shape[1]
    stride = WORD_BITS * rows
    left, rest, nothing = core_words.copy(), eroded.ravel().copy(), np.zeros(core.size, dtype=np.uint64)
    thin = np.zeros(core.size, dtype=np.uint64)
    queue = np.empty(FIRST_QUEUE, dtype=np.int64)
    for i in non_zero(left):
        while left[i] != 0:
            seed = WORD_BITS * i + lowest_one(left[i])
            if is_set(rest, seed):
                size, _, queue = collect(seed, stride, rest, nothing, queue, 0)
                thick = 0
                for k in range(size):
                    thick += is_set(core_words, queue[k])
                if thick < least or _THIN * thick < size:
                    for k in range(size):
                        set_pixel(thin, queue[k])
            is_thin = is_set(thin, seed)
            size, _, queue = collect(seed, stride, left, nothing, queue, 0)
            if is_thin and size < least:
                for k in range(size):
                    clear_pixel(core_words, queue[k])


@kernel(write(uint64, 2, "C"), write(uint64, 1, "C"), int64, int64)
def find_fringe(eroded: Words, inside: Words, reach: int, least: int) -> tuple[Words, Words]:
    """Find where fringe may lie: within reach of the edge of a part that is clearly thicker than fringe can be.

    A part is thick where it holds a square of side ``4 reach + 1``, twice as wide as the widest thing that the opening
    takes, for more than a few pixels: so is a thin mask where cables cross. Its edge extends as far as a slit of one
    pixel and such a thing; its surroundings extend as far as half of its width, up to `_BLOCK_PX`, and hold the edge.

    Parameters
    ----------
    eroded : (n, R) uint64
        A mask, eroded by the square of an opening.
    inside : (n,) uint64
        The columns that lie in the image.
    reach : int
        The square has a side of ``2 reach + 1``, px.
    least : int
        Smallest number of places at which the square fits in a thick part of an otherwise thin mask.

    Returns
    -------
    edge, surroundings : (n, R) uint64
        With the thick parts themselves. (0, 0) where nothing is thick.
    """
    n, rows = eroded.shape
    core = grow_times(eroded, inside, reach, ERODE)
    _drop_crossings(core, eroded, least)
    if not core.any():
        nothing = np.empty((0, 0), dtype=np.uint64)
        return nothing, nothing
    side = 2 * reach + 1
    edge = grow_times(core, inside, 2 * reach + side, DILATE)
    cores = np.zeros((max(_BLOCK_PX - side, 0), n, rows), dtype=np.uint64)  # cores[i] is eroded side + 1 + i times
    steps = 2 * reach
    deepest = -1
    for i in range(len(cores)):
        core = grow_times(core, inside, side + 1 + i - steps, ERODE)
        steps = side + 1 + i
        if not core.any():
            break
        cores[i] = core
        deepest = i
    if deepest < 0:
        return edge, edge
    around = cores[deepest]
    for i in range(deepest - 1, -1, -1):  # a part that is eroded m times more is grown 2 m times more
        around = grow_times(around, inside, 2, DILATE)
        around |= cores[i]
    around = grow_times(around, inside, 2 * (side + 1), DILATE)
    around |= edge
    return edge, around
