"""Input and output of the pipeline: a frame of a stream, and the detections, crossings and tracks in it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Any

import numpy as np
import numpy.typing as npt

from dloftbs._arrays import LARGEST, AnyArray, FloatArray, check_depth, check_image, check_mask
from dloftbs._text import readable
from dloftbs._values import (
    check_all,
    check_integer,
    check_number,
    check_pair,
    check_size,
    check_spans,
    check_stamp,
    check_text,
    check_type,
    shown,
)
from dloftbs.camera import PinholeCamera
from dloftbs.centerline import Centerline, Joint, JointKind, Point, Segment
from dloftbs.curve import BSplineCurve
from dloftbs.errors import InputError

_MOST = 2**53  # of a count: the largest integer that JSON and a float64 hold exactly

_REGISTER = (
    "; depth of a camera of its own must be registered to the image first: DepthRegistration.register, "
    "or registration= of sources.open, or --registration"
)


@dataclass(frozen=True, eq=False)
class Frame:
    """One moment of a stream. The arrays are held as read-only views, not copied.

    Parameters
    ----------
    image : numpy.ndarray, shape (H, W, 3), uint8, optional
        Colour image in OpenCV's order, BGR.
    mask : numpy.ndarray, shape (H, W) or (H, W, 1), bool or any integer type, optional
        Any non-zero is cable. Where it is given, no segmentation takes place.
    depth : numpy.ndarray, shape (H, W) or (H, W, 1), floating point or integer, optional
        Registered to the image: metres where floating point, `LiftingConfig.integer_unit_m` where integer. Depth that
        is not, `DepthRegistration` brings there.
    camera : PinholeCamera, optional
        Without it, depth cannot become metres and there are no curves in space.
    index : int
        Position in the stream; a frame that could not be read leaves a hole.
    stamp : float, optional
        Time in seconds, up to 1e11.
    name : str
        Origin of the frame, for messages and file names.

    Raises
    ------
    InputError
        If neither image nor mask is given, or shapes or types are wrong or disagree, or the camera is for images of
        another size, or a stamp is no finite number of seconds.
    """

    image: AnyArray | None = None
    mask: AnyArray | None = None
    depth: AnyArray | None = None
    camera: PinholeCamera | None = None
    index: int = 0
    stamp: float | None = None
    name: str = ""

    def __post_init__(self) -> None:
        if self.image is None and self.mask is None:
            raise InputError("a frame needs an image or a mask, got neither")
        if self.image is not None:
            object.__setattr__(self, "image", _read_only(check_image(self.image)))
        if self.mask is not None:
            object.__setattr__(self, "mask", _read_only(check_mask(self.mask)))
        if self.depth is not None:
            object.__setattr__(self, "depth", _read_only(check_depth(self.depth)))
        for name in ("image", "mask", "depth"):
            array = getattr(self, name)
            if array is not None and array.shape[:2] != self.size:
                remedy = _REGISTER if name == "depth" else ""
                raise InputError(
                    f"{name} must have the frame's size {self.size} (rows, columns), got {array.shape[:2]}{remedy}"
                )
        if self.camera is not None:
            check_type("camera", self.camera, PinholeCamera)
            self.camera.check_size(self.size)
        _set(
            self,
            index=check_integer("index", self.index, 0, _MOST),
            stamp=check_stamp(self.stamp),
            name=check_text("name", self.name),
        )

    @property
    def size(self) -> tuple[int, int]:
        """``(H, W)``, rows and columns."""
        array = self.image if self.image is not None else self.mask
        assert array is not None  # the constructor saw to it
        return int(array.shape[0]), int(array.shape[1])


def _set(instance: object, **fields: object) -> None:
    """Replace fields of a frozen instance while it is made."""
    for name, value in fields.items():
        object.__setattr__(instance, name, value)


def _stage_ms(given: object) -> dict[str, float]:
    if not isinstance(given, Mapping):
        raise InputError(f"stage_ms must map stages to milliseconds, got {shown(given)}")
    return {
        check_text("a stage of stage_ms", stage): check_number("milliseconds of stage_ms", ms, 0.0, LARGEST)
        for stage, ms in given.items()
    }


def _check_curve(name: str, curve: object, ndim: int) -> None:
    if not isinstance(curve, BSplineCurve) or curve.ndim != ndim:
        raise InputError(f"{name} must be a BSplineCurve with {ndim} dimensions, got {shown(curve)}")


def _read_only(array: AnyArray) -> AnyArray:
    view = array.view()
    view.flags.writeable = False
    return view


@dataclass(frozen=True, eq=False)
class Detection:
    """One object in one frame.

    Parameters
    ----------
    centerline : Centerline
        The pixels that the curve was fitted to, and how they were linked.
    curve : BSplineCurve
        In the image, px.
    curve_3d : BSplineCurve, optional
        In the camera's frame, metres: the object's axis, or what was published, its surface. Its ``u`` is its own arc
        length in space, normalised, with hidden parts counted in; ``u = 0`` is at the same end as that of `curve`.
    no_3d_reason : str, optional
        Reason why there is no `curve_3d`.
    inferred_3d : tuple of (float, float)
        The intervals of the ``u`` of `curve_3d`, ascending, that no depth tells of: under another cable or an occluder,
        in holes of the depth image, where depth was not to be believed, and beyond the last depth at an end.

    Raises
    ------
    InputError
        If a field has another type, or the intervals are not ascending in 0..1.
    """

    centerline: Centerline
    curve: BSplineCurve
    curve_3d: BSplineCurve | None = None
    no_3d_reason: str | None = None
    inferred_3d: tuple[tuple[float, float], ...] = ()

    def __post_init__(self) -> None:
        check_type("centerline", self.centerline, Centerline)
        _check_curve("curve", self.curve, 2)
        if self.curve_3d is not None:
            _check_curve("curve_3d", self.curve_3d, 3)
        if self.no_3d_reason is not None:
            _set(self, no_3d_reason=check_text("no_3d_reason", self.no_3d_reason))
        _set(self, inferred_3d=check_spans("inferred_3d", self.inferred_3d))

    @classmethod
    def _unchecked(
        cls,
        centerline: Centerline,
        curve: BSplineCurve,
        curve_3d: BSplineCurve | None = None,
        no_3d_reason: str | None = None,
        inferred_3d: tuple[tuple[float, float], ...] = (),
    ) -> Detection:
        """Make what the constructor makes, faster."""
        detection = cls.__new__(cls)
        detection.__dict__.update(
            centerline=centerline, curve=curve, curve_3d=curve_3d, no_3d_reason=no_3d_reason, inferred_3d=inferred_3d
        )
        return detection

    @property
    def width(self) -> float:
        """Width of the object, px: twice the median radius along the centre line."""
        return self.centerline.width

    @property
    def joints(self) -> tuple[Joint, ...]:
        """Joints that link the segments, in order."""
        return self.centerline.joints

    @property
    def confidence(self) -> float:
        """That of the joint or of the open ends that the linking is least sure of, in 0..1."""
        return self.centerline.confidence

    @property
    def inferred(self) -> tuple[tuple[float, float], ...]:
        """The intervals of the ``u`` of `curve` that were inferred across gaps of the mask rather than seen."""
        return tuple(joint.u for joint in self.joints if joint.kind is JointKind.GAP)

    def reversed(self) -> Detection:
        """Return the same object run the other way."""
        curve_3d = None if self.curve_3d is None else self.curve_3d.reversed()
        inferred_3d = tuple((1.0 - high, 1.0 - low) for low, high in reversed(self.inferred_3d))
        return Detection._unchecked(
            self.centerline.reversed(), self.curve.reversed(), curve_3d, self.no_3d_reason, inferred_3d
        )

    def to_dict(self) -> dict[str, Any]:
        """Return plain values, ready for JSON."""
        return {
            "curve": self.curve.to_dict(),
            "curve_3d": None if self.curve_3d is None else self.curve_3d.to_dict(),
            "no_3d_reason": self.no_3d_reason,
            "inferred_3d": [list(interval) for interval in self.inferred_3d],
            "width_px": self.width,
            "confidence": self.confidence,
            "joints": [joint.to_dict() for joint in self.joints],
        }


@dataclass(frozen=True)
class Crossing:
    """Crossing of one object with another, or with itself, in the image.

    Parameters
    ----------
    position : (float, float)
        ``(x, y)`` px.
    passes : ((int, float), (int, float))
        The two that cross, each as the index of its detection in `FrameResult.detections` and the ``u`` in 0..1 of that
        detection's curve; the lower index first, and where both are of the same detection, the lower ``u``.
    top : int, optional
        Pass that lies on top, 0 or 1; None where that is not known.
    confidence : float
        Confidence in `top`, in 0..1; 0 where it is not known. Its meaning is that of the stage that made it.

    Raises
    ------
    InputError
        If a value is of another type or out of range.
    """

    position: Point
    passes: tuple[tuple[int, float], tuple[int, float]]
    top: int | None = None
    confidence: float = 0.0

    def __post_init__(self) -> None:
        passes = self.passes
        if not isinstance(passes, tuple) or [len(one) if isinstance(one, tuple) else 0 for one in passes] != [2, 2]:
            raise InputError(f"passes must be two pairs (detection, u), got {shown(passes)}")
        _set(
            self,
            position=check_pair("position", self.position, -LARGEST, LARGEST),
            passes=tuple(
                (check_integer("detection of a pass", number, 0, _MOST), check_number("u of a pass", u, 0.0, 1.0))
                for number, u in passes
            ),
            top=None if self.top is None else check_integer("top", self.top, 0, 1),
            confidence=check_number("confidence", self.confidence, 0.0, 1.0),
        )

    @classmethod
    def _unchecked(
        cls, position: Point, passes: tuple[tuple[int, float], tuple[int, float]], top: int | None, confidence: float
    ) -> Crossing:
        """Make what the constructor makes, faster."""
        crossing = cls.__new__(cls)
        crossing.__dict__.update(position=position, passes=passes, top=top, confidence=confidence)
        return crossing

    def to_dict(self) -> dict[str, Any]:
        """Return plain values, ready for JSON."""
        return {
            "position": list(self.position),
            "passes": [{"detection": detection, "u": u} for detection, u in self.passes],
            "top": self.top,
            "confidence": self.confidence,
        }


class TrackState(str, Enum):
    """Stage of a track's life."""

    TENTATIVE = "tentative"
    """Seen, but in too few frames to be sure."""
    CONFIRMED = "confirmed"
    """Seen in this frame."""
    HIDDEN = "hidden"
    """Nothing of it is seen in this frame; the curve is predicted."""


@dataclass(frozen=True, eq=False)
class Track:
    """One object through time, as it stands after one frame.

    Parameters
    ----------
    id : int
        From 1 on, never used again.
    state : TrackState
    curve : BSplineCurve
        In the image, px; ``u = 0`` stays at the same end from frame to frame.
    curve_3d : BSplineCurve, optional
        In the camera's frame, metres, in the same direction.
    hits : int
        Frames in which the object was detected, in all.
    misses : int
        Frames since it was last detected.
    detection : Detection, optional
        This frame's detection, run in the track's direction; the longest one, where several are parts of the object.
        None while hidden, and where the tracker was given bare curves.
    inferred : tuple of (float, float)
        The intervals of the ``u`` of `curve`, ascending, that this frame does not show.
    confidence : float
        Confidence in the curve, in 0..1: 1 where it is seen, and less the longer ago the inferred part of it was seen.
    width : float, optional
        Of the object, px, when it was last seen; None where no detection told it.

    Raises
    ------
    InputError
        If a value is of another type or out of range.
    """

    id: int
    state: TrackState
    curve: BSplineCurve
    curve_3d: BSplineCurve | None
    hits: int
    misses: int
    detection: Detection | None
    inferred: tuple[tuple[float, float], ...] = ()
    confidence: float = 1.0
    width: float | None = None

    def __post_init__(self) -> None:
        check_type("state", self.state, TrackState)
        _check_curve("curve", self.curve, 2)
        if self.curve_3d is not None:
            _check_curve("curve_3d", self.curve_3d, 3)
        if self.detection is not None:
            check_type("detection", self.detection, Detection)
        _set(
            self,
            id=check_integer("id", self.id, 1, _MOST),
            hits=check_integer("hits", self.hits, 0, _MOST),
            misses=check_integer("misses", self.misses, 0, _MOST),
            inferred=check_spans("inferred", self.inferred),
            confidence=check_number("confidence", self.confidence, 0.0, 1.0),
            width=None if self.width is None else check_number("width", self.width, 0.0, LARGEST),
        )

    @classmethod
    def _unchecked(
        cls,
        number: int,
        state: TrackState,
        curve: BSplineCurve,
        curve_3d: BSplineCurve | None,
        hits: int,
        misses: int,
        detection: Detection | None,
        inferred: tuple[tuple[float, float], ...],
        confidence: float,
        width: float | None,
    ) -> Track:
        """Make what the constructor makes, faster."""
        track = cls.__new__(cls)
        track.__dict__.update(
            id=number,
            state=state,
            curve=curve,
            curve_3d=curve_3d,
            hits=hits,
            misses=misses,
            detection=detection,
            inferred=inferred,
            confidence=confidence,
            width=width,
        )
        return track

    def to_dict(self) -> dict[str, Any]:
        """Return plain values, ready for JSON."""
        return {
            "id": self.id,
            "state": self.state.value,
            "hits": self.hits,
            "misses": self.misses,
            "curve": self.curve.to_dict(),
            "curve_3d": None if self.curve_3d is None else self.curve_3d.to_dict(),
            "inferred": [list(interval) for interval in self.inferred],
            "confidence": self.confidence,
            "width_px": self.width,
        }


@dataclass(frozen=True, eq=False)
class FrameResult:
    """Detections, crossings and tracks of a frame.

    Parameters
    ----------
    detections : tuple of Detection
        In a fixed order: the same mask gives the same order.
    tracks : tuple of Track
        By id; tracks that are gone are not listed.
    reason : str, optional
        Reason why nothing was detected; None where something was.
    stage_ms : mapping of str to float
        Milliseconds that each stage took, in the order in which they ran.
    index, stamp, name
        As the frame has them.
    size : (int, int)
        ``(H, W)`` of the frame.
    crossings : tuple of Crossing
        Crossings of the detections with each other and themselves, by their passes.
    dropped : tuple of Centerline
        Detections beyond the known number of objects (`ObjectsConfig.objects`).

    Raises
    ------
    InputError
        If a value is of another type or out of range.
    """

    detections: tuple[Detection, ...]
    tracks: tuple[Track, ...]
    reason: str | None
    size: tuple[int, int]
    stage_ms: Mapping[str, float] = field(default_factory=dict)
    index: int = 0
    stamp: float | None = None
    name: str = ""
    crossings: tuple[Crossing, ...] = ()
    dropped: tuple[Centerline, ...] = ()

    def __post_init__(self) -> None:
        _set(
            self,
            detections=check_all("detections", self.detections, Detection),
            tracks=check_all("tracks", self.tracks, Track),
            reason=None if self.reason is None else check_text("reason", self.reason),
            size=check_size("size", self.size, 0),
            index=check_integer("index", self.index, 0, _MOST),
            stamp=check_stamp(self.stamp),
            name=check_text("name", self.name),
            crossings=check_all("crossings", self.crossings, Crossing),
            stage_ms=_stage_ms(self.stage_ms),
            dropped=check_all("dropped", self.dropped, Centerline),
        )

    @classmethod
    def _unchecked(
        cls,
        detections: tuple[Detection, ...],
        tracks: tuple[Track, ...],
        reason: str | None,
        size: tuple[int, int],
        stage_ms: dict[str, float],
        index: int,
        stamp: float | None,
        name: str,
        crossings: tuple[Crossing, ...],
        dropped: tuple[Centerline, ...],
    ) -> FrameResult:
        """Make what the constructor makes, faster."""
        result = cls.__new__(cls)
        result.__dict__.update(
            detections=detections,
            tracks=tracks,
            reason=reason,
            size=size,
            stage_ms=stage_ms,
            index=index,
            stamp=stamp,
            name=name,
            crossings=crossings,
            dropped=dropped,
        )
        return result

    @property
    def total_ms(self) -> float:
        """Milliseconds of all stages together."""
        return sum(self.stage_ms.values())

    def to_dict(self) -> dict[str, Any]:
        """Return plain values, ready for JSON."""
        return {
            "index": self.index,
            "stamp": self.stamp,
            "name": readable(self.name),
            "size": list(self.size),
            "reason": self.reason,
            "detections": [detection.to_dict() for detection in self.detections],
            "crossings": [crossing.to_dict() for crossing in self.crossings],
            "dropped": [_dropped(line) for line in self.dropped],
            "tracks": [track.to_dict() for track in self.tracks],
            "stage_ms": dict(self.stage_ms),
        }


def _dropped(line: Centerline) -> dict[str, Any]:
    """Return what is known of an object that was dropped; without a curve, the ``u`` of its joints says nothing."""
    return {
        "start": line.points[0].tolist(),
        "end": line.points[-1].tolist(),
        "closed": line.closed,
        "width_px": line.width,
        "confidence": line.confidence,
    }


@dataclass(frozen=True, eq=False)
class StageTrace:
    """Everything between a frame and its curves, for pictures and for finding out what went wrong.

    Points are ``(x, y)`` px in the frame.

    Parameters
    ----------
    frame : Frame
    mask, cleaned : numpy.ndarray, shape (H, W), bool
        As segmented or given, and after the morphology.
    skeleton, endpoints, branch_points : numpy.ndarray, shape (n, 2)
        All skeleton pixels; those with one neighbour; those with more than two.
    segments, short_segments : tuple of Segment
        Paths of the walks: the ones kept, and the ones too short.
    result : FrameResult
    """

    frame: Frame
    mask: npt.NDArray[np.bool_]
    cleaned: npt.NDArray[np.bool_]
    skeleton: FloatArray
    endpoints: FloatArray
    branch_points: FloatArray
    segments: tuple[Segment, ...]
    short_segments: tuple[Segment, ...]
    result: FrameResult
