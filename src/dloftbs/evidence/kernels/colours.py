"""Colours around places of an image."""

from __future__ import annotations

import numpy as np

from dloftbs.kernels.compiler import Bytes, Floats, helper

CLEAR_WIDTHS = 0.25
"""Margin around the mask in which nothing counts as ground, widths; `CLEAR_PX` is added.

Source: by hand; shadows and blur grow with the width.
"""

CLEAR_PX = 1.0
"""Margin around the mask in which nothing counts as ground, px, besides `CLEAR_WIDTHS`.

Source: geometry; pixels at the edge mix cable and ground.
"""

BLOCK_WIDTHS = 0.2
"""Half the side of the square of pixels whose mean is a sample, widths.

Source: by hand; the square lies within the cable, and averages noise.
"""


@helper
def is_on_mask(mask: Bytes, x: float, y: float, reach: float) -> bool:
    """Return whether the mask has any of five points: the given one, and those `reach` px beside it."""
    for dx, dy in ((0.0, 0.0), (-reach, 0.0), (reach, 0.0), (0.0, -reach), (0.0, reach)):
        row, column = int(np.floor(y + dy + 0.5)), int(np.floor(x + dx + 0.5))
        if 0 <= row < mask.shape[0] and 0 <= column < mask.shape[1] and mask[row, column] != 0:
            return True
    return False


@helper
def block_mean(image: Bytes, x: float, y: float, half: int, colour: Floats) -> bool:
    """Write the mean colour of a square of pixels; return whether it lies in the image."""
    row, column = int(np.floor(y + 0.5)), int(np.floor(x + 0.5))
    if row < half or column < half or row + half >= image.shape[0] or column + half >= image.shape[1]:
        return False
    blue = green = red = np.int64(0)  # plain Python would add in 8 bits
    for r in range(row - half, row + half + 1):
        for c in range(column - half, column + half + 1):
            blue, green, red = blue + image[r, c, 0], green + image[r, c, 1], red + image[r, c, 2]
    count = (2 * half + 1) ** 2
    colour[0], colour[1], colour[2] = blue / count, green / count, red / count
    return True


@helper
def colour_distance(a: Floats, b: Floats) -> float:
    """Return the distance of two colours, grey levels."""
    return np.sqrt((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2)
