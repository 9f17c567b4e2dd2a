"""Colour to mask through a table of all colours, with a small table in front that stays in the fastest cache."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import uint8

from dloftbs.kernels._compile import kernel, read, write

NONE, ALL, MIXED = 0, 1, 2
"""What a coarse cell says of its 512 colours."""


@kernel(read(uint8, 3, "C"), read(uint8, 1), read(uint8, 1), write(uint8, 2, "C"))
def look_up(
    image: npt.NDArray[np.uint8],
    coarse: npt.NDArray[np.uint8],
    fine: npt.NDArray[np.uint8],
    mask: npt.NDArray[np.uint8],
) -> None:
    """Write 1 where a pixel's colour is in the table, else 0.

    Parameters
    ----------
    image : (H, W, 3) uint8
        BGR.
    coarse : (2**15,) uint8
        `NONE`, `ALL` or `MIXED` for the cell ``r >> 3 << 10 | g >> 3 << 5 | b >> 3``.
    fine : (2**21,) uint8
        One bit a colour: bit ``b & 7`` of byte ``r << 13 | g << 5 | b >> 3``.
    mask : (H, W) uint8
        Written.
    """
    rows, columns, _ = image.shape
    for row in range(rows):
        for column in range(columns):
            b = np.uint32(image[row, column, 0])
            g = np.uint32(image[row, column, 1])
            r = np.uint32(image[row, column, 2])
            cell = coarse[
                ((r & np.uint32(0xF8)) << np.uint32(7)) | ((g & np.uint32(0xF8)) << np.uint32(2)) | (b >> np.uint32(3))
            ]
            if cell == MIXED:
                byte = fine[(r << np.uint32(13)) | (g << np.uint32(5)) | (b >> np.uint32(3))]
                cell = (byte >> (b & np.uint32(7))) & np.uint8(1)
            mask[row, column] = cell
