"""Means of a map along straight lines through a pixel in eight directions, and beside them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import int64, uint8

from dloftbs.kernels.compiler import inlined, kernel, read, write

DIRECTIONS = 8
"""Number of directions.

Source: bounds time; a line of seven widths turns by a width at its ends from one to the next.
"""
_OFFSETS = (1, 2, 3, 4, 6, 8, 11, 14)
"""Distances from the pixel that are looked at along a line, px of a map in which cables are 4 px wide.

Source: bounds time; each by half farther than the one before at most.
"""
_ENDS = (2, 4, 6, 8)
"""Numbers of these distances in lines of 1, 2, 4 and 7 widths.

Source: by definition.
"""
COUNT = 4 * len(_ENDS)
"""Number of features.

Source: by definition.
"""
_BESIDE_PX = 4
"""Distance of the lines beside, px of the same map.

Source: by definition, the cable's width.
"""


@inlined
def _at(plane: npt.NDArray[np.uint8], row: float, column: float) -> int:
    r = min(max(int(row + 0.5), 0), plane.shape[0] - 1)
    c = min(max(int(column + 0.5), 0), plane.shape[1] - 1)
    return int(plane[r, c])


@kernel(read(uint8, 2), read(int64, 1), write(uint8, 2))
def lines_at(plane: npt.NDArray[np.uint8], pixels: npt.NDArray[np.int64], features: npt.NDArray[np.uint8]) -> None:
    """Write the features of listed pixels, four for each length of lines.

    They are the greatest and the least mean along a line, the greatest difference of a line from both its sides, and
    the difference of the first line from its lower side.

    Parameters
    ----------
    plane : (H, W) uint8
        Map in which cables are 4 px wide.
    pixels : (n,) int64
        Flat numbers of pixels.
    features : (n, COUNT) uint8
        Written; differences as ``128 + half of it``.
    """
    width = plane.shape[1]
    sums = np.empty(3, np.int64)
    highest, lowest = np.empty(len(_ENDS), np.int64), np.empty(len(_ENDS), np.int64)
    ridge, lower = np.empty(len(_ENDS), np.int64), np.empty(len(_ENDS), np.int64)
    for i in range(len(pixels)):
        row, column = float(pixels[i] // width), float(pixels[i] % width)
        highest[:], lowest[:], ridge[:], lower[:] = -1, 256, -256, 0
        for direction in range(DIRECTIONS):
            angle = np.pi * direction / DIRECTIONS
            along_r, along_c = np.sin(angle), np.cos(angle)
            for side in range(3):
                away = float(_BESIDE_PX * (side - 1))
                sums[side] = _at(plane, row + away * along_c, column - away * along_r)
            done = 0
            for k in range(len(_ENDS)):
                while done < _ENDS[k]:
                    for side in range(3):
                        away = float(_BESIDE_PX * (side - 1))
                        r, c = row + away * along_c, column - away * along_r
                        step = float(_OFFSETS[done])
                        sums[side] += _at(plane, r + step * along_r, c + step * along_c)
                        sums[side] += _at(plane, r - step * along_r, c - step * along_c)
                    done += 1
                number = 2 * done + 1
                mean, left, right = sums[1] // number, sums[0] // number, sums[2] // number
                if mean > highest[k]:
                    highest[k], lower[k] = mean, mean - min(left, right)
                lowest[k] = min(lowest[k], mean)
                ridge[k] = max(ridge[k], mean - max(left, right))
        for k in range(len(_ENDS)):
            features[i, 4 * k], features[i, 4 * k + 1] = highest[k], lowest[k]
            features[i, 4 * k + 2], features[i, 4 * k + 3] = (ridge[k] + 256) >> 1, (lower[k] + 256) >> 1
