"""Objects that branch: their branch points, branches, and the ways through them from end to end."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from dloftbs.data.branch_point import BranchPoint, End, check_end
from dloftbs.data.centerline import Point
from dloftbs.data.curve import BSplineCurve
from dloftbs.data.detection import Detection
from dloftbs.data.harness_paths import Paths, Step
from dloftbs.data.harness_routes import Routing
from dloftbs.errors import InputError
from dloftbs.support.arrays import LARGEST
from dloftbs.support.values import (
    MAX_WHOLE,
    check_all,
    check_integer,
    check_number,
    check_type,
    list_of,
    set_fields,
    values_of,
)


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

    Raises
    ------
    InputError
        If a value is of another type or out of range.
    """

    curve: BSplineCurve
    width: float
    harness: int
    ends: tuple[End, End]

    def __post_init__(self) -> None:
        check_type("curve", self.curve, BSplineCurve)
        ends = tuple([check_end("an end", one) for one in list_of("ends", self.ends)])
        if len(ends) != 2:
            raise InputError(f"ends must be two, got {len(ends)}")
        width = check_number("width", self.width, 0.0, LARGEST)
        set_fields(self, width=width, harness=check_integer("harness", self.harness, 0, MAX_WHOLE), ends=ends)

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
    def _paths(self) -> Paths:
        return Paths(self.detections, self.branch_points, self._point_of)

    @cached_property
    def _routing(self) -> Routing:
        return Routing(self._paths, self.branches, self.ends)

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
        return self._routing.trunk()

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
        curve = self._paths.curve_along(self._steps(end_a, end_b), in_space=False)
        assert curve is not None
        return curve

    def path_3d(self, end_a: End, end_b: End) -> BSplineCurve | None:
        """Return the same in the camera's frame, metres; None where a branch on the way has no curve in space.

        Raises
        ------
        InputError
            As `path`.
        """
        return self._paths.curve_along(self._steps(end_a, end_b), in_space=True)

    @cached_property
    def routes(self) -> Routes:
        """Ways from the end of the trunk to each other end, in the order of `ends`; ``routes(trunk=end)`` from another.

        A way that turns back at a branch point, by more than three quarters of a half turn, is no route: cables that
        come together there lead on side by side. Such an end has its route from the end that it faces.
        Branches on no such way, as those of a loop, are on one more each, from the trunk's end to where the way without
        them leads. One that no way passes is reached from the trunk's end, and left for the nearest other end; without
        another end, the way leads back around to where it entered the loop, and ends there. Where all ways to a branch
        turn back, it has the straightest one of any two ends. An object without branch points has one route, from end
        to end.
        """
        found = Routes(self._routes_from(self.trunk))
        found._harness = self
        return found

    def _routes_from(self, trunk: End | None) -> tuple[Route, ...]:
        return tuple([self._route(steps) for steps in self._routing.ways(trunk)])

    def _route(self, steps: Sequence[Step]) -> Route:
        curve = self._paths.curve_along(steps, in_space=False)
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

    def _steps(self, end_a: End, end_b: End) -> list[Step]:
        first, last = self._checked(end_a), self._checked(end_b)
        if first == last:
            raise InputError(f"a path leads from one end to another, got {first} twice")
        steps = self._paths.shortest(first, last)
        if steps is None:
            raise InputError(f"the branches do not lead from {first} to {last}")
        return steps


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
