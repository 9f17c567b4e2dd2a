"""Colours of a cable."""

from __future__ import annotations

import numpy as np
from numba import boolean, float64, uint8

from dloftbs.evidence.kernels.colours import BLOCK_WIDTHS, block_mean
from dloftbs.kernels.compiler import Bools, Bytes, Floats, kernel, read
from dloftbs.kernels.shared.selection import median_of

_MAX_SAMPLES = 24
"""Largest number of places along a cable where it is sampled.

Source: bounds time and memory.
"""


@kernel(read(uint8, 3), read(float64, 2), read(boolean, 1), float64)
def sample_appearance(image: Bytes, points: Floats, seen: Bools, width: float) -> tuple[Floats, Floats]:
    """Sample the colours along a cable.

    Parameters
    ----------
    image : (h, w, 3) uint8
    points : (n, 2) float64
        Along the cable, ``(x, y)`` px; two or more.
    seen : (n,) bool
        False where it is hidden: nothing is sampled there.
    width : float
        px; NaN if it is unknown: single pixels are sampled.

    Returns
    -------
    cable : (k, 3) float64
    colour : (3,) float64
        The median colour; NaN without samples.
    """
    half = int(BLOCK_WIDTHS * width) if width > 0.0 else 0
    cable, cables = np.empty((_MAX_SAMPLES, 3)), 0
    step = max((len(points) - 1) // _MAX_SAMPLES + 1, 1)
    for k in range(step // 2, len(points), step):
        if seen[k] and cables < _MAX_SAMPLES:
            cables += block_mean(image, points[k, 0], points[k, 1], half, cable[cables])
    colour = np.full(3, np.nan)
    if cables > 0:
        for c in range(3):
            colour[c] = median_of(cable[:cables, c])
    return cable[:cables].copy(), colour
