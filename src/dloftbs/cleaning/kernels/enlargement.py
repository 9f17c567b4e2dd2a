"""Factor by which a mask was enlarged by repeating its pixels: its rows and columns then change in steps of that."""

from __future__ import annotations

import numpy as np
from numba import uint64

from dloftbs.kernels.compiler import Words, helper, kernel, read
from dloftbs.kernels.shared.bitmask_layout import WORD_BITS

_FEWEST_CHANGES = 16
"""Number of rows, and of columns, at which a mask must change to show that it was enlarged.

Source: by hand; what is drawn along the axes changes at fewer, and has no steps.
"""


@helper
def _divisor(a: int, b: int) -> int:
    """Return the greatest common divisor of two numbers, the second one not 0."""
    while a != 0:
        a, b = b % a, a
    return b


@helper
def _row_step(bitmask: Words) -> int:
    """Return the greatest step between the rows at which a mask changes; 1 where it changes at few."""
    step, last, changes = 0, -1, 0
    for row in range(1, bitmask.shape[1]):
        for k in range(len(bitmask)):
            if bitmask[k, row] != bitmask[k, row - 1]:
                if last >= 0:
                    step = _divisor(step, row - last)
                    if step == 1:
                        return 1
                last = row
                changes += 1
                break
    return step if changes >= _FEWEST_CHANGES else 1


@helper
def _column_step(bitmask: Words) -> int:
    """Return the greatest step between the columns at which a mask changes; 1 where it changes at few."""
    step, last, changes = 0, -1, 0
    for k in range(len(bitmask)):
        together = np.uint64(0)
        for row in range(bitmask.shape[1]):
            before = bitmask[k - 1, row] >> np.uint64(WORD_BITS - 1) if k > 0 else np.uint64(0)
            together |= bitmask[k, row] ^ (bitmask[k, row] << np.uint64(1) | before)
        for bit in range(WORD_BITS):
            if (together >> np.uint64(bit)) & np.uint64(1):
                column = k * WORD_BITS + bit
                if last >= 0:
                    step = _divisor(step, column - last)
                    if step == 1:
                        return 1
                last = column
                changes += 1
    return step if changes >= _FEWEST_CHANGES else 1


@kernel(read(uint64, 2, "C"))
def enlargement(bitmask: Words) -> int:
    """Return by how much a mask was enlarged, 1 if it was not.

    Parameters
    ----------
    bitmask : (n, R) uint64
        See `dloftbs.kernels.bitmask`.
    """
    rows = _row_step(bitmask)
    return rows if rows == 1 else _divisor(rows, _column_step(bitmask))
