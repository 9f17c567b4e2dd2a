"""Photographs with label images, segmented by the colours of the cables of mBEST (Choi et al., RA-L 2023)."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import numpy.typing as npt

from dloftbs.data.frame import Frame
from dloftbs_lab.recorded import label_images
from dloftbs_lab.recorded.label_images import LabelledImages
from dloftbs_lab.recorded.layout import Layout

TREE = """\
mbest: the same as labels, but the masks are by the colours of mBEST's cables, not by the labels
  folder/
    00.jpg
    00.labels.png"""

_RANGES = (
    ((0, 20, 75), (20, 255, 255)),
    ((160, 20, 75), (180, 255, 255)),
    ((25, 20, 75), (50, 255, 255)),
    ((50, 20, 20), (120, 255, 255)),
)
"""Lowest and highest hue, saturation and value, as OpenCV has them: pink, pink, green, teal."""


class MbestImages(LabelledImages):
    """Photographs of mBEST's data set with masks by colour, as its authors make them.

    Parameters
    ----------
    folder : Path

    Raises
    ------
    SourceError
        As `LabelledImages`.
    """

    def _frame(self, index: int) -> Frame:
        frame = super()._frame(index)
        assert frame.image is not None  # each has one
        return replace(frame, mask=mask_by_colour(frame.image))


def mask_by_colour(image: npt.NDArray[np.uint8]) -> npt.NDArray[np.bool_]:
    """Return where an image (H, W, 3) BGR has the colour of a cable, shape (H, W), closed and opened by 3 x 3."""
    hsv = cv2.cvtColor(image, cv2.COLOR_BGR2HSV)
    mask = np.zeros(image.shape[:2], np.uint8)
    for low, high in _RANGES:
        mask |= np.asarray(cv2.inRange(hsv, low, high), np.uint8)
    square = np.ones((3, 3), np.uint8)
    closed = cv2.morphologyEx(mask, cv2.MORPH_CLOSE, square)
    return np.asarray(cv2.morphologyEx(closed, cv2.MORPH_OPEN, square)) > 0


LAYOUT = Layout("mbest", TREE, label_images.LAYOUT.fits, MbestImages)
