"""The two ways in for a program: one frame, or a stream of frames."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Any, cast

import numpy as np
import numpy.typing as npt

from dloftbs import sources
from dloftbs._arrays import AnyArray
from dloftbs._values import shown
from dloftbs.camera import PinholeCamera
from dloftbs.config import Colour, Config
from dloftbs.errors import InputError
from dloftbs.frame import Frame, as_frame
from dloftbs.frame_result import FrameResult
from dloftbs.pipeline import Pipeline
from dloftbs.segmentation import Segmenter
from dloftbs.sources import Source, Where


def detect(
    x: Frame | npt.ArrayLike,
    *,
    hsv: Colour | None = None,
    image: npt.ArrayLike | None = None,
    depth: npt.ArrayLike | None = None,
    depth_unit_m: float | None = None,
    camera: PinholeCamera | None = None,
    occluders: npt.ArrayLike | None = None,
    objects: int | None = None,
    config: Config | None = None,
    segmenter: Segmenter | None = None,
) -> FrameResult:
    """Find the objects in one frame, without memory.

    Parameters
    ----------
    x : array_like or Frame
        A mask (H, W) or (H, W, 1) of bool or any integer type, in which any non-zero is cable; or a BGR image
        (H, W, 3), uint8, with `hsv` or a configuration that has one; or a whole frame. Never changed.
    hsv : str, HsvRange or several, optional
        Colour of the cables in an image, such as ``"170:10,80:255,60:255"`` for red: hue, saturation and value.
    image : array_like, shape (H, W, 3), uint8, optional
        BGR, beside a mask; tells what lies in gaps of the mask, and which cable is on top.
    depth : array_like, shape (H, W), optional
        See `Frame`; tells what hides gaps of the mask, or shows the ground in them, and with a camera gives curves in
        space.
    depth_unit_m : float, optional
        Metres per count of an integer depth image; 0.001 where it is not given: millimetres.
    camera : PinholeCamera, optional
    occluders : array_like, shape (H, W) or (H, W, 1), bool or any integer type, optional
        What may hide cables, as `Frame` has it.
    objects : int, optional
        Number of objects, if it is known: pieces are joined, and short ones left out, until there are no more.
    config : Config, optional
    segmenter : callable, optional
        From an image (H, W, 3) to a mask (H, W), a `ColourModel` say, in the place of a colour.

    Returns
    -------
    FrameResult
        As a sequence it is its detections. Its `reason` says why there are none, if so.

    Raises
    ------
    InputError
        If shapes or types are wrong or disagree, or nothing says what in an image is cable.
    ConfigError
        If the colour or the number of objects is wrong.
    """
    frame = as_frame(x)
    beside = {
        "image": image,
        "depth": depth,
        "depth_unit_m": depth_unit_m,
        "camera": camera,
        "occluders": occluders,
    }
    given: dict[str, Any] = {name: value for name, value in beside.items() if value is not None}
    if isinstance(x, Frame) and given:
        raise InputError(f"a frame brings its own data: give {', '.join(given)} to the Frame")
    if image is not None and frame.image is not None:
        raise InputError(f"with an image beside it, x must be a mask (H, W), got shape {frame.image.shape}")
    if hsv is not None and frame.mask is not None and not isinstance(x, Frame):
        raise InputError("hsv makes a mask of an image (H, W, 3), and x is a mask already; leave out one of them")
    if segmenter is not None and frame.mask is not None:
        raise InputError("a segmenter makes a mask of an image (H, W, 3), and x has a mask; leave out one of them")
    return Pipeline(config, hsv=hsv, objects=objects, segmenter=segmenter).detect(replace(frame, **given))


Stream = Where | Iterable[Frame | AnyArray]
"""Streams that `track` follows: all that `sources.open` opens, or frames one after the other."""


def track(
    frames: Stream,
    *,
    hsv: Colour | None = None,
    objects: int | None = None,
    config: Config | None = None,
    segmenter: Segmenter | None = None,
) -> Iterator[FrameResult]:
    """Follow the objects through a stream, one result a frame, as the frames come.

    Parameters
    ----------
    frames : str, path, int, array (N, H, W) or (N, H, W, 3), or iterable
        A video, a folder, a glob or a camera, as `sources.open` takes it, which has more options; or frames, masks
        (H, W) or BGR images (H, W, 3), one after the other, a `Source` among them.
    hsv, objects, config, segmenter
        As `Pipeline` takes them.

    Returns
    -------
    iterator of FrameResult

    Raises
    ------
    InputError, ConfigError
        At once, if an argument is wrong; later, if a frame is.
    SourceError
        If there is nothing there or it cannot be opened.
    """
    pipeline = Pipeline(config, hsv=hsv, objects=objects, segmenter=segmenter)
    if isinstance(frames, Frame) or (isinstance(frames, np.ndarray) and _is_one(frames)):
        raise InputError("expected a stream, got a single frame: detect takes one, and Pipeline.process one by one")
    if isinstance(frames, (str, os.PathLike, int, np.integer, np.ndarray)) or _are_paths(frames):
        return _track_source(sources.open(cast(Where, frames)), pipeline)
    if not isinstance(frames, Iterable) or isinstance(frames, (bytes, dict)):
        raise InputError(f"expected a path, a camera's index or an iterable of frames, got {shown(frames)}")
    return (pipeline.process(cast("Frame | AnyArray", frame)) for frame in frames)


def _is_one(array: AnyArray) -> bool:
    """Return True for a mask or a colour image rather than a stack of them."""
    return array.ndim < 3 or (array.ndim == 3 and array.shape[2] == 3 and array.dtype == np.uint8)


def _are_paths(frames: object) -> bool:
    return isinstance(frames, (list, tuple)) and any(isinstance(one, (str, os.PathLike)) for one in frames)


def _track_source(source: Source, pipeline: Pipeline) -> Iterator[FrameResult]:
    with source:
        for frame in source:
            yield pipeline.process(frame)
