"""The image's border, where an end of a curve may be a cut."""

from __future__ import annotations

import math

from dloftbs._arrays import FloatArray
from dloftbs.observation import Observation

_BORDER_PX = 3.0
"""Distance from the image's border within which it may cut an end, px, besides `_BORDER_WIDTHS`.

Source: by hand; cleaning, thinning and fitting each move an end by a pixel.
"""

_BORDER_WIDTHS = 1.5
"""Distance from the image's border within which it may cut an end, widths.

Source: by hand; a cable that leaves at a slant ends about one width before it.
"""


def ends_at_border(observation: Observation, size: tuple[int, int] | None, width: float) -> list[bool]:
    """Return, for each end of an observation, True if the image's border may cut it."""
    return [size is not None and is_at_border(end, size, width) for end in observation.points[[0, -1]]]


def is_at_border(point: FloatArray, size: tuple[int, int], width: float) -> bool:
    """Return True if a point lies within about a width of the border of the image, ``(H, W)`` px."""
    margin = _BORDER_PX + (0.0 if math.isnan(width) else _BORDER_WIDTHS * width)
    x, y = float(point[0]), float(point[1])
    return min(x, y, size[1] - 1.0 - x, size[0] - 1.0 - y) < margin
