"""Pixels around places of the image: depth and occluders, which show what hides a cable there, and other cables."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from numba import float32, float64, int64, uint8, uint16

from dloftbs.evidence.kernels.gap_depths import DEPTH_NOISE_PER_M, pixel
from dloftbs.kernels.compiler import helper, kernel, read

HIDDEN, UNKNOWN, IN_SIGHT = 1, 0, -1
"""Answers of `OcclusionEvidence.look` for a place, codes.

Source: by definition.
"""

_DEPTH_TOLERANCE_M = 0.01
"""Least difference of depths that shows what is in front, metres.

Source: geometry; half of a thick cable, whose surface is nearer than its axis.
"""

_MIN_DEPTHS = 3
"""Least number of pixels of a place with depth, of five, that show that it is in plain sight.

Source: by definition; the majority.
"""

_CROSS = np.array([(0.0, 0.0), (0.5, 0.0), (-0.5, 0.0), (0.0, 0.5), (0.0, -0.5)])
"""Pixels of a place that are asked for their depth, from its middle, widths.

Source: geometry; the cable's middle and its edges.
"""


@helper
def _is_set(pixels: npt.NDArray[np.uint8], x: float, y: float) -> bool:
    """Return True if the pixel nearest to a place is not 0; beyond the border that of the border counts."""
    return bool(pixels[pixel(y, pixels.shape[0]), pixel(x, pixels.shape[1])] != 0)


@kernel(
    read(float64, 2), read(uint8, 2), read(uint8, 2), int64, int64, float64,
    (read(float32, 2), read(float64, 2), read(uint16, 2)), float64, float64, float64,
    read(float64, 1),
)  # fmt: skip
def look_at_pixels(
    points: npt.NDArray[np.float64],
    occluders: npt.NDArray[np.uint8],
    mask: npt.NDArray[np.uint8],
    rows: int,
    columns: int,
    reach: float,
    depth: npt.NDArray[Any],
    unit_m: float,
    nearest_m: float,
    farthest_m: float,
    expected: npt.NDArray[np.float64],
) -> npt.NDArray[np.int64]:
    """Find what hides a cable in places: by their depth, then by the occluders and the mask.

    Parameters
    ----------
    points : (n, 2) float64
        ``(x, y)`` px; those outside of the image are hidden.
    occluders, mask : (H, W) uint8
        Not 0 where something may hide cables, and where a cable is seen; (0, 0) if it is not known.
    rows, columns : int
        Size of the image.
    reach : float
        Width of the cable, px: other cables within half of it are near a place.
    depth : (H, W) float32, float64 or uint16
        Counts.
    unit_m : float
        Metres per count.
    nearest_m, farthest_m : float
        Depths outside of these are missing, and so are those that are not finite.
    expected : (n,) float64
        That of the cable, m; NaN where it is unknown, (0,) if it is everywhere: depth shows nothing there.

    Returns
    -------
    (n,) int64
        `HIDDEN`, `IN_SIGHT` or `UNKNOWN`.
    """
    told = np.zeros(len(points), dtype=np.int64)
    if len(expected):
        counts = np.empty((len(points), len(_CROSS)))
        for n in range(len(points)):
            for k in range(len(_CROSS)):
                x, y = points[n, 0] + reach * _CROSS[k, 0], points[n, 1] + reach * _CROSS[k, 1]
                counts[n, k] = depth[pixel(y, depth.shape[0]), pixel(x, depth.shape[1])]
        for n in range(len(points)):
            limit = _DEPTH_TOLERANCE_M + DEPTH_NOISE_PER_M * expected[n] * expected[n]
            nearer, farther, known = 0, 0, 0
            for k in range(len(_CROSS)):
                metres = counts[n, k] * unit_m
                if nearest_m <= metres <= farthest_m:
                    known += 1
                    nearer += metres < expected[n] - limit
                    farther += metres > expected[n] + limit
            if 2 * nearer > known:
                told[n] = HIDDEN
            elif farther == known and known >= _MIN_DEPTHS:
                told[n] = IN_SIGHT
    for n in range(len(points)):
        x, y = points[n, 0], points[n, 1]
        if not (-0.5 < x < columns - 0.5 and -0.5 < y < rows - 0.5):
            told[n] = HIDDEN
            continue
        if told[n] == UNKNOWN and occluders.size and _is_set(occluders, x, y):
            told[n] = HIDDEN
        if told[n] == IN_SIGHT and mask.size:
            half = 0.5 * reach
            beside = _is_set(mask, x, y) or _is_set(mask, x - half, y) or _is_set(mask, x + half, y)
            if beside or _is_set(mask, x, y - half) or _is_set(mask, x, y + half):
                told[n] = UNKNOWN
    return told
