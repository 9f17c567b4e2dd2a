"""Colour to mask through a table of all colours, with a small table in front that stays in the cache."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import uint8

from dloftbs.kernels._compile import kernel, read, write

NONE, ALL, MIXED = 0, 1, 2
"""What a coarse cell says of its 64 colours."""


@kernel(read(uint8, 1, "C"), read(uint8, 1, "C"), read(uint8, 1, "C"), write(uint8, 1, "C"))
def look_up(
    image: npt.NDArray[np.uint8],
    coarse: npt.NDArray[np.uint8],
    fine: npt.NDArray[np.uint8],
    mask: npt.NDArray[np.uint8],
) -> None:
    """Write 1 where a pixel's colour is in the table, else 0.

    Parameters
    ----------
    image : (3 n,) uint8
        Blue, green, red, pixel after pixel.
    coarse : (2**18,) uint8
        `NONE`, `ALL` or `MIXED` for the cell ``r >> 2 << 12 | g >> 2 << 6 | b >> 2``.
    fine : (2**21,) uint8
        One bit a colour: bit ``b & 7`` of byte ``r << 13 | g << 5 | b >> 3``.
    mask : (n,) uint8
        Written.
    """
    one, two, three = np.uint64(1), np.uint64(2), np.uint64(3)  # unsigned indices spare a test for negative ones
    j = np.uint64(0)
    for i in range(np.uint64(mask.size)):
        b, g, r = np.uint64(image[j]), np.uint64(image[j + one]), np.uint64(image[j + two])
        j += three
        cell = coarse[((r & np.uint64(0xFC)) << np.uint64(10)) | ((g & np.uint64(0xFC)) << np.uint64(4)) | (b >> two)]
        if cell == MIXED:
            byte = fine[(r << np.uint64(13)) | (g << np.uint64(5)) | (b >> three)]
            cell = (byte >> (b & np.uint64(7))) & np.uint8(1)
        mask[i] = cell
