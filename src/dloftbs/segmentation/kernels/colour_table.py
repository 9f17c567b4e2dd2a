"""Colour to mask through a table of all colours, with a small table in front that stays in the cache."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import uint8

from dloftbs.kernels.compiler import Bytes, inlined, kernel, read, write

NONE, ALL, MIXED = 0, 1, 2
"""Share of a coarse cell's 256 colours that are in range: none, all, or some.

Source: by definition.
"""

_BLOCK = 1024
"""Pixels that are looked up together.

Source: bounds time; their cells stay in the fastest cache.
"""
_WORD = 8
"""Pixels that are tested at once.

Source: by definition, the bytes of a word.
"""
_ANY_MIXED = sum(MIXED << (8 * k) for k in range(_WORD))
"""Code of a word of pixels that are all mixed.

Source: derived.
"""


@inlined
def _place(image: Bytes, first: int, count: int, cells: npt.NDArray[np.uint16]) -> None:
    """Write the coarse cell of some pixels, several at once."""
    pixels = image[3 * first : 3 * (first + count)]
    for i in range(count):
        b, g, r = np.uint16(pixels[3 * i]), np.uint16(pixels[3 * i + 1]), np.uint16(pixels[3 * i + 2])
        red = (r & np.uint16(0xF8)) << np.uint16(8)
        green = (g & np.uint16(0xFC)) << np.uint16(3)
        cells[i] = red | green | (b >> np.uint16(3))


@inlined
def _list_mixed(found: Bytes, mixed: npt.NDArray[np.uint16]) -> int:
    """List where MIXED was found; return how often. Few are; others are passed eight at a time."""
    count = np.uint64(0)
    words = found[: len(found) - len(found) % _WORD].view(np.uint64)
    for k in range(len(words)):
        if words[k] & np.uint64(_ANY_MIXED):
            for i in range(_WORD * k, _WORD * (k + 1)):
                mixed[count] = i
                count += np.uint64(found[i] == MIXED)
    for i in range(_WORD * len(words), len(found)):
        mixed[count] = i
        count += np.uint64(found[i] == MIXED)
    return count


@kernel(read(uint8, 1, "C"), read(uint8, 1, "C"), read(uint8, 1, "C"), write(uint8, 1, "C"))
def look_up(image: Bytes, coarse: Bytes, fine: Bytes, mask: Bytes) -> None:
    """Write 1 where a pixel's colour is in the table, else 0.

    Parameters
    ----------
    image : (3 n,) uint8
        Blue, green, red, pixel after pixel.
    coarse : (2**16,) uint8
        `NONE`, `ALL` or `MIXED` for the cell ``r >> 3 << 11 | g >> 2 << 5 | b >> 3``.
    fine : (2**21,) uint8
        One bit a colour: bit ``b & 7`` of byte ``r << 13 | g << 5 | b >> 3``.
    mask : (n,) uint8
        Written.
    """
    cells = np.empty(_BLOCK, dtype=np.uint16)
    mixed = np.empty(_BLOCK + 1, dtype=np.uint16)
    for first in range(0, len(mask), _BLOCK):
        found = mask[first : first + _BLOCK]
        _place(image, first, len(found), cells)
        for i in range(len(found)):
            found[i] = coarse[cells[i]]
        for k in range(_list_mixed(found, mixed)):
            i = np.uint64(mixed[k])  # unsigned indices spare numba's test for negative ones
            j = np.uint64(3) * (np.uint64(first) + i)
            b, g, r = np.uint64(image[j]), np.uint64(image[j + np.uint64(1)]), np.uint64(image[j + np.uint64(2)])
            byte = fine[(r << np.uint64(13)) | (g << np.uint64(5)) | (b >> np.uint64(3))]
            found[i] = (byte >> (b & np.uint64(7))) & np.uint64(1)
