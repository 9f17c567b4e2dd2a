"""Objects that branch: their branch points, branches, and the ways through them from end to end."""

from __future__ import annotations

import heapq
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from scipy.interpolate import make_interp_spline

from dloftbs.data.centerline import Point
from dloftbs.data.curve import BSplineCurve
from dloftbs.data.detection import Detection
from dloftbs.errors import InputError
from dloftbs.support.arrays import LARGEST, FloatArray
from dloftbs.support.values import (
    MAX_WHOLE,
    check_all,
    check_integer,
    check_number,
    check_pair,
    check_type,
    list_of,
    set_fields,
    shown,
    values_of,
)

TRUNK_RATIO = 1.1
"""Width of the trunk, in widths of the widest other branch with a free end, from which it tells which one it is.

Source: by definition of `Harness.trunk`.
"""

_STEP_WIDTHS = 0.5
"""Distance of the points that a path through branches is laid through, widths.

Source: numerics; half of what a curve may bend by.
"""

_CLEAR_WIDTHS = 1.0
"""Length of a branch before a branch point that a path through it cuts across, widths.

Source: geometry; branches meet within a width.
"""

_DIRECTION_WIDTHS = 4.0
"""Length of a branch by which its direction at a branch point is told, widths.

Source: by hand; twice what branches that part at a small angle have in common.
"""

_TURNS_BACK_RAD = 0.75 * math.pi
"""Turn at a branch point from which a route does not follow it, rad.

Source: by definition; nearer to the way back than to a right angle.
"""

_MIN_SAMPLES = 4
"""Least number of points of a path.

Source: geometry; a cubic has four.
"""

_MAX_SAMPLES = 2000
"""Largest number of points of a branch that a path is laid through.

Source: bounds time.
"""

End = tuple[int, int]
"""End of a branch: the index of its detection in `FrameResult.detections`, and the end's ``u``, 0 or 1."""


@dataclass(frozen=True)
class BranchPoint:
    """Place at which three or more ends of branches meet.

    Parameters
    ----------
    position : (float, float)
        ``(x, y)`` px.
    members : tuple of (int, int)
        Ends that meet there, as ``(detection, end)``: the index of a detection in `FrameResult.detections`, and 0 or 1,
        the ``u`` of its end.
    confidence : float
        Probability that it is a branch point, in 0..1.
    position_3d : (float, float, float), optional
        In the camera's frame, metres; None where there is no depth.
    id : int, optional
        Number of it in a stream, from 1 on, never used again; None in a frame by itself.

    Raises
    ------
    InputError
        If a value is of another type or out of range.
    """

    position: Point
    members: tuple[End, ...]
    confidence: float
    position_3d: tuple[float, float, float] | None = None
    id: int | None = None

    def __post_init__(self) -> None:
        set_fields(
            self,
            position=check_pair("position", self.position, -LARGEST, LARGEST),
            members=tuple([check_end("a member", one) for one in list_of("members", self.members)]),
            confidence=check_number("confidence", self.confidence, 0.0, 1.0),
            position_3d=None if self.position_3d is None else _in_space(self.position_3d),
            id=None if self.id is None else check_integer("id", self.id, 1, MAX_WHOLE),
        )

    def to_dict(self) -> dict[str, Any]:
        """Return plain values, ready for JSON."""
        return {
            "id": self.id,
            "position": list(self.position),
            "position_3d": None if self.position_3d is None else list(self.position_3d),
            "members": [{"detection": detection, "end": end} for detection, end in self.members],
            "confidence": self.confidence,
        }

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> BranchPoint:
        """Build a branch point from what `to_dict` gave, without loss.

        Raises
        ------
        InputError
            If it is no dictionary, a key is missing or a value is wrong.
        """
        keys = "id", "position", "position_3d", "members", "confidence"
        number, position, position_3d, rows, confidence = values_of("a branch point", data, *keys)
        members = tuple([tuple(values_of("a member", row, "detection", "end")) for row in list_of("members", rows)])
        return cls(position, members, confidence, position_3d, number)


@dataclass(frozen=True, eq=False)
class Route:
    """Way through an object from one end to another.

    Parameters
    ----------
    curve : BSplineCurve
        In the image, px.
    width : float
        Mean width along it, px.
    harness : int
        Index in `FrameResult.harnesses`.
    ends : ((int, int), (int, int))
        Ends at its start and at its end, as ``(detection, end)``.
    """

    curve: BSplineCurve
    width: float
    harness: int
    ends: tuple[End, End]

    def to_dict(self) -> dict[str, Any]:
        """Return plain values, ready for JSON; the curve follows from the harness."""
        return {
            "ends": [{"detection": detection, "end": end} for detection, end in self.ends],
            "length_px": self.curve.length,
            "width_px": self.width,
        }


class Routes(tuple[Route, ...]):
    """The routes of a harness from the end of its trunk; called, those from another end."""

    _harness: Harness

    def __call__(self, *, trunk: End) -> tuple[Route, ...]:
        """Return the routes from another end of the harness than that of its trunk.

        Parameters
        ----------
        trunk : (int, int)
            One of `Harness.ends`.

        Raises
        ------
        InputError
            If the harness has no such end.
        """
        return self._harness._routes_from(self._harness._checked(trunk))


class _Step(NamedTuple):
    """Branch of a path, and whether it is run from its end to its start."""

    branch: int
    backwards: bool


@dataclass(frozen=True, eq=False, repr=False)
class Harness:
    """Object of one branch or several, which meet at branch points.

    Parameters
    ----------
    detections : tuple of Detection
        All of the frame.
    branches : tuple of int
        Indices of its branches in these.
    branch_points : tuple of BranchPoint
        Those of its branches.
    index : int
        Its own index in `FrameResult.harnesses`.
    id : int, optional
        Number of it in a stream, from 1 on, never used again; None in a frame by itself.

    Raises
    ------
    InputError
        If a value is of another type or out of range.
    """

    detections: tuple[Detection, ...]
    branches: tuple[int, ...]
    branch_points: tuple[BranchPoint, ...] = ()
    index: int = 0
    id: int | None = None

    def __post_init__(self) -> None:
        found = check_all("detections", self.detections, Detection)
        set_fields(
            self,
            detections=found,
            branches=tuple(
                [check_integer("a branch", one, 0, len(found) - 1) for one in list_of("branches", self.branches)]
            ),
            branch_points=check_all("branch_points", self.branch_points, BranchPoint),
            index=check_integer("index", self.index, 0, MAX_WHOLE),
            id=None if self.id is None else check_integer("id", self.id, 1, MAX_WHOLE),
        )
        for point in self.branch_points:
            check_type("branch_points", point, BranchPoint)
            for branch, _ in point.members:
                if branch not in self.branches:
                    raise InputError(f"a branch point's members must be among the branches, got detection {branch}")

    def __repr__(self) -> str:
        parts = f"branches {len(self.branches)}", f"branch points {len(self.branch_points)}"
        return f"Harness({', '.join(parts)})"

    def to_dict(self) -> dict[str, Any]:
        """Return plain values, ready for JSON: its branches and ends by their detections, and its routes' widths."""
        return {
            "id": self.id,
            "branches": list(self.branches),
            "branch_points": [point.to_dict() for point in self.branch_points],
            "ends": [{"detection": detection, "end": end} for detection, end in self.ends],
            "length_px": self.length,
            "length_m": self.length_3d,
            "routes": [route.to_dict() for route in self.routes],
        }

    @classmethod
    def from_dict(cls, data: Mapping[str, Any], detections: tuple[Detection, ...], index: int = 0) -> Harness:
        """Build a harness from what `to_dict` gave, without loss.

        Parameters
        ----------
        data : mapping
        detections : tuple of Detection
            Those of its frame.
        index : int
            Its own in `FrameResult.harnesses`.

        Raises
        ------
        InputError
            If it is no dictionary, a key is missing or a value is wrong.
        """
        number, branches, rows = values_of("a harness", data, "id", "branches", "branch_points")
        points = tuple([BranchPoint.from_dict(row) for row in list_of("branch_points", rows)])
        return cls(detections, branches, points, index, number)

    @cached_property
    def _point_of(self) -> dict[End, int]:
        """Number of the branch point at each end that has one."""
        return {end: k for k, point in enumerate(self.branch_points) for end in point.members}

    @cached_property
    def ends(self) -> tuple[End, ...]:
        """Ends that lie at no branch point, as ``(detection, end)``: connectors, or where the frame shows no more."""
        return tuple(
            [
                (branch, end)
                for branch in self.branches
                for end in (0, 1)
                if (branch, end) not in self._point_of and not self.detections[branch].curve.closed
            ]
        )

    @property
    def length(self) -> float:
        """Length of all branches together, px."""
        return sum(self.detections[branch].curve.length for branch in self.branches)

    @property
    def length_3d(self) -> float | None:
        """Length of all branches together, metres; None where one has no curve in space."""
        curves = [self.detections[branch].curve_3d for branch in self.branches]
        return None if None in curves else sum(curve.length for curve in curves if curve is not None)

    @property
    def edges(self) -> list[tuple[str, str, dict[str, Any]]]:
        """Branches as edges with attributes, as `networkx.MultiGraph` reads them.

        A branch point is called ``"point 0"``, by its number in `branch_points`, an end ``"end 3.1"``, by its detection
        and its ``u``.
        """
        return [
            (
                self._name((branch, 0)),
                self._name((branch, 1)),
                {
                    "branch": branch,
                    "length_px": self.detections[branch].curve.length,
                    "width_px": self.detections[branch].width_px,
                },
            )
            for branch in self.branches
        ]

    def _name(self, end: End) -> str:
        return f"point {self._point_of[end]}" if end in self._point_of else f"end {end[0]}.{end[1]}"

    @cached_property
    def trunk(self) -> End | None:
        """End from which the routes lead; None where there is none, as of a loop.

        It is that of the branch that is wider than all others with a free end by a tenth, or without such a branch the
        end whose paths to the others share the longest stretch.
        """
        if len(self.ends) < 2:
            return self.ends[0] if self.ends else None
        widths = sorted([(self.detections[end[0]].width_px, end) for end in self.ends], reverse=True)
        other = next((width for width, end in widths if end[0] != widths[0][1][0]), 0.0)
        if widths[0][0] >= TRUNK_RATIO * other:
            return widths[0][1]
        return max(self.ends, key=self._shared_length)

    def _shared_length(self, end: End) -> float:
        """Return the length that the paths from an end to all others have in common, px."""
        paths = [steps for other in self.ends if other != end and (steps := self._way(end, other)) is not None]
        shared = 0.0
        for same in zip(*paths, strict=False):
            if len(set(same)) > 1:
                break
            shared += self.detections[same[0].branch].curve.length
        return shared

    def path(self, end_a: End, end_b: End) -> BSplineCurve:
        """Return one smooth curve in the image from one end to another, through the branch points between them.

        Parameters
        ----------
        end_a, end_b : (int, int)
            Two of `ends`; the curve starts at the first.

        Returns
        -------
        BSplineCurve
            px; of several ways, the shortest.

        Raises
        ------
        InputError
            If the harness has no such end, or both are the same.
        """
        curve = self._curve_along(self._steps(end_a, end_b), in_space=False)
        assert curve is not None
        return curve

    def path_3d(self, end_a: End, end_b: End) -> BSplineCurve | None:
        """Return the same in the camera's frame, metres; None where a branch on the way has no curve in space.

        Raises
        ------
        InputError
            As `path`.
        """
        return self._curve_along(self._steps(end_a, end_b), in_space=True)

    @cached_property
    def routes(self) -> Routes:
        """Ways from the end of the trunk to each other end, in the order of `ends`; ``routes(trunk=end)`` from another.

        A way that turns back at a branch point, by more than three quarters of a half turn, is no route: cables that
        come together there lead on side by side. Such an end has its route from the end that it faces.
        Branches on no such way, as those of a loop, are on one more each, from the trunk's end to where the way without
        them leads. An object without branch points has one route, from end to end.
        """
        found = Routes(self._routes_from(self.trunk))
        found._harness = self
        return found

    def _routes_from(self, trunk: End | None) -> tuple[Route, ...]:
        if trunk is None or len(self.branches) == 1:
            return tuple([self._route([_Step(branch, False)]) for branch in self.branches])
        ways = [steps for end in self.ends if end != trunk and (steps := self._way_to(trunk, end))]
        covered = {step.branch for steps in ways for step in steps}
        for branch in self.branches:
            if branch not in covered and (around := self._way_around(trunk, branch, ways)) is not None:
                ways.append(around)
                covered |= {step.branch for step in around}
        return tuple([self._route(steps) for steps in ways])

    def _route(self, steps: Sequence[_Step]) -> Route:
        curve = self._curve_along(steps, in_space=False)
        assert curve is not None
        lengths = np.array([self.detections[step.branch].curve.length for step in steps])
        widths = np.array([self.detections[step.branch].width_px for step in steps])
        ends = (steps[0].branch, int(steps[0].backwards)), (steps[-1].branch, int(not steps[-1].backwards))
        return Route(curve, float(lengths @ widths / max(lengths.sum(), 1e-9)), self.index, ends)

    def _checked(self, end: object) -> End:
        known = check_end("an end", end)
        if known not in self.ends:
            raise InputError(f"an end must be one of the harness's ends {self.ends}, got {known}")
        return known

    def _steps(self, end_a: End, end_b: End) -> list[_Step]:
        first, last = self._checked(end_a), self._checked(end_b)
        if first == last:
            raise InputError(f"a path leads from one end to another, got {first} twice")
        steps = self._way(first, last)
        if steps is None:
            raise InputError(f"the branches do not lead from {first} to {last}")
        return steps

    def _way(self, start: End, stop: End) -> list[_Step] | None:
        """Return the shortest way from one end to another; None where there is none."""
        queue: list[tuple[float, list[_Step]]] = [(0.0, [_Step(start[0], start[1] == 1)])]
        done: set[int] = set()
        while queue:
            length, steps = heapq.heappop(queue)
            last = steps[-1]
            leaves = last.branch, int(not last.backwards)
            if leaves == stop:
                return steps
            at = self._point_of.get(leaves)
            if at is None or at in done:
                continue
            done.add(at)
            length += self.detections[last.branch].curve.length
            for branch, end in self.branch_points[at].members:
                if (branch, end) != leaves:
                    heapq.heappush(queue, (length, [*steps, _Step(branch, end == 1)]))
        return None

    def _way_to(self, trunk: End, end: End) -> list[_Step] | None:
        """Return the way of the route to an end: from the trunk's, or where that turns back, from the one it faces."""
        steps = self._way(trunk, end)
        if steps is None or self._sharpest(steps) < _TURNS_BACK_RAD:
            return steps
        others = [self._way(other, end) for other in self.ends if other not in (trunk, end)]
        return min([steps, *(way for way in others if way is not None)], key=self._sharpest)

    def _sharpest(self, steps: Sequence[_Step]) -> float:
        """Return the sharpest turn of a way at a branch point, rad."""
        turns = [0.0]
        for before, after in pairwise(steps):
            ahead = self._away((before.branch, int(not before.backwards)))
            onward = self._away((after.branch, int(after.backwards)))
            turns.append(math.pi - math.acos(min(max(float(ahead @ onward), -1.0), 1.0)))
        return max(turns)

    def _away(self, end: End) -> FloatArray:
        """Return the unit direction in which a branch leads away from its end, shape (2,)."""
        found = self.detections[end[0]]
        share = min(_DIRECTION_WIDTHS * found.width_px / max(found.curve.length, 1e-9), 1.0)
        first, last = found.curve(np.array([0.0, share]) if end[1] == 0 else np.array([1.0, 1.0 - share]))
        way = last - first
        result: FloatArray = way / max(float(np.hypot(*way)), 1e-9)
        return result

    def _way_around(self, trunk: End, branch: int, ways: Sequence[list[_Step]]) -> list[_Step] | None:
        """Return the way of a route that takes a branch of a loop, too: the first one that passes both its ends."""
        points = self._point_of.get((branch, 0)), self._point_of.get((branch, 1))
        for steps in ways:
            passed = [self._point_of.get((step.branch, int(not step.backwards))) for step in steps[:-1]]
            if points[0] in passed and points[1] in passed:
                first, last = passed.index(points[0]), passed.index(points[1])
                if first > last:  # around the loop, and once more along what lies between
                    return self._looped(steps, last, first, _Step(branch, backwards=True))
                return self._looped(steps, first, last, _Step(branch, backwards=False))
        return None

    def _looped(self, steps: list[_Step], first: int, last: int, loop: _Step) -> list[_Step]:
        """Return a way that goes on to the later point, back by a branch to the earlier one, and on again."""
        if first == last:
            return [*steps[: first + 1], loop, *steps[first + 1 :]]
        back = _Step(loop.branch, not loop.backwards)
        return [*steps[: last + 1], back, *steps[first + 1 :]]

    def _curve_along(self, steps: Sequence[_Step], *, in_space: bool) -> BSplineCurve | None:
        curves = []
        for step in steps:
            found = self.detections[step.branch]
            curve = found.curve_3d if in_space else found.curve
            if curve is None:
                return None
            curves.append(curve.reversed() if step.backwards else curve)
        if len(curves) == 1:
            return curves[0]
        parts: list[FloatArray] = []
        for k, (step, curve) in enumerate(zip(steps, curves, strict=True)):
            found = self.detections[step.branch]
            widths = max(found.curve.length / found.width_px, 1e-9)
            clear = min(_CLEAR_WIDTHS / widths, 0.5)
            low, high = (clear if k else 0.0), (1.0 - clear if k + 1 < len(steps) else 1.0)
            count = min(math.ceil((high - low) * widths / _STEP_WIDTHS), _MAX_SAMPLES) + 1
            own = curve(np.linspace(low, high, count)) if high > low else np.empty((0, curve.ndim))
            parts += [own, curve(np.array([1.0]))] if k + 1 < len(steps) else [own]
        return smooth_curve(np.concatenate(parts))


def smooth_curve(points: FloatArray) -> BSplineCurve:
    """Return a cubic spline through points, shape (n, ndim), by the root of their distances."""
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    own = points[np.concatenate(([True], steps > 1e-9 * max(steps.sum(), 1e-9)))]
    if len(own) < _MIN_SAMPLES:
        share = np.linspace(0.0, 1.0, _MIN_SAMPLES)
        along = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(own, axis=0), axis=1))))
        own = np.stack([np.interp(share * along[-1], along, column) for column in own.T], axis=1)
    root = np.sqrt(np.linalg.norm(np.diff(own, axis=0), axis=1))
    t = np.concatenate(([0.0], np.cumsum(root)))
    spline = make_interp_spline(t / t[-1], own, k=3)
    return BSplineCurve(spline.t, spline.c)


def check_end(name: str, value: object) -> End:
    """Return an end ``(detection, end)``, checked.

    Raises
    ------
    InputError
        If it is none.
    """
    if not isinstance(value, (tuple, list)) or len(value) != 2:
        raise InputError(f"{name} must be (detection, end), got {shown(value)}")
    return check_integer(f"detection of {name}", value[0], 0, MAX_WHOLE), check_integer(
        f"end of {name}", value[1], 0, 1
    )


def _in_space(value: object) -> tuple[float, float, float]:
    if not isinstance(value, (tuple, list)) or len(value) != 3:
        raise InputError(f"position_3d must be (x, y, z), got {shown(value)}")
    x, y, z = [check_number("position_3d", one, -LARGEST, LARGEST) for one in value]
    return x, y, z


def find_harnesses(detections: tuple[Detection, ...]) -> tuple[tuple[BranchPoint, ...], tuple[Harness, ...]]:
    """Group detections whose ends meet in branch points: an object without any is a harness of one branch.

    Parameters
    ----------
    detections : tuple of Detection
        Of a frame.

    Returns
    -------
    branch_points : tuple of BranchPoint
    harnesses : tuple of Harness
        In the order of their first branches.
    """
    at: dict[Point, tuple[list[End], float]] = {}
    for number, found in enumerate(detections):
        for end, met in enumerate(found.centerline.branch_ends):
            if met is not None:
                at.setdefault(met.point, ([], met.confidence))[0].append((number, end))
    points = tuple(
        [BranchPoint(place, tuple(ends), sure, _middle(detections, ends)) for place, (ends, sure) in at.items()]
    )
    group = list(range(len(detections)))
    for point in points:
        joined = {group[branch] for branch, _ in point.members}
        group = [min(joined) if one in joined else one for one in group]
    harnesses: list[Harness] = []
    for first in dict.fromkeys(group):
        branches = tuple([number for number, one in enumerate(group) if one == first])
        own = tuple([point for point in points if point.members[0][0] in branches])
        harnesses.append(Harness(detections, branches, own, len(harnesses)))
    return tuple([point for harness in harnesses for point in harness.branch_points]), tuple(harnesses)


def _middle(detections: Sequence[Detection], ends: Sequence[End]) -> tuple[float, float, float] | None:
    """Return the median of the ends of curves in space, metres; None where there are none."""
    curves = [(detections[number].curve_3d, end) for number, end in ends]
    known = [curve.end if end else curve.start for curve, end in curves if curve is not None]
    return None if not known else tuple(np.median(known, axis=0).tolist())
