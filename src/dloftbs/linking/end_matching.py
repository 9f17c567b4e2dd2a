"""Stage 5: graph to end matching: the joints at junctions, across gaps and along shared branches."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from dloftbs.evidence import EndEvidence
from dloftbs.graph import (
    POSITION,
    UNAVAILABLE,
    Branches,
    EndMatching,
    Graph,
    ends_of,
    is_start,
    other_end,
    same_side,
    start_of,
    stop_of,
)
from dloftbs.kernels.tracing import measure_radius
from dloftbs.linking.kernels import bending, branch_overlap, end_matching
from dloftbs.linking.kernels.hidden_gaps import match_with_hiding
from dloftbs.linking.kernels.wide_stretches import wide_reach
from dloftbs.mask_crop import MaskCrop
from dloftbs.prior import TemporalPrior

_ROUNDS = 4
"""Largest number of searches for branches that are counted twice.

Source: bounds time; each search adds the set of paths that saves most.
"""

PRIOR_BONUS = 0.6
"""Maximum discount, in units of cost, for a joint that follows a predicted curve.

Source: by hand; less than one end left open in a junction, so that the past decides where the mask leaves a doubt.
"""

UNCLEAR = 0.55
"""Difference of cost below which a pair of ends that stays open counts as nearly joined.

Source: derived from `_GAP_SCALE`; the odds against such a gap are nine to one, e to the power of 0.55 / 0.25.
"""

_CHORD_REACH_PX = 4
"""Number of points to either side over which the direction across a branch is measured for its width, px.

Source: by hand; long enough for a staircase, short enough for a bend.
"""

_Ints = npt.NDArray[np.int64]
_Floats = npt.NDArray[np.float64]
_JunctionCosts = tuple[_Ints, _Ints, _Ints, _Floats]
_HIDDEN = 0.03
"""Discount of a gap per width that is shown to be hidden.

Source: by hand; of generated hidden gaps with pictures .917 are right at 0, .950 from 0.04 on.
"""

_GROUND = 1.5
"""Cost of a gap per width of ground in sight.

Source: derived; a gap over two widths of ground costs more than any two free ends left open.
"""


class _Ends(NamedTuple):
    """Ends of a graph, those of duplicates of shared branches among them.

    Parameters
    ----------
    nodes : numpy.ndarray, shape (n,)
        Junction at each end.
    ids : numpy.ndarray, shape (n,)
        End of the graph that each stands for.
    states : numpy.ndarray, shape (n, 6)
    roundness : numpy.ndarray, shape (n,)
    spurs : numpy.ndarray, shape (n / 2,)
    bordering : numpy.ndarray, shape (n,)
    corners : numpy.ndarray, shape (n,)
    """

    nodes: _Ints
    ids: _Ints
    states: _Floats
    roundness: _Floats
    spurs: npt.NDArray[np.bool_]
    bordering: npt.NDArray[np.bool_]
    corners: _Ints


def match_ends(
    crop: MaskCrop,
    graph: Graph,
    max_gap_widths: float,
    prior: TemporalPrior | None = None,
    evidence: EndEvidence | None = None,
) -> EndMatching:
    """Join the ends of a graph so that the cables bend the least, and few ends stay open.

    Parameters
    ----------
    crop : MaskCrop
    graph : Graph
    max_gap_widths : float
        Longest gap that is bridged, in widths.
    prior : TemporalPrior, optional
        Predicted curves: pairs of ends that continue each other along one of them get a discount.
    evidence : EndEvidence, optional
        What the frame tells of the stretch between the ends of a gap.

    Returns
    -------
    EndMatching
    """
    mask = crop.oriented(crop.pixels)
    junctions = bending.junction_costs(graph.nodes, graph.spurs, graph.end_states, graph.width, mask)
    duplicates, partial, gains, reach, raw_radius = _find_shared(graph, mask, junctions)
    ends = _list_ends(graph, duplicates, partial)
    points, radius, spans = _own_points(graph, duplicates, partial, reach)
    more = max(UNCLEAR, 0.0 if prior is None else PRIOR_BONUS)
    rows, columns, costs, open_cost = bending.pair_costs(
        ends.nodes,
        ends.ids,
        ends.spurs,
        ends.roundness,
        ends.states,
        graph.width,
        mask,
        *junctions,
        ends.bordering,
        ends.corners,
        max_gap_widths * graph.width,
        0.0 if evidence is None else 2.0 * bending.OPEN_CUT + _HIDDEN * max_gap_widths,
        more,
    )
    if evidence is not None:
        rows, columns, costs, open_cost = _weigh_evidence(graph, ends, rows, columns, costs, open_cost, evidence, more)
    bonus = np.zeros(len(rows))
    if prior is not None and len(rows):
        bonus = PRIOR_BONUS * prior.continuity(ends.states, rows, columns)
    partner, cost, margin, alternative, override, costs, lacking = match_with_hiding(
        rows, columns, costs, bonus, open_cost, ends.ids, ends.nodes, ends.states, graph.width
    )
    duplicate_of: dict[int, int] = {}
    for duplicate, branch in enumerate(duplicates.tolist(), start=graph.branch_count):
        duplicate_of[duplicate], duplicate_of[branch] = branch, duplicate
    branches = Branches(
        points,
        radius,
        [*range(graph.branch_count), *duplicates.tolist()],
        ends.nodes.tolist(),
        open_cost.tolist(),
        spans,
        ends.spurs.tolist(),
        ends.states,
        duplicate_of,
        raw_radius,
    )
    matching = EndMatching(
        branches,
        partner.tolist(),
        cost.tolist(),
        margin.tolist(),
        alternative.tolist(),
        _near_joints(rows, columns, costs, lacking, ends.nodes),
        override,
    )
    for duplicate, gain in enumerate(gains.tolist(), start=graph.branch_count):
        for branch in (duplicate, duplicate_of[duplicate]):
            for end in (start_of(branch), stop_of(branch)):
                matching.limit_margin(end, gain)  # another choice is not to share the branch
    return matching


def _near_joints(
    rows: _Ints, columns: _Ints, costs: _Floats, lacking: _Floats, nodes: _Ints
) -> list[tuple[float, float, int, int]]:
    """List the pairs of free ends that cost little more than both ends open, the least difference first."""
    if len(rows) == 0:
        return []
    near = (lacking >= 0.0) & (lacking < UNCLEAR) & (nodes[rows] < 0) & (nodes[columns] < 0)
    return sorted(zip(*(given[near].tolist() for given in (lacking, costs, rows, columns)), strict=True))


def _list_ends(graph: Graph, duplicates: _Ints, partial: _Ints) -> _Ends:
    """List the ends of a graph, those of duplicates of branches last; a branch shared in part ends inside."""
    count = len(graph.nodes)
    if len(duplicates) == 0:
        return _Ends(
            graph.nodes,
            np.arange(count),
            graph.end_states,
            graph.end_roundness,
            graph.spurs,
            graph.bordering,
            graph.corners,
        )
    ids = np.concatenate((np.arange(count), ends_of(duplicates)))
    nodes = graph.nodes[ids]
    inside = np.flatnonzero(partial >= 0)
    if len(inside):
        nodes[other_end(same_side(graph.branch_count + inside, partial[inside]))] = UNAVAILABLE
    return _Ends(
        nodes,
        ids,
        graph.end_states[ids],
        graph.end_roundness[ids],
        np.concatenate((graph.spurs, np.zeros(len(duplicates), dtype=np.bool_))),
        graph.bordering[ids],
        graph.corners[ids],
    )


def _weigh_evidence(
    graph: Graph,
    ends: _Ends,
    rows: _Ints,
    columns: _Ints,
    costs: _Floats,
    open_cost: _Floats,
    evidence: EndEvidence,
    more: float,
) -> tuple[_Ints, _Ints, _Floats, _Floats]:
    """Add the evidence of the frame to the costs of pairs, and leave out gaps that cost more than two open ends.

    Depths that differ raise the cost of any pair, and ground in sight that of a gap; what tells nothing leaves it as it
    is. An end before most of a gap that an occluder or the cable itself takes up counts as cut off, whatever its shape
    and whichever end it is joined with: what is told of one gap and not of another one must not decide between them.
    Its tip may lie off the axis.

    Parameters
    ----------
    graph : Graph
    ends : Ends
    rows, columns : numpy.ndarray, shape (k,)
        Pairs, those at junctions among them.
    costs : numpy.ndarray, shape (k,)
    open_cost : numpy.ndarray, shape (n,)
        Cost of leaving each end open.
    evidence : EndEvidence
    more : float
        Largest extra cost of pairs over that of open ends.

    Returns
    -------
    rows, columns, costs
        Remaining pairs, in the same order.
    open_cost : numpy.ndarray, shape (n,)
    """
    if len(rows) == 0:
        return rows, columns, costs, open_cost
    width, pairs = graph.width, np.stack((rows, columns), axis=1)
    gaps = (ends.nodes[rows] < 0) | (ends.nodes[rows] != ends.nodes[columns])
    lengths = np.hypot(*(ends.states[rows, POSITION] - ends.states[columns, POSITION]).T)
    swerves = evidence.swerves(ends.ids[pairs], lengths) * ~are_shared(ends.ids)[pairs].any(axis=1)
    costs = costs + bending.swerve_costs(lengths, gaps, swerves, width)
    (first, second), (ground, cable, neither) = pairs[gaps].T, evidence.across(ends.ids[pairs[gaps]]).T
    length = np.maximum(lengths[gaps] / width, 1e-9)
    hidden = np.minimum(cable + neither, length)
    share, cut = np.maximum(hidden - ground, 0.0) / length, np.zeros(len(open_cost))
    for end in (first, second):
        np.maximum.at(cut, end, share)
    open_cost = open_cost + cut * np.maximum(bending.OPEN_CUT - open_cost, 0.0) * (ends.nodes == -1)
    slant = bending.slant_costs(ends.states, pairs[gaps], width)
    costs[gaps] += _GROUND * ground - _HIDDEN * hidden - slant * (hidden > ground)
    keep = ~gaps | (costs < open_cost[rows] + open_cost[columns] + more)
    return rows[keep], columns[keep], costs[keep], open_cost


def are_shared(ids: _Ints) -> npt.NDArray[np.bool_]:
    """Return True for ends of branches that two cables share: depth there is that of the one on top."""
    shared: npt.NDArray[np.bool_] = np.bincount(ids)[ids] > 1
    return shared


def _own_points(
    graph: Graph, duplicates: _Ints, partial: _Ints, reach: _Ints
) -> tuple[_Floats, _Floats, list[tuple[int, int]]]:
    """Return points, radius and spans, those of the duplicates last."""
    spans = [(start, stop) for start, stop in graph.spans.tolist()]
    if len(duplicates) == 0:
        return graph.points, graph.radius, spans
    points, radius = [graph.points], [graph.radius]
    at = len(graph.points)
    for branch, end in zip(duplicates.tolist(), partial.tolist(), strict=True):
        start, stop = spans[branch]
        if end >= 0:
            start, stop = (start, start + int(reach[end])) if is_start(end) else (stop - int(reach[end]), stop)
        points.append(graph.points[start:stop])
        radius.append(graph.radius[start:stop])
        spans.append((at, at + stop - start))
        at += stop - start
    return np.concatenate(points), np.concatenate(radius), spans


def _find_shared(
    graph: Graph, mask: npt.NDArray[np.uint8], junctions: _JunctionCosts
) -> tuple[_Ints, _Ints, _Floats, _Ints, _Floats | None]:
    """Find the branches that two cables share.

    Parameters
    ----------
    graph : Graph
    mask : (H, W) uint8
    junctions
        As `junction_costs` makes them of the graph.

    Returns
    -------
    duplicates, partial : (c,) int64
        Shared branches, and for each the end from which it is shared in part, or -1.
    gains : (c,) float64
        Gain in cost by sharing each.
    reach : (2 n,) int64
        As `wide_reach` makes it.
    raw_radius : (m,) float64 or None
        Half the mask's width at each point of the graph, not smoothed; None where no branch can be shared.
    """
    duplicates = partial = reach = np.empty(0, dtype=np.int64)
    gains = np.empty(0)
    if not branch_overlap.has_odd_junction(graph.nodes, graph.spurs):
        return duplicates, partial, gains, reach, None
    spans, width = graph.spans, graph.width
    # Not smoothed: the width of re-centring is limited to that of one cable where two lie side by side.
    raw_radius = measure_radius(mask, graph.pixels, graph.offsets, _CHORD_REACH_PX)
    reach, widths = wide_reach(graph.nodes, spans, raw_radius, width)
    open_cost = np.full(len(graph.nodes), bending.OPEN_JUNCTION)
    open_cost[graph.spurs.repeat(2)] = 0.0
    for _ in range(_ROUNDS):
        paths, inside, path_cost = branch_overlap.list_paths(
            graph.nodes, graph.spurs, reach, spans, widths, width, *junctions, duplicates, partial
        )
        if len(paths) == 0:
            break
        sets, slots, changes = branch_overlap.changed_junctions(
            paths, inside, graph.nodes, *junctions[:2], duplicates, partial
        )
        totals = end_matching.least_costs(sets, slots, graph.nodes, open_cost, *junctions)
        chosen = branch_overlap.choose_paths(paths, inside, path_cost, changes, totals, graph.nodes)
        if len(chosen[0]) == 0:
            break
        so_far = (duplicates, partial, gains)
        duplicates, partial, gains = (np.concatenate(both) for both in zip(so_far, chosen, strict=True))
    return duplicates, partial, gains, reach, raw_radius
