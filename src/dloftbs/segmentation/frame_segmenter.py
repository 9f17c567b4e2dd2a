"""The way from a frame to a mask that a configuration chooses."""

from __future__ import annotations

import copy
import functools
import inspect
from collections.abc import Callable, Sequence
from typing import TypeVar, cast

import numpy as np

from dloftbs.config import BackgroundConfig, LocalConfig, Roi, SegmentationConfig
from dloftbs.data.frame import Frame
from dloftbs.data.frame_region import Region
from dloftbs.data.prompt import Prompt
from dloftbs.errors import InputError
from dloftbs.segmentation.background_difference import BackgroundSegmenter, read_background
from dloftbs.segmentation.colour_model import ColourModel
from dloftbs.segmentation.colour_ranges import HsvSegmenter
from dloftbs.segmentation.local import LocalSegmenter
from dloftbs.segmentation.network import NetworkSegmenter
from dloftbs.segmentation.plane import PlaneSegmenter
from dloftbs.segmentation.stroke_segmenter import StrokeSegmenter
from dloftbs.support.arrays import AnyArray, BoolArray, ByteArray, check_mask

_OfImage = Callable[[ByteArray], AnyArray]

Segmenter = _OfImage | Callable[[ByteArray, Prompt], AnyArray]
"""Any function from an image (H, W, 3) BGR uint8 to a mask or a probability (H, W); or from an image and a `Prompt`."""

_Function = TypeVar("_Function", bound=Callable[..., AnyArray])

OfFrame = Callable[[Frame], AnyArray]
"""Any function from a frame to a mask (H, W)."""


class FrameSegmenter:
    """A callable ``frame -> mask`` that asks functions of the image, and joins with them what else says what is cable.

    A probability, floating point, stays one where it is not joined with anything; else it is cable from one half on.

    Parameters
    ----------
    of_image : sequence of callables
        A pixel is cable where any of them says so. A function of two arguments gets the prompt, too.
    joined : sequence of (callable, "and" or "or")
        Functions of the frame. Those of "or" add to what is cable, whatever their order; of that each of "and" must
        say so, too.
    """

    def __init__(self, of_image: Sequence[Segmenter] = (), joined: Sequence[tuple[OfFrame, str]] = ()) -> None:
        self._of_image: list[tuple[Callable[..., AnyArray], int]] = [(ask, _arguments_of(ask)) for ask in of_image]
        self._joined = tuple(joined)

    @property
    def takes_prompt(self) -> bool:
        """True if a function gets a prompt."""
        return any(count == 2 for _, count in self._of_image)

    def __call__(self, frame: Frame, prompt: Prompt | None = None) -> AnyArray:
        """Return the mask of a frame, shape (H, W); the prompt is empty where it is left out.

        Raises
        ------
        InputError
            If the frame lacks what is asked, or a function returns no mask of its size.
        """
        masks = []
        if frame.image is not None:
            given = frame.image, prompt or Prompt()
            masks += [_checked(ask(*given[:count]), frame.size) for ask, count in self._of_image]
        masks += [ask(frame) for ask, join in self._joined if join == "or"]
        needed = [ask(frame) for ask, join in self._joined if join == "and"]
        if masks:
            needed.insert(0, functools.reduce(_either, masks))
        return functools.reduce(_both, needed)  # a frame without a mask has an image

    def alone(self) -> FrameSegmenter:
        """Return one for a frame by itself, which has no plane nor light of the frames before; this one keeps them."""
        other = copy.copy(self)
        other._of_image = [(_alone(ask), count) for ask, count in self._of_image]
        other._joined = tuple([(_alone(ask), join) for ask, join in self._joined])
        return other

    def reset(self) -> None:
        """Forget the frames before."""
        for ask, _ in (*self._of_image, *self._joined):
            if isinstance(ask, (PlaneSegmenter, StrokeSegmenter)):
                ask.reset()


def _alone(ask: _Function) -> _Function:
    return cast(_Function, ask.alone()) if isinstance(ask, (PlaneSegmenter, StrokeSegmenter)) else ask


def make_segmenter(config: SegmentationConfig, roi: Roi | None = None) -> FrameSegmenter | None:
    """Return the way from a frame to a mask that a configuration chooses; None where it chooses none.

    Parameters
    ----------
    config : SegmentationConfig
    roi : tuple, optional
        Region of interest that frames are cut to; a background is a picture of the whole place.

    Raises
    ------
    ConfigError
        If what it names cannot be read.
    InputError
        If the region does not lie within the background.
    """
    of_image: list[Segmenter] = []
    if config.hsv:
        of_image.append(HsvSegmenter(config))
    if config.colour is not None:
        model = ColourModel(config.colour)
        of_image.append(StrokeSegmenter(model, follows_light=config.colour.follow_light))
    if config.onnx is not None:
        of_image.append(NetworkSegmenter(config.onnx))
    joined: list[tuple[OfFrame, str]] = []
    if config.plane is not None:
        joined.append((PlaneSegmenter(config.plane), config.plane.join))
    if isinstance(config.local, LocalConfig):
        joined.append((_of_image("local", LocalSegmenter(config.local)), config.local.join))
    if isinstance(config.background, BackgroundConfig):
        background = read_background(config.background.file)
        if roi is not None:
            background = Region(roi, (background.shape[0], background.shape[1])).cut(background)
        segmenter = BackgroundSegmenter(background, config.background.contrast)
        joined.append((_of_image("background", segmenter), config.background.join))
    return FrameSegmenter(of_image, joined) if of_image or joined else None


def _of_image(name: str, segmenter: _OfImage) -> OfFrame:
    """Return a function of a frame that asks one of its image."""

    def ask(frame: Frame) -> AnyArray:
        if frame.image is None:
            raise InputError(f"segmentation.{name} needs frames with an image; {frame!r} has none")
        return segmenter(frame.image)

    return ask


def _arguments_of(segmenter: Callable[..., AnyArray]) -> int:
    """Return 2 for a function of an image and a prompt, else 1.

    Its second argument has no default, or is called ``prompt``.
    """
    try:
        parameters = inspect.signature(segmenter).parameters.values()
    except (TypeError, ValueError):  # of some functions written in C
        return 1
    placed = [one for one in parameters if one.kind in (one.POSITIONAL_ONLY, one.POSITIONAL_OR_KEYWORD)]
    return 2 if len(placed) > 1 and (placed[1].default is placed[1].empty or placed[1].name == "prompt") else 1


def _both(one: AnyArray, other: AnyArray) -> AnyArray:
    return np.asarray(_is_cable(one) & _is_cable(other))


def _either(one: AnyArray, other: AnyArray) -> AnyArray:
    return np.asarray(_is_cable(one) | _is_cable(other))


def _is_cable(mask: AnyArray) -> BoolArray:
    return np.asarray(mask >= 0.5 if mask.dtype.kind == "f" else mask != 0)


def _checked(mask: AnyArray, size: tuple[int, int]) -> AnyArray:
    if mask is None:
        raise InputError("the segmenter returned None; it must return a mask (H, W)")
    shape = getattr(mask, "shape", None)  # of an array of any library
    if isinstance(shape, tuple) and len([side for side in shape if side != 1]) == 3:
        got = tuple(shape)
        raise InputError(f"the segmenter must return a mask (H, W), got {got}; return the channel of the cable alone")
    mask = check_mask(mask, may_be_soft=True)
    if mask.shape != size:
        raise InputError(
            f"the segmenter's mask must have the frame's size {size}, got {mask.shape}{_remedy(mask, size)}"
        )
    return mask


def _remedy(mask: AnyArray, size: tuple[int, int]) -> str:
    """Return what gives a mask a size, to be added to a message."""
    if mask.shape == size[::-1]:
        return "; rows come first: mask.T"
    if mask.dtype.kind == "f":
        return f"; resize it: cv2.resize(mask, {size[::-1]})"
    return f"; resize it: cv2.resize(mask.astype(np.uint8), {size[::-1]}, interpolation=cv2.INTER_NEAREST)"
