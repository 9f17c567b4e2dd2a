"""Heights above a plane as integers, and what stands out among them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import float32, float64, uint8, uint16

from dloftbs.kernels.compiler import Bytes, Floats, kernel, read, write

QUANTUM_M = 2e-5
"""Step of integer heights, metres.

Source: derived; a fiftieth of the noise of a depth camera, and 16 bits reach farther than a hand.
"""
ON_PLANE = 20_000
"""Integer height of the plane itself, steps: 0.4 m below it and 0.9 m above it can be known.

Source: derived from `QUANTUM_M`.
"""
MISSING = 0
"""Integer height where there is no depth, steps.

Source: by definition.
"""
_LARGEST = 65_535
"""Largest integer height, steps.

Source: by definition, that of 16 bits.
"""


@kernel(read(float32, 1, "C"), read(float32, 2, "C"), read(float64, 1, "C"), write(uint16, 1, "C"))
def measure_heights(
    depth_m: npt.NDArray[np.float32], rays: npt.NDArray[np.float32], plane: Floats, heights: npt.NDArray[np.uint16]
) -> None:
    """Write the height of each pixel above a plane, towards the camera.

    Parameters
    ----------
    depth_m : (n,) float32
        NaN where missing.
    rays : (3, n) float32
        Point seen by each pixel, over its depth.
    plane : (3,) float64
        Its product with a point of the plane is 1. Not 0.
    heights : (n,) uint16
        Written: `ON_PLANE` plus the height over `QUANTUM_M`, rounded and kept in range, or `MISSING`.
    """
    a, b, c = np.float32(plane[0]), np.float32(plane[1]), np.float32(plane[2])
    length = np.sqrt(plane[0] ** 2 + plane[1] ** 2 + plane[2] ** 2)
    scale = np.float32(1.0 / (length * QUANTUM_M))
    middle = np.float32(ON_PLANE + 0.5)
    for i in range(len(depth_m)):
        inverse = a * rays[0, i] + b * rays[1, i] + c * rays[2, i]
        height = middle + (np.float32(1.0) - depth_m[i] * inverse) * scale
        height = min(max(height, np.float32(MISSING + 1)), np.float32(_LARGEST))
        heights[i] = np.uint16(height) if depth_m[i] == depth_m[i] else np.uint16(MISSING)


@kernel(read(uint16, 1, "C"), read(uint16, 1, "C"), uint16, float64, write(uint8, 1, "C"))
def mark_standing(
    heights: npt.NDArray[np.uint16], highest: npt.NDArray[np.uint16], least: np.uint16, share: float, mask: Bytes
) -> None:
    """Write 1 where a pixel is high, and not much lower than the highest one beside it, else 0.

    Parameters
    ----------
    heights, highest : (n,) uint16
        As `measure_heights` has them; the highest beside each.
    least : uint16
        Heights are more than it.
    share : float
        Of the highest height above the plane, which a height is more than.
    mask : (n,) uint8
        Written.
    """
    part = np.float32(share)
    offset = np.float32(ON_PLANE) * (np.float32(1.0) - part)
    for i in range(len(heights)):
        is_high = np.float32(heights[i]) > np.float32(highest[i]) * part + offset
        mask[i] = np.uint8((heights[i] > least) & is_high)
