"""Dilation and erosion of bitmasks by squares and octagons, 64 pixels at a time."""

from __future__ import annotations

import numpy as np

from dloftbs.kernels.compiler import Words, helper
from dloftbs.kernels.shared.bitmask_layout import WORD_BITS

DILATE, ERODE = np.uint64(0), ~np.uint64(0)


@helper
def grow(source: Words, target: Words, inside: Words, flip: int) -> None:
    """Add to the foreground its eight neighbours inside the image; with `flip` all ones, to the background."""
    n, rows = source.shape
    one, last = np.uint64(1), np.uint64(WORD_BITS - 1)
    line = np.zeros(rows, dtype=np.uint64)
    up, middle, down = line[:-2], line[1:-1], line[2:]
    for k in range(1, n - 1):
        left, here, right = source[k - 1, 1:-1], source[k, 1:-1], source[k + 1, 1:-1]
        in_left, in_here, in_right = inside[k - 1], inside[k], inside[k + 1]
        for r in range(rows - 2):
            word = (here[r] ^ flip) & in_here
            beside = (((left[r] ^ flip) & in_left) >> last) | (((right[r] ^ flip) & in_right) << last)
            middle[r] = word | (word << one) | (word >> one) | beside
        grown = target[k, 1:-1]
        for r in range(rows - 2):
            grown[r] = ((up[r] | middle[r] | down[r]) ^ flip) & in_here


@helper
def _grow_straight(source: Words, target: Words, inside: Words, flip: int) -> None:
    """Add to the foreground its four neighbours inside the image; with `flip` all ones, to the background."""
    n, rows = source.shape
    one, last = np.uint64(1), np.uint64(WORD_BITS - 1)
    for k in range(1, n - 1):
        left, here, right = source[k - 1], source[k], source[k + 1]
        in_left, in_here, in_right = inside[k - 1], inside[k], inside[k + 1]
        grown = target[k]
        for r in range(1, rows - 1):
            word = (here[r] ^ flip) & in_here
            beside = (((left[r] ^ flip) & in_left) >> last) | (((right[r] ^ flip) & in_right) << last)
            above = ((here[r - 1] ^ flip) | (here[r + 1] ^ flip)) & in_here
            grown[r] = ((word | (word << one) | (word >> one) | beside | above) ^ flip) & in_here


@helper
def grow_round(source: Words, inside: Words, reach: int, flip: int) -> Words:
    """Dilate a bitmask by an octagon, which is about a disc of a radius; with `flip` all ones, erode it."""
    n, rows = source.shape
    buffers = np.zeros((min(reach, 2), n, rows), dtype=np.uint64)
    for step in range(reach):
        if step % 2 == 0:
            _grow_straight(source, buffers[step % 2], inside, flip)
        else:
            grow(source, buffers[step % 2], inside, flip)
        source = buffers[step % 2]
    return source


@helper
def grow_times(source: Words, inside: Words, times: int, flip: int) -> Words:
    """Dilate a bitmask by a square of side ``2 times + 1``; with `flip` all ones, erode it."""
    n, rows = source.shape
    buffers = np.zeros((min(times, 2), n, rows), dtype=np.uint64)
    for step in range(times):
        grow(source, buffers[step % 2], inside, flip)
        source = buffers[step % 2]
    return source
