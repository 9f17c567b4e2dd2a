"""The way from a frame to a mask that a configuration chooses."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt

from dloftbs._arrays import AnyArray, check_mask
from dloftbs.config import SegmentationConfig
from dloftbs.errors import InputError
from dloftbs.frame import Frame
from dloftbs.segmentation.colour_model import ColourModel
from dloftbs.segmentation.colour_ranges import HsvSegmenter

Segmenter = Callable[[npt.NDArray[np.uint8]], AnyArray]
"""Any function from an image (H, W, 3) BGR uint8 to a mask (H, W): a network, say."""


class FrameSegmenter:
    """A callable ``frame -> mask`` that asks one function of the image or several.

    Parameters
    ----------
    of_image : sequence of callables
        A pixel is cable where any of them says so.
    """

    def __init__(self, of_image: Sequence[Segmenter]) -> None:
        self._of_image = tuple(of_image)

    def __call__(self, frame: Frame) -> AnyArray:
        """Return the mask of a frame, shape (H, W).

        Raises
        ------
        InputError
            If the frame lacks what is asked, or a function returns no mask of its size.
        """
        assert frame.image is not None  # a frame without a mask has one
        masks = [self._checked(segmenter(frame.image), frame.size) for segmenter in self._of_image]
        mask = masks[0]
        for other in masks[1:]:
            mask = (mask != 0) | (other != 0)
        return mask

    def reset(self) -> None:
        """Forget what earlier frames told."""

    @staticmethod
    def _checked(mask: AnyArray, size: tuple[int, int]) -> AnyArray:
        mask = check_mask(mask)
        if mask.shape != size:
            raise InputError(f"the segmenter's mask must have the frame's size {size}, got {mask.shape}")
        return mask


def make_segmenter(config: SegmentationConfig) -> FrameSegmenter | None:
    """Return the way from a frame to a mask that a configuration chooses; None where it chooses none.

    Raises
    ------
    ConfigError
        If what it names cannot be read.
    """
    of_image: list[Segmenter] = []
    if config.hsv:
        of_image.append(HsvSegmenter(config))
    if config.colour is not None:
        of_image.append(ColourModel(config.colour))
    return FrameSegmenter(of_image) if of_image else None
