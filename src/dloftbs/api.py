"""The two ways in for a program: one frame, or a stream of frames."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Any, cast

import numpy as np
import numpy.typing as npt

from dloftbs import sources
from dloftbs.camera import CameraLike
from dloftbs.config import Colour, ConfigLike, RoiLike
from dloftbs.data.frame import Frame, as_frame
from dloftbs.data.frame_result import FrameResult
from dloftbs.data.instance_labels import Instances, are_masks_of_objects
from dloftbs.errors import InputError, SourceError
from dloftbs.pipeline import Pipeline
from dloftbs.segmentation import Segmenter
from dloftbs.sources import PathLike, Source, Where
from dloftbs.sources.one_frame import read_beside, read_frame, read_instances
from dloftbs.sources.pixels import Kind, kind_for
from dloftbs.support.array_likes import as_pixels, is_array_like
from dloftbs.support.arrays import AnyArray
from dloftbs.support.values import shown


def detect(
    x: Frame | npt.ArrayLike | PathLike | None = None,
    *,
    hsv: Colour | None = None,
    image: npt.ArrayLike | PathLike | None = None,
    depth: npt.ArrayLike | PathLike | None = None,
    depth_unit_m: float | None = None,
    camera: CameraLike | None = None,
    occluders: npt.ArrayLike | PathLike | None = None,
    instances: Instances | PathLike | None = None,
    objects: int | None = None,
    config: ConfigLike | None = None,
    segmenter: Segmenter | PathLike | None = None,
    roi: RoiLike | None = None,
    mask_is: str | None = None,
    branched: bool | None = None,
) -> FrameResult:
    """Find the objects in one frame, without memory.

    Parameters
    ----------
    x : array_like, str, path or Frame, optional
        A mask (H, W), (H, W, 1) or (1, H, W) of bool or any integer type, in which any non-zero is cable, or a
        probability, as networks give it, of 8 bits or in 0..1 (see `Frame`); or a BGR image (H, W, 3), uint8, with
        `hsv` or a configuration that has one. With these, uint8 (H, W) is a grey image, and bool a mask. Also the file
        of one picture, which is read as `sources.open` reads it; or a whole frame.
        Arrays and tensors of any library are taken, and a picture of Pillow by its mode; an array that is RGB has to be
        turned: ``x[..., ::-1]``. Never changed. May be left out where there are instances.
    hsv : str, HsvRange or several, optional
        Colour of the cables in an image, such as ``"170:10,80:255,60:255"`` for red: hue, saturation and value.
    image : array_like, shape (H, W, 3), uint8, or path, optional
        BGR, beside a mask; shows what lies in gaps of the mask, and which cable is on top.
    depth : array_like, shape (H, W), or path, optional
        See `Frame`; shows what hides gaps of the mask, or shows the ground in them, and with a camera gives curves in
        space. A file as `sources.open` reads it, or beside the file of a picture a naming rule such as
        ``"{stem}_depth.png"``.
    depth_unit_m : float, optional
        Metres per count of an integer depth image; 0.001 where it is not given: millimetres.
    camera : PinholeCamera, str, path or array_like, optional
        Also the file of a calibration, its matrix K, shape (3, 3), or (fx, fy, cx, cy).
    occluders : array_like, shape (H, W), bool or any integer type, or path, optional
        What may hide cables, as `Frame` has it; files as of `depth`.
    instances : label image, stack, sequence of masks or of dictionaries, object with `mask`, or path, optional
        A mask per object, as segmenters give it: a label image (H, W), a stack (N, H, W), a list of masks (H, W), SAM's
        list of dictionaries, or an object whose `mask` is a stack, as `supervision.Detections` (see `Frame`). Any
        non-zero is cable, unless x is a mask. Files as `sources.open` takes them: with that of a picture also a naming
        rule such as ``"{stem}_mask_*.png"``.
    objects : int, optional
        Number of objects, if it is known: pieces are joined, and short ones left out, until there are no more.
    config : Config, str, path or dict, optional
        Also a YAML file, or a dictionary as `Config.from_dict` takes it.
    segmenter : callable, str or path, optional
        From an image (H, W, 3) to a mask (H, W), a `ColourModel` say, in the place of a colour; or an ONNX file, as
        `Pipeline` takes it.
    roi : (x, y, w, h), polygon [(x, y), ...] or str, optional
        Region of interest, px: the rest of the image is left out, as `RegionConfig` has it. The curves are in pixels
        of the whole image.
    mask_is : {"auto", "binary", "probability", "labels"}, optional
        What the values of a mask are, as `Frame` has it.
    branched : bool, optional
        Whether objects may branch, as wiring harnesses do: see `FrameResult.harnesses`.

    Returns
    -------
    FrameResult
        As a sequence it is its detections. Its `reason` says why there are none, if so.

    Raises
    ------
    InputError
        If shapes or types are wrong or disagree, nothing says what in an image is cable, or the region of interest does
        not lie within the image, or there are neither x nor instances.
    ConfigError
        If the colour, the number of objects, the region or the configuration's file is wrong.
    SourceError
        If a file cannot be read.
    """
    pipeline = Pipeline(
        config, hsv=hsv, objects=objects, segmenter=segmenter, roi=roi, mask_is=mask_is, branched=branched
    )
    known = pipeline.config.segmentation.mask_is
    segmented = pipeline.segments_images and image is None
    kind: Kind = kind_for("auto" if image is None else "mask", segmented=segmented)
    picture = image if x is None else x
    is_alone = x is None and instances is not None
    if x is None and image is not None and instances is None:
        raise InputError("an image stands beside a mask or instances; give an image alone as x")
    # What stands beside a picture is for its pixels as stored.
    as_stored = any(one is not None for one in (image, depth, camera, occluders, instances))
    if isinstance(image, (str, os.PathLike)):
        image = read_frame(image, "image", as_stored=as_stored).image
    if is_alone:
        frame = _frame_of_instances(instances, image, picture)
        image = instances = None
    elif isinstance(x, (str, os.PathLike)):
        frame = read_frame(x, kind, known, as_stored=as_stored)
    else:
        frame = as_frame(cast("Frame | npt.ArrayLike", x), grey_as_image=segmented, mask_is=known)
    if isinstance(depth, (str, os.PathLike)):
        depth = read_beside("depth", depth, picture)
    if isinstance(occluders, (str, os.PathLike)):
        occluders = read_beside("occluders", occluders, picture)
    if isinstance(instances, (str, os.PathLike)):
        instances = read_instances(instances, picture, frame.size)
    beside = {
        "image": image,
        "depth": depth,
        "depth_unit_m": depth_unit_m,
        "camera": camera,
        "occluders": occluders,
        "instances": instances,
    }
    given: dict[str, Any] = {name: value for name, value in beside.items() if value is not None}
    if isinstance(x, Frame) and given:
        raise InputError(f"a frame brings its own data: give {', '.join(given)} to the Frame")
    if image is not None and frame.image is not None:
        raise InputError(f"with an image beside it, x must be a mask (H, W), got shape {frame.image.shape}")
    has = "the instances are a mask" if is_alone or instances is not None else "x is a mask"
    frame = replace(frame, **given)
    if hsv is not None and frame.mask is not None and not isinstance(x, Frame):
        raise InputError(f"hsv makes a mask of an image (H, W, 3), and {has} already; leave out one of them")
    if segmenter is not None and frame.mask is not None:
        raise InputError(f"a segmenter makes a mask of an image (H, W, 3), and {has} already; leave out one of them")
    return pipeline.detect(frame)


def _frame_of_instances(instances: Instances | PathLike | None, image: npt.ArrayLike | None, picture: object) -> Frame:
    """Return the frame of instances without a mask, with an image beside them where there is one."""
    if isinstance(instances, (str, os.PathLike)):
        size = None if image is None else Frame(image=cast(AnyArray, image)).size
        instances = read_instances(instances, picture, size)
    return Frame(image=cast("AnyArray | None", image), instances=cast(AnyArray, instances))


Stream = Where | Iterable[Frame | AnyArray]
"""Streams that `track` follows: all that `sources.open` opens, or frames one after the other."""


def track(
    frames: Stream,
    *,
    hsv: Colour | None = None,
    objects: int | None = None,
    config: ConfigLike | None = None,
    segmenter: Segmenter | PathLike | None = None,
    roi: RoiLike | None = None,
    mask_is: str | None = None,
    branched: bool | None = None,
) -> Iterator[FrameResult]:
    """Follow the objects through a stream, one result a frame, as the frames come.

    Parameters
    ----------
    frames : str, path, int, array (N, H, W) or (N, H, W, 3), cv2.VideoCapture, or iterable
        A video, a folder, a glob or a camera, as `sources.open` takes it, which has more options; or frames, masks
        (H, W) or BGR images (H, W, 3), one after the other, a `Source` among them. Each mask is a frame: the masks of
        several objects in one frame are ``Frame(instances=...)``. A capture is read until it gives no
        more, and stays open; its frames have no times, as those of its path or index have.
    hsv, objects, config, segmenter, roi, mask_is, branched
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
    pipeline = Pipeline(
        config, hsv=hsv, objects=objects, segmenter=segmenter, roi=roi, mask_is=mask_is, branched=branched
    )
    if are_masks_of_objects(frames):
        raise InputError(
            f"expected a stream, got the masks of one frame's objects, {shown(frames)}: "
            "detect(instances=x) takes them, and track an iterable of Frame(instances=x)"
        )
    if is_array_like(frames):
        array = as_pixels("the stream", frames, "any")
        frames = list(array) if array.ndim == 1 and array.dtype.kind == "O" else array  # arrays of several sizes
    if isinstance(frames, Frame) or (isinstance(frames, np.ndarray) and _is_one(frames)):
        raise InputError("expected a stream, got a single frame: detect takes one, and Pipeline.process one by one")
    if isinstance(frames, (str, os.PathLike, int, np.integer, np.ndarray)) or _are_paths(frames):
        kind = kind_for("auto", segmented=pipeline.segments_images)
        known = pipeline.config.segmentation.mask_is
        return _track_source(sources.open(cast(Where, frames), kind=kind, mask_is=known), pipeline)
    if _is_capture(frames):
        frames = _frames_of(frames)
    if not isinstance(frames, Iterable) or isinstance(frames, (bytes, dict)):
        raise InputError(f"expected a path, a camera's index or an iterable of frames, got {shown(frames)}")
    return (pipeline.process(cast("Frame | AnyArray", frame)) for frame in frames)


def _is_capture(frames: object) -> bool:
    """Return True for what reads frames as `cv2.VideoCapture` does."""
    return all(callable(getattr(frames, name, None)) for name in ("isOpened", "grab", "read"))


def _frames_of(capture: Any) -> Iterator[AnyArray]:
    """Return the frames of a capture, as they come.

    Raises
    ------
    SourceError
        At once, if the capture is not open.
    """
    if not capture.isOpened():
        raise SourceError("the capture is not open: there is no such video or camera, or it was released")
    return _read_all(capture)


def _read_all(capture: Any) -> Iterator[AnyArray]:
    while True:
        is_read, image = capture.read()
        if not is_read:
            return
        yield image


def _is_one(array: AnyArray) -> bool:
    """Return True for a mask or a colour image rather than a stack of them."""
    return array.ndim < 3 or (array.ndim == 3 and (array.shape[2], array.dtype) in ((3, np.uint8), (1, array.dtype)))


def _are_paths(frames: object) -> bool:
    return isinstance(frames, (list, tuple)) and any(isinstance(one, (str, os.PathLike)) for one in frames)


def _track_source(source: Source, pipeline: Pipeline) -> Iterator[FrameResult]:
    with source:
        for frame in source:
            yield pipeline.process(frame)
