"""Masks that were enlarged by repeating their pixels, as networks' are: edges without the steps that this leaves."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

LARGEST_STEP = 16
"""Largest factor by which masks are enlarged.

Source: by hand; networks work at an eighth of an image or finer.
"""

_THICK_STEPS = 3
"""Least width of what is smoothed, steps: a median takes what is thinner away.

Source: geometry; the median looks at two steps and a pixel.
"""


def smooth_steps(mask: npt.NDArray[Any], step: int) -> npt.NDArray[np.uint8]:
    """Return a mask, 0 or 1, whose edges run as they would if it had been drawn at its size; what is thin stays.

    Parameters
    ----------
    mask : numpy.ndarray, shape (H, W)
        Any non-zero is cable.
    step : int
        Factor by which it was enlarged, px.
    """
    cable = np.ascontiguousarray(mask != 0).view(np.uint8)
    side = _THICK_STEPS * step
    thick = cv2.morphologyEx(cable, cv2.MORPH_OPEN, np.ones((side, side), np.uint8))
    beside = cv2.dilate(thick, np.ones((2 * step + 1, 2 * step + 1), np.uint8))
    return np.where(beside != 0, cv2.medianBlur(cable, 2 * step + 1), cable)
