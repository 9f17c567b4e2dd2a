"""Conversion of what a method returns for a frame, in any of its forms, to one form."""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from dloftbs.camera import PinholeCamera
from dloftbs.data.curve import BSplineCurve
from dloftbs.data.detection import Detection
from dloftbs.data.frame import Frame
from dloftbs.data.frame_result import FrameResult
from dloftbs.errors import InputError
from dloftbs.support.arrays import FloatArray, as_points
from dloftbs_lab.evaluation.curves import length_of
from dloftbs_lab.evaluation.traces import SAMPLES, Trace, trace_of

Curve = BSplineCurve | FloatArray


@dataclass(frozen=True, eq=False)
class FoundTrack:
    """A track as a method published it.

    Parameters
    ----------
    id : hashable
    curve : BSplineCurve or numpy.ndarray, shape (n, 2)
        In the image, px.
    seen : bool
        Whether the object was detected in this frame; else the track is a memory of an earlier one.
    """

    id: Hashable
    curve: Curve
    seen: bool


_MIN_SAMPLES, _MAX_SAMPLES = 200, 4000


@dataclass(frozen=True, eq=False)
class Found:
    """Curves and tracks that a method found in one frame.

    Parameters
    ----------
    curves : tuple of BSplineCurve or numpy.ndarray, shape (n, 2)
        In the image, px; points are in order, and two or more.
    curves_3d : tuple of BSplineCurve or numpy.ndarray, shape (n, 3), or None
        The same in the camera's frame, metres; None where the method says nothing of it.
    ids : tuple of hashable, optional
        Identities that the method gives them from frame to frame; None where it gives none.
    detections : tuple of Detection
        Those that the curves come from; empty where a method has curves alone.
    tracks : tuple of FoundTrack
        Of a method with identities: all that it published, also those that it did not see in this frame.
    detected : Found, optional
        Detections of the frame, where the curves are others: tracks that are put together from parts, say.
    branch_points : numpy.ndarray, shape (n, 2)
        Of a method that finds any, px.
    """

    curves: tuple[Curve, ...] = ()
    curves_3d: tuple[Curve | None, ...] = ()
    ids: tuple[Hashable, ...] | None = None
    detections: tuple[Detection, ...] = ()
    tracks: tuple[FoundTrack, ...] = ()
    detected: Found | None = None
    branch_points: FloatArray = field(default_factory=lambda: np.empty((0, 2)))

    @cached_property
    def points(self) -> FloatArray:
        """Points of all curves as `samples` spaces them, shape (n, 2)."""
        return np.concatenate([np.empty((0, 2)), *(samples(curve) for curve in self.curves)])

    @cached_property
    def traces(self) -> tuple[Trace, ...]:
        """The curves as dense polylines: each is compared with several true ones, whole and as far as they show."""
        return tuple(trace_of("found", curve, SAMPLES) for curve in self.curves)


def found_in(output: Any, frame: Frame) -> Found:
    """Bring a method's output into one form.

    Parameters
    ----------
    output : FrameResult, mapping, or iterable
        Of a `FrameResult`, the detections count as what was found in the frame, and for identities the tracks that were
        seen in it. A mapping is from ids to curves. A curve is a `BSplineCurve` or an array (n, 2) px or (n, 3) m in
        order; one in space is projected with the frame's camera.
    frame : Frame

    Raises
    ------
    InputError
        If the output is nothing of this.
    """
    if isinstance(output, FrameResult):
        return _of_result(output)
    if isinstance(output, Mapping):
        return _of_curves(list(output.values()), frame.camera, tuple(output))
    if not isinstance(output, Iterable):
        raise InputError(f"a method must return curves or a FrameResult, got {type(output).__name__}")
    return _of_curves(list(output), frame.camera, None)


def samples(curve: Curve) -> FloatArray:
    """Return points at equal distances along a curve in the image, about 1 px apart or less, shape (n, 2).

    Curves of more than 4000 px get 4000 points.
    """
    if isinstance(curve, BSplineCurve):
        return curve.sample(_count(curve.length))
    trace = Trace(curve, closed=False)
    return trace.resampled(_count(length_of(curve, trace)))


def _count(length_px: float) -> int:
    return min(max(math.ceil(length_px) + 1, _MIN_SAMPLES), _MAX_SAMPLES)


def _of_result(result: FrameResult) -> Found:
    # A hidden track is predicted from earlier frames: it is no finding in this one.
    seen = [(track, track.detection) for track in result.tracks if track.detection is not None]
    of = [track for track, _ in seen] if result.tracks else list(result.detections)
    detections = tuple(detection for _, detection in seen) if result.tracks else result.detections
    as_detected = len(of) == len(result.detections) and all(
        np.array_equal(curve.control_points, detection.curve.control_points)
        for curve, detection in zip((item.curve for item in of), detections, strict=True)
    )
    return Found(
        tuple(item.curve for item in of),
        tuple(item.curve_3d for item in of),
        tuple(track.id for track, _ in seen) if result.tracks else None,
        detections,
        tuple(FoundTrack(track.id, track.curve, track.detection is not None) for track in result.tracks),
        None if as_detected else _of_result(replace(result, tracks=())),
        np.array([point.position for point in result.branch_points]).reshape(-1, 2),
    )


def _of_curves(values: list[Any], camera: PinholeCamera | None, ids: tuple[Hashable, ...] | None) -> Found:
    both = [_both(value, camera) for value in values]
    curves = tuple(flat for flat, _ in both)
    tracks = tuple(FoundTrack(name, curve, seen=True) for name, curve in zip(ids or (), curves, strict=bool(ids)))
    return Found(curves, tuple(deep for _, deep in both), ids, tracks=tracks)


def _both(value: Any, camera: PinholeCamera | None) -> tuple[Curve, Curve | None]:
    """Return one curve in the image and, where known, in space."""
    curve: Curve = value if isinstance(value, BSplineCurve) else as_points("a curve", value)
    if not isinstance(curve, BSplineCurve) and len(curve) < 2:
        raise InputError(f"a curve must have two points or more, got {len(curve)}")
    points = curve.sample(_MIN_SAMPLES) if isinstance(curve, BSplineCurve) else curve
    if points.shape[1] == 2:
        return curve, None
    if camera is None:
        raise InputError("a curve in metres needs a frame with a camera, to be compared in the image")
    return as_points("a curve as the camera sees it", camera.project(points)), curve
