"""Reach of a cable beyond an end at a junction: mask beside its axis that no other cable explains."""

from __future__ import annotations

import numpy as np
from numba import float64, uint8

from dloftbs.kernels.compiler import Bytes, Floats, helper, kernel, read

_AHEAD_WIDTHS = 3.5
"""Largest distance from an open end to such a tip, widths.

Source: by hand; beyond it the tip would have a skeleton of its own.
"""

_CAP_PX = 4.5
"""Width up to which a cable's end counts as flat, px.

Source: geometry; the same limit as in `end_extension`, twice `_SEEN_PX`.
"""

_BESIDE_WIDTHS = 0.35
"""Distance from a cable's axis at which its mask is sought where another cable covers a part of it, widths.

Source: geometry; inside of its edge by more than a pixel's noise, and by so much that a round tip still shows.
"""

_CLEAR_WIDTHS = 0.1
"""Margin around the other cables in which mask shows nothing, widths; half a pixel is added.

Source: by hand; more than the noise of an edge.
"""

REACH_WIDTHS = _AHEAD_WIDTHS + 1.0
"""Distance along rows and columns up to which another cable explains mask ahead, widths.

Source: derived; beyond it nothing is near enough to what is looked at.
"""


@helper
def _is_on(mask: Bytes, x: float, y: float) -> bool:
    """Return whether a point lies on the mask."""
    column, row = int(np.rint(x)), int(np.rint(y))
    return 0 <= row < mask.shape[0] and 0 <= column < mask.shape[1] and mask[row, column] != 0


@kernel(read(uint8, 2), read(float64, 1), read(float64, 2), float64)
def shown_ahead(mask: Bytes, ray: Floats, others: Floats, width: float) -> float:
    """Return how far ahead a cable reaches at least: up to the last mask beside its axis that no other cable explains.

    Parameters
    ----------
    mask : (H, W) uint8
    ray : (4,) float64
        Position and direction of its end.
    others : (n, 2) float64
        Points along the axes of the others.
    width : float
        px.

    Returns
    -------
    float
        px, 0 where nothing shows.
    """
    x, y, dx, dy = ray[0], ray[1], ray[2], ray[3]
    count, most = 0, int(np.ceil(_AHEAD_WIDTHS * width))
    while count < most and _is_on(mask, x + count * dx, y + count * dy):
        count += 1
    clear = (0.5 + _CLEAR_WIDTHS) * width + 0.5
    farthest = 0.0
    for aside in (-_BESIDE_WIDTHS, 0.0, _BESIDE_WIDTHS):
        cap = np.sqrt(0.25 - aside * aside) * width if width > _CAP_PX else 0.0  # reaches beyond the axis
        along = count - 1
        while along - cap > farthest:
            px, py = x + along * dx - aside * width * dy, y + along * dy + aside * width * dx
            shows = _is_on(mask, px, py)
            k = 0
            while shows and k < len(others):
                shows = np.sqrt((others[k, 0] - px) ** 2 + (others[k, 1] - py) ** 2) > clear
                k += 1
            if shows:
                farthest = along - cap
            along -= 1
    return farthest
