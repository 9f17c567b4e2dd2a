"""The moments of a mask's border, which choose its pose."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import int32, int64

from dloftbs.kernels._compile import kernel, read


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
