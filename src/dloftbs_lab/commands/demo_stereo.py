"""The demo with two cameras: two videos and a rig, the curves in metres, held against the true axis."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import yaml

from dloftbs import sinks
from dloftbs.cli.outputs import open_outputs
from dloftbs.data.frame import Frame
from dloftbs.data.frame_result import FrameResult
from dloftbs.stereo import CameraRig, StereoPipeline
from dloftbs.support.safe_files import write_whole
from dloftbs_lab.commands.demo_files import as_it_is
from dloftbs_lab.commands.scoring import spread, spread_text
from dloftbs_lab.evaluation import match_curves
from dloftbs_lab.synthetic import TwoCameraSequence

LEFT, RIGHT, RIG, OVERLAY = "left.mp4", "right.mp4", "rig.yaml", "overlay.mp4"
CURVES = ("curves.jsonl", "curves.ply")
MESHES = "curves/"
WHAT = {
    LEFT: "the video of the left camera, drawn",
    RIGHT: "that of the right one, 300 mm beside it",
    RIG: "both cameras and their poses",
    OVERLAY: "the left video with the curves",
    CURVES[0]: "the curves in metres, one line of JSON a frame",
    MESHES: "the curves in metres, a mesh a frame",
}
DRAWN = "two videos of a cable"
_VARIANT = "300 mm, 0.8 m"
_CABLE_BGR, _GROUND_BGR = (40, 40, 200), (120, 120, 120)
_COLOUR = "red"
_MM_PER_M = 1e3


def follow(frames: int, size: tuple[int, int], seed: int, folder: Path) -> str:
    """Draw two videos, follow the cable in them by its colour, write all files, and return the figures as text.

    Raises
    ------
    SinkError
        If a file cannot be written.
    """
    sequence = TwoCameraSequence(_VARIANT, seed, frames, size, seed)
    first = sequence.frame(0)
    assert first.camera is not None
    rig = CameraRig([first.camera, first.camera], first.poses)
    write_whole(folder / RIG, yaml.safe_dump(rig.to_dict()).encode())
    pipeline = StereoPipeline(rig, hsv=_COLOUR)
    errors = []
    overlay = sinks.OverlayVideoSink(folder / OVERLAY, fps=sequence.fps or 30.0)
    with (
        sinks.OverlayVideoSink(folder / LEFT, fps=sequence.fps or 30.0, draw=as_it_is) as left,
        sinks.OverlayVideoSink(folder / RIGHT, fps=sequence.fps or 30.0, draw=as_it_is) as right,
        open_outputs([str(folder / name) for name in CURVES], overlay) as sink,
    ):
        for index in range(frames):
            frame = sequence.frame(index)
            assert frame.second is not None  # the sequence draws it
            views = [_painted(view) for view in (frame, frame.second)]
            for video, view in zip((left, right), views, strict=True):
                video.write(view, FrameResult((), (), None, view.size, index=view.index))
            result = pipeline.process(views).as_frame_result()
            sink.write(views[0], result)
            curves = [one.curve_3d for one in result.detections if one.curve_3d is not None]
            pairs = match_curves(curves, sequence.truth(index).curves_3d).pairs if curves else ()
            errors.append(_MM_PER_M * pairs[0].l3 if pairs else math.nan)
    command = f"dloftbs stereo {LEFT} {RIGHT} --rig {RIG} --hsv {_COLOUR} --out again.jsonl"
    rows = (
        ("two cameras", f"{frames} frames of {size[1]}x{size[0]}, {_VARIANT}"),
        ("L3, curve to true axis", spread_text(spread(errors), "mm")),
        ("by hand, in this folder", command),
    )
    return "\n".join(f"{name:24}{value}" for name, value in rows)


def _painted(frame: Frame) -> Frame:
    """Return a view as a picture."""
    assert frame.mask is not None
    image = np.where(frame.mask[..., None], _CABLE_BGR, _GROUND_BGR).astype(np.uint8)
    return Frame(image=image, index=frame.index, stamp=frame.stamp, name=frame.name)
