"""A chain of branches cut into the pieces of a cable, around its corners."""

from __future__ import annotations

import math
from bisect import bisect_right
from dataclasses import dataclass

import numpy as np

from dloftbs.data.graph import RAY, TANGENT, Graph, branch_of, is_start, start_of, stop_of
from dloftbs.linking.bend_corners import way_around
from dloftbs.linking.kernels.end_extension import is_seen
from dloftbs.linking.matched_ends import Branches, EndMatching
from dloftbs.support.arrays import ByteArray, FloatArray

_MIN_JUMP_PX = 2.0
"""Distance of neighbouring points between which there is room for another one, px.

Source: geometry; pixels of a skeleton are at most the square root of 2 apart.
"""

Span = tuple[int, int, int]
"""First point, the one after the last, step: 1 or -1."""


@dataclass(slots=True, eq=False)
class Piece:
    """Part of a cable: one branch, or several with nothing but spurs between them, and the joint that leads there."""

    spans: list[Span]
    entered: int
    cost: float
    margin: float
    through_junction: bool = False

    @property
    def count(self) -> int:
        """Number of points."""
        count = 0
        for start, stop, step in self.spans:
            count += (stop - start) * step
        return count


class Points:
    """Points of branches, and those added at corners and at extended ends."""

    def __init__(self, branches: Branches) -> None:
        self._points, self._radius = [branches.points], [branches.radius]
        self._first = [0]
        self._count = len(branches.points)

    def add(self, points: FloatArray, radius: float) -> Span:
        """Append points, and return their span."""
        self._points.append(points)
        self._first.append(self._count)
        self._radius.append(np.full(len(points), radius))
        self._count += len(points)
        return self._count - len(points), self._count, 1

    def at(self, number: int) -> tuple[float, float, float]:
        """Return a point, ``(x, y)``, and its radius."""
        part = bisect_right(self._first, number) - 1
        x, y = self._points[part][number - self._first[part]].tolist()
        return x, y, self._radius[part].item(number - self._first[part])

    def all(self) -> tuple[FloatArray, FloatArray]:
        """Return all points, and their radius."""
        if len(self._points) == 1:
            return self._points[0], self._radius[0]
        return np.concatenate(self._points), np.concatenate(self._radius)


def cut_into_pieces(
    mask: ByteArray,
    graph: Graph,
    offsets: list[int],
    matching: EndMatching,
    chain: list[int],
    degree: list[int],
    buffer: Points,
) -> list[Piece]:
    """Cut a chain into pieces at its joints; branches with only a spur between them make one piece."""
    branches, partner, costs, margins = matching.branches, matching.partner, matching.cost, matching.margin
    nodes, spans = branches.nodes, branches.spans
    width, last = graph.width, len(chain) - 1
    pieces: list[Piece] = []
    cost, margin, through = 0.0, math.inf, True
    for k, end in enumerate(chain):
        branch, node = branch_of(end), nodes[end]
        if k > 0:
            cost, margin = max(cost, costs[end]), min(margin, margins[end])
            through = through and node >= 0 and nodes[partner[end]] == node
        start, stop = spans[branch]
        if k in (0, last) or stop - start < 2:
            start, stop = _own_span(graph, offsets, matching, branch)
        if stop <= start:
            continue
        span = (start, stop, 1) if is_start(end) else (stop - 1, start - 1, -1)
        alone = bool(pieces) and through and degree[node] == 2
        own: list[Span] = [span]
        if pieces and through and (alone or _turns_back(branches, matching.partner[end], end)):
            route = _way_around_corner(mask, graph, matching, end, pieces[-1].spans[-1], span)
            if route is not None and (alone or _is_on(mask, route)):
                own = [buffer.add(route, float(branches.radius[span[0]])), span]
        if pieces and through and len(own) == 1:
            _, before, step = pieces[-1].spans[-1]
            through = is_seen(mask, branches.points, before - step, span[0], width)
        if alone and through:
            pieces[-1].spans += own
        else:
            pieces.append(Piece(own, end, cost, margin, bool(pieces) and through))
        cost, margin, through = 0.0, math.inf, True
    return pieces


def fill_junctions(piece: Piece, points: Points, *, closed: bool = False) -> None:
    """Add points, a px apart, where a piece goes straight on over a junction that is wider than a cable."""
    spans = [span for span in piece.spans if span[0] != span[1]]
    filled: list[Span] = []
    for before, span in zip([spans[-1], *spans[:-1]], spans, strict=True):
        if filled or closed:
            _, stop, step = before
            (ax, ay, radius), (bx, by, other) = points.at(stop - step), points.at(span[0])
            distance = math.hypot(bx - ax, by - ay)
            if distance > max(min(2.0 * radius, 2.0 * other), _MIN_JUMP_PX):
                share = np.linspace(0.0, 1.0, math.ceil(distance) + 1)[1:-1, None]
                way = (1.0 - share) * np.array((ax, ay)) + share * np.array((bx, by))
                filled.append(points.add(way, radius))
        filled.append(span)
    piece.spans = filled


def _way_around_corner(
    mask: ByteArray, graph: Graph, matching: EndMatching, end: int, before: Span, after: Span
) -> FloatArray | None:
    """Return the points of a cable that goes to a corner and back; None where there is no corner."""
    branches = matching.branches
    here, there = branches.end_states[matching.partner[end], RAY], branches.end_states[end, RAY]
    radius = min(float(branches.radius[before[1] - before[2]]), float(branches.radius[after[0]]))
    return way_around(mask, here, there, graph.width, radius, _stub(graph, end))


def _turns_back(branches: Branches, end: int, other: int) -> bool:
    """Return whether a cable turns by more than a right angle from one end to another."""
    ax, ay = branches.end_states[end, TANGENT].tolist()
    bx, by = branches.end_states[other, TANGENT].tolist()
    return bool(ax * bx + ay * by > 0.0)


def _is_on(mask: ByteArray, points: FloatArray) -> bool:
    """Return whether all of some points, ``(x, y)``, lie on a mask: where other cables are, a corner may be none."""
    columns, rows = np.rint(points).astype(np.int64).T
    inside = (rows >= 0) & (columns >= 0) & (rows < mask.shape[0]) & (columns < mask.shape[1])
    return bool(inside.all()) and bool(mask[rows, columns].all())


def _stub(graph: Graph, end: int) -> FloatArray | None:
    """Return the skeleton in the corner at an end, from the junction on; None where it has no branch there."""
    tip = int(graph.corners[end]) if end < len(graph.corners) else -1
    if tip < 0:
        return None
    branch = int(np.searchsorted(graph.offsets, tip, side="right")) - 1
    if graph.nodes[start_of(branch)] >= 0:
        return graph.points[graph.offsets[branch] : tip + 1]
    return graph.points[tip : graph.offsets[branch + 1]][::-1]


def _own_span(graph: Graph, offsets: list[int], matching: EndMatching, branch: int) -> tuple[int, int]:
    """Return the span of a branch that belongs to a cable: up to the first or last point at an end that stays open."""
    start, stop = matching.branches.spans[branch]
    if branch >= graph.branch_count:
        return start, stop
    partner = matching.partner
    return (
        offsets[branch] if partner[start_of(branch)] < 0 else start,
        offsets[branch + 1] if partner[stop_of(branch)] < 0 else stop,
    )
