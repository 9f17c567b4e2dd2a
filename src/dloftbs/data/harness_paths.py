"""Paths through branches and the branch points between them: the shortest, and smooth curves along them."""

from __future__ import annotations

import heapq
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.interpolate import make_interp_spline

from dloftbs.data.branch_point import BranchPoint, End
from dloftbs.data.curve import BSplineCurve
from dloftbs.data.detection import Detection
from dloftbs.support.arrays import FloatArray

_STEP_WIDTHS = 0.5
"""Distance of the points that a path through branches is laid through, widths.

Source: numerics; half of what a curve may bend by.
"""

_CLEAR_WIDTHS = 1.0
"""Length of a branch before a branch point that a path through it cuts across, widths.

Source: geometry; branches meet within a width.
"""

_MIN_SAMPLES = 4
"""Least number of points of a path.

Source: geometry; a cubic has four.
"""

_MAX_SAMPLES = 2000
"""Largest number of points of a branch that a path is laid through.

Source: bounds time.
"""


class Step(NamedTuple):
    """Branch of a path, and whether it is run from its end to its start."""

    branch: int
    backwards: bool


@dataclass(frozen=True, eq=False)
class Paths:
    """Branches that meet, and the paths through them.

    Parameters
    ----------
    detections : tuple of Detection
        All of a frame.
    branch_points : tuple of BranchPoint
    point_of : mapping of (int, int) to int
        Number of the branch point at each end that has one.
    """

    detections: tuple[Detection, ...]
    branch_points: tuple[BranchPoint, ...]
    point_of: Mapping[End, int]

    def shortest(self, start: End, *stops: End) -> list[Step] | None:
        """Return the shortest way from one end to the nearest of others; None where there is none."""
        first = self.detections[start[0]].curve.length
        queue: list[tuple[float, list[Step]]] = [(first, [Step(start[0], start[1] == 1)])]
        done: set[int] = set()
        while queue:
            length, steps = heapq.heappop(queue)
            last = steps[-1]
            leaves = last.branch, int(not last.backwards)
            if leaves in stops:
                return steps
            at = self.point_of.get(leaves)
            if at is None or at in done:
                continue
            done.add(at)
            for branch, end in self.branch_points[at].members:
                if (branch, end) != leaves:
                    own = self.detections[branch].curve.length
                    heapq.heappush(queue, (length + own, [*steps, Step(branch, end == 1)]))
        return None

    def met_by(self, end: End) -> list[End]:
        """List the ends that an end meets at its branch point; none where it has none."""
        at = self.point_of.get(end)
        return [] if at is None else [other for other in self.branch_points[at].members if other != end]

    def length(self, steps: Sequence[Step]) -> float:
        """Return the length of a way, px."""
        return sum(self.detections[step.branch].curve.length for step in steps)

    def curve_along(self, steps: Sequence[Step], *, in_space: bool) -> BSplineCurve | None:
        """Return one smooth curve along the branches of a path; None where one has none in space."""
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
