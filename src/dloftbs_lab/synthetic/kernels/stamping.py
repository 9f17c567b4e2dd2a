"""Drawing discs into a mask, so that a dense row of them is a cable of changing width."""

from __future__ import annotations

import math

from numba import boolean, float64

from dloftbs.kernels.compiler import Bools, Floats, kernel, read, write


@kernel(read(float64, 2), read(float64, 1), write(boolean, 2, "C"))
def stamp_discs(centres: Floats, radii: Floats, mask: Bools) -> None:
    """Set the pixels whose centre lies in a disc.

    Not checked: the numbers of centres and radii agree, and no radius is negative.

    Parameters
    ----------
    centres : (n, 2) float64
        ``(x, y)`` px; discs may leave the image.
    radii : (n,) float64
        Px.
    mask : (H, W) bool
    """
    rows, columns = mask.shape
    for k in range(len(radii)):
        x, y, radius = centres[k, 0], centres[k, 1], radii[k]
        left, right = max(math.floor(x - radius), 0), min(math.ceil(x + radius), columns - 1)
        top, bottom = max(math.floor(y - radius), 0), min(math.ceil(y + radius), rows - 1)
        for row in range(top, bottom + 1):
            for column in range(left, right + 1):
                if not mask[row, column]:
                    mask[row, column] = (row - y) ** 2 + (column - x) ** 2 <= radius**2
