"""Limits of masks that are probabilities, and the places where they are asked."""

from __future__ import annotations

import math

from dloftbs.kernels.compiler import Bytes, helper

HALF = 128
"""Least value of what is rather cable than not, of 256.

Source: by definition.
"""

LEAST_PROBABLE = HALF // 8
"""Least value that shows cable at all, of 256.

Source: by definition; a sixteenth: below, 8 bits hold little but noise.
"""

AHEAD_WIDTHS = (1.0, 1.25, 1.5)
"""Distances ahead of an end that are looked at, widths.

Source: by hand; beyond the soft border of the end itself, and no farther than most gaps of networks' masks.
"""

ASIDE_WIDTHS = (-0.4, -0.2, 0.0, 0.2, 0.4)
"""Distances to the sides of a place ahead of an end, or in a gap, where the cable may be, widths.

Source: geometry; the pixels of a cable that lies there.
"""

_BESIDE_WIDTHS = 1.0
"""Distance to either side of such a place where there is less if a cable lies there, widths.

Source: geometry; beyond its edge by half a width. On the soft border of another cable there is more on one side.
"""


@helper
def ridge_at(soft: Bytes, x: float, y: float, dx: float, dy: float, width: float) -> int:
    """Return the largest value across a place of a way, if there is less on either side; else 0, and -1 off the image.

    Parameters
    ----------
    soft : (h, w) uint8
        Probability, of 256.
    x, y, dx, dy : float
        The place, and the direction of the way.
    width : float
        px.
    """
    most = -1
    for aside in ASIDE_WIDTHS:
        row, column = math.floor(y + aside * width * dx + 0.5), math.floor(x - aside * width * dy + 0.5)
        if not (0 <= row < soft.shape[0] and 0 <= column < soft.shape[1]):
            return -1
        most = max(most, int(soft[row, column]))
    for aside in (-_BESIDE_WIDTHS, _BESIDE_WIDTHS):
        row, column = math.floor(y + aside * width * dx + 0.5), math.floor(x - aside * width * dy + 0.5)
        if 0 <= row < soft.shape[0] and 0 <= column < soft.shape[1] and int(soft[row, column]) >= most:
            return 0
    return most
