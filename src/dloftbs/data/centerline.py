"""Segments, the joints between them, and the centre line they make: the step between the skeleton and the curve."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from dloftbs.errors import InputError
from dloftbs.support.arrays import LARGEST, FloatArray, as_points, as_vector, frozen
from dloftbs.support.values import (
    check_all,
    check_flag,
    check_number,
    check_pair,
    check_spans,
    check_type,
    count_of,
    kind_of,
    shown,
    unchecked,
    values_of,
    varied,
)

Point = tuple[float, float]
"""``(x, y)`` px."""


class JointKind(str, Enum):
    """Kind of place that a joint bridges."""

    CROSSING = "crossing"
    """The mask goes on from one end to the other: the joint runs through a junction of the skeleton."""
    GAP = "gap"
    """The mask is interrupted: this part of the object was inferred, not seen."""


@dataclass(frozen=True, eq=False, repr=False)
class Segment:
    """A run of skeleton pixels without branches.

    Parameters
    ----------
    points : array_like, shape (n, 2)
        The pixels' centres in order, ``(x, y)`` px.
    radius : array_like, shape (n,)
        Half the width of the mask at each of them, px.

    Raises
    ------
    InputError
        If the shapes disagree or there is no point.
    """

    points: FloatArray
    radius: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", as_points("points", self.points, (2,)))
        object.__setattr__(self, "radius", as_vector("radius", self.radius, len(self.points)))
        if len(self.points) == 0:
            raise InputError("a segment needs at least one point, got none")

    @classmethod
    def _unchecked(cls, points: FloatArray, radius: FloatArray) -> Segment:
        """Wrap arrays that are known to be right and that nobody else will change."""
        return unchecked(cls, points=frozen(points), radius=frozen(radius))

    @classmethod
    def cut(cls, points: FloatArray, radius: FloatArray, start: int, stop: int) -> Segment:
        """Wrap a part of arrays that are known to be right and that are marked as read-only already."""
        return unchecked(cls, points=points[start:stop], radius=radius[start:stop])

    def __repr__(self) -> str:
        return f"Segment({count_of(len(self), 'point')})"

    def __len__(self) -> int:
        return len(self.points)

    def reversed(self) -> Segment:
        """Return the segment run the other way."""
        return self._unchecked(self.points[::-1], self.radius[::-1])


@dataclass(frozen=True)
class Joint:
    """Link from the end of one segment to the start of the next.

    Parameters
    ----------
    kind : JointKind
        Whether the mask goes on underneath.
    u : (float, float)
        The span that it covers: of a centre line, of the distance along its pixels, `Centerline.u`; of a detection,
        of the ``u`` of its curve.
    cost : float
        Cost of the link; for the published method ``J``.
    margin : float
        Extra cost of the next best choice in this frame, leaving both ends open included: negative where only the
        past speaks for the joint, infinite where there is no other choice.
    confidence : float
        Confidence of the linking in it, in 0..1, from the margin; its meaning is that of the linking that made it.
    alternatives : (point or None, point or None)
        Targets of its start and its end in the next best choice: the ``(x, y)`` px of another end, or None where it
        would stay open.

    Raises
    ------
    InputError
        If a value is of another type or out of range.
    """

    kind: JointKind
    u: tuple[float, float]
    cost: float
    margin: float
    confidence: float = 1.0
    alternatives: tuple[Point | None, Point | None] = (None, None)

    def __post_init__(self) -> None:
        check_type("kind", self.kind, JointKind)
        (u,) = check_spans("u", (self.u,))
        ends = self.alternatives
        if not isinstance(ends, (tuple, list)) or len(ends) != 2:
            raise InputError(f"alternatives must be two points or None, got {shown(ends)}")
        endless = isinstance(self.margin, float) and self.margin == math.inf
        self.__dict__.update(
            u=u,
            cost=check_number("cost", self.cost, 0.0, LARGEST),
            margin=math.inf if endless else check_number("margin", self.margin, -LARGEST, LARGEST),
            confidence=check_number("confidence", self.confidence, 0.0, 1.0),
            alternatives=tuple(
                None if end is None else check_pair("alternatives", end, -LARGEST, LARGEST) for end in ends
            ),
        )

    def to_dict(self) -> dict[str, Any]:
        """Return plain values, ready for JSON, which has no infinity: an infinite margin becomes None."""
        return {
            "kind": self.kind.value,
            "u": list(self.u),
            "cost": self.cost,
            "margin": self.margin if math.isfinite(self.margin) else None,
            "confidence": self.confidence,
            "alternatives": [None if point is None else list(point) for point in self.alternatives],
        }

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Joint:
        """Build a joint from what `to_dict` gave, without loss.

        Raises
        ------
        InputError
            If it is no dictionary, a key is missing or a value is wrong.
        """
        keys = "kind", "u", "cost", "margin", "confidence", "alternatives"
        kind, u, cost, margin, confidence, alternatives = values_of("a joint", data, *keys)
        return cls(
            kind_of("the kind of a joint", JointKind, kind),
            u,
            cost,
            math.inf if margin is None else margin,
            confidence,
            alternatives,
        )

    def reversed(self) -> Joint:
        """Return the joint as it lies on the reversed centre line."""
        u, alternatives = (1.0 - self.u[1], 1.0 - self.u[0]), (self.alternatives[1], self.alternatives[0])
        return varied(self, u=u, alternatives=alternatives)

    def _over(self, u: tuple[float, float]) -> Joint:
        """Return the joint with another span, as of another parameter along the same object."""
        return varied(self, u=u)


@dataclass(frozen=True)
class NearJoint:
    """Gap that was not bridged: another end that an end of a centre line may go on to.

    Parameters
    ----------
    u : float
        The end: 0 for the start, 1 for the other one.
    point : point
        ``(x, y)`` px of the end across the gap.
    confidence : float
        Probability that the two are one cable, in 0..1.

    Raises
    ------
    InputError
        If a value is of another type or out of range.
    """

    u: float
    point: Point
    confidence: float

    def __post_init__(self) -> None:
        self.__dict__.update(
            u=check_number("u", self.u, 0.0, 1.0),
            point=check_pair("point", self.point, -LARGEST, LARGEST),
            confidence=check_number("confidence", self.confidence, 0.0, 1.0),
        )
        if self.u not in (0.0, 1.0):
            raise InputError(f"u must be 0 or 1, an end of the centre line, got {shown(self.u)}")

    def to_dict(self) -> dict[str, Any]:
        """Return plain values, ready for JSON."""
        return {"u": self.u, "point": list(self.point), "confidence": self.confidence}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> NearJoint:
        """Build a near joint from what `to_dict` gave, without loss.

        Raises
        ------
        InputError
            If it is no dictionary, a key is missing or a value is wrong.
        """
        return cls(*values_of("a near joint", data, "u", "point", "confidence"))

    def reversed(self) -> NearJoint:
        """Return the near joint as it lies on the reversed centre line."""
        return NearJoint(1.0 - self.u, self.point, self.confidence)


@dataclass(frozen=True)
class BranchEnd:
    """Branch point at which an end of a centre line meets others.

    Parameters
    ----------
    point : point
        ``(x, y)`` px; the same for all ends that meet there.
    confidence : float
        Probability that it is a branch point, in 0..1.

    Raises
    ------
    InputError
        If a value is of another type or out of range.
    """

    point: Point
    confidence: float

    def __post_init__(self) -> None:
        self.__dict__.update(
            point=check_pair("point", self.point, -LARGEST, LARGEST),
            confidence=check_number("confidence", self.confidence, 0.0, 1.0),
        )


_REVERSED_LATE = "segments", "joints", "near_joints"
"""Fields of a reversed centre line that are made once somebody asks for them.

Source: by definition; all that have a direction.
"""


@dataclass(frozen=True, eq=False, repr=False)
class Centerline:
    """Segments in the order and direction in which one object runs through them.

    Parameters
    ----------
    segments : tuple of Segment
        At least one.
    joints : tuple of Joint
        One less than there are segments: ``joints[i]`` lies between ``segments[i]`` and ``segments[i + 1]``.
    closed : bool
        Whether the object is a loop without ends; then it is one segment, whose last pixel touches its first.
    near_joints : tuple of NearJoint
        The most probable gap that each end may go on across, where there is one that was not bridged.
    course_confidence : float
        Confidence that the mask shows its course, in 0..1; below 0.9 the mask is a lump, or has one on the way.
    existence : float
        Probability that it is a cable at all, and no debris or error of the segmentation, in 0..1.
    branch_ends : (BranchEnd or None, BranchEnd or None)
        Branch points at its start and at its end, None where there is none.

    Raises
    ------
    InputError
        If the counts disagree, or a part has another type.
    """

    segments: tuple[Segment, ...]
    joints: tuple[Joint, ...] = field(default_factory=tuple)  # not a class attribute, which would hide `__getattr__`
    closed: bool = False
    near_joints: tuple[NearJoint, ...] = field(default_factory=tuple)
    course_confidence: float = 1.0
    existence: float = 1.0
    branch_ends: tuple[BranchEnd | None, BranchEnd | None] = (None, None)

    def __post_init__(self) -> None:
        object.__setattr__(self, "segments", check_all("segments", self.segments, Segment))
        object.__setattr__(self, "joints", check_all("joints", self.joints, Joint))
        object.__setattr__(self, "near_joints", check_all("near_joints", self.near_joints, NearJoint))
        object.__setattr__(self, "closed", check_flag("closed", self.closed))
        object.__setattr__(self, "existence", check_number("existence", self.existence, 0.0, 1.0))
        if not self.segments:
            raise InputError("a centre line needs at least one segment")
        if len(self.joints) != len(self.segments) - 1:
            raise InputError(
                f"{len(self.segments)} segments need {len(self.segments) - 1} joints, got {len(self.joints)}"
            )
        if self.closed and len(self.segments) != 1:
            raise InputError(f"a closed centre line is one segment, got {len(self.segments)}")

    @classmethod
    def _unchecked(
        cls,
        segments: tuple[Segment, ...],
        joints: tuple[Joint, ...],
        closed: bool,
        near_joints: tuple[NearJoint, ...] = (),
        branch_ends: tuple[BranchEnd | None, BranchEnd | None] = (None, None),
        **known: FloatArray | float,
    ) -> Centerline:
        """Wrap parts that are known to fit together; `points`, `radius`, `u` or `width_px` may be given, too."""
        return unchecked(
            cls,
            segments=segments,
            joints=joints,
            closed=closed,
            near_joints=near_joints,
            branch_ends=branch_ends,
            **known,
        )

    def __repr__(self) -> str:
        parts = count_of(len(self.points), "point"), count_of(len(self.joints), "joint")
        return f"Centerline({'loop' if self.closed else 'open'}, {', '.join(parts)}, {self.width_px:.3g} px wide)"

    def _narrowed(self, factor: float) -> Centerline:
        """Return the same centre line with its width, and its radius everywhere, multiplied by a factor."""
        segments = tuple(Segment._unchecked(one.points, factor * one.radius) for one in self.segments)
        line = varied(self, width_px=factor * self.width_px, segments=segments)
        line.__dict__.pop("radius", None)
        return line

    def reversed(self) -> Centerline:
        """Return the centre line run the other way."""
        return unchecked(
            type(self),
            closed=self.closed,
            course_confidence=self.course_confidence,
            existence=self.existence,
            branch_ends=self.branch_ends[::-1],
            width_px=self.width_px,
            _forwards=self,
        )

    if not TYPE_CHECKING:  # where it would vouch for any name

        def __getattr__(self, name: str) -> Any:
            """Make the parts of a reversed centre line once somebody asks for them: of most tracks, nobody does."""
            forwards = self.__dict__.get("_forwards")
            if forwards is None or name not in _REVERSED_LATE:
                raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
            parts = tuple(part.reversed() for part in reversed(getattr(forwards, name)))
            self.__dict__[name] = parts
            return parts

    @cached_property
    def points(self) -> FloatArray:
        """All pixels in order, shape (n, 2), ``(x, y)`` px."""
        if len(self.segments) == 1:
            return self.segments[0].points
        return frozen(np.concatenate([s.points for s in self.segments]))

    @cached_property
    def radius(self) -> FloatArray:
        """Half the width of the mask at each pixel, shape (n,), px."""
        if len(self.segments) == 1:
            return self.segments[0].radius
        return frozen(np.concatenate([s.radius for s in self.segments]))

    @cached_property
    def width_px(self) -> float:
        """Width of the object: twice the median radius."""
        return 2.0 * float(np.median(self.radius))

    @property
    def ends_confidence(self) -> float:
        """The probability that no gap goes on from its ends, in 0..1."""
        return 1.0 - max((near.confidence for near in self.near_joints), default=0.0)

    @property
    def confidence(self) -> float:
        """The probability that it is a cable, all joints are right, no end goes on and no lump hides the course."""
        known = self.existence * self.ends_confidence * self.course_confidence
        return math.prod((joint.confidence for joint in self.joints), start=known)

    @property
    def gaps(self) -> tuple[tuple[float, float], ...]:
        """The spans of its joints that bridge gaps of the mask."""
        return tuple([joint.u for joint in self.joints if joint.kind is JointKind.GAP])

    @cached_property
    def u(self) -> FloatArray:
        """The distance along the pixels at each, normalised, shape (n,), which the spline is fitted by: its ``t``.

        Across a gap around a turn, the arc may count in place of the chord.
        """
        forwards: Centerline | None = self.__dict__.get("_forwards")
        if forwards is None:
            return frozen(arc_parameter(self.points, self.closed))
        return frozen(1.0 - forwards.u[::-1])


def arc_parameter(points: FloatArray, closed: bool = False) -> FloatArray:
    """Return the normalised cumulative distance along points, from 0 to 1.

    The parameter ``t`` of the paper (spline fitting): the Euclidean distances between neighbours, within segments and
    across the gaps between them alike, summed and divided by the total.

    Parameters
    ----------
    points : numpy.ndarray, shape (n, d)
    closed : bool
        Whether the way from the last point back to the first counts; then the last value is below 1.

    Returns
    -------
    numpy.ndarray, shape (n,)
        All zeros where all points are the same.
    """
    steps = points[1:] - points[:-1]
    parameter = np.zeros(len(points))
    np.cumsum(np.sqrt(np.einsum("ij,ij->i", steps, steps)), out=parameter[1:])
    total = parameter[-1] + (float(np.linalg.norm(points[0] - points[-1])) if closed else 0.0)
    return parameter / total if total > 0.0 else parameter
