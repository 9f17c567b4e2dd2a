"""The two ways in for a program: one mask, or a stream of frames."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy.typing as npt

from dloftbs._arrays import check_depth, check_image, check_mask
from dloftbs._values import MILLIMETRE_M
from dloftbs.camera import PinholeCamera
from dloftbs.config import Config
from dloftbs.frame import Frame
from dloftbs.frame_result import FrameResult
from dloftbs.pipeline import Pipeline
from dloftbs.stage_order import Segmenter


def detect(
    mask: npt.ArrayLike,
    config: Config | None = None,
    *,
    image: npt.ArrayLike | None = None,
    depth: npt.ArrayLike | None = None,
    depth_unit_m: float = MILLIMETRE_M,
    camera: PinholeCamera | None = None,
    occluders: npt.ArrayLike | None = None,
) -> FrameResult:
    """Find the objects in one mask, without memory.

    Parameters
    ----------
    mask : array_like, shape (H, W) or (H, W, 1), bool or any integer type
        Any non-zero is cable. Never changed.
    config : Config, optional
    image : array_like, shape (H, W, 3), uint8, optional
        BGR; tells what lies in gaps of the mask, and which cable is on top.
    depth : array_like, shape (H, W), optional
        See `Frame`; tells what hides gaps of the mask, or shows the ground in them, and with a camera gives curves in
        space.
    depth_unit_m : float
        Metres per count of an integer depth image.
    camera : PinholeCamera, optional
    occluders : array_like, shape (H, W) or (H, W, 1), bool or any integer type, optional
        What may hide cables, as `Frame` has it.

    Returns
    -------
    FrameResult
        As a sequence it is its detections. Its `reason` says why there are none, if so.

    Raises
    ------
    InputError
        If shapes or types are wrong or disagree.
    """
    frame = Frame(
        image=None if image is None else check_image(image),
        mask=check_mask(mask),
        depth=None if depth is None else check_depth(depth),
        camera=camera,
        occluders=None if occluders is None else check_mask(occluders, "occluders"),
        depth_unit_m=depth_unit_m,
    )
    return Pipeline(config).detect(frame)


def track(
    frames: Iterable[Frame], config: Config | None = None, *, segmenter: Segmenter | None = None
) -> Iterator[FrameResult]:
    """Follow the objects through a stream, one result a frame, as the frames come.

    Parameters
    ----------
    frames : iterable of Frame
        A source, as `dloftbs.sources.open` makes it, or any other.
    config, segmenter
        As `Pipeline` takes them.

    Yields
    ------
    FrameResult
    """
    pipeline = Pipeline(config, segmenter=segmenter)
    for frame in frames:
        yield pipeline.process(frame)
