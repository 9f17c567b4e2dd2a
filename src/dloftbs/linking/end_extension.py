"""Stage 5, the result: the ends of cables, led on to where the mask shows that they end."""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from dloftbs._arrays import FloatArray
from dloftbs.graph import (
    FREE,
    POSITION,
    RAY,
    UNAVAILABLE,
    Branches,
    EndMatching,
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

_TAIL_WIDTHS = 6.0
"""Length before a free end that is given to its extension, widths.

Source: by hand; twice the 5.5 radii that `extend_end` looks at.
"""

_OUT_WIDTHS = 0.35
"""Least distance by which a cable's tip shows beyond the cable that it lies beside, widths.

Source: by hand; more than the pixel noise of an edge.
"""

_AHEAD_WIDTHS = 3.5
"""Largest distance from an open end to such a tip, widths.

Source: by hand; beyond it the tip would have a skeleton of its own.
"""

_CAP_PX = 4.5
"""Width up to which a cable's end counts as flat, px.

Source: geometry; the same limit as in `end_extension`, twice `_SEEN_PX`.
"""

_BESIDE_WIDTHS = 0.35
"""Distance from a cable's axis at which its mask is sought where another cable covers a part of it, widths.

Source: geometry; inside of its edge by more than a pixel's noise, and by so much that a round tip still shows.
"""

_CLEAR_WIDTHS = 0.1
"""Margin around the other cables in which mask tells nothing, widths; half a pixel is added.

Source: by hand; more than the noise of an edge.
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
        points, owners = self._points
        here = self._matching.branches.end_states[end, POSITION]
        is_near = (np.abs(points - here) <= (_AHEAD_WIDTHS + 1.0) * self._width).all(axis=1)
        return points[is_near & (owners != branch_of(end))]

    @cached_property
    def _points(self) -> tuple[FloatArray, npt.NDArray[np.int64]]:
        """The points of the axes (n, 2), px, and the branch of each."""
        matching = self._matching
        branches, partner, nodes = matching.branches, matching.partner, matching.branches.nodes
        axes, owners = [np.empty((0, 2))], []
        for branch, span in enumerate(branches.spans):
            ends = start_of(branch), stop_of(branch)
            is_lone_spur = branches.spurs[branch] and matching.is_open(ends[0]) and matching.is_open(ends[1])
            # One without any end to join lies inside of a junction.
            if is_lone_spur or nodes[ends[0]] == nodes[ends[1]] == UNAVAILABLE:
                continue
            before = len(axes)
            axes.append(branches.points[slice(*span)])
            axes += [
                between(*branches.end_states[[end, partner[end]], POSITION])
                for end in ends
                if partner[end] > end and matching.is_crossing(end)
            ]
            owners += [branch] * sum(map(len, axes[before:]))
        return np.concatenate(axes), np.array(owners, np.int64)


def extend_ends(
    mask: npt.NDArray[np.uint8],
    graph: Graph,
    matching: EndMatching,
    axes: CableAxes,
    chain: list[int],
    pieces: list[Piece],
    buffer: Points,
) -> None:
    """Extend the free ends of a cable to the edge of the mask."""
    branches = matching.branches
    tail = int(_TAIL_WIDTHS * graph.width) + 8
    for end, at_start in ((chain[0], True), (other_end(chain[-1]), False)):
        spans = pieces[0].spans if at_start else pieces[-1].spans
        if branches.nodes[end] >= 0:
            _extend_through_junction(mask, graph, matching, axes, end, spans, at_start, buffer)
        elif branches.nodes[end] == UNAVAILABLE:
            _extend_inside(mask, graph.width, branches, end, spans, at_start, buffer)
        if branches.nodes[end] != FREE:
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
        if at_start:
            spans[0] = cut
            first, last, _ = buffer.add(added, radius)
            spans.insert(0, (last - 1, first - 1, -1))
        else:
            spans[-1] = cut
            spans.append(buffer.add(added, radius))


def _extend_through_junction(
    mask: npt.NDArray[np.uint8],
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
    if branch >= graph.branch_count or not matching.is_open(end) or graph.spurs[branch]:
        return
    ray = matching.branches.end_states[end, RAY]
    ahead = _shown_ahead(mask, ray, axes.near(end), width)
    if ahead > 1.0:
        k = 0 if at_start else -1
        spans[k] = _clear_of_junction(graph, matching.branches, end, spans[k])
        _lead_on(spans, at_start, ray, ahead, width, buffer)


def _extend_inside(
    mask: npt.NDArray[np.uint8],
    width: float,
    branches: Branches,
    end: int,
    spans: list[Span],
    at_start: bool,
    buffer: Points,
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
    ahead = _shown_ahead(mask, ray, others, width)
    if ahead >= _OUT_WIDTHS * width:
        ahead = max(ahead, 0.5 * (ahead + last))  # the wide mask reaches as far as the tip or farther
        low, high = (low, high - last) if towards_high else (low + last, high)
        spans[0 if at_start else -1] = (low, high, 1) if step == 1 else (high - 1, low - 1, -1)
        _lead_on(spans, at_start, ray, ahead, width, buffer)


def _lead_on(spans: list[Span], at_start: bool, ray: FloatArray, length: float, width: float, buffer: Points) -> None:
    """Add the points of a straight line to one end of a cable."""
    first, last, _ = buffer.add(ray[:2] + np.arange(1.0, round(length) + 1.0)[:, None] * ray[2:], 0.5 * width)
    if at_start:
        spans.insert(0, (last - 1, first - 1, -1))
    else:
        spans.append((first, last, 1))


def _shown_ahead(mask: npt.NDArray[np.uint8], ray: FloatArray, others: FloatArray, width: float) -> float:
    """Return how far ahead a cable reaches at least: up to the last mask beside its axis that no other cable explains.

    Parameters
    ----------
    mask : numpy.ndarray, shape (H, W)
    ray : numpy.ndarray, shape (4,)
        Position and direction of its end.
    others : numpy.ndarray, shape (n, 2)
        Points along the axes of the others.
    width : float
        px.
    """
    position, direction = ray[:2], ray[2:]
    normal = np.array((-direction[1], direction[0]))
    along = np.arange(0.0, _AHEAD_WIDTHS * width)
    axis = position + along[:, None] * direction
    on_mask = _is_on(mask, axis)
    count = len(along) if on_mask.all() else int(np.argmin(on_mask))
    farthest = 0.0
    for aside in (-_BESIDE_WIDTHS, 0.0, _BESIDE_WIDTHS):
        asked = axis[:count] + aside * width * normal
        away = cKDTree(others).query(asked)[0] if len(others) else np.full(count, np.inf)
        (shown,) = np.nonzero(_is_on(mask, asked) & (away > (0.5 + _CLEAR_WIDTHS) * width + 0.5))
        if len(shown):
            cap = math.sqrt(0.25 - aside * aside) * width if width > _CAP_PX else 0.0  # reaches beyond the axis
            farthest = max(farthest, float(along[shown[-1]]) - cap)
    return farthest


def _is_on(mask: npt.NDArray[np.uint8], points: FloatArray) -> npt.NDArray[np.bool_]:
    """Tell which points lie on the mask."""
    columns, rows = np.rint(points).astype(np.int64).T
    inside = (rows >= 0) & (rows < mask.shape[0]) & (columns >= 0) & (columns < mask.shape[1])
    on_mask: npt.NDArray[np.bool_] = mask[rows * inside, columns * inside] != 0
    return on_mask & inside


def _clear_of_junction(graph: Graph, branches: Branches, end: int, span: Span) -> Span:
    """Cut off the points inside the junction at an end from a span of its branch; return other spans as they are."""
    first, last, step = span
    low, high = (first, last) if step == 1 else (last + 1, first + 1)
    branch = branch_of(end)
    if low < graph.offsets[branch] or high > graph.offsets[branch + 1]:  # the branch is too short to have a piece
        return span
    start, stop = branches.spans[branch]
    if is_start(end):
        low = min(max(low, start), high)
    else:
        high = max(min(high, stop), low)
    return (low, high, 1) if step == 1 else (high - 1, low - 1, -1)
