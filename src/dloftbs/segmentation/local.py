"""Without a colour: the pixels that are darker, or brighter, than what surrounds them."""

from __future__ import annotations

import cv2
import numpy as np

from dloftbs.config import LocalConfig
from dloftbs.segmentation.contrast import (
    LEVEL,
    SMOOTHING_PX,
    Counts,
    greatest_within,
    limits_of,
    mask_of,
    noise_of,
    pixels_of,
)
from dloftbs.support.arrays import ByteArray, check_image

_WINDOW = 3.0
"""Side of the square that the surroundings are looked for in, in widths of the widest cable.

Source: geometry; it reaches over two cables side by side, and to the ground between those that cross.
"""
_SHARE = 1.0 / 40.0
"""Width of the widest cable, as a share of the shorter side of the image, where none is given.

Source: by hand; 12 px of 480, and the window finds cables up to 36 px.
"""
_SMOOTHING = 1.0 / 6.0
"""Standard deviation of the smoothing, in widths of the widest cable.

Source: geometry; 99 % of its weight lie within the cable.
"""
_REACH = 0.5
"""Distance within which a pixel has half of the greatest contrast, in widths of the widest cable.

Source: geometry; from the edge of a cable to its middle.
"""


class LocalSegmenter:
    """A callable ``image -> mask`` that compares a pixel with the ground around it.

    The ground is the morphological closing of the smoothed brightness (the opening, for bright cables): what is
    narrower than the window is filled, and edges of wider things stay where they are.

    Parameters
    ----------
    config : LocalConfig
    """

    def __init__(self, config: LocalConfig) -> None:
        self._config = config

    def __call__(self, image: ByteArray) -> ByteArray:
        """Return 1 for the pixels that stand out on the side of the configuration, shape (H, W).

        Parameters
        ----------
        image : numpy.ndarray, shape (H, W, 3), uint8
            BGR.

        Raises
        ------
        InputError
            If it is no such image.
        """
        image = check_image(image)
        shorter = min(image.shape[:2])
        if shorter == 0:
            return np.zeros(image.shape[:2], np.uint8)
        given = self._config.width_px
        width_px = _SHARE * shorter if given is None else given
        smoothing_px = SMOOTHING_PX if given is None else max(_SMOOTHING * given, SMOOTHING_PX)
        sign = LEVEL if self._config.tone == "darker" else -LEVEL
        grey = cv2.cvtColor(image, cv2.COLOR_BGR2GRAY).astype(np.int16) * np.int16(sign)
        smooth = cv2.GaussianBlur(grey, (0, 0), smoothing_px)
        contrast = cv2.subtract(_ground(smooth, max(1, round(0.5 * _WINDOW * width_px))), smooth)
        least, strong = limits_of(*noise_of(contrast), self._config.contrast)
        beside = greatest_within(contrast, max(1, round(_REACH * width_px)))
        return mask_of(pixels_of(contrast, beside, least), contrast, strong)


def _ground(smooth: Counts, half_px: int) -> Counts:
    """Return the brightness around dark lines, shape (H, W)."""
    side = 2 * half_px + 1
    ground: Counts = cv2.morphologyEx(smooth, cv2.MORPH_CLOSE, np.ones((side, side), np.uint8))
    for inward in (ground, ground[::-1], ground.T, ground.T[::-1]):
        _level_border(inward, half_px)
    return ground


def _level_border(inward: Counts, half_px: int) -> None:
    """Lower the rows at a border, where the closing is level, to the slope that it has farther in.

    Otherwise, an image that gets darker towards its border is a dark line there.
    """
    if len(inward) <= 2 * half_px:
        return
    near, far = inward[half_px].astype(np.int32), inward[2 * half_px].astype(np.int32)
    steps = np.arange(half_px, 0, -1)[:, None]
    slope = near + (near - far) * steps // half_px
    info = np.iinfo(np.int16)
    np.minimum(inward[:half_px], np.clip(slope, info.min, info.max), out=inward[:half_px], casting="same_kind")
