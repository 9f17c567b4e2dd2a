"""Objects through time."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from enum import Enum
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple, cast

import numpy as np
import numpy.typing as npt

from dloftbs.camera import PinholeCamera
from dloftbs.data.curve import BSplineCurve, check_curve, spans_by_length
from dloftbs.data.detection import Detection
from dloftbs.data.deviation import WEIGHTS, WEIGHTS_3D, with_hidden
from dloftbs.data.object_shape import ObjectShape
from dloftbs.data.spans import Spans, outside
from dloftbs.data.u_mapping import is_in_front
from dloftbs.errors import InputError
from dloftbs.support.arrays import LARGEST, FloatArray, as_points, frozen
from dloftbs.support.values import (
    MAX_WHOLE,
    check_integer,
    check_number,
    check_spans,
    check_type,
    extent_of,
    kind_of,
    list_of,
    set_fields,
    shown,
    values_of,
    varied,
)

_WHOLE = ((0.0, 1.0),)


class TrackState(str, Enum):
    """Stage of a track's life."""

    TENTATIVE = "tentative"
    """Seen, but not yet sure to exist."""
    CONFIRMED = "confirmed"
    """Seen in this frame."""
    HIDDEN = "hidden"
    """Nothing of it is seen in this frame; the curve is predicted."""


class EndKind(str, Enum):
    """Kind of an end of a track's curve."""

    FREE = "free"
    """The object ends here, and the frame shows it."""
    BORDER = "border"
    """The curve ends at the image's border, within about a width and a half of it: the object may go on outside."""
    HIDDEN = "hidden"
    """The frame does not show this end: it was inferred, or something is known to hide what may follow."""
    HELD = "held"
    """A gripper of the frame holds this end, whether the frame shows it or not."""


class SeenPart(NamedTuple):
    """A detection that shows a part of a track, in the track's direction: spans of the splines' own parameters."""

    detection: Detection
    track_span: tuple[float, float]
    curve_span: tuple[float, float]

    def reversed(self, detection: Detection) -> SeenPart:
        """Return the same part of a track that is run the other way, and so is the detection that is given."""
        (low, high), (first, last) = self.track_span, self.curve_span
        return SeenPart(detection, (1.0 - high, 1.0 - low), (1.0 - last, 1.0 - first))

    def without_depth(self) -> Spans:
        """Return the spans of the track of whose depth the detection says nothing."""
        if self.detection.curve_3d is None:
            return (self.track_span,)
        (low, high), (first, last) = self.track_span, self.curve_span
        curve, unknown = self.detection.curve, self.detection.inferred_3d
        if self.detection.camera is not None and is_in_front(self.detection.curve_3d):
            unknown = tuple([(float(a), float(b)) for a, b in map(self.detection.u_2d, unknown)])
        clipped = [np.clip(curve.t_at(span), first, last).tolist() for span in unknown]
        places = [((a - first) / (last - first), (b - first) / (last - first)) for a, b in clipped if b > a]
        return tuple([(low + a * (high - low), low + b * (high - low)) for a, b in places])


@dataclass(frozen=True, eq=False, repr=False)
class Track(ObjectShape):
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
        The intervals of the ``u`` of `curve`, ascending, that this frame does not show; all of it while hidden.
    confidence : float
        Probability that the curve is right, less than 5 px off in an image of 1280 x 720, in 0..1; less the longer ago
        the inferred part of it was seen.
    width_px : float, optional
        Width of the object when it was last seen; None where no detection had one.
    ends : (EndKind, EndKind), optional
        Kinds of the curve's ends at ``u = 0`` and ``u = 1``; None for a loop, and where the tracker does not know them.
    velocity : numpy.ndarray, shape (n, 2), optional
        Velocity of the curve at even ``u`` from 0 to 1, px/s: of its shape, as a cable that slides along itself looks
        the same. None before it is known, as in an object's first frame.
    velocity_3d : numpy.ndarray, shape (n, 3), optional
        The same of `curve_3d`, m/s.
    camera : PinholeCamera, optional
        The one that `curve_3d` is in the frame of.

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
    inferred: tuple[tuple[float, float], ...] = field(default_factory=tuple)  # see `__getattr__`
    confidence: float = 1.0
    width_px: float | None = None
    ends: tuple[EndKind, EndKind] | None = None
    velocity: FloatArray | None = field(default_factory=lambda: None)
    velocity_3d: FloatArray | None = field(default_factory=lambda: None)
    camera: PinholeCamera | None = None

    def __post_init__(self) -> None:
        check_type("state", self.state, TrackState)
        check_curve("curve", self.curve, 2)
        if self.curve_3d is not None:
            check_curve("curve_3d", self.curve_3d, 3)
        if self.detection is not None:
            check_type("detection", self.detection, Detection)
        if self.camera is not None:
            check_type("camera", self.camera, PinholeCamera)
        set_fields(
            self,
            id=check_integer("id", self.id, 1, MAX_WHOLE),
            hits=check_integer("hits", self.hits, 0, MAX_WHOLE),
            misses=check_integer("misses", self.misses, 0, MAX_WHOLE),
            inferred=_WHOLE if self.state is TrackState.HIDDEN else check_spans("inferred", self.inferred),
            confidence=check_number("confidence", self.confidence, 0.0, 1.0),
            width_px=None if self.width_px is None else check_number("width_px", self.width_px, 0.0, LARGEST),
            ends=None if self.ends is None else _check_ends(self.ends),
            velocity=None if self.velocity is None else as_points("velocity", self.velocity, (2,)),
            velocity_3d=None if self.velocity_3d is None else as_points("velocity_3d", self.velocity_3d, (3,)),
        )

    if not TYPE_CHECKING:  # where it would vouch for any name

        def __getattr__(self, name: str) -> Any:
            """Measure the curves once somebody asks for what lies along their length: in most frames, nobody does."""
            fitted = self.__dict__.get("_fitted")
            if name not in ("inferred", "velocity", "velocity_3d") or fitted is None:
                raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
            inferred, velocity, velocity_3d = fitted
            if name == "inferred":
                value = spans_by_length(self.curve, inferred)
            elif name == "velocity":
                value = _by_length(self.curve, velocity)
            else:
                value = _by_length(self.curve_3d, velocity_3d)
            self.__dict__[name] = value
            return value

    def __repr__(self) -> str:
        in_space = "" if self.curve_3d is None else f", {self.curve_3d.length:.4g} m in space"
        extent = extent_of(self.curve.length, "px", self.curve.closed)
        return f"Track(id {self.id}, {self.state.value}, {extent}{in_space})"

    @cached_property
    def inferred_3d(self) -> Spans:
        """The intervals of the ``u`` of `curve_3d`, ascending, that this frame or its depth does not show."""
        if self.curve_3d is None:
            return ()
        seen = self.detection
        if seen is not None and self.curve_3d is seen.curve_3d and self.curve != seen.curve:
            return seen.inferred_3d  # of a rig, which has in space what is seen
        spans = self._unknown_in_space(self._parts)
        if self.detection is not None and not self._parts:
            spans += _spans_on(self.curve_3d, self.detection.curve_3d, self.detection.inferred_3d)
        return outside(outside(spans))

    def _way(self, seconds: float) -> tuple[FloatArray, FloatArray] | None:
        """Return how far the curve moves from its frame on in some seconds, or moved before, where a tracker knows it.

        It is given at even parameters of the spline, (n, 2) px, first as a whole; then what the change of the velocity
        adds to it, or all of it where no change is known.
        """
        _, velocity, _ = self.__dict__.get("_fitted", (None, None, None))
        if velocity is None:
            return None
        acceleration, age_s = self.__dict__["_fitted_change"]
        steady = seconds * velocity
        if acceleration is None:
            return steady, steady
        change = seconds * (age_s + 0.5 * seconds) * acceleration
        return steady + change, change

    @property
    def _parts(self) -> tuple[SeenPart, ...]:
        return self.__dict__.get("_fitted_parts", ())

    def _unknown_in_space(self, parts: Iterable[SeenPart]) -> list[tuple[float, float]]:
        """Return the intervals of the ``u`` of `curve_3d` that are inferred, or whose depth some parts do not show."""
        fitted = tuple(span for part in parts for span in part.without_depth())
        spans = [*self.inferred, *spans_by_length(self.curve, fitted)]
        if self.camera is None or self.curve_3d is None or not is_in_front(self.curve_3d):
            return spans
        return [(float(low), float(high)) for low, high in map(self.u_3d, spans)]

    def curve_std(self, u: npt.ArrayLike) -> FloatArray:
        """Return the standard deviation of points of `curve`, shape (...), px: as `Detection.curve_std`.

        Parts that this frame does not show are as sure as gaps of a mask that are as long.

        Raises
        ------
        InputError
            If a ``u`` is not on the curve, or the track holds no detection of this frame.
        """
        seen = self._seen()
        return _std_on(self.curve, seen.curve, seen.curve_std, self.inferred, 0.5 * seen.width_px, u)

    def curve_3d_std(self, u_3d: npt.ArrayLike) -> FloatArray:
        """Return the standard deviation of points of `curve_3d`, shape (...), metres: as `Detection.curve_3d_std`.

        Raises
        ------
        InputError
            If a ``u`` is not on the curve, there is no curve in space, or the track holds no detection of this frame.
        """
        seen, curve = self._seen(), self._in_space()
        if seen.curve_3d is None:
            raise InputError(f"the detection of the track has no curve in space: {seen.no_3d_reason}")
        unknown = outside(outside(self._unknown_in_space(one for one in self._parts if one.detection is not seen)))
        return _std_on(curve, seen.curve_3d, seen.curve_3d_std, unknown, 0.0, u_3d, WEIGHTS_3D[-1])

    def _seen(self) -> Detection:
        if self.detection is None:
            raise InputError("a track without a detection of its frame has no deviations: nothing of it was measured")
        return self.detection

    def _with_detection(self, detection: Detection) -> Track:
        """Return the track with a detection that has the same curve in the image and another one in space."""
        if detection.curve_3d is None and self._seen().curve_3d is None:
            return varied(self, detection=detection)
        place = {"curve_3d": detection.curve_3d, "camera": detection.camera, "velocity_3d": None, "_fitted_parts": ()}
        made = varied(self, detection=detection, **place)
        made.__dict__.pop("inferred_3d", None)
        return made

    def reversed(self) -> Track:
        """Return the same track run the other way."""
        seen = None if self.detection is None else self.detection.reversed()
        parts = [
            part.reversed(seen if seen is not None and part.detection is self.detection else part.detection.reversed())
            for part in reversed(self._parts)
        ]
        turned = replace(
            self,
            curve=self.curve.reversed(),
            curve_3d=None if self.curve_3d is None else self.curve_3d.reversed(),
            detection=seen,
            inferred=tuple((1.0 - high, 1.0 - low) for low, high in reversed(self.inferred)),
            ends=None if self.ends is None else (self.ends[1], self.ends[0]),
            velocity=None if self.velocity is None else self.velocity[::-1],
            velocity_3d=None if self.velocity_3d is None else self.velocity_3d[::-1],
        )
        return varied(turned, _fitted_parts=tuple(parts))

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
            "width_px": self.width_px,
            "ends": None if self.ends is None else [end.value for end in self.ends],
        }

    @classmethod
    def from_dict(cls, data: Mapping[str, Any], detection: Detection | None = None) -> Track:
        """Build a track from what `to_dict` gave, without loss; it has no velocities and no camera.

        Parameters
        ----------
        data : mapping
        detection : Detection, optional
            Of the same frame, run in the track's direction, which that leaves out.

        Raises
        ------
        InputError
            If it is no dictionary, a key is missing or a value is wrong.
        """
        keys = "id", "state", "hits", "misses", "curve", "curve_3d", "inferred", "confidence", "width_px", "ends"
        number, state, hits, misses, shape, shape_3d, inferred, *rest = values_of("a track", data, *keys)
        confidence, width, ends = rest
        return cls(
            number,
            kind_of("the state of a track", TrackState, state),
            BSplineCurve.from_dict(shape),
            None if shape_3d is None else BSplineCurve.from_dict(shape_3d),
            hits,
            misses,
            detection,
            inferred,
            confidence,
            width,
            None
            if ends is None
            else cast(Any, tuple(kind_of("an end of a track", EndKind, end) for end in list_of("ends", ends))),
        )


def _spans_on(curve: BSplineCurve, seen: BSplineCurve | None, spans: Spans) -> Spans:
    """Return intervals of a detection's curve on the curve of its track, between the nearest places."""
    if seen is None or curve == seen:
        return spans
    found: list[tuple[float, float]] = []
    for low, high in ([curve.nearest(point)[0] for point in seen(span)] for span in spans):
        found += [(low, high)] if low <= high else [(low, 1.0), (0.0, high)] if curve.closed else []
    return tuple(found)


def _std_on(
    curve: BSplineCurve,
    seen: BSplineCurve,
    std_of: Callable[[FloatArray], FloatArray],
    inferred: tuple[tuple[float, float], ...],
    margin: float,
    u: npt.ArrayLike,
    weight: float = WEIGHTS[-1],
) -> FloatArray:
    """Return the deviations (...) of a track's curve, from those of its detection's curve at the nearest places."""
    at = curve.u_at(curve.t_at(u))
    if curve == seen:
        return std_of(at)
    flat = np.mod(at.ravel(), 1.0) if curve.closed else at.ravel()
    places = np.array([seen.nearest(point)[0] for point in curve(flat)])
    return with_hidden(std_of(places), flat, inferred, curve.length, margin, weight).reshape(at.shape)


def _by_length(curve: BSplineCurve | None, values: FloatArray | None) -> FloatArray | None:
    """Return values (n, d) at even parameters of a spline as they are at even ``u``, read-only."""
    if curve is None or values is None:
        return None
    even = np.linspace(0.0, 1.0, len(values))
    return frozen(np.stack([np.interp(curve.t_at(even), even, column) for column in values.T], axis=1))


def _check_ends(ends: tuple[EndKind, EndKind]) -> tuple[EndKind, EndKind]:
    if not isinstance(ends, (tuple, list)) or len(ends) != 2:
        raise InputError(f"ends must be two of EndKind, got {shown(ends)}")
    for end in ends:
        check_type("an end", end, EndKind)
    return ends[0], ends[1]
