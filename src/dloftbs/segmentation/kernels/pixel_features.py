"""Features of listed pixels: colour, colour less its surroundings, and ridges at three scales; one byte each."""

from __future__ import annotations

import numpy as np
from numba import int64, uint8

from dloftbs.kernels.compiler import Bytes, Ints, inlined, kernel, read, write

STEPS = (1, 3, 5)
"""Distances over which second differences are taken, px.

Source: derived; a fifth, three fifths and the whole of `canonical.WIDTH_PX`, so that cables of half to twice
the usual width are ridges at one of them.
"""
COUNT = 9 + 4 * len(STEPS)
"""Number of features.

Source: by definition: three channels, twice less their surroundings, and four ridges a step.
"""
_ZERO = 128
"""Level of 255 of a signed feature that is zero.

Source: by definition.
"""


@inlined
def _byte(value: float) -> np.uint8:
    return np.uint8(min(max(value, 0.0), 255.0))


@inlined
def _clamped(value: int, count: int) -> int:
    return min(max(value, 0), count - 1)


@kernel(
    read(uint8, 3, "C"), read(uint8, 3, "C"), read(uint8, 3, "C"), read(uint8, 3, "C"), read(int64, 1), write(uint8, 2)
)
def features_at(fine: Bytes, smooth: Bytes, near: Bytes, far: Bytes, pixels: Ints, features: Bytes) -> None:
    """Write the features of each pixel.

    Parameters
    ----------
    fine, smooth, near, far : (H, W, 3) uint8
        Lightness and two tints, smoothed ever more: by less than a pixel, for second differences, over the surroundings
        and farther.
    pixels : (n,) int64
        Flat numbers of pixels.
    features : (COUNT, n) uint8
        Written.
    """
    height, width = fine.shape[:2]
    for i in range(len(pixels)):
        row, column = pixels[i] // width, pixels[i] % width
        for channel in range(3):
            own = int(fine[row, column, channel])
            features[channel, i] = own
            features[3 + channel, i] = (own - int(near[row, column, channel]) + 256) >> 1
            features[6 + channel, i] = (own - int(far[row, column, channel]) + 256) >> 1
        at = 9
        for step in STEPS:
            up, down = _clamped(row - step, height), _clamped(row + step, height)
            left, right = _clamped(column - step, width), _clamped(column + step, width)
            for channel in range(3):
                middle = 2 * int(smooth[row, column, channel])
                xx = float(int(smooth[row, left, channel]) + int(smooth[row, right, channel]) - middle)
                yy = float(int(smooth[up, column, channel]) + int(smooth[down, column, channel]) - middle)
                xy = 0.25 * float(
                    int(smooth[up, left, channel])
                    + int(smooth[down, right, channel])
                    - int(smooth[up, right, channel])
                    - int(smooth[down, left, channel])
                )
                mean, spread = 0.5 * (xx + yy), np.sqrt(0.25 * (xx - yy) ** 2 + xy * xy)
                across = mean + spread if mean >= 0.0 else mean - spread
                features[at, i] = _byte(_ZERO + across)
                at += 1
                if channel == 0:
                    features[at, i] = _byte(_ZERO + 2.0 * mean - across)
                    at += 1
