"""Frames and results made by hand, for the tests of the sinks and for the process that is killed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from dloftbs import sinks
from dloftbs.data.centerline import Centerline, Joint, JointKind, Segment
from dloftbs.data.curve import BSplineCurve
from dloftbs.data.detection import Detection
from dloftbs.data.frame import Frame
from dloftbs.data.frame_result import FrameResult
from dloftbs.data.tracks import Track, TrackState

MAX_FRAMES = 300
"""That are written where nothing goes wrong before: 400 kB as NPZ, the smallest kind."""


def curve(ndim: int = 2, n: int = 8, seed: int = 0) -> BSplineCurve:
    inner = np.linspace(0.0, 1.0, n - 2)[1:-1]
    control = np.random.default_rng(seed).uniform(0.0, 60.0 if ndim == 2 else 1.0, (n, ndim))
    return BSplineCurve(np.r_[[0.0] * 4, inner, [1.0] * 4], control)


def detection(seed: int = 0, *, in_space: bool = False, n: int = 8) -> Detection:
    points = np.column_stack([np.arange(10.0), np.zeros(10)])
    segments = (Segment(points, np.full(10, 2.5)), Segment(points + np.array([20.0, 0.0]), np.full(10, 2.5)))
    shape = curve(2, n, seed)
    low, high = shape.t_at([0.45, 0.55]).tolist()
    line = Centerline(segments, (Joint(JointKind.GAP, (low, high), 1.0, 3.0, 0.75),))
    return Detection(line, shape, curve(3, n + 3, seed) if in_space else None)


def detected(index: int = 0, count: int = 2, *, in_space: bool = False) -> FrameResult:
    detections = tuple(detection(10 * index + i, in_space=in_space, n=6 + i) for i in range(count))
    return FrameResult(detections, (), None, (48, 64), {"fit": 0.5}, index, index / 30, f"frame {index}")


def tracked(index: int = 0) -> FrameResult:
    """Return a confirmed track, one that runs against its detection, and a hidden one."""
    first, second = detection(index, in_space=True), detection(index + 1)
    flipped = second.reversed()
    tracks = (
        Track(3, TrackState.CONFIRMED, first.curve, first.curve_3d, 5, 0, first),
        Track(4, TrackState.TENTATIVE, flipped.curve, None, 1, 0, flipped),
        Track(9, TrackState.HIDDEN, curve(2, 12, 7), None, 4, 2, None),
    )
    return FrameResult((second, first), tracks, None, (48, 64), {}, index, None)


def nothing(index: int = 0) -> FrameResult:
    return FrameResult((), (), "the mask is empty", (48, 64), {}, index)


def frame(index: int = 0, size: tuple[int, int] = (48, 64), name: str = "") -> Frame:
    """Return a picture of one grey level, by which it can be known again."""
    return Frame(image=np.full((*size, 3), 40 + 3 * (index % 60), np.uint8), index=index, name=name)


def draw(frame: Frame, result: FrameResult) -> np.ndarray:
    assert frame.image is not None
    return frame.image


def open_sink(name: str) -> sinks.Sink:
    """Open a sink of any kind that writes what is made here."""
    in_space, drawn = {"radius_m": 0.005}, {"draw": draw}
    options: dict[str, dict[str, Any]] = {".mp4": drawn, "": drawn}
    options |= dict.fromkeys((".ply", ".obj", ".usda", ".xml"), in_space)
    return sinks.open(name, **options.get(Path(name).suffix, {}))
