"""Output of a rig: the views' results, the objects in space, and their tracks."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy.typing as npt

from dloftbs.data.curve import BSplineCurve, check_curve
from dloftbs.data.deviation import deviation_at
from dloftbs.data.frame_result import FrameResult, checked_stage_ms
from dloftbs.data.inferred_spans import InferredSpans
from dloftbs.data.tracks import TrackState
from dloftbs.errors import InputError
from dloftbs.support.arrays import LARGEST, FloatArray, as_vector, frozen
from dloftbs.support.values import (
    MAX_WHOLE,
    check_all,
    check_flag,
    check_integer,
    check_number,
    check_spans,
    check_stamp,
    check_text,
    check_type,
    count_of,
    kind_of,
    list_of,
    set_fields,
    shown,
    values_of,
    varied,
)

Members = tuple[int | None, ...]


@dataclass(frozen=True, eq=False, repr=False)
class RigObject(InferredSpans):
    """One object as a rig sees it at one moment.

    Parameters
    ----------
    members : tuple of int or None
        For each view, the index of the object's detection there; None where the view does not show it.
    curve_3d : BSplineCurve, optional
        The object's axis in the frame of the first camera, metres. It covers what two views show from end to end.
        ``u = 0`` is at the same end as that of its first member's curve.
    no_3d_reason : str, optional
        Reason why there is no `curve_3d`.
    inferred_3d : tuple of (float, float)
        The intervals of the ``u`` of `curve_3d`, ascending, that are no measurement: fewer than two views show them, or
        their standard deviation is larger than the object is wide.
    width_m : float, optional
        Width of the object, metres.
    confidence : float
        Probability that the members are one object, by what is seen at this moment alone, in 0..1; 1 where there is
        one member.
    std_m : numpy.ndarray, shape (n,), optional
        Standard deviation of `curve_3d` at even parameters of its spline: see `curve_3d_std`.
    pieces : tuple of tuple of int, optional
        For each view, the indices of all its detections that are parts of the object, in the object's direction: its
        member, and where something hides a part in that view alone, what is beyond. Without them, the members.

    Raises
    ------
    InputError
        If a value is of another type or out of range.
    """

    members: Members
    curve_3d: BSplineCurve | None = None
    no_3d_reason: str | None = None
    inferred_3d: tuple[tuple[float, float], ...] = field(default_factory=tuple)  # see `InferredSpans`
    width_m: float | None = None
    confidence: float = 1.0
    std_m: FloatArray | None = None
    pieces: tuple[tuple[int, ...], ...] = ()

    def __post_init__(self) -> None:
        if not isinstance(self.members, (tuple, list)):
            raise InputError(f"members must be a detection's index or None for each view, got {shown(self.members)}")
        set_fields(
            self,
            members=tuple(
                None if one is None else check_integer("a member", one, 0, MAX_WHOLE) for one in self.members
            ),
            no_3d_reason=None if self.no_3d_reason is None else check_text("no_3d_reason", self.no_3d_reason),
            inferred_3d=check_spans("inferred_3d", self.inferred_3d),
            width_m=None if self.width_m is None else check_number("width_m", self.width_m, 0.0, LARGEST),
            confidence=check_number("confidence", self.confidence, 0.0, 1.0),
        )
        set_fields(self, pieces=_checked_pieces(self.pieces, self.members))
        if (self.curve_3d is None) != (self.std_m is None):
            raise InputError("curve_3d and std_m go together: give both or neither")
        if self.curve_3d is not None and self.std_m is not None:
            check_curve("curve_3d", self.curve_3d, 3)
            std = as_vector("std_m", self.std_m)
            if len(std) < 2 or not (std >= 0.0).all():
                raise InputError("std_m must be two numbers or more, none of them negative")
            set_fields(self, std_m=frozen(std))

    def __repr__(self) -> str:
        in_space = f"{self.curve_3d.length:.4g} m" if self.curve_3d is not None else "not in space"
        return f"RigObject(members {self.members}, {in_space})"

    def curve_3d_std(self, u: npt.ArrayLike) -> FloatArray:
        """Return the standard deviation of `curve_3d` across itself at places on it, metres, in the same shape.

        It comes from the noise of the images and the rig's stated errors: the root of the trace of the covariance
        across the curve, nearly all of which lies along the line of sight. Along itself a curve cannot be off.

        Raises
        ------
        InputError
            If there is no curve in space, with the reason, or a ``u`` is not in 0..1.
        """
        if self.curve_3d is None or self.std_m is None:
            raise InputError(f"there is no curve in space{f': {self.no_3d_reason}' if self.no_3d_reason else ''}")
        return deviation_at(self.std_m, self.curve_3d, u)

    def reversed(self) -> RigObject:
        """Return the same object run the other way."""
        if self.curve_3d is None or self.std_m is None:
            return self
        curve, std = self.curve_3d.reversed(), self.std_m[::-1].copy()
        pieces = tuple([own[::-1] for own in self.pieces])
        made = varied(self, curve_3d=curve, std_m=frozen(std), pieces=pieces)
        for name in ("inferred_3d", "_fitted_inferred_3d"):
            if name in self.__dict__:
                made.__dict__[name] = tuple([(1.0 - high, 1.0 - low) for low, high in reversed(self.__dict__[name])])
        return made

    def to_dict(self) -> dict[str, Any]:
        """Return plain values, ready for JSON."""
        return {
            "members": list(self.members),
            "curve_3d": None if self.curve_3d is None else self.curve_3d.to_dict(),
            "no_3d_reason": self.no_3d_reason,
            "inferred_3d": [list(span) for span in self.inferred_3d],
            "width_m": self.width_m,
            "confidence": self.confidence,
            "std_m": None if self.std_m is None else self.std_m.tolist(),
            "pieces": [list(own) for own in self.pieces],
        }

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> RigObject:
        """Build an object from what `to_dict` gave, without loss.

        Raises
        ------
        InputError
            If it is no dictionary, a key is missing or a value is wrong.
        """
        keys = "members", "curve_3d", "no_3d_reason", "inferred_3d", "width_m", "confidence", "std_m", "pieces"
        members, curve, *rest = values_of("an object of a rig", data, *keys)
        return cls(tuple(list_of("members", members)), None if curve is None else BSplineCurve.from_dict(curve), *rest)


def _checked_pieces(pieces: object, members: Members) -> tuple[tuple[int, ...], ...]:
    """Return a view's detections that are parts of an object.

    Raises
    ------
    InputError
        If they are no lists of indices, one for each view, that its member is in.
    """
    if not isinstance(pieces, (tuple, list)) or not all(isinstance(own, (tuple, list)) for own in pieces):
        raise InputError(f"pieces must be a list of indices for each view, got {shown(pieces)}")
    if not pieces:
        return tuple(() if one is None else (one,) for one in members)
    checked = tuple(tuple(check_integer("a piece", one, 0, MAX_WHOLE) for one in own) for own in pieces)
    if [None if not own else True for own in checked] != [None if one is None else True for one in members] or any(
        one is not None and one not in own for one, own in zip(members, checked, strict=True)
    ):
        raise InputError(f"pieces must hold each view's member, {shown(members)}, got {shown(pieces)}")
    return checked


@dataclass(frozen=True, eq=False, repr=False)
class RigTrack:
    """One object of a rig through time, as it stands after one moment.

    Parameters
    ----------
    id : int
        From 1 on, never used again.
    state : TrackState
        Hidden where no view shows it at this moment.
    object : int, optional
        Index of its object in `RigResult.objects`; None while hidden.
    members : tuple of int or None
        For each view, the id of its track there.
    backwards : tuple of bool
        For each view, whether its track there runs the other way; False also where the object never was in space.
    curve_3d : BSplineCurve, optional
        The last one in space, in the frame of the first camera, run in the track's direction, metres.
    hits, misses : int
        Moments in which it was seen, in all, and since it was last seen.

    Raises
    ------
    InputError
        If a value is of another type or out of range.
    """

    id: int
    state: TrackState
    object: int | None
    members: Members
    backwards: tuple[bool, ...]
    curve_3d: BSplineCurve | None
    hits: int
    misses: int

    def __post_init__(self) -> None:
        check_type("state", self.state, TrackState)
        if not isinstance(self.members, (tuple, list)):
            raise InputError(f"members must be a track's id or None for each view, got {shown(self.members)}")
        if not isinstance(self.backwards, (tuple, list)) or len(self.backwards) != len(self.members):
            raise InputError(f"backwards must be True or False for each view, got {shown(self.backwards)}")
        if self.curve_3d is not None:
            check_curve("curve_3d", self.curve_3d, 3)
        set_fields(
            self,
            id=check_integer("id", self.id, 1, MAX_WHOLE),
            object=None if self.object is None else check_integer("object", self.object, 0, MAX_WHOLE),
            members=tuple(
                None if one is None else check_integer("a member", one, 1, MAX_WHOLE) for one in self.members
            ),
            backwards=tuple(check_flag("backwards", one) for one in self.backwards),
            hits=check_integer("hits", self.hits, 0, MAX_WHOLE),
            misses=check_integer("misses", self.misses, 0, MAX_WHOLE),
        )

    def __repr__(self) -> str:
        return f"RigTrack(id {self.id}, {self.state.value}, members {self.members})"

    def to_dict(self) -> dict[str, Any]:
        """Return plain values, ready for JSON."""
        return {
            "id": self.id,
            "state": self.state.value,
            "object": self.object,
            "members": list(self.members),
            "backwards": list(self.backwards),
            "curve_3d": None if self.curve_3d is None else self.curve_3d.to_dict(),
            "hits": self.hits,
            "misses": self.misses,
        }

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> RigTrack:
        """Build a track from what `to_dict` gave, without loss.

        Raises
        ------
        InputError
            If it is no dictionary, a key is missing or a value is wrong.
        """
        keys = "id", "state", "object", "members", "backwards", "curve_3d", "hits", "misses"
        number, state, index, members, backwards, curve, hits, misses = values_of("a track of a rig", data, *keys)
        curve_3d = None if curve is None else BSplineCurve.from_dict(curve)
        kind = kind_of("state", TrackState, state)
        runs = tuple(list_of("backwards", backwards))
        return cls(number, kind, index, tuple(list_of("members", members)), runs, curve_3d, hits, misses)


@dataclass(frozen=True, eq=False, repr=False)
class RigResult:
    """Results of the views of one moment and the objects in space; as a sequence it is its objects.

    Parameters
    ----------
    views : tuple of FrameResult
        One for each view. Their detections that are part of an object in space have its curve as `curve_3d`, in the
        frame of their own camera and in their own direction, and so have the tracks and harnesses of these.
    objects : tuple of RigObject
        Those in space first. What one view alone shows is an object, too, and says why it is not in space.
    tracks : tuple of RigTrack
        By id; none where the moment was looked at by itself.
    stage_ms : mapping of str to float
        Milliseconds of matching the views and of fitting the curves in space.
    index : int
        Position in the stream.
    stamp : float, optional
        Time of the first view, seconds.

    Raises
    ------
    InputError
        If a value is of another type or out of range.
    """

    views: tuple[FrameResult, ...]
    objects: tuple[RigObject, ...]
    tracks: tuple[RigTrack, ...] = ()
    stage_ms: Mapping[str, float] = field(default_factory=dict)
    index: int = 0
    stamp: float | None = None

    def __post_init__(self) -> None:
        set_fields(
            self,
            views=check_all("views", self.views, FrameResult),
            objects=check_all("objects", self.objects, RigObject),
            tracks=check_all("tracks", self.tracks, RigTrack),
            stage_ms=checked_stage_ms(self.stage_ms),
            index=check_integer("index", self.index, 0, MAX_WHOLE),
            stamp=check_stamp(self.stamp),
        )

    def __getitem__(self, index: int) -> RigObject:
        return self.objects[index]

    def __iter__(self) -> Iterator[RigObject]:
        return iter(self.objects)

    def __len__(self) -> int:
        return len(self.objects)

    def __repr__(self) -> str:
        placed = sum(one.curve_3d is not None for one in self.objects)
        return f"RigResult(frame {self.index}: {count_of(len(self.objects), 'object')}, {placed} in space)"

    @property
    def total_ms(self) -> float:
        """Milliseconds of all views and of the rig together."""
        return sum(view.total_ms for view in self.views) + sum(self.stage_ms.values())

    def as_frame_result(self) -> FrameResult:
        """Return the result of the first view with the rig's ids, for sinks and drawings.

        Its tracks have the ids and directions of the rig's; what the first view's tracker does not know is left out.
        """
        view = self.views[0]
        own = {track.id: track for track in view.tracks}
        tracks = []
        for track in self.tracks:
            seen = own.get(track.members[0] or 0)
            if seen is not None:
                tracks.append(varied(seen.reversed() if track.backwards[0] else seen, id=track.id))
        stage_ms = {f"view {number}": one.total_ms for number, one in enumerate(self.views)}
        return replace(view, tracks=tuple(tracks), stage_ms={**stage_ms, **self.stage_ms})

    def to_dict(self) -> dict[str, Any]:
        """Return plain values, ready for JSON."""
        return {
            "index": self.index,
            "stamp": self.stamp,
            "views": [view.to_dict() for view in self.views],
            "objects": [one.to_dict() for one in self.objects],
            "tracks": [track.to_dict() for track in self.tracks],
            "stage_ms": dict(self.stage_ms),
        }

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> RigResult:
        """Build a result from what `to_dict` gave; of the views, what `FrameResult.from_dict` leaves out is not there.

        Raises
        ------
        InputError
            If it is no dictionary, a key is missing or a value is wrong.
        """
        keys = "index", "stamp", "views", "objects", "tracks", "stage_ms"
        index, stamp, views, objects, tracks, stage_ms = values_of("a result of a rig", data, *keys)
        return cls(
            tuple(FrameResult.from_dict(row) for row in list_of("views", views)),
            tuple(RigObject.from_dict(row) for row in list_of("objects", objects)),
            tuple(RigTrack.from_dict(row) for row in list_of("tracks", tracks)),
            stage_ms,
            index,
            stamp,
        )
