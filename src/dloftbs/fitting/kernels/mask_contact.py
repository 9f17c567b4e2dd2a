"""Whether points lie on a mask, or beside it."""

from __future__ import annotations

import numpy as np
from numba import float64, int64, uint8

from dloftbs.kernels.compiler import Bools, Bytes, Floats, helper, kernel, read


@helper
def _is_near(mask: Bytes, x: float, y: float, reach: float) -> bool:
    """Return whether a place lies on the mask, or no farther beside it than `reach`, px."""
    rows, columns = mask.shape
    column, row = int(np.floor(x + 0.5)), int(np.floor(y + 0.5))
    if 0 <= row < rows and 0 <= column < columns and mask[row, column] != 0:
        return True
    for r in range(max(int(np.floor(y - reach)), 0), min(int(np.ceil(y + reach)) + 1, rows)):
        for c in range(max(int(np.floor(x - reach)), 0), min(int(np.ceil(x + reach)) + 1, columns)):
            if mask[r, c] != 0:
                across, along = max(abs(c - x) - 0.5, 0.0), max(abs(r - y) - 0.5, 0.0)
                if across * across + along * along <= reach * reach:
                    return True
    return False


@kernel(read(float64, 2), read(uint8, 2), float64)
def stays_on_mask(points: Floats, mask: Bytes, reach: float) -> bool:
    """Return whether a curve surely lies on the mask, or no farther beside it than `reach`, between its points, too.

    Parameters
    ----------
    points : (n, 2) float64
        Along the curve, px.
    mask : (H, W) uint8
    reach : float
        px, to the edges of the pixels.

    Returns
    -------
    bool
    """
    before = 0.0
    for k in range(len(points)):
        after = 0.0
        if k + 1 < len(points):
            after = np.sqrt((points[k + 1, 0] - points[k, 0]) ** 2 + (points[k + 1, 1] - points[k, 1]) ** 2)
        left = reach - 0.5 * max(before, after)
        if left < 0.0 or not _is_near(mask, points[k, 0], points[k, 1], left):
            return False
        before = after
    return True


@kernel(read(float64, 2), read(uint8, 2), float64)
def lie_on_mask(points: Floats, mask: Bytes, reach: float) -> Bools:
    """Return which points (n,) lie on the mask, or no farther beside it than `reach`; as `stays_on_mask` takes them."""
    on = np.empty(len(points), dtype=np.bool_)
    for k in range(len(points)):
        on[k] = _is_near(mask, points[k, 0], points[k, 1], reach)
    return on


@kernel(read(float64, 2), read(uint8, 2), int64, int64)
def leaves_mask(points: Floats, mask: Bytes, left: int, top: int) -> tuple[int, int]:
    """Return the first and the last point that lies beside the mask; the number of points and -1 if none does.

    Parameters
    ----------
    points : (n, 2) float64
        In the image, px.
    mask : (H, W) uint8
        A part of the image, 0 and 1.
    left, top : int
        Column and row of its first pixel in the image.
    """
    rows, columns = mask.shape
    first, last = len(points), -1
    for k in range(len(points)):
        column, row = int(np.floor(points[k, 0] - left + 0.5)), int(np.floor(points[k, 1] - top + 0.5))
        if not (0 <= row < rows and 0 <= column < columns and mask[row, column] != 0):
            first, last = min(first, k), k
    return first, last
