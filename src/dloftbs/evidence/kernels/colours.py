"""Colours around places of an image, and when two of them are of one kind."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from dloftbs.kernels.compiler import helper
from dloftbs.kernels.shared.selection import nth_least

BESIDE_WIDTHS = 1.0
"""Distance from the axis to the samples of the ground beside a cable, widths.

Source: geometry; half a width beyond the edge.
"""

CLEAR_WIDTHS = 0.25
"""Margin around the mask in which nothing counts as ground, widths; `CLEAR_PX` is added.

Source: by hand; shadows and blur grow with the width.
"""

CLEAR_PX = 1.0
"""Margin around the mask in which nothing counts as ground, px, besides `CLEAR_WIDTHS`.

Source: geometry; pixels at the edge mix cable and ground.
"""

AGREE = 6
"""One in this number of reference samples must be alike.

Source: by hand; samples beside an end may show what hides the cable, so a majority cannot be asked for.
"""

BLOCK_WIDTHS = 0.2
"""Half the side of the square of pixels whose mean is a sample, widths.

Source: by hand; the square lies within the cable, and averages noise.
"""

MIN_REFERENCES = 6
"""Number of ground samples below which nothing is decided.

Source: by hand; the same number as `AGREE`, so that one sample must agree.
"""

LENIENT = 4.0
"""Largest distance of equal colours, as a multiple of the references' spread.

Source: measured on drawn pictures of facing ends (60 flat, 60 round; wood, tiles): 0.90 of the decisions are right at
2, 0.93 to 0.95 at 3, 0.97 to 0.98 at 4; of cables behind discs 0.98, 0.98 and 0.97.
"""

FLOOR = 12.0
"""Colour distance within which two colours are the same in any case, grey levels.

Source: by hand; a few times the noise of a camera's 8-bit image.
"""


_MIN_LIGHT = 0.35
"""Least brightness of ground in a shadow, as a share of that in the light.

Source: by hand; what one lamp of two and the sky leave.
"""


@helper
def is_on_mask(mask: npt.NDArray[np.uint8], x: float, y: float, reach: float) -> bool:
    """Return whether the mask has any of five points: the given one, and those `reach` px beside it."""
    for dx, dy in ((0.0, 0.0), (-reach, 0.0), (reach, 0.0), (0.0, -reach), (0.0, reach)):
        row, column = int(np.floor(y + dy + 0.5)), int(np.floor(x + dx + 0.5))
        if 0 <= row < mask.shape[0] and 0 <= column < mask.shape[1] and mask[row, column] != 0:
            return True
    return False


@helper
def block_mean(image: npt.NDArray[np.uint8], x: float, y: float, half: int, colour: npt.NDArray[np.float64]) -> bool:
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
def colour_distance(a: npt.NDArray[np.float64], b: npt.NDArray[np.float64]) -> float:
    """Return the distance of two colours, grey levels."""
    return np.sqrt((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2)


@helper
def distance_of_one_in(colour: npt.NDArray[np.float64], colours: npt.NDArray[np.float64]) -> float:
    """Return within which distance one in `AGREE` of some colours lies."""
    away = np.empty(len(colours))
    for k in range(len(colours)):
        away[k] = colour_distance(colour, colours[k])
    return nth_least(away, len(colours) // AGREE)


@helper
def is_like(colour: npt.NDArray[np.float64], colours: npt.NDArray[np.float64], alike: float) -> bool:
    """Return whether more than one in `AGREE` of some colours lie within a distance, as `distance_of_one_in` would."""
    count = 0
    for k in range(len(colours)):
        count += colour_distance(colour, colours[k]) <= alike
    return count > len(colours) // AGREE


@helper
def spread_of(colours: npt.NDArray[np.float64]) -> float:
    """Return how far apart colours of one kind are by that measure, where they lie closest.

    Ground may be of several kinds, with shadows and other cables on it: a mean over all would call everything alike.
    """
    if len(colours) == 0:
        return 0.0
    away = np.empty(len(colours))
    for k in range(len(colours)):
        away[k] = distance_of_one_in(colours[k], colours)
    return nth_least(away, len(away) // AGREE)


@helper
def is_in_other_light(colour: npt.NDArray[np.float64], ground: npt.NDArray[np.float64]) -> bool:
    """Return True if a colour is that of some ground, darker or brighter."""
    for k in range(len(ground)):
        square, dot = 0.0, 0.0
        for c in range(3):
            square += ground[k, c] * ground[k, c]
            dot += ground[k, c] * colour[c]
        share = dot / square if square > 0.0 else 1.0
        least = max(FLOOR, FLOOR * share)
        if _MIN_LIGHT <= share <= 1.0 / _MIN_LIGHT and colour_distance(colour, share * ground[k]) <= least:
            return True
    return False
