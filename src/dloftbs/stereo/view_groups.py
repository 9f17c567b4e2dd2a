"""Detections of all views that are one object: one in each view, and the parts of one that a view shows apart."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from dloftbs.camera import PinholeCamera
from dloftbs.stereo.curve_parts import joined, nodes_between
from dloftbs.stereo.epipolar_matching import EPIPOLAR_STD_PX, Match, match_views, pair_costs
from dloftbs.stereo.kernels.epipolar_paths import OPEN_COST
from dloftbs.stereo.space_fit import Pose, RigErrors
from dloftbs.stereo.view_curves import ViewCurve
from dloftbs.support.arrays import FloatArray

Costs = Mapping[tuple[int, int], FloatArray]
"""Costs of other evidence between the detections of two views, by their numbers; see `match_views`."""


class RigGeometry(NamedTuple):
    """Cameras of the views of one moment.

    Parameters
    ----------
    cameras : tuple of PinholeCamera
    steps : tuple of tuple of Pose
        From the frame of each view to that of each.
    errors : RigErrors
    focals_px : tuple of float
    rotations : numpy.ndarray, shape (n, n, 3, 3)
    shifts : numpy.ndarray, shape (n, n, 3)
        The steps, as arrays.
    """

    cameras: tuple[PinholeCamera, ...]
    steps: tuple[tuple[Pose, ...], ...]
    errors: RigErrors
    focals_px: tuple[float, ...]
    rotations: FloatArray
    shifts: FloatArray

    def epipolar_std(self, view: int) -> float:
        """Return the standard deviation of a right pair's distance from the epipolar constraint, of rays."""
        rotation, pixel = math.radians(self.errors.rotation_std_deg), self.errors.pixel_std / self.focals_px[view]
        return math.sqrt((EPIPOLAR_STD_PX / self.focals_px[view]) ** 2 + rotation**2 + 2.0 * pixel**2)


@dataclass
class Group:
    """Detections that are one object.

    Parameters
    ----------
    matches : dict of int to Match
        For each view that shows it, the detection that was matched; that of the first view is its own match.
    curves : dict of int to ViewCurve
        For each view its curve, all in the direction of the first one.
    pieces : dict of int to list of int
        For each view the detections that its curve consists of, in order.
    """

    matches: dict[int, Match]
    curves: dict[int, ViewCurve] = field(default_factory=dict)
    pieces: dict[int, list[int]] = field(default_factory=dict)

    def add(self, view: int, match: Match, curve: ViewCurve) -> None:
        """Add a view."""
        self.matches[view] = match
        self.curves[view] = curve.reversed() if match.backwards else curve
        self.pieces[view] = [match.second]


def group_detections(
    curves: Sequence[Sequence[ViewCurve]], geometry: RigGeometry, extra: Costs, carried: Costs
) -> list[Group]:
    """Return the groups of all detections; the first view that shows an object is the one that others match.

    Parameters
    ----------
    curves : sequence of sequence of ViewCurve
        Of each view.
    geometry : RigGeometry
    extra, carried : mapping of (int, int) to numpy.ndarray
        Evidence of this moment and of earlier ones.
    """
    groups: list[Group] = []
    for view, own in enumerate(curves):
        free = list(range(len(own)))
        for first in range(view):
            waiting = [group for group in groups if min(group.matches) == first and view not in group.matches]
            rows, columns = [group.matches[first].second for group in waiting], list(free)
            chosen = np.ix_(rows, columns)
            matches = match_views(
                [curves[first][i] for i in rows],
                [own[j] for j in columns],
                geometry.steps[first][view],
                geometry.epipolar_std(first),
                *(costs[first, view][chosen] if (first, view) in costs else None for costs in (extra, carried)),
            )
            for match in matches:
                number = columns[match.second]
                waiting[match.first].add(view, match._replace(first=rows[match.first], second=number), own[number])
                free.remove(number)
        for number in free:
            group = Group({})
            group.add(view, Match(number, number, False, 0.0, 1.0), own[number])
            groups.append(group)
    _join_pieces(groups, geometry, (extra, carried))
    return groups


def _join_pieces(groups: list[Group], geometry: RigGeometry, evidence: Sequence[Costs]) -> None:
    """Add what one view shows apart, and no other view does, to the objects of which it is a part."""
    for piece in [group for group in groups if len(group.matches) == 1]:
        ((view, own),) = piece.curves.items()
        if own.closed or own.problem is not None:
            continue
        (number,) = piece.pieces[view]
        best, chosen = 0.0, None
        for group in groups:
            if view not in group.matches or len(group.matches) < 2 or group.curves[view].closed:
                continue
            before = _cost(group, view, group.curves[view], geometry) - len(own.nodes) * _unlike(
                group, view, number, evidence
            )
            if before <= best:  # no piece can make it better than that
                continue
            for curve, order in _orders(group, view, own, number, geometry):
                gain = before - _cost(group, view, curve, geometry)
                if gain > best:
                    best, chosen = gain, (group, curve, order)
        if chosen is not None:
            group, group.curves[view], group.pieces[view] = chosen
            groups.remove(piece)


def _orders(
    group: Group, view: int, own: ViewCurve, number: int, geometry: RigGeometry
) -> Iterator[tuple[ViewCurve, list[int]]]:
    """Yield the curves that a piece makes at either end of an object's, run either way, and the order of pieces.

    Left out is what cannot fit better than without the piece: what a path gains by a piece is at most what one along
    the piece alone does, and what it gains in the gap.
    """
    curve, pieces, other = group.curves[view], group.pieces[view], _other(group, view)
    costs = pair_costs(group.curves[other], own, geometry.steps[other][view], geometry.epipolar_std(other))
    for alone, turned in zip(costs, (own, own.reversed()), strict=True):
        most = 0.5 * OPEN_COST * len(group.curves[other].nodes) - alone
        for first, second, order in ((curve, turned, [*pieces, number]), (turned, curve, [number, *pieces])):
            if most + 0.5 * OPEN_COST * nodes_between(first, second) > 0.0:
                yield joined(first, second), order


def _other(group: Group, view: int) -> int:
    """Return the first other view that shows an object."""
    return min(one for one in group.matches if one != view)


def _cost(group: Group, view: int, curve: ViewCurve, geometry: RigGeometry) -> float:
    """Return by how much a curve that an object may have in a view differs from that in another one, in all."""
    other = _other(group, view)
    forward, _ = pair_costs(group.curves[other], curve, geometry.steps[other][view], geometry.epipolar_std(other))
    return forward


def _unlike(group: Group, view: int, number: int, evidence: Sequence[Costs]) -> float:
    """Return what other evidence says against a detection's being a part of an object, as a cost of a point."""
    other = _other(group, view)
    partner = group.matches[other].second
    pair = min(other, view), max(other, view)
    place = (partner, number) if other < view else (number, partner)
    return sum(float(costs[pair][place]) for costs in evidence if pair in costs)
