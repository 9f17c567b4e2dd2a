"""Routes of a harness: the ways from the end of its trunk to each other end."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from itertools import pairwise

import numpy as np

from dloftbs.data.branch_point import End
from dloftbs.data.harness_paths import Paths, Step
from dloftbs.support.arrays import FloatArray

TRUNK_RATIO = 1.1
"""Width of the trunk, in widths of the widest other branch with a free end, from which it tells which one it is.

Source: by definition of `Harness.trunk`.
"""

_DIRECTION_WIDTHS = 4.0
"""Length of a branch by which its direction at a branch point is told, widths.

Source: by hand; twice what branches that part at a small angle have in common.
"""

_TURNS_BACK_RAD = 0.75 * math.pi
"""Turn at a branch point from which a route does not follow it, rad.

Source: by definition; nearer to the way back than to a right angle.
"""


class Routing:
    """Choice of the trunk of a harness and of the ways from its end.

    Parameters
    ----------
    paths : Paths
    branches : sequence of int
        Indices of its branches in the detections.
    ends : sequence of (int, int)
        Its ends that lie at no branch point.
    """

    def __init__(self, paths: Paths, branches: Sequence[int], ends: Sequence[End]) -> None:
        self._paths, self._branches, self._ends = paths, branches, ends
        self._detections = paths.detections

    def trunk(self) -> End | None:
        """Return the end from which the routes lead, as `Harness.trunk` has it."""
        if len(self._ends) < 2 or len(self._branches) == 1:
            return self._ends[0] if self._ends else None
        widths = sorted([(self._detections[end[0]].width_px, end) for end in self._ends], reverse=True)
        other = next((width for width, end in widths if end[0] != widths[0][1][0]), 0.0)
        if widths[0][0] >= TRUNK_RATIO * other:
            return widths[0][1]
        return max(self._ends, key=self._shared_length)

    def ways(self, trunk: End | None) -> list[list[Step]]:
        """Return the ways of the routes from an end, as `Harness.routes` has them."""
        if trunk is None or len(self._branches) == 1:
            return [[Step(branch, trunk == (branch, 1))] for branch in self._branches]
        others = [end for end in self._ends if end != trunk]
        ways = [steps for end in others if (steps := self._way_to(trunk, end))]
        if others and not any(steps[0].branch == trunk[0] for steps in ways):  # all turn back
            onward = [steps for end in others if (steps := self._paths.shortest(trunk, end))]
            ways += sorted(onward, key=self._sharpest)[:1]
        covered = {step.branch for steps in ways for step in steps}
        for branch in self._branches:
            if branch not in covered and (around := self._way_around(trunk, branch, ways)) is not None:
                ways.append(around)
                covered |= {step.branch for step in around}
        left = [
            (branch, steps)
            for branch in self._branches
            if branch not in covered
            if (steps := self._way_through(trunk, branch)) is not None
        ]
        for branch, steps in sorted(left, key=lambda item: self._paths.length(item[1]), reverse=True):
            if branch not in covered:  # the farthest first: the way there may take others
                ways.append(steps)
                covered |= {step.branch for step in steps}
        return ways

    def _shared_length(self, end: End) -> float:
        """Return the length that the paths from an end to all others have in common, px."""
        paths = [
            steps for other in self._ends if other != end and (steps := self._paths.shortest(end, other)) is not None
        ]
        shared = 0.0
        for same in zip(*paths, strict=False):
            if len(set(same)) > 1:
                break
            shared += self._detections[same[0].branch].curve.length
        return shared

    def _way_to(self, trunk: End, end: End) -> list[Step] | None:
        """Return the way of the route to an end: from the trunk's, or where that turns back, from the one it faces."""
        steps = self._paths.shortest(trunk, end)
        if steps is None or self._sharpest(steps) < _TURNS_BACK_RAD:
            return steps
        others = [self._paths.shortest(other, end) for other in self._ends if other not in (trunk, end)]
        return min([steps, *(way for way in others if way is not None)], key=self._sharpest)

    def _way_through(self, trunk: End, branch: int) -> list[Step] | None:
        """Return the way of the route that takes a branch that is on no way to an end: the shortest from the trunk's.

        Where that turns back, it is the straightest one from any end.
        """
        ways = self._ways_through(trunk, branch)
        shortest = min(ways, key=self._paths.length, default=None)
        if shortest is None or self._sharpest(shortest) < _TURNS_BACK_RAD:
            return shortest
        others = [way for end in self._ends if end != trunk for way in self._ways_through(end, branch)]
        return min([shortest, *ways, *others], key=self._sharpest)

    def _ways_through(self, start: End, branch: int) -> list[list[Step]]:
        """List the ways from an end through a branch, run either way: to the nearest other end, or back around."""
        others = [end for end in self._ends if end != start]
        found = []
        for enters, leaves in (((branch, 0), (branch, 1)), ((branch, 1), (branch, 0))):
            there = self._paths.shortest(start, leaves)
            onward = self._paths.shortest(enters, *(others or self._paths.met_by(enters)))
            if there is not None and onward is not None:
                found.append([*there, *onward[1:]])
        return found

    def _sharpest(self, steps: Sequence[Step]) -> float:
        """Return the sharpest turn of a way at a branch point, rad."""
        turns = [0.0]
        for before, after in pairwise(steps):
            ahead = self._away[before.branch, int(not before.backwards)]
            onward = self._away[after.branch, int(after.backwards)]
            turns.append(math.pi - math.acos(min(max(float(ahead @ onward), -1.0), 1.0)))
        return max(turns)

    @cached_property
    def _away(self) -> dict[End, FloatArray]:
        """The unit direction in which a branch leads away from each of its ends at branch points, shape (2,)."""
        return {end: self._direction(end) for end in self._paths.point_of}

    def _direction(self, end: End) -> FloatArray:
        found = self._detections[end[0]]
        share = min(_DIRECTION_WIDTHS * found.width_px / max(found.curve.length, 1e-9), 1.0)
        first, last = found.curve(np.array([0.0, share]) if end[1] == 0 else np.array([1.0, 1.0 - share]))
        way = last - first
        result: FloatArray = way / max(float(np.hypot(*way)), 1e-9)
        return result

    def _way_around(self, trunk: End, branch: int, ways: Sequence[list[Step]]) -> list[Step] | None:
        """Return the way of a route that takes a branch of a loop, too: the first one that passes both its ends."""
        points = self._paths.point_of.get((branch, 0)), self._paths.point_of.get((branch, 1))
        for steps in ways:
            passed = [self._paths.point_of.get((step.branch, int(not step.backwards))) for step in steps[:-1]]
            if points[0] in passed and points[1] in passed:
                first, last = passed.index(points[0]), passed.index(points[1])
                if first > last:  # around the loop, and once more along what lies between
                    return self._looped(steps, last, first, Step(branch, backwards=True))
                return self._looped(steps, first, last, Step(branch, backwards=False))
        return None

    def _looped(self, steps: list[Step], first: int, last: int, loop: Step) -> list[Step]:
        """Return a way that goes on to the later point, back by a branch to the earlier one, and on again."""
        if first == last:
            return [*steps[: first + 1], loop, *steps[first + 1 :]]
        back = Step(loop.branch, not loop.backwards)
        return [*steps[: last + 1], back, *steps[first + 1 :]]
