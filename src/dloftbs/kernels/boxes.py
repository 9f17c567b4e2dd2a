"""Where a mask lies: its box, the moments of its border, which choose its pose, and its pixels in that pose."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import boolean, int32, int64, uint8, uint64

from dloftbs.kernels._compile import helper, kernel, read


@kernel(read(uint64, 2, "C"))
def word_box(words: npt.NDArray[np.uint64]) -> tuple[int, int, int, int]:
    """Return the box ``k0, row0, k1, row1`` of the words that are not 0, the last two excluded; or four times 0.

    Parameters
    ----------
    words : (H, W / 8) uint64
        A mask, eight pixels a word.
    """
    rows, columns = words.shape
    across = np.zeros(columns, dtype=np.uint64)
    row0, row1 = 0, 0
    for row in range(rows):
        line = words[row]
        together = np.uint64(0)
        for k in range(columns):
            together |= line[k]
        if together != 0:
            for k in range(columns):
                across[k] |= line[k]
            if row1 == 0:
                row0 = row
            row1 = row + 1
    k0, k1 = 0, 0
    for k in range(columns):
        if across[k] != 0:
            if k1 == 0:
                k0 = k
            k1 = k + 1
    return k0, row0, k1, row1


@helper
def _is_empty(line: npt.NDArray[np.uint8]) -> bool:
    for value in line:
        if value != 0:
            return False
    return True


@kernel(read(uint8, 2))
def tight_box(mask: npt.NDArray[np.uint8]) -> tuple[int, int, int, int]:
    """Return the box ``x0, y0, x1, y1`` of the foreground, the last two excluded; all 0 where there is none.

    Looks inwards from the four sides, so it is fast where the box fills most of the mask.

    Parameters
    ----------
    mask : (H, W) uint8
        Any non-zero is foreground.
    """
    y1, width = mask.shape
    y0 = 0
    while y0 < y1 and _is_empty(mask[y0]):
        y0 += 1
    if y0 == y1:
        return 0, 0, 0, 0
    while _is_empty(mask[y1 - 1]):
        y1 -= 1
    x0, x1 = width, 0
    for row in range(y0, y1):
        column = 0
        while column < x0 and mask[row, column] == 0:
            column += 1
        x0 = column
        column = width
        while column > x1 and mask[row, column - 1] == 0:
            column -= 1
        x1 = column
    return x0, y0, x1, y1


@kernel(read(int32, 1), int64, int64, int64)
def border_moments(
    border: npt.NDArray[np.int32], stride: int, h: int, w: int
) -> tuple[int, int, int, int, int, int, int, int]:
    """Return the sums of x, y, x y^2, y x^2, x^3, y^3, x^2 and y^2 over pixels, measured from the middle of a box.

    In half pixels, so that all are whole numbers and equal sums are exactly equal, also where they overflow.

    Parameters
    ----------
    border : (n,) int32
        Flat indices ``row * stride + column``, ascending; the box's first row and column are 1.
    stride : int
    h, w : int
        Size of the box.
    """
    sx = sy = sxyy = syxx = sxxx = syyy = sxx = syy = 0
    row = 0
    for p in border:
        while p >= (row + 1) * stride:  # cheaper than a division
            row += 1
        y = 2 * row - h - 1
        x = 2 * (p - row * stride) - w - 1
        xx, yy = x * x, y * y
        sx += x
        sy += y
        sxyy += x * yy
        syxx += y * xx
        sxxx += x * xx
        syyy += y * yy
        sxx += xx
        syy += yy
    return sx, sy, sxyy, syxx, sxxx, syyy, sxx, syy


@kernel(read(int32, 1), int64, int64, int64, boolean, boolean, boolean)
def pose_pixels(
    flat: npt.NDArray[np.int32], stride: int, h: int, w: int, flip_x: bool, flip_y: bool, transpose: bool
) -> npt.NDArray[np.int32]:
    """Turn flat indices into ``(row, column)`` of a pose, in ascending order there, by counting.

    Parameters
    ----------
    flat : (n,) int32
        ``row * stride + column``, ascending.
    stride : int
    h, w : int
        Size of the box; with its margin, rows run from 0 to ``h + 1`` and columns to ``w + 1``.
    flip_x, flip_y, transpose : bool
        The pose: flip the columns, flip the rows, then transpose.

    Returns
    -------
    (n, 2) int32
    """
    n = len(flat)
    unsorted = np.empty((n, 2), dtype=np.int32)
    starts = np.zeros((w if transpose else h) + 3, dtype=np.int64)
    row = 0
    for i in range(n):
        while flat[i] >= (row + 1) * stride:
            row += 1
        column = flat[i] - row * stride
        y = h + 1 - row if flip_y else row
        x = w + 1 - column if flip_x else column
        unsorted[i, 0], unsorted[i, 1] = (x, y) if transpose else (y, x)
        starts[unsorted[i, 0] + 1] += 1
    for i in range(1, len(starts)):
        starts[i] += starts[i - 1]
    # Within a line of the pose the pixels come in ascending order, or in descending order where that axis is flipped.
    backwards = flip_y if transpose else flip_x
    posed = np.empty((n, 2), dtype=np.int32)
    for k in range(n):
        i = n - 1 - k if backwards else k
        line = unsorted[i, 0]
        posed[starts[line], 0] = line
        posed[starts[line], 1] = unsorted[i, 1]
        starts[line] += 1
    return posed
