"""The ends of cables, led on to where the mask shows that they end."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cached_property

import numpy as np

from dloftbs.data.graph import (
    FREE,
    POSITION,
    RAY,
    UNAVAILABLE,
    Graph,
    branch_of,
    is_start,
    other_end,
    start_of,
    stop_of,
)
from dloftbs.linking.bend_corners import between
from dloftbs.linking.cable_pieces import Piece, Points, Span
from dloftbs.linking.kernels.end_extension import extend_end
from dloftbs.linking.kernels.shown_ahead import REACH_WIDTHS, shown_ahead
from dloftbs.linking.matched_ends import Branches, EndMatching
from dloftbs.support.arrays import ByteArray, FloatArray, IntArray

_TAIL_WIDTHS = 6.0
"""Length before a free end that is given to its extension, widths.

Source: by hand; twice the 5.5 radii that `extend_end` looks at.
"""

_OUT_WIDTHS = 0.35
"""Least distance by which a cable's tip shows beyond the cable that it lies beside, widths.

Source: by hand; more than the pixel noise of an edge.
"""

_NOTHING: FloatArray = np.empty((0, 2))
"""No points.

Source: by definition.
"""


class CableAxes:
    """The axes of all cables of a frame, through junctions, too: what explains the mask beyond an end.

    Parameters
    ----------
    graph : Graph
    matching : EndMatching
    """

    def __init__(self, graph: Graph, matching: EndMatching) -> None:
        self._width, self._matching = graph.width, matching

    def near(self, end: int) -> FloatArray:
        """Return points (n, 2) of the axes of the other cables near an end that stays open at a junction, px."""
        axes, owners, low, high = self._axes
        here = self._matching.branches.end_states[end, POSITION]
        reach = REACH_WIDTHS * self._width
        is_near = ((high - here >= -reach) & (low - here <= reach)).all(axis=1) & (owners != branch_of(end))
        points = np.concatenate([_NOTHING, *(axes[k] for k in np.flatnonzero(is_near).tolist())])
        near: FloatArray = points[(np.abs(points - here) <= reach).all(axis=1)]
        return near

    @cached_property
    def _axes(self) -> tuple[list[FloatArray], IntArray, FloatArray, FloatArray]:
        """The axes in parts (n, 2), px, the branch of each, and the least and the largest x and y of each."""
        matching = self._matching
        branches, partner, nodes = matching.branches, matching.partner, matching.branches.nodes
        axes, owners = [], []
        for branch, span in enumerate(branches.spans):
            ends = start_of(branch), stop_of(branch)
            is_lone_spur = branches.spurs[branch] and matching.is_open(ends[0]) and matching.is_open(ends[1])
            # One without any end to join lies inside of a junction.
            if is_lone_spur or nodes[ends[0]] == nodes[ends[1]] == UNAVAILABLE:
                continue
            parts = [branches.points[slice(*span)]]
            parts += [
                between(*branches.end_states[[end, partner[end]], POSITION])
                for end in ends
                if partner[end] > end and matching.is_crossing(end)
            ]
            parts = [part for part in parts if len(part)]
            axes += parts
            owners += [branch] * len(parts)
        if not axes:
            return axes, np.array(owners, np.int64), _NOTHING, _NOTHING
        points, first = np.concatenate(axes), np.cumsum([0, *map(len, axes[:-1])])
        low, high = np.minimum.reduceat(points, first), np.maximum.reduceat(points, first)
        return axes, np.array(owners, np.int64), low, high


def extend_ends(
    mask: ByteArray,
    graph: Graph,
    matching: EndMatching,
    axes: CableAxes,
    chain: list[int],
    pieces: list[Piece],
    buffer: Points,
    branch_points: Mapping[int, tuple[FloatArray, float]],
) -> None:
    """Extend the free ends of a cable to the edge of the mask, and those at a branch point to it."""
    branches = matching.branches
    tail = int(_TAIL_WIDTHS * graph.width) + 8
    for end, at_start in ((chain[0], True), (other_end(chain[-1]), False)):
        spans = pieces[0].spans if at_start else pieces[-1].spans
        if end in branch_points:
            _lead_to(branch_points[end][0], graph, branches, end, spans, at_start, buffer)
        elif branches.nodes[end] >= 0:
            _extend_through_junction(mask, graph, matching, axes, end, spans, at_start, buffer)
        elif branches.nodes[end] == UNAVAILABLE:
            _extend_inside(mask, graph.width, branches, end, spans, at_start, buffer)
        if branches.nodes[end] != FREE or end in branch_points:
            continue
        start, stop, step = spans[0] if at_start else spans[-1]
        low, high = (start, stop) if step == 1 else (stop + 1, start + 1)
        towards_high = (step == 1) != at_start
        own = slice(max(high - tail, low), high) if towards_high else slice(low, min(low + tail, high))
        points = branches.points[own]
        radius = float(branches.radius[(own.start + own.stop) // 2])
        drop, added = extend_end(mask, points if towards_high else points[::-1], radius)
        low, high = (low, high - drop) if towards_high else (low + drop, high)
        cut = (low, high, 1) if step == 1 else (high - 1, low - 1, -1)
        spans[0 if at_start else -1] = cut
        _attach(added, radius, spans, at_start, buffer)


def _extend_through_junction(
    mask: ByteArray,
    graph: Graph,
    matching: EndMatching,
    axes: CableAxes,
    end: int,
    spans: list[Span],
    at_start: bool,
    buffer: Points,
) -> None:
    """Extend an end that stays open at a junction straight on, where the mask shows more than the other cables explain.

    That part of the cable is too short for a branch of its own.
    """
    branch, width = branch_of(end), graph.width
    if branch >= graph.branch_count:
        return
    ray = matching.branches.end_states[end, RAY]
    ahead = shown_ahead(mask, ray, axes.near(end), width)
    if ahead > 1.0:
        k = 0 if at_start else -1
        spans[k] = _clear_of_junction(graph, matching.branches, end, spans[k])
        _lead_on(spans, at_start, ray, ahead, width, buffer)


def _extend_inside(
    mask: ByteArray, width: float, branches: Branches, end: int, spans: list[Span], at_start: bool, buffer: Points
) -> None:
    """Lead a cable that ends inside of a shared branch straight on, where its mask shows beside the other cable.

    Its last width is left out: there the mask gets narrow, and its axis comes near to the other one.
    """
    start, stop, step = spans[0] if at_start else spans[-1]
    low, high = (start, stop) if step == 1 else (stop + 1, start + 1)
    own, last = branches.points[low:high], max(int(width), 2)
    if branch_of(end) not in branches.duplicate_of or len(own) < 3 * last:
        return
    towards_high = (step == 1) != at_start
    before = (own if towards_high else own[::-1])[-2 * last - 1 : -last]
    way = before[-1] - before[0]
    ray = np.concatenate((before[-1], way / max(float(np.hypot(*way)), 1e-9)))
    others = branches.points[slice(*branches.spans[branches.duplicate_of[branch_of(end)]])]
    ahead = shown_ahead(mask, ray, others, width)
    if ahead >= _OUT_WIDTHS * width:
        ahead = max(ahead, 0.5 * (ahead + last))  # the wide mask reaches as far as the tip or farther
        low, high = (low, high - last) if towards_high else (low + last, high)
        spans[0 if at_start else -1] = (low, high, 1) if step == 1 else (high - 1, low - 1, -1)
        _lead_on(spans, at_start, ray, ahead, width, buffer)


def _lead_on(spans: list[Span], at_start: bool, ray: FloatArray, length: float, width: float, buffer: Points) -> None:
    """Add the points of a straight line to one end of a cable."""
    points = ray[:2] + np.arange(1.0, round(length) + 1.0)[:, None] * ray[2:]
    _attach(points, 0.5 * width, spans, at_start, buffer)


def _attach(points: FloatArray, radius: float, spans: list[Span], at_start: bool, buffer: Points) -> None:
    """Add points, which lead away from a cable, to one of its ends."""
    first, last, _ = buffer.add(points, radius)
    if at_start:
        spans.insert(0, (last - 1, first - 1, -1))
    else:
        spans.append((first, last, 1))


def _lead_to(
    place: FloatArray, graph: Graph, branches: Branches, end: int, spans: list[Span], at_start: bool, buffer: Points
) -> None:
    """Lead a cable from where it is clear of a junction, and short of the branch point there, straight to that."""
    k = 0 if at_start else -1
    clear = _clear_of_junction(graph, branches, end, spans[k])
    first, last, step = spans[k] if clear[0] == clear[1] else clear  # of a short branch, nothing may be clear of it
    if first != last:
        inward = step if at_start else -step
        tip = first if at_start else last - step
        count = min(int(_TAIL_WIDTHS * graph.width), abs(last - first))
        beyond = tip + inward * count
        away = branches.points[tip : beyond if beyond >= 0 else None : inward] - place
        squares = away[:, 0] * away[:, 0] + away[:, 1] * away[:, 1]
        nearest = int(squares.argmin())
        tip += inward * nearest
        spans[k] = (tip, last, step) if at_start else (first, tip + step, step)
        length = math.sqrt(squares[nearest])
        way = away[nearest] / -max(length, 1e-9)
        at = np.append(np.arange(1.0, length), length)
        _attach(branches.points[tip] + at[:, None] * way, 0.5 * graph.width, spans, at_start, buffer)


def _clear_of_junction(graph: Graph, branches: Branches, end: int, span: Span) -> Span:
    """Cut off the points inside the junction at an end from a span of its branch; return other spans as they are."""
    first, last, step = span
    low, high = (first, last) if step == 1 else (last + 1, first + 1)
    branch = branch_of(end)
    if (
        branch >= graph.branch_count or low < graph.offsets[branch] or high > graph.offsets[branch + 1]
    ):  # the branch is too short to have a piece
        return span
    start, stop = branches.spans[branch]
    if is_start(end):
        low = min(max(low, start), high)
    else:
        high = max(min(high, stop), low)
    return (low, high, 1) if step == 1 else (high - 1, low - 1, -1)
