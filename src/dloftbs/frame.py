"""What goes in and what comes out: a frame of a stream, and what was found in it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Any

import numpy as np
import numpy.typing as npt

from dloftbs._arrays import FloatArray
from dloftbs.camera import PinholeCamera
from dloftbs.centerline import Centerline, Joint, JointKind, Point, Segment
from dloftbs.curve import BSplineCurve
from dloftbs.errors import InputError

AnyArray = npt.NDArray[Any]

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
        Time in seconds.
    name : str
        Where the frame comes from, for messages and file names.

    Raises
    ------
    InputError
        If neither image nor mask is given, or shapes or types are wrong or disagree, or the camera is for images of
        another size.
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
            self.camera.check_size(self.size)

    @property
    def size(self) -> tuple[int, int]:
        """``(H, W)``, rows and columns."""
        array = self.image if self.image is not None else self.mask
        assert array is not None  # the constructor saw to it
        return int(array.shape[0]), int(array.shape[1])


def check_image(image: npt.ArrayLike) -> AnyArray:
    """Return the image (H, W, 3) as an array.

    Raises
    ------
    InputError
        If it is not uint8 of that shape.
    """
    array = np.asarray(image)
    if array.ndim != 3 or array.shape[2] != 3 or array.dtype != np.uint8:
        raise InputError(f"image must have shape (H, W, 3) and type uint8, got {array.shape} of {array.dtype}")
    return array


def check_mask(mask: npt.ArrayLike) -> AnyArray:
    """Return the mask as an array (H, W) of bool or integers.

    Raises
    ------
    InputError
        If it has another shape or type.
    """
    array = np.asarray(mask)
    if array.ndim == 3 and array.shape[2] == 1:
        array = array[:, :, 0]
    if array.ndim != 2:
        raise InputError(f"mask must have shape (H, W) or (H, W, 1), got {array.shape}")
    if array.dtype != np.bool_ and not np.issubdtype(array.dtype, np.integer):
        raise InputError(f"mask must be bool or integer, any non-zero being cable, got {array.dtype}")
    return array


def check_depth(depth: npt.ArrayLike) -> AnyArray:
    """Return the depth as an array (H, W) of integers or floating point.

    Raises
    ------
    InputError
        If it has another shape or type.
    """
    array = np.asarray(depth)
    if array.ndim == 3 and array.shape[2] == 1:
        array = array[:, :, 0]
    if array.ndim != 2:
        raise InputError(f"depth must have shape (H, W) or (H, W, 1), got {array.shape}")
    if not (np.issubdtype(array.dtype, np.floating) or np.issubdtype(array.dtype, np.integer)):
        raise InputError(f"depth must be integer counts or floating-point metres, got {array.dtype}")
    return array


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
        length in space, normalised, what is hidden counted in; ``u = 0`` is at the same end as that of `curve`.
    no_3d_reason : str, optional
        Why there is no `curve_3d`.
    inferred_3d : tuple of (float, float)
        The intervals of the ``u`` of `curve_3d`, ascending, that no depth tells of: under another cable or an occluder,
        in holes of the depth image, where depth was not to be believed, and beyond the last depth at an end.
    """

    centerline: Centerline
    curve: BSplineCurve
    curve_3d: BSplineCurve | None = None
    no_3d_reason: str | None = None
    inferred_3d: tuple[tuple[float, float], ...] = ()

    @property
    def width(self) -> float:
        """Width of the object, px: twice the median radius along the centre line."""
        return self.centerline.width

    @property
    def joints(self) -> tuple[Joint, ...]:
        """How the segments were linked, in order."""
        return self.centerline.joints

    @property
    def confidence(self) -> float:
        """That of the joint or of the open ends that the linking is least sure of, in 0..1."""
        return min([self.centerline.ends_confidence, *(joint.confidence for joint in self.joints)])

    @property
    def inferred(self) -> tuple[tuple[float, float], ...]:
        """The intervals of the ``u`` of `curve` that were inferred across gaps of the mask rather than seen."""
        return tuple(joint.u for joint in self.joints if joint.kind is JointKind.GAP)

    def reversed(self) -> Detection:
        """Return the same object run the other way."""
        curve_3d = None if self.curve_3d is None else self.curve_3d.reversed()
        inferred_3d = tuple((1.0 - high, 1.0 - low) for low, high in reversed(self.inferred_3d))
        return Detection(self.centerline.reversed(), self.curve.reversed(), curve_3d, self.no_3d_reason, inferred_3d)

    def to_dict(self) -> dict[str, Any]:
        """Return plain values, ready for JSON, which has no infinity: an infinite margin becomes None."""
        return {
            "curve": self.curve.to_dict(),
            "curve_3d": None if self.curve_3d is None else self.curve_3d.to_dict(),
            "no_3d_reason": self.no_3d_reason,
            "inferred_3d": [list(interval) for interval in self.inferred_3d],
            "width_px": self.width,
            "confidence": self.confidence,
            "joints": [
                {
                    "kind": joint.kind.value,
                    "u": list(joint.u),
                    "cost": joint.cost,
                    "margin": joint.margin if math.isfinite(joint.margin) else None,
                    "confidence": joint.confidence,
                    "alternatives": [None if point is None else list(point) for point in joint.alternatives],
                }
                for joint in self.joints
            ],
        }


@dataclass(frozen=True)
class Crossing:
    """Where one object crosses another, or itself, in the image.

    Parameters
    ----------
    position : (float, float)
        ``(x, y)`` px.
    passes : ((int, float), (int, float))
        The two that cross, each as the index of its detection in `FrameResult.detections` and the ``u`` in 0..1 of that
        detection's curve; the lower index first, and where both are of the same detection, the lower ``u``.
    top : int, optional
        Which of the two passes, 0 or 1, lies on top; None where that is not known.
    confidence : float
        How sure that is, in 0..1; 0 where it is not known. What the number means, the stage says that made it.
    """

    position: Point
    passes: tuple[tuple[int, float], tuple[int, float]]
    top: int | None = None
    confidence: float = 0.0

    def to_dict(self) -> dict[str, Any]:
        """Return plain values, ready for JSON."""
        return {
            "position": list(self.position),
            "passes": [{"detection": detection, "u": u} for detection, u in self.passes],
            "top": self.top,
            "confidence": self.confidence,
        }


class TrackState(str, Enum):
    """Where in its life a track is."""

    TENTATIVE = "tentative"
    """Seen, but not often enough to be sure."""
    CONFIRMED = "confirmed"
    """Seen in this frame."""
    COASTING = "coasting"
    """Not seen in this frame; the curve is predicted."""


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
        None while coasting, and where the tracker was given bare curves.
    inferred : tuple of (float, float)
        The intervals of the ``u`` of `curve`, ascending, that this frame does not show.
    confidence : float
        How sure the curve is, in 0..1: 1 where it is seen, and less the longer ago the inferred part of it was seen.
    width : float, optional
        Of the object, px, when it was last seen; None where no detection told it.
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
    """What was found in a frame.

    Parameters
    ----------
    detections : tuple of Detection
        In a fixed order: the same mask gives the same order.
    tracks : tuple of Track
        By id; what is gone is not listed.
    reason : str, optional
        Why nothing was detected; None where something was.
    stage_ms : mapping of str to float
        Milliseconds that each stage took, in the order in which they ran.
    index, stamp, name
        As the frame has them.
    size : (int, int)
        ``(H, W)`` of the frame.
    crossings : tuple of Crossing
        Where the detections cross each other and themselves, by their passes.
    dropped : tuple of Centerline
        What was found beyond the known number of objects (`ObjectsConfig.objects`).
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

    @property
    def total_ms(self) -> float:
        """Milliseconds of all stages together."""
        return sum(self.stage_ms.values())

    def to_dict(self) -> dict[str, Any]:
        """Return plain values, ready for JSON."""
        return {
            "index": self.index,
            "stamp": self.stamp,
            "name": self.name,
            "size": list(self.size),
            "reason": self.reason,
            "detections": [detection.to_dict() for detection in self.detections],
            "crossings": [crossing.to_dict() for crossing in self.crossings],
            "dropped": [
                {"start": line.points[0].tolist(), "end": line.points[-1].tolist(), "width_px": line.width}
                for line in self.dropped
            ],
            "tracks": [track.to_dict() for track in self.tracks],
            "stage_ms": dict(self.stage_ms),
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
        What the walks found: the ones kept, and the ones too short.
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
