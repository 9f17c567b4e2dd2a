"""A mask as a bitmask, a bit a pixel, 64 to a word: cut out of the image, framed, and listed.

A bitmask is an array (n, R) of words: bit j of word ``[k, r]`` is the pixel in column ``64 k + j`` of row r. So the
words of the same 64 columns lie below each other in memory, and the same can be done to several rows at once. The first
and the last word of each row are empty, and so are the first and the last row.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import boolean, int64, uint64

from dloftbs.kernels.compiler import Bytes, Words, helper, inlined, kernel, read
from dloftbs.kernels.shared.bitmask_layout import TILE_ROWS, WORD_BITS
from dloftbs.kernels.shared.popcount import count_ones, lowest_one

_BYTE = 8
_SPREAD = np.array([sum((value >> j & 1) << (8 * j) for j in range(8)) for value in range(256)], dtype=np.uint64)
"""Eight pixels as eight bytes; the machine puts the lowest byte of a word first."""


@inlined
def _length(word: int) -> int:
    """Return the place above the highest one."""
    for shift in (1, 2, 4, 8, 16, 32):
        word |= word >> np.uint64(shift)
    return np.int64(count_ones(word))


@kernel(read(uint64, 2, "C"), int64, int64)
def cut(packed: Words, columns: int, margin: int) -> tuple[Words, Words, int, int, int]:
    """Cut out the rows and columns of words that are not empty, with a margin as far as the image goes.

    Parameters
    ----------
    packed : (H, n) uint64
        A mask row after row, 64 pixels a word, the first one in the lowest bit; 0 beyond the image.
    columns : int
        Of the image.
    margin : int
        px.

    Returns
    -------
    bitmask : (k, R) uint64
        (0, 0) where the mask is empty.
    inside : (k,) uint64
        The columns that lie in the image.
    x0, y0 : int
        The image's column and row that are 0 in the bitmask.
    area : int
        Number of pixels of the box, without the margin: the same wherever the mask lies in the image.
    """
    rows, count = packed.shape
    across = np.zeros(count, dtype=np.uint64)
    top, bottom = 0, 0
    for row in range(rows):
        together = np.uint64(0)
        for k in range(count):
            together |= packed[row, k]
        if together != 0:
            for k in range(count):
                across[k] |= packed[row, k]
            if bottom == 0:
                top = row
            bottom = row + 1
    if bottom == 0:
        return np.empty((0, 0), dtype=np.uint64), np.empty(0, dtype=np.uint64), 0, 0, 0
    first, last = 0, count - 1
    while across[first] == 0:
        first += 1
    while across[last] == 0:
        last -= 1
    left, right = WORD_BITS * first + lowest_one(across[first]), WORD_BITS * last + _length(across[last])
    above, below = max(top - margin, 0), min(bottom + margin, rows)
    area = (bottom - top) * (right - left)
    pad = (margin + WORD_BITS - 1) // WORD_BITS + 1
    bitmask = np.zeros((last - first + 1 + 2 * pad, below - above + 2), dtype=np.uint64)
    for row in range(top, bottom):
        for k in range(first, last + 1):
            bitmask[k - first + pad, row - above + 1] = packed[row, k]
    x0 = WORD_BITS * (first - pad)
    inside = np.zeros(len(bitmask), dtype=np.uint64)
    for k in range(len(bitmask)):
        start = x0 + WORD_BITS * k
        if 0 <= start < columns:
            inside[k] = ~np.uint64(0) >> np.uint64(max(WORD_BITS - (columns - start), 0))
    return bitmask, inside, x0, above - 1, area


@helper
def _box(bitmask: Words) -> tuple[int, int, int, int]:
    """Return the first and last column and row that are not empty; the last is -1 where all are."""
    n, rows = bitmask.shape
    last = -1
    left, right = 0, 0
    along = np.zeros(rows, dtype=np.uint64)
    for k in range(n):
        together = np.uint64(0)
        for r in range(rows):
            together |= bitmask[k, r]
            along[r] |= bitmask[k, r]
        if together != 0:
            if last < 0:
                left = WORD_BITS * k + lowest_one(together)
            last = k
            right = WORD_BITS * last + _length(together) - 1
    top, bottom = 0, rows - 1
    while top < rows and along[top] == 0:
        top += 1
    while bottom >= 0 and along[bottom] == 0:
        bottom -= 1
    return left, right, top, bottom


@helper
def _moved(bitmask: Words, left: int, right: int, top: int, bottom: int) -> Words:
    """Return a part of a bitmask with its first pixel in bit 1 of the second word of row 1."""
    n = len(bitmask)
    h, w = bottom - top + 1, right - left + 1
    framed = np.zeros((-(-(w + 2) // WORD_BITS) + 2, -(-h // TILE_ROWS) * TILE_ROWS + 2), dtype=np.uint64)
    for k in range(len(framed) - 2):
        start = WORD_BITS * k + left - 1
        source = start // WORD_BITS
        low = np.uint64(start % WORD_BITS)
        high = np.uint64(WORD_BITS) - low
        here = framed[k + 1, 1 : h + 1]
        if source < n:
            words = bitmask[source, top : bottom + 1]
            for r in range(h):
                here[r] = words[r] >> low
        if source + 1 < n and low > 0:
            words = bitmask[source + 1, top : bottom + 1]
            for r in range(h):
                here[r] |= words[r] << high
    return framed


@kernel(read(uint64, 2, "C"), int64, int64)
def as_bytes(framed: Words, h: int, w: int) -> Bytes:
    """Return a framed bitmask as bytes, 0 and 1, the margin included.

    Parameters
    ----------
    framed : (n, R) uint64
    h, w : int
        Size of the box.

    Returns
    -------
    (h + 2, W) uint8
    """
    across = -(-(w + 2) // _BYTE)
    pixels = np.zeros((h + 2, across), dtype=np.uint64)
    for k in range(1, len(framed) - 1):
        first = _BYTE * (k - 1)
        count = min(_BYTE, across - first)
        for r in range(1, h + 1):
            word = framed[k, r]
            if word != 0:
                for i in range(count):
                    pixels[r, first + i] = _SPREAD[word & np.uint64(0xFF)]
                    word >>= np.uint64(_BYTE)
    return pixels.view(np.uint8)


@helper
def _border_moments(framed: Words, h: int, w: int) -> tuple[int, int, int, int, int, int, int, int]:
    """Return the moments of the border pixels, see `frame`."""
    sx = sy = sxyy = syxx = sxxx = syyy = sxx = syy = 0
    one, last = np.uint64(1), np.uint64(WORD_BITS - 1)
    for k in range(1, len(framed) - 1):
        for r in range(1, h + 1):
            word = framed[k, r]
            if word == 0:
                continue
            left = (word << one) | (framed[k - 1, r] >> last)
            right = (word >> one) | (framed[k + 1, r] << last)
            edge = word & ~(left & right & framed[k, r - 1] & framed[k, r + 1])
            y = 2 * r - h - 1
            first = 2 * WORD_BITS * (k - 1) - w - 1
            n = sum_x = sum_xx = sum_xxx = 0
            while edge != 0:
                x = first + 2 * lowest_one(edge)
                edge &= edge - one
                n += 1
                sum_x += x
                sum_xx += x * x
                sum_xxx += x * x * x
            yy = y * y
            sx += sum_x
            sy += n * y
            sxyy += sum_x * yy
            syxx += y * sum_xx
            sxxx += sum_xxx
            syyy += n * y * yy
            sxx += sum_xx
            syy += n * yy
    return sx, sy, sxyy, syxx, sxxx, syyy, sxx, syy


@kernel(read(uint64, 2, "C"))
def frame(
    bitmask: Words,
) -> tuple[Bytes, Words, tuple[int, int, int, int], tuple[int, int, int, int, int, int, int, int]]:
    """Cut a bitmask to its bounding box, with an empty margin of a pixel, and measure it.

    Returns
    -------
    pixels : (h + 2, W) uint8
        0 and 1; the box's first pixel is ``[1, 1]``, W a multiple of 8. (0, 0) where there is nothing.
    framed : (n + 2, R) uint64
        The same as a bitmask: column 0 of `pixels` is the first bit of the second word, and row 0 is row 0. R is 2 more
        than a multiple of `TILE_ROWS`.
    box : left, top, h, w
        Of the box, in the columns and rows of `bitmask`, and its size.
    moments : tuple of int
        The sums of x, y, x y^2, y x^2, x^3, y^3, x^2 and y^2 over the pixels that have background on a side, measured
        from the middle of the box in half pixels, so that all are whole numbers and equal sums are exactly equal, also
        where they overflow.
    """
    left, right, top, bottom = _box(bitmask)
    if bottom < 0:
        nothing = (0, 0, 0, 0, 0, 0, 0, 0)
        return np.empty((0, 0), dtype=np.uint8), np.empty((0, 0), dtype=np.uint64), (0, 0, 0, 0), nothing
    h, w = bottom - top + 1, right - left + 1
    framed = _moved(bitmask, left, right, top, bottom)
    return as_bytes(framed, h, w), framed, (left, top, h, w), _border_moments(framed, h, w)


@inlined
def _row_sums(framed: Words, k: int, r: int, middle: int) -> tuple[int, int]:
    """Return how many of three pixels in a row are set, in binary: those beside each pixel of a word, and `middle`."""
    one, last = np.uint64(1), np.uint64(WORD_BITS - 1)
    left = (framed[k, r] << one) | (framed[k - 1, r] >> last)
    right = (framed[k, r] >> one) | (framed[k + 1, r] << last)
    either = left ^ right
    return either ^ middle, (left & right) | (either & middle)


@inlined
def _degrees(framed: Words, k: int, r: int) -> tuple[int, int, int, int]:
    """Return the number of neighbours of each pixel of a word, in binary."""
    above, aboves = _row_sums(framed, k, r - 1, framed[k, r - 1])
    beside, besides = _row_sums(framed, k, r, np.uint64(0))
    below, belows = _row_sums(framed, k, r + 1, framed[k, r + 1])
    carried = (above & beside) | (below & (above ^ beside))
    one, other = aboves ^ besides, belows ^ carried
    pair, another, third = aboves & besides, belows & carried, one & other
    return above ^ beside ^ below, one ^ other, pair ^ another ^ third, pair & another


@kernel(read(uint64, 2, "C"), int64, int64, boolean, boolean, boolean)
def list_pixels(
    framed: Words, h: int, w: int, flip_x: bool, flip_y: bool, transpose: bool
) -> tuple[npt.NDArray[np.int32], Bytes]:
    """List the pixels of a framed bitmask as ``(row, column)`` of an orientation, in ascending order, by counting.

    Parameters
    ----------
    framed : (n, R) uint64
        As `frame` makes them.
    h, w : int
        Size of the box; with its margin, rows run from 0 to ``h + 1`` and columns to ``w + 1``.
    flip_x, flip_y, transpose : bool
        The orientation: flip the columns, flip the rows, then transpose.

    Returns
    -------
    pixels_rc : (m, 2) int32
    degrees : (m,) uint8
        The number of neighbours of each.
    """
    n = len(framed)
    one = np.uint64(1)
    total = 0
    for k in range(1, n - 1):
        for r in range(1, h + 1):
            total += np.int64(count_ones(framed[k, r]))
    unsorted = np.empty((total, 3), dtype=np.int32)  # line and place in the orientation, and degree
    starts = np.zeros((w if transpose else h) + 3, dtype=np.int64)
    count = 0
    for k in range(1, n - 1):
        for r in range(1, h + 1):
            word = framed[k, r]
            if word == 0:
                continue
            ones, twos, fours, eights = _degrees(framed, k, r)
            y = h + 1 - r if flip_y else r
            while word != 0:
                j = lowest_one(word)
                word &= word - one
                column = WORD_BITS * (k - 1) + j
                x = w + 1 - column if flip_x else column
                line, place = (x, y) if transpose else (y, x)
                bit = np.uint64(j)
                degree = np.int64((ones >> bit) & one) + 2 * np.int64((twos >> bit) & one)
                degree += 4 * np.int64((fours >> bit) & one) + 8 * np.int64((eights >> bit) & one)
                unsorted[count, 0], unsorted[count, 1], unsorted[count, 2] = line, place, degree
                starts[line + 1] += 1
                count += 1
    for i in range(1, len(starts)):
        starts[i] += starts[i - 1]
    # Within a line of the orientation the pixels come in ascending order, or in descending order on a flipped axis.
    backwards = flip_y if transpose else flip_x
    pixels_rc = np.empty((total, 2), dtype=np.int32)
    degrees = np.empty(total, dtype=np.uint8)
    for i in range(total):
        source = total - 1 - i if backwards else i
        line = unsorted[source, 0]
        at = starts[line]
        pixels_rc[at, 0], pixels_rc[at, 1] = line, unsorted[source, 1]
        degrees[at] = unsorted[source, 2]
        starts[line] = at + 1
    return pixels_rc, degrees
