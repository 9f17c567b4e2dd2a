"""Width of the ground in a mask at a pixel, and of the mask at both of its sides."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from dloftbs.kernels.compiler import helper, inlined
from dloftbs.kernels.shared.bitmask_layout import WORD_BITS

_Words = npt.NDArray[np.uint64]


@inlined
def _get(bitmask: _Words, r: int, c: int) -> bool:
    """Tell whether a pixel is set."""
    return (bitmask[(c + WORD_BITS) >> 6, r] >> np.uint64(c & 63)) & np.uint64(1) != 0


@inlined
def _run(bitmask: _Words, rows: int, columns: int, r: int, c: int, down: int, right: int, is_set: bool) -> int:
    """Return how many pixels from one on are all set, or all not."""
    count = 0
    while 0 <= r < rows and 0 <= c < columns and _get(bitmask, r, c) == is_set:
        r, c, count = r + down, c + right, count + 1
    return count


@inlined
def _thickness(bitmask: _Words, rows: int, columns: int, r: int, c: int, down: int, right: int) -> int:
    """Return how thick the mask is at a pixel where one enters it: the less of what lies ahead and across, px."""
    ahead = _run(bitmask, rows, columns, r, c, down, right, True)
    across = _run(bitmask, rows, columns, r, c, right, down, True)
    return min(ahead, max(across + _run(bitmask, rows, columns, r, c, -right, -down, True) - 1, 0))


@inlined
def _look(bitmask: _Words, rows: int, columns: int, r: int, c: int, down: int, right: int) -> tuple[int, int]:
    """Return how wide the ground is at a pixel along a row or a column, and the mask at both of its sides together."""
    ahead = _run(bitmask, rows, columns, r, c, down, right, False)
    behind = _run(bitmask, rows, columns, r, c, -down, -right, False)
    thickness = _thickness(bitmask, rows, columns, r + ahead * down, c + ahead * right, down, right)
    thickness += _thickness(bitmask, rows, columns, r - behind * down, c - behind * right, -down, -right)
    return ahead + behind - 1, thickness


@helper
def look_across(bitmask: _Words, rows: int, columns: int, r: int, c: int) -> tuple[int, int]:
    """Return how wide ground and the mask beside it are at a pixel, along the row or the column with less ground."""
    along, mask_along = _look(bitmask, rows, columns, r, c, 0, 1)
    down, mask_down = _look(bitmask, rows, columns, r, c, 1, 0)
    if along < down or (along == down and mask_along > mask_down):
        return along, mask_along
    return down, mask_down
