"""Stage 5, the result: end matching to centre lines, with free ends extended to the edge of the mask."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import accumulate, pairwise

import numpy as np
import numpy.typing as npt

from dloftbs._arrays import FloatArray, frozen
from dloftbs.centerline import Centerline, Joint, JointKind, Segment
from dloftbs.graph import (
    FREE,
    POSITION,
    RAY,
    Branches,
    EndMatching,
    Graph,
    branch_of,
    is_start,
    other_end,
    start_of,
    stop_of,
)
from dloftbs.kernels.polyline_lengths import lay_out
from dloftbs.linking.calibration import CROSSING, GAP
from dloftbs.linking.kernels.end_extension import extend_end, is_seen
from dloftbs.mask_crop import MaskCrop

_LEAST = 2
"""Smallest number of points of an open centre line.

Source: geometry; a line has two ends.
"""

_LEAST_AROUND = 8
"""Smallest number of points of a closed centre line.

Source: by hand; twice the four points that a cubic needs.
"""

_TAIL_WIDTHS = 6.0
"""Length before a free end that is given to its extension, widths.

Source: by hand; twice the 5.5 radii that `extend_end` looks at.
"""

_OUT_WIDTHS = 0.35
"""Least distance by which a cable's tip shows beyond the cable that it crosses, widths.

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

_MOST_HALF_TURN = 1.4
"""Largest half turn across a gap for which an arc lengthens the gap, rad.

Source: by hand; the arc over its chord diverges at pi.
"""

_CORNER_WIDTHS = 3.0
"""Largest distance from a branch end to the corner of its bend, widths.

Source: by hand.
"""

_PARALLEL = 0.4
"""Sine of the angle of two branch ends below which the point where they meet is uncertain.

Source: by hand; at this angle an error of 1 px aside is 2.5 px along.
"""

_STEEP = 0.5
"""Sine of the least angle at which a tip is sought beyond another cable.

Source: geometry; at 30 degrees the way across the other cable is two of its widths.
"""

_MOST_LOG_ODDS = 50.0
"""Largest log-odds of a joint, nats.

Source: numerics; the exponential of more overflows, and beyond 37 the confidence is 1 to the last bit.
"""

_CROSSING, _GAP = JointKind.CROSSING, JointKind.GAP  # members of an enumeration are slow to look up


_Span = tuple[int, int, int]  # first point, the one after the last, step: 1 or -1


@dataclass(slots=True, eq=False)
class _Piece:
    """Part of a cable: one branch, or several with nothing but spurs between them, and the joint that leads there."""

    spans: list[_Span]
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


class _Points:
    """Points of branches, and those added at corners and at extended ends."""

    def __init__(self, branches: Branches) -> None:
        self._points, self._radius = [branches.points], [branches.radius]
        self._count = len(branches.points)

    def add(self, points: FloatArray, radius: float) -> _Span:
        """Append points, and return their span."""
        self._points.append(points)
        self._radius.append(np.full(len(points), radius))
        self._count += len(points)
        return self._count - len(points), self._count, 1

    def all(self) -> tuple[FloatArray, FloatArray]:
        """Return all points, and their radius."""
        if len(self._points) == 1:
            return self._points[0], self._radius[0]
        return np.concatenate(self._points), np.concatenate(self._radius)


def assemble(crop: MaskCrop, graph: Graph, matching: EndMatching, least_widths: float) -> list[Centerline]:
    """Make a centre line of each cable.

    Parameters
    ----------
    crop : MaskCrop
    graph : Graph
    matching : EndMatching
    least_widths : float
        Shortest skeleton of a cable, in widths.

    Returns
    -------
    list of Centerline
        Cables with ends first, then loops.
    """
    least = max(least_widths * graph.width, _LEAST)
    around = max(2.0 * least, _LEAST_AROUND)
    buffer = _Points(matching.branches)
    lines: list[list[_Piece]] = []
    loops: list[list[_Piece]] = []
    doubts: list[float] = []
    left_out: dict[int, float] = {}  # how sure the nearest joint would be that an end does not have
    for lacking, cost, i, j in reversed(matching.near_joints):
        if matching.is_open(i) and matching.is_open(j):
            left_out[i] = left_out[j] = _confidence(-lacking, cost, is_crossing=False)
    left_over: set[int] = set()
    offsets, degree = graph.offsets.tolist(), _degrees(matching.branches)
    mask = crop.oriented(crop.pixels)
    for chain, is_loop in matching.chains():
        if _is_left_over(matching.branches, chain, left_over):
            left_over |= {branch_of(end) for end in chain}
            continue
        pieces = _pieces(mask, graph, offsets, matching, chain, degree, buffer)
        count = sum([piece.count for piece in pieces])
        if is_loop and count >= around:
            loops.append(pieces)
        elif not is_loop and count >= least:
            _extend_ends(mask, graph, matching, chain, pieces, buffer)
            lines.append(pieces)
            doubts.append(max(left_out.get(chain[0], 0.0), left_out.get(other_end(chain[-1]), 0.0)))
    for start, stop in graph.loops:
        if stop - start >= around:
            loops.append([_Piece([(start, stop, 1)], -1, 0.0, math.inf)])
    if not lines and not loops:
        return []
    return _lay_out(crop, matching, lines, loops, buffer, doubts)


def _lay_out(
    crop: MaskCrop,
    matching: EndMatching,
    lines: list[list[_Piece]],
    loops: list[list[_Piece]],
    buffer: _Points,
    doubts: list[float],
) -> list[Centerline]:
    """Make centre lines, in the image, of the pieces of cables with ends and of loops."""
    counts = [[piece.count for piece in pieces] for pieces in lines + loops]
    first = [0, *accumulate(map(sum, counts))]
    spans = [number for pieces in lines + loops for piece in pieces for span in piece.spans for number in span]
    points, radius, u, widths, positions = lay_out(
        *buffer.all(),
        np.array(spans).reshape(-1, 3),
        np.array(first),
        len(lines),
        matching.branches.end_states,
        *crop.image_transform,
    )
    for k, pieces in enumerate(lines):
        if len(pieces) > 1:
            _lengthen_gaps(u[first[k] : first[k + 1]], counts[k], matching, pieces)
    points, radius, u = frozen(points), frozen(radius), frozen(u)
    places = positions.tolist() if any(len(pieces) > 1 for pieces in lines) else []
    result: list[Centerline] = []
    for k, (width, (start, stop)) in enumerate(zip(widths.tolist(), pairwise(first), strict=True)):
        own = points[start:stop], radius[start:stop], u[start:stop], width
        if k < len(lines):
            result.append(_line(*own, counts[k], matching, lines[k], places, doubts[k]))
        else:
            result.append(_loop(*own))
    return result


def _degrees(branches: Branches) -> list[int]:
    """Count the ends at each junction, spurs left out."""
    nodes, spurs = branches.nodes, branches.spurs
    degree = [0] * (max(nodes, default=0) + 1)
    for end, node in enumerate(nodes):
        if node >= 0 and not spurs[branch_of(end)]:
            degree[node] += 1
    return degree


def _is_left_over(branches: Branches, chain: list[int], left_over: set[int]) -> bool:
    """Tell whether a chain consists of duplicates of shared branches alone, and has no free end."""
    duplicate_of, nodes = branches.duplicate_of, branches.nodes
    if not duplicate_of or any(duplicate_of.get(branch_of(end), -1) in left_over | {-1} for end in chain):
        return False
    return all(nodes[end] != FREE for end in (chain[0], other_end(chain[-1])))


def _pieces(
    mask: npt.NDArray[np.uint8],
    graph: Graph,
    offsets: list[int],
    matching: EndMatching,
    chain: list[int],
    degree: list[int],
    buffer: _Points,
) -> list[_Piece]:
    """Cut a chain into pieces at its joints; branches with only a spur between them make one piece."""
    branches, partner, costs, margins = matching.branches, matching.partner, matching.cost, matching.margin
    nodes, duplicate_of, spans = branches.nodes, branches.duplicate_of, branches.spans
    width, last = graph.width, len(chain) - 1
    pieces: list[_Piece] = []
    cost, margin, through = 0.0, math.inf, True
    for k, end in enumerate(chain):
        branch, node = branch_of(end), nodes[end]
        if k > 0:
            cost, margin = max(cost, costs[end]), min(margin, margins[end])
            through = through and node >= 0 and nodes[partner[end]] == node
        start, stop = spans[branch]
        if k in (0, last) or stop - start < 2:
            start, stop = _own_span(graph, offsets, matching, branch)
        if stop <= start or (branch in duplicate_of and pieces and stop - start < width):
            continue
        span = (start, stop, 1) if is_start(end) else (stop - 1, start - 1, -1)
        alone = bool(pieces) and through and degree[node] == 2
        route = _way_around_corner(mask, graph, matching, end, pieces[-1].spans[-1], span) if alone else None
        if route is not None:
            pieces[-1].spans += [buffer.add(route, float(branches.radius[span[0]])), span]
        else:
            if pieces and through:
                _, before, step = pieces[-1].spans[-1]
                through = is_seen(mask, branches.points, before - step, span[0], width)
            if alone and through:
                pieces[-1].spans.append(span)
            else:
                pieces.append(_Piece([span], end, cost, margin, bool(pieces) and through))
        cost, margin, through = 0.0, math.inf, True
    return pieces


def _corner(mask: npt.NDArray[np.uint8], graph: Graph, matching: EndMatching, end: int) -> FloatArray | None:
    """Return the corner of a bend that turns back: the intersection of its two tangents on the mask, or its mitre.

    The farther one is taken if both are known: the tangents of short branches intersect too early.
    """
    states = matching.branches.end_states
    ax, ay, adx, ady = states[matching.partner[end], RAY].tolist()
    bx, by, bdx, bdy = states[end, RAY].tolist()
    if adx * bdx + ady * bdy <= 0.0:
        return None
    known = graph.corners[end] if end < len(graph.corners) else -1
    mitre = graph.points[known] if known >= 0 else None
    sine = adx * bdy - ady * bdx
    if abs(sine) < _PARALLEL:
        return mitre
    ahead = ((bx - ax) * bdy - (by - ay) * bdx) / sine
    back = ((bx - ax) * ady - (by - ay) * adx) / sine
    row, column = int(ay + ahead * ady + 0.5), int(ax + ahead * adx + 0.5)
    near = min(ahead, back) > 0.0 and max(ahead, back) <= _CORNER_WIDTHS * graph.width
    if not (near and 0 <= row < mask.shape[0] and 0 <= column < mask.shape[1] and mask[row, column] != 0):
        return mitre
    meets = np.array((ax + ahead * adx, ay + ahead * ady))
    if mitre is not None and float((mitre - meets) @ (adx + bdx, ady + bdy)) > 0.0:
        return mitre
    return meets


def _way_around_corner(
    mask: npt.NDArray[np.uint8], graph: Graph, matching: EndMatching, end: int, before: _Span, after: _Span
) -> FloatArray | None:
    """Return the points of a cable that goes straight to a corner and back; None where there is no corner."""
    corner = _corner(mask, graph, matching, end)
    if corner is None:
        return None
    points = matching.branches.points
    here, there = points[before[1] - before[2]], points[after[0]]
    return np.concatenate((_between(here, corner), corner[None], _between(corner, there)))


def _between(start: FloatArray, stop: FloatArray) -> FloatArray:
    """Return the points between two others, about 1 px apart."""
    steps = max(int(np.hypot(*(stop - start))), 1)
    result: FloatArray = start + np.arange(1, steps)[:, None] / steps * (stop - start)
    return result


def _own_span(graph: Graph, offsets: list[int], matching: EndMatching, branch: int) -> tuple[int, int]:
    """Return the span of a branch that belongs to a cable: up to the first or last point at an end that stays open."""
    start, stop = matching.branches.spans[branch]
    if branch >= graph.branch_count:
        return start, stop
    if stop - start < 2 and matching.branches.spurs[branch]:
        return offsets[branch], offsets[branch + 1]
    partner = matching.partner
    return (
        offsets[branch] if partner[start_of(branch)] < 0 else start,
        offsets[branch + 1] if partner[stop_of(branch)] < 0 else stop,
    )


def _extend_ends(
    mask: npt.NDArray[np.uint8],
    graph: Graph,
    matching: EndMatching,
    chain: list[int],
    pieces: list[_Piece],
    buffer: _Points,
) -> None:
    """Extend the free ends of a cable to the edge of the mask."""
    branches = matching.branches
    tail = int(_TAIL_WIDTHS * graph.width) + 8
    for end, at_start in ((chain[0], True), (other_end(chain[-1]), False)):
        spans = pieces[0].spans if at_start else pieces[-1].spans
        if branches.nodes[end] >= 0:
            _extend_through_junction(graph, matching, end, spans, at_start, buffer)
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
    graph: Graph, matching: EndMatching, end: int, spans: list[_Span], at_start: bool, buffer: _Points
) -> None:
    """Extend an end that stays open at a junction straight on, where the mask sticks out beyond the junction.

    That part of the cable is too short for a branch of its own.
    """
    branch, width = branch_of(end), graph.width
    if branch >= graph.branch_count or not matching.is_open(end) or graph.spurs[branch]:
        return
    ahead = float(graph.clear_distance_px[end])
    if not _OUT_WIDTHS * width <= ahead <= _AHEAD_WIDTHS * width:
        return
    if ahead < _far_side(matching, end, width) + _OUT_WIDTHS * width:
        return
    x, y, dx, dy = matching.branches.end_states[end, RAY].tolist()
    cap = 0.5 * width if width > _CAP_PX else 0.0  # a thinner cable counts as cut off flat, as in end_extension
    steps = np.arange(1.0, ahead - cap)
    added = np.column_stack((x + steps * dx, y + steps * dy))
    k = 0 if at_start else -1
    spans[k] = _clear_of_junction(graph, matching.branches, end, spans[k])
    first, last, _ = buffer.add(added, 0.5 * width)
    if at_start:
        spans.insert(0, (last - 1, first - 1, -1))
    else:
        spans.append((first, last, 1))


def _clear_of_junction(graph: Graph, branches: Branches, end: int, span: _Span) -> _Span:
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


def _far_side(matching: EndMatching, end: int, width: float) -> float:
    """Return the distance from an end to the far side of the cables that pass its junction; inf for one along it."""
    states, nodes = matching.branches.end_states, matching.branches.nodes
    x, y, dx, dy = states[end, RAY].tolist()
    farthest, node = 0.0, nodes[end]
    for i in [k for k, own in enumerate(nodes) if own == node]:
        j = matching.partner[i]
        if j > i and nodes[j] == node:
            ax, ay = states[i, POSITION].tolist()
            bx, by = states[j, POSITION].tolist()
            across = math.hypot(bx - ax, by - ay)
            sine = (dx * (by - ay) - dy * (bx - ax)) / max(across, 1.0)
            if abs(sine) < _STEEP:
                return math.inf
            meets = ((ax - x) * (by - ay) - (ay - y) * (bx - ax)) / max(across, 1.0) / sine
            farthest = max(farthest, meets + 0.5 * width / abs(sine))
    return farthest


def _lengthen_gaps(u: FloatArray, counts: list[int], matching: EndMatching, pieces: list[_Piece]) -> None:
    """Lengthen the parameter of a line across its gaps to the length of the arc there, in place."""
    nodes, partner = matching.branches.nodes, matching.partner
    at, found = counts[0], False
    for count, piece in zip(counts[1:], pieces[1:], strict=True):
        end = piece.entered
        if nodes[end] < 0 or nodes[partner[end]] != nodes[end]:
            _widen(u, at, _arc_over_chord(matching, end))
            found = True
        at += count
    if found and u[-1] > 0.0:
        u /= u[-1]


def _line(
    points: FloatArray,
    radius: FloatArray,
    u: FloatArray,
    width: float,
    counts: list[int],
    matching: EndMatching,
    pieces: list[_Piece],
    places: list[list[float]],
    doubt: float,
) -> Centerline:
    partner, alternative = matching.partner, matching.alternative
    segments, joints = [Segment.cut(points, radius, 0, counts[0])], []
    at = counts[0]
    for count, piece in zip(counts[1:], pieces[1:], strict=True):
        end = piece.entered
        before, after = alternative[partner[end]], alternative[end]
        is_crossing = piece.through_junction
        joints.append(
            Joint._unchecked(
                _CROSSING if is_crossing else _GAP,
                (u.item(at - 1), u.item(at)),
                piece.cost,
                piece.margin,
                _confidence(piece.margin, piece.cost, is_crossing),
                (
                    (places[before][0], places[before][1]) if before >= 0 else None,
                    (places[after][0], places[after][1]) if after >= 0 else None,
                ),
            )
        )
        segments.append(Segment.cut(points, radius, at, at + count))
        at += count
    return Centerline._unchecked(
        tuple(segments),
        tuple(joints),
        closed=False,
        ends_confidence=1.0 - doubt,
        points=points,
        radius=radius,
        u=u,
        width=width,
    )


def _confidence(margin: float, cost: float, is_crossing: bool) -> float:
    """Return the probability that a joint is right.

    Across a gap the odds are at most those against its best alternative. At a junction the best two often are the same
    cable, by a branch that both share.
    """
    none, per_margin, per_cost = CROSSING if is_crossing else GAP
    log_odds = none + per_margin * margin + per_cost * cost
    return 1.0 / (1.0 + math.exp(-min(log_odds, math.inf if is_crossing else margin, _MOST_LOG_ODDS)))


def _arc_over_chord(matching: EndMatching, end: int) -> float:
    """Return the length of the arc across a gap, given by the tangents of its ends, over that of its chord."""
    states = matching.branches.end_states
    ax, ay, ahead_x, ahead_y = states[matching.partner[end], RAY].tolist()
    bx, by, back_x, back_y = states[end, RAY].tolist()
    cx, cy = bx - ax, by - ay
    leaves = math.atan2(ahead_x * cy - ahead_y * cx, ahead_x * cx + ahead_y * cy)
    comes = math.atan2(-cx * back_y + cy * back_x, -cx * back_x - cy * back_y)
    half_turn = min(0.5 * abs(leaves + comes), _MOST_HALF_TURN)
    return half_turn / math.sin(half_turn) if half_turn > 1e-3 else 1.0


def _widen(u: FloatArray, at: int, factor: float) -> None:
    """Lengthen the step of the parameter from one point to the next, in place."""
    u[at:] += (factor - 1.0) * (u[at] - u[at - 1])


def _loop(points: FloatArray, radius: FloatArray, u: FloatArray, width: float) -> Centerline:
    segment = Segment.cut(points, radius, 0, len(points))
    return Centerline._unchecked((segment,), (), closed=True, u=u, width=width)
