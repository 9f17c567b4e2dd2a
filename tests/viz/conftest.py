"""Results built by hand: straight and bent curves of which every pixel is known."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.interpolate import make_lsq_spline

from dloftbs.data.centerline import Centerline, Joint, JointKind, Segment
from dloftbs.data.curve import BSplineCurve
from dloftbs.data.detection import Detection
from dloftbs.data.frame_result import FrameResult
from dloftbs.data.tracks import Track, TrackState

Points = np.ndarray


class Build:
    """Short ways to results."""

    @staticmethod
    def curve(points: Points) -> BSplineCurve:
        steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
        u = np.concatenate(([0.0], np.cumsum(steps)))
        u /= u[-1]
        spline = make_lsq_spline(u, points, np.r_[[0.0] * 4, np.linspace(0, 1, 10)[1:-1], [1.0] * 4], 3)
        return BSplineCurve(spline.t, spline.c)

    @staticmethod
    def straight(start: tuple[float, float], end: tuple[float, float]) -> Points:
        return np.linspace(start, end, 201)

    @staticmethod
    def circle(centre: tuple[float, float], radius: float) -> BSplineCurve:
        angle = 2 * np.pi * np.arange(12) / 12
        control = np.stack((np.cos(angle), np.sin(angle)), axis=1) * radius + centre
        return BSplineCurve(np.arange(-3, 16) / 12, np.vstack((control, control[:3])), closed=True)

    @classmethod
    def detection(
        cls, points: Points, joints: tuple[tuple[JointKind, tuple[float, float]], ...] = (), width: float = 20.0
    ) -> Detection:
        u = np.linspace(0, 1, len(points))
        cuts = [0.0, *(end for _, span in joints for end in span), 1.0]
        pieces = [points[(u >= low) & (u <= high)] for low, high in zip(cuts[::2], cuts[1::2], strict=True)]
        segments = tuple(Segment(piece, np.full(len(piece), width / 2)) for piece in pieces)
        line = Centerline(segments, tuple(Joint(kind, span, 1.0, 1.0) for kind, span in joints))
        return Detection(line, cls.curve(points))

    @staticmethod
    def track(number: int, detection: Detection, state: TrackState = TrackState.CONFIRMED) -> Track:
        hidden = state is TrackState.HIDDEN
        return Track(number, state, detection.curve, None, 3, int(hidden), None if hidden else detection)

    @staticmethod
    def result(
        size: tuple[int, int],
        detections: tuple[Detection, ...] = (),
        tracks: tuple[Track, ...] = (),
        reason: str | None = None,
    ) -> FrameResult:
        return FrameResult(detections, tracks, reason, size)


@pytest.fixture
def build() -> type[Build]:
    return Build


@pytest.fixture
def textured() -> Callable[[int, int], np.ndarray]:
    def make(height: int, width: int) -> np.ndarray:
        return np.random.default_rng(5).integers(60, 160, (height, width, 3), dtype=np.uint8)

    return make
