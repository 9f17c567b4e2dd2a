"""The way from a frame to a mask that a configuration chooses."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt

from dloftbs._arrays import AnyArray, check_mask
from dloftbs.config import SegmentationConfig
from dloftbs.errors import InputError
from dloftbs.frame import Frame
from dloftbs.segmentation.colour_model import ColourModel
from dloftbs.segmentation.colour_ranges import HsvSegmenter
from dloftbs.segmentation.network import NetworkSegmenter
from dloftbs.segmentation.plane import PlaneSegmenter

Segmenter = Callable[[npt.NDArray[np.uint8]], AnyArray]
"""Any function from an image (H, W, 3) BGR uint8 to a mask (H, W): a network, say."""


class FrameSegmenter:
    """A callable ``frame -> mask`` that asks one function of the image or several, the depth, or both.

    Parameters
    ----------
    of_image : sequence of callables
        A pixel is cable where any of them says so.
    plane : PlaneSegmenter, optional
    join : "and" or "or"
        Whether a pixel must be found in the image and by the plane, or in one of them.
    """

    def __init__(
        self, of_image: Sequence[Segmenter] = (), plane: PlaneSegmenter | None = None, join: str = "and"
    ) -> None:
        self._of_image = tuple(of_image)
        self._plane = plane
        self._join = join

    def __call__(self, frame: Frame) -> AnyArray:
        """Return the mask of a frame, shape (H, W).

        Raises
        ------
        InputError
            If the frame lacks what is asked, or a function returns no mask of its size.
        """
        masks = [] if frame.image is None else [_checked(ask(frame.image), frame.size) for ask in self._of_image]
        found = functools.reduce(_either, masks) if masks else None
        if self._plane is None:
            assert found is not None  # a frame without a mask has an image
            return found
        above = self._plane(frame)
        if found is None:
            return above
        return _either(found, above) if self._join == "or" else (found != 0) & (above != 0)

    def reset(self) -> None:
        """Forget the frames before."""
        if self._plane is not None:
            self._plane.reset()


def make_segmenter(config: SegmentationConfig) -> FrameSegmenter | None:
    """Return the way from a frame to a mask that a configuration chooses; None where it chooses none.

    Parameters
    ----------
    config : SegmentationConfig

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
    if config.onnx is not None:
        of_image.append(NetworkSegmenter(config.onnx))
    if config.plane is None:
        return FrameSegmenter(of_image) if of_image else None
    return FrameSegmenter(of_image, PlaneSegmenter(config.plane), config.plane.join)


def _either(one: AnyArray, other: AnyArray) -> AnyArray:
    return np.asarray((one != 0) | (other != 0))


def _checked(mask: AnyArray, size: tuple[int, int]) -> AnyArray:
    if mask is None:
        raise InputError("the segmenter returned None; it must return a mask (H, W)")
    mask = check_mask(mask)
    if mask.shape != size:
        raise InputError(f"the segmenter's mask must have the frame's size {size}, got {mask.shape}")
    return mask
