"""Colour image to mask, by ranges of hue, saturation and value."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from dloftbs.config import HUE_MAX, HsvRange, SegmentationConfig
from dloftbs.errors import ConfigError
from dloftbs.segmentation.colour_table import LEVELS, ColourTable


class HsvSegmenter(ColourTable):
    """A callable ``image -> mask`` that holds one bit for each of the 16.7 million colours.

    The table comes from OpenCV's own conversion, so the mask is what ``cv2.cvtColor`` and ``cv2.inRange`` give, at a
    cost that does not depend on the number of ranges. Making it takes some 50 ms, once.

    Parameters
    ----------
    config : SegmentationConfig
        With one range or more.

    Raises
    ------
    ConfigError
        If there is no range.
    """

    def __init__(self, config: SegmentationConfig) -> None:
        if not config.hsv:
            raise ConfigError("segmentation.hsv is empty: a colour needs one range or more")
        super().__init__(_colour_bits(config.hsv))


def _colour_bits(ranges: tuple[HsvRange, ...]) -> npt.NDArray[np.uint8]:
    """Return the bit of every colour, shape (256 red, 256 green, 32 bytes of 8 blues)."""
    boxes = [box for hsv_range in ranges for box in _opencv_boxes(hsv_range)]
    plane = np.empty((LEVELS, LEVELS, 3), dtype=np.uint8)  # all colours of one red: fits the cache
    plane[..., 0] = np.arange(LEVELS)
    plane[..., 1] = np.arange(LEVELS)[:, None]
    table = np.zeros((LEVELS, LEVELS, LEVELS // 8), dtype=np.uint8)
    for red in range(LEVELS):
        plane[..., 2] = red
        hsv = cv2.cvtColor(plane, cv2.COLOR_BGR2HSV)
        for low, high in boxes:
            table[red] |= np.packbits(cv2.inRange(hsv, low, high), axis=1, bitorder="little")
    return table


def _opencv_boxes(hsv_range: HsvRange) -> list[tuple[tuple[int, int, int], tuple[int, int, int]]]:
    """Return the bounds that ``cv2.inRange`` takes: two boxes where the hue wraps around 0."""
    (h0, h1), (s0, s1), (v0, v1) = hsv_range.hue, hsv_range.saturation, hsv_range.value
    hues = [(h0, h1)] if h0 <= h1 else [(h0, HUE_MAX), (0, h1)]
    return [((low, s0, v0), (high, s1, v1)) for low, high in hues]
