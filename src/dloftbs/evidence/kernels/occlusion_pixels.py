"""Pixels around places of the image: occluders, which may hide a cable there, and other cables."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import float64, int64, uint8

from dloftbs.kernels.compiler import helper, kernel, read, write


@helper
def _is_set(pixels: npt.NDArray[np.uint8], x: float, y: float) -> bool:
    """Return True if the pixel nearest to a place is not 0; beyond the border that of the border counts."""
    row = min(max(int(np.rint(y)), 0), pixels.shape[0] - 1)
    column = min(max(int(np.rint(x)), 0), pixels.shape[1] - 1)
    return bool(pixels[row, column] != 0)


@kernel(read(float64, 2), read(uint8, 2), read(uint8, 2), float64, int64, int64, write(int64, 1))
def look_around(
    points: npt.NDArray[np.float64],
    occluders: npt.NDArray[np.uint8],
    mask: npt.NDArray[np.uint8],
    reach: float,
    hidden: int,
    in_sight: int,
    told: npt.NDArray[np.int64],
) -> None:
    """Tell what hides places, of which depth may have told already.

    Parameters
    ----------
    points : (n, 2) float64
        ``(x, y)`` px.
    occluders, mask : (H, W) uint8
        Not 0 where something may hide cables, and where a cable is seen; (0, 0) if it is not known.
    reach : float
        Distance in which occluders are near a place, px; cables are in half of it.
    hidden, in_sight : int
        Codes of places that something hides, and that are in plain sight and empty; 0 is unknown.
    told : (n,) int64
        What depth told; written.
    """
    for n in range(len(points)):
        x, y = points[n, 0], points[n, 1]
        if told[n] == 0 and occluders.size:
            near = False
            for dy in (-reach, 0.0, reach):
                for dx in (-reach, 0.0, reach):
                    near |= _is_set(occluders, x + dx, y + dy)
            told[n] = hidden if _is_set(occluders, x, y) else 0 if near else in_sight
        if told[n] == in_sight and mask.size:
            half = 0.5 * reach
            beside = _is_set(mask, x, y) or _is_set(mask, x - half, y) or _is_set(mask, x + half, y)
            if beside or _is_set(mask, x, y - half) or _is_set(mask, x, y + half):
                told[n] = 0
