"""Means of a map along straight lines through each pixel in eight directions, and beside them."""

from __future__ import annotations

import numpy as np
from numba import uint8

from dloftbs.kernels.compiler import Bytes, kernel, read, write

DIRECTIONS = 8
"""Number of directions.

Source: bounds time; a line of six widths turns by a width at its ends from one to the next.
"""
_OFFSETS = (1, 2, 3, 4, 6, 8, 11, 14)
"""Distances from the pixel that are looked at along a line, px of a map in which cables are 5 px wide.

Source: bounds time; each by half farther than the one before at most.
"""
_ENDS = (2, 4, 6, 8)
"""Numbers of these distances in lines of 1, 2, 3 and 6 widths.

Source: by definition.
"""
COUNT = 4 * len(_ENDS)
"""Number of features.

Source: by definition.
"""
_BESIDE_PX = 4
"""Distance of the lines beside, px of the same map.

Source: by definition; the ground just beside a cable.
"""
MARGIN_PX = _OFFSETS[-1] + _BESIDE_PX
"""Width of the border around a map that lines reach, px.

Source: derived.
"""


@kernel(read(uint8, 2, "C"), write(uint8, 3, "C"))
def lines_of(plane: Bytes, features: Bytes) -> None:
    """Write the features of all pixels, four for each length of lines.

    They are the greatest and the least mean along a line, the greatest difference of a line from both its sides, and
    the difference of the first line from its lower side.

    Parameters
    ----------
    plane : (H + 2 `MARGIN_PX`, W + 2 `MARGIN_PX`) uint8
        Map in which cables are 5 px wide, with a border.
    features : (COUNT, H, W) uint8
        Written; differences as ``128 + half of it``.
    """
    height, width = features.shape[1:]
    tall, wide = height + 2 * _BESIDE_PX, width + 2 * _BESIDE_PX
    reach = MARGIN_PX - _BESIDE_PX
    sums = np.empty((tall, wide), np.uint16)
    highest = np.zeros((len(_ENDS), height, width), np.int16)
    lowest = np.full((len(_ENDS), height, width), 255, np.int16)
    ridge = np.full((len(_ENDS), height, width), -256, np.int16)
    lower = np.zeros((len(_ENDS), height, width), np.int16)
    for direction in range(DIRECTIONS):
        angle = np.pi * direction / DIRECTIONS
        along_r, along_c = np.sin(angle), np.cos(angle)
        side_r, side_c = int(np.rint(_BESIDE_PX * along_c)), int(np.rint(-_BESIDE_PX * along_r))
        for row in range(tall):
            for column in range(wide):
                sums[row, column] = plane[row + reach, column + reach]
        done = 0
        for k in range(len(_ENDS)):
            while done < _ENDS[k]:
                step_r, step_c = int(np.rint(_OFFSETS[done] * along_r)), int(np.rint(_OFFSETS[done] * along_c))
                for row in range(tall):
                    ahead = plane[row + reach + step_r, reach + step_c : reach + step_c + wide]
                    behind = plane[row + reach - step_r, reach - step_c : reach - step_c + wide]
                    into = sums[row]
                    for column in range(wide):
                        into[column] += np.uint16(ahead[column]) + np.uint16(behind[column])
                done += 1
            scale = np.float32(1.0 / (2 * done + 1))
            for row in range(height):
                at = row + _BESIDE_PX
                middle = sums[at, _BESIDE_PX : _BESIDE_PX + width]
                one = sums[at + side_r, _BESIDE_PX + side_c : _BESIDE_PX + side_c + width]
                other = sums[at - side_r, _BESIDE_PX - side_c : _BESIDE_PX - side_c + width]
                high, low, apart, beside = highest[k, row], lowest[k, row], ridge[k, row], lower[k, row]
                for column in range(width):
                    mean = np.int16(np.float32(middle[column]) * scale)
                    left, right = np.int16(np.float32(one[column]) * scale), np.int16(np.float32(other[column]) * scale)
                    is_first = mean > high[column]
                    high[column] = mean if is_first else high[column]
                    beside[column] = mean - min(left, right) if is_first else beside[column]
                    low[column] = min(low[column], mean)
                    apart[column] = max(apart[column], mean - max(left, right))
    for k in range(len(_ENDS)):
        for row in range(height):
            for column in range(width):
                features[4 * k, row, column] = highest[k, row, column]
                features[4 * k + 1, row, column] = lowest[k, row, column]
                features[4 * k + 2, row, column] = (ridge[k, row, column] + 256) >> 1
                features[4 * k + 3, row, column] = (lower[k, row, column] + 256) >> 1
