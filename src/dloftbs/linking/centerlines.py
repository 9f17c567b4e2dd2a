"""End matching to centre lines, with free ends extended to the edge of the mask."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import accumulate, pairwise

import numpy as np

from dloftbs.data.centerline import BranchEnd, Centerline, Joint, JointKind, NearJoint, Segment
from dloftbs.data.graph import RAY, Graph, branch_of, other_end
from dloftbs.data.mask_crop import MaskCrop
from dloftbs.kernels.polyline_lengths import lay_out
from dloftbs.linking.cable_pieces import Piece, Points, cut_into_pieces, fill_junctions
from dloftbs.linking.end_extension import CableAxes, extend_ends
from dloftbs.linking.joint_confidence import Gaps, crossing_confidence
from dloftbs.linking.kernels.lumps import course_confidence
from dloftbs.linking.matched_ends import Branches, EndMatching
from dloftbs.support.arrays import FloatArray, frozen
from dloftbs.support.values import unchecked, varied

_MIN = 2
"""Smallest number of points of an open centre line.

Source: geometry; a line has two ends.
"""

_MIN_AROUND = 8
"""Smallest number of points of a closed centre line.

Source: by hand; twice the four points that a cubic needs.
"""

_MAX_HALF_TURN = 1.4
"""Largest half turn across a gap for which an arc lengthens the gap, rad.

Source: by hand; the arc over its chord diverges at pi.
"""

_CROSSING, _GAP = JointKind.CROSSING, JointKind.GAP  # members of an enumeration are slow to look up


def assemble(
    crop: MaskCrop,
    graph: Graph,
    matching: EndMatching,
    least_widths: float,
    places: Mapping[int, tuple[FloatArray, float]],
) -> list[Centerline]:
    """Make a centre line of each cable.

    Parameters
    ----------
    crop : MaskCrop
    graph : Graph
    matching : EndMatching
    least_widths : float
        Shortest skeleton of a cable, in widths.
    places : mapping of int to (numpy.ndarray, float)
        The branch points, as `find_branch_points` makes them.

    Returns
    -------
    list of Centerline
        Cables with ends first, then loops.
    """
    least = max(least_widths * graph.width, _MIN)
    around = max(2.0 * least, _MIN_AROUND)
    buffer = Points(matching.branches)
    lines: list[list[Piece]] = []
    loops: list[list[Piece]] = []
    ends: list[tuple[int, int]] = []
    offsets, degree = graph.offsets.tolist(), _degrees(matching.branches)
    mask, axes = crop.oriented(crop.pixels), CableAxes(graph, matching)
    for chain, is_loop in matching.chains():
        pieces = cut_into_pieces(mask, graph, offsets, matching, chain, degree, buffer)
        count = sum([piece.count for piece in pieces])
        if is_loop and count >= around:
            around_all = Piece([span for piece in pieces for span in piece.spans], -1, 0.0, math.inf)
            fill_junctions(around_all, buffer, closed=True)
            loops.append([around_all])
        elif not is_loop and count >= (_MIN if chain[0] in places or other_end(chain[-1]) in places else least):
            extend_ends(mask, graph, matching, axes, chain, pieces, buffer, places)
            for piece in pieces:
                fill_junctions(piece, buffer)
            lines.append(pieces)
            ends.append((chain[0], other_end(chain[-1])))
    for start, stop in graph.loops:
        if stop - start >= around:
            loops.append([Piece([(start, stop, 1)], -1, 0.0, math.inf)])
    if not lines and not loops:
        return []
    return _lay_out(crop, graph, matching, lines, loops, buffer, ends, places)


def _likeliest(matching: EndMatching, gaps: Gaps) -> dict[int, tuple[float, int]]:
    """Return the most probable gap that each open end does not have: its probability, and the other end."""
    found: dict[int, tuple[float, int]] = {}
    for lacking, i, j in matching.near_joints:
        if matching.is_open(i) and matching.is_open(j):
            confidence = gaps.confidence(i, j, -lacking)
            found[i], found[j] = (
                max(found.get(i, (0.0, j)), (confidence, j)),
                max(found.get(j, (0.0, i)), (confidence, i)),
            )
    return found


def _lay_out(
    crop: MaskCrop,
    graph: Graph,
    matching: EndMatching,
    lines: list[list[Piece]],
    loops: list[list[Piece]],
    buffer: Points,
    ends: list[tuple[int, int]],
    places: Mapping[int, tuple[FloatArray, float]],
) -> list[Centerline]:
    """Make centre lines, in the image, of the pieces of cables with ends and of loops."""
    counts = [[piece.count for piece in pieces] for pieces in lines + loops]
    first = [0, *accumulate(map(sum, counts))]
    spans = [number for pieces in lines + loops for piece in pieces for span in piece.spans for number in span]
    oriented, own_radius = buffer.all()
    runs = np.array(spans).reshape(-1, 3)
    points, radius, u, widths, positions = lay_out(
        oriented, own_radius, runs, np.array(first), len(lines), matching.branches.end_states, *crop.image_transform
    )
    parts = np.array([0, *accumulate(sum(len(piece.spans) for piece in pieces) for pieces in lines + loops)])
    ends_there = np.array([[end in places for end in both] for both in ends], dtype=np.bool_).reshape(-1, 2)
    sure = course_confidence(crop.oriented(crop.pixels), oriented, runs, parts, len(lines), widths, ends_there).tolist()
    branch_ends: dict[int, BranchEnd] = {}
    if places:
        met_at = crop.to_image(np.array([place for place, _ in places.values()])).tolist()
        for (end, (_, confidence)), (x, y) in zip(places.items(), met_at, strict=True):
            branch_ends[end] = BranchEnd((x, y), confidence)
    for k, pieces in enumerate(lines):
        if len(pieces) > 1:
            _lengthen_gaps(u[first[k] : first[k + 1]], counts[k], matching, pieces)
    points, radius, u = frozen(points), frozen(radius), frozen(u)
    gaps = Gaps(matching, graph.width)
    likeliest = _likeliest(matching, gaps) if matching.near_joints else {}
    positions_of = positions.tolist() if likeliest or any(len(pieces) > 1 for pieces in lines) else []
    result: list[Centerline] = []
    for k, (width, (start, stop)) in enumerate(zip(widths.tolist(), pairwise(first), strict=True)):
        own = points[start:stop], radius[start:stop], u[start:stop], width
        if k < len(lines):
            near = [
                NearJoint(
                    u, (positions_of[likeliest[end][1]][0], positions_of[likeliest[end][1]][1]), likeliest[end][0]
                )
                for u, end in zip((0.0, 1.0), ends[k], strict=True)
                if end in likeliest
            ]
            line = _line(*own, counts[k], gaps, matching, lines[k], positions_of, tuple(near), sure[k])
            met = branch_ends.get(ends[k][0]), branch_ends.get(ends[k][1])
            result.append(line if met == (None, None) else varied(line, branch_ends=met))
        else:
            result.append(_loop(*own, sure[k]))
    return result


def _degrees(branches: Branches) -> list[int]:
    """Count the ends at each junction, spurs left out."""
    nodes, spurs = branches.nodes, branches.spurs
    degree = [0] * (max(nodes, default=0) + 1)
    for end, node in enumerate(nodes):
        if node >= 0 and not spurs[branch_of(end)]:
            degree[node] += 1
    return degree


def _lengthen_gaps(u: FloatArray, counts: list[int], matching: EndMatching, pieces: list[Piece]) -> None:
    """Lengthen the parameter of a line across its gaps to the length of the arc there, in place."""
    at, found = counts[0], False
    for count, piece in zip(counts[1:], pieces[1:], strict=True):
        end = piece.entered
        if not matching.is_crossing(end):
            u[at:] += (_arc_over_chord(matching, end) - 1.0) * (u[at] - u[at - 1])
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
    gaps: Gaps,
    matching: EndMatching,
    pieces: list[Piece],
    places: list[list[float]],
    near_joints: tuple[NearJoint, ...],
    sure: float,
) -> Centerline:
    partner, alternative, shared = matching.partner, matching.alternative, matching.branches.duplicate_of
    segments, joints = [Segment.cut(points, radius, 0, counts[0])], []
    at = counts[0]
    for count, piece in zip(counts[1:], pieces[1:], strict=True):
        end = piece.entered
        before, after = alternative[partner[end]], alternative[end]
        is_crossing = piece.through_junction
        if is_crossing:
            # Along a branch that two cables share the best alternative often is the same cable, by its other copy.
            is_shared = branch_of(end) in shared or branch_of(partner[end]) in shared
            confidence = crossing_confidence(piece.margin, piece.cost, bounded=not is_shared)
        else:
            confidence = gaps.confidence(partner[end], end, piece.margin)
        joints.append(
            unchecked(
                Joint,
                kind=_CROSSING if is_crossing else _GAP,
                u=(u.item(at - 1), u.item(at)),
                cost=piece.cost,
                margin=piece.margin,
                confidence=confidence,
                alternatives=(
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
        near_joints=near_joints,
        course_confidence=sure,
        points=points,
        radius=radius,
        u=u,
        width_px=width,
    )


def _arc_over_chord(matching: EndMatching, end: int) -> float:
    """Return the length of the arc across a gap, given by the tangents of its ends, over that of its chord."""
    states = matching.branches.end_states
    ax, ay, ahead_x, ahead_y = states[matching.partner[end], RAY].tolist()
    bx, by, back_x, back_y = states[end, RAY].tolist()
    cx, cy = bx - ax, by - ay
    leaves = math.atan2(ahead_x * cy - ahead_y * cx, ahead_x * cx + ahead_y * cy)
    comes = math.atan2(-cx * back_y + cy * back_x, -cx * back_x - cy * back_y)
    half_turn = min(0.5 * abs(leaves + comes), _MAX_HALF_TURN)
    return half_turn / math.sin(half_turn) if half_turn > 1e-3 else 1.0


def _loop(points: FloatArray, radius: FloatArray, u: FloatArray, width: float, sure: float) -> Centerline:
    segment = Segment.cut(points, radius, 0, len(points))
    return Centerline._unchecked((segment,), (), closed=True, course_confidence=sure, u=u, width_px=width)
