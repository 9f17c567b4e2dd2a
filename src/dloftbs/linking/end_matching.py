"""Graph to end matching: the joints at junctions, across gaps and along shared branches."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from dloftbs.data.graph import UNAVAILABLE, Graph, branch_of, ends_of, is_start, other_end, same_side, start_of, stop_of
from dloftbs.data.mask_crop import MaskCrop
from dloftbs.evidence import EndEvidence
from dloftbs.kernels.tracing import measure_radius
from dloftbs.linking.branch_weights import BRANCH_END, ROUND_END
from dloftbs.linking.joint_evidence import add_evidence, are_shared
from dloftbs.linking.kernels import branch_overlap, end_matching
from dloftbs.linking.kernels.hidden_gaps import match_with_hiding
from dloftbs.linking.kernels.joint_features import GAP_LENGTH, GAP_ROUND, OPEN_JUNCTION, prices
from dloftbs.linking.kernels.pair_costs import junction_costs, pair_costs
from dloftbs.linking.kernels.weights import JOINT, OPEN
from dloftbs.linking.kernels.wide_stretches import wide_reach
from dloftbs.linking.matched_ends import Branches, EndMatching
from dloftbs.linking.temporal_prior import TemporalPrior
from dloftbs.support.arrays import BoolArray, ByteArray, FloatArray, IntArray

PRIOR_BONUS = 2.4
"""Maximum discount for a joint that follows a predicted curve, nats.

Source: by hand; less than one end left open in a junction, so that the past decides where the mask leaves a doubt.
"""

UNCLEAR = 2.2
"""Difference of cost below which a pair of ends that stays open counts as nearly joined, nats.

Source: by definition; the odds against such a gap are nine to one, e to the power of 2.2.
"""

INSTANCE = (2.2, 0.7)
"""Discount of a joint of two ends that are labelled as one object, and cost of one of two, nats.

Source: measured; tools cut cables where others lie across. Of 120 frames of recorded motion whose labels are all cut
there .625 are right, and .558 at a cost of 2.2; with labels without a mistake .75, and .758.
"""


class Ends(NamedTuple):
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

    nodes: IntArray
    ids: IntArray
    states: FloatArray
    roundness: FloatArray
    spurs: BoolArray
    bordering: BoolArray
    corners: IntArray


def match_ends(
    crop: MaskCrop,
    graph: Graph,
    max_gap_widths: float,
    prior: TemporalPrior | None = None,
    evidence: EndEvidence | None = None,
    *,
    branched: bool = False,
    unshared: Sequence[int] = (),
) -> EndMatching:
    """Join the ends of a graph so that the cables bend the least, and few ends stay open.

    Parameters
    ----------
    crop : MaskCrop
    graph : Graph
    max_gap_widths : float
        Longest gap that is bridged, in widths.
    prior : TemporalPrior, optional
        Predicted curves: pairs of ends that continue each other along one of them get a discount, and those of two
        that are known not to hang together are none.
    evidence : EndEvidence, optional
        What the frame shows of the stretch between the ends of a gap.
    branched : bool
        Whether an end that stays open at a junction may be that of a branch.
    unshared : sequence of int
        Branches that no two cables share.

    Returns
    -------
    EndMatching
    """
    mask = crop.oriented(crop.pixels)
    open_there = BRANCH_END if branched else float(OPEN[OPEN_JUNCTION])
    duplicates, partial, gains, reach, raw_radius = _find_shared(graph, mask, open_there, unshared, branched=branched)
    ends = list_ends(graph, duplicates, partial)
    points, radius, spans = _own_points(graph, duplicates, partial, reach)
    more = max(UNCLEAR, 0.0 if prior is None else PRIOR_BONUS)
    if evidence is not None and evidence.has_labels:
        more += INSTANCE[0]
    rows, columns, joints, opens = list_joints(graph, ends, max_gap_widths, evidence, more)
    if prior is not None and prior.knows_of_cuts and len(rows):
        keep = ~prior.are_apart(ends.states, rows, columns)
        rows, columns, joints = rows[keep], columns[keep], joints[keep]
    costs, open_cost = prices(joints, JOINT), prices(opens, OPEN)
    if branched:
        open_cost = np.where(opens[:, OPEN_JUNCTION] > 0.0, open_there, open_cost)
        costs = costs + ROUND_END * joints[:, GAP_ROUND]
    if evidence is not None and evidence.has_labels:
        pairs = np.stack((rows, columns), axis=1)
        known = ~are_shared(ends.ids)[pairs].any(axis=1)  # the label there is of the one on top
        signs = known * evidence.instance_signs(ends.ids[pairs])
        costs = costs - np.where(signs > 0.0, *INSTANCE) * signs
    bonus = np.zeros(len(rows))
    if prior is not None and len(rows):
        bonus = PRIOR_BONUS * prior.continuity(ends.states, rows, columns)
    partner, cost, margin, alternative, lacking = match_with_hiding(
        rows, columns, costs, bonus, open_cost, ends.ids, ends.nodes, ends.states, joints[:, GAP_LENGTH]
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
        np.maximum(cost, 0.0).tolist(),
        margin.tolist(),
        alternative.tolist(),
        _near_joints(rows, columns, lacking, ends.nodes),
    )
    for duplicate, gain in enumerate(gains.tolist(), start=graph.branch_count):
        for branch in (duplicate, duplicate_of[duplicate]):
            for end in (start_of(branch), stop_of(branch)):
                matching.limit_margin(end, gain)  # another choice is not to share the branch
    return matching


def list_joints(
    graph: Graph, ends: Ends, max_gap_widths: float, evidence: EndEvidence | None, more: float
) -> tuple[IntArray, IntArray, FloatArray, FloatArray]:
    """List the pairs of ends that may be joined, with what is measured of them and of each end that stays open.

    Parameters
    ----------
    graph : Graph
    ends : Ends
    max_gap_widths : float
        Longest gap, widths.
    evidence : EndEvidence, optional
    more : float
        Largest extra cost of a pair over that of both ends left open, nats.

    Returns
    -------
    rows, columns : numpy.ndarray, shape (k,)
        The ends, the lower one first, in ascending order.
    joints : numpy.ndarray, shape (k, columns)
        As `joint_features` has them.
    opens : numpy.ndarray, shape (n, columns)
    """
    rows, columns, joints, opens = pair_costs(
        ends.nodes,
        ends.ids,
        ends.spurs,
        ends.roundness,
        ends.states,
        graph.width,
        ends.bordering,
        ends.corners,
        max_gap_widths * graph.width,
        evidence is not None,
        evidence is not None and evidence.knows_covers,
        more,
    )
    if evidence is None or len(rows) == 0:
        return rows, columns, joints, opens
    pairs = np.stack((rows, columns), axis=1)
    add_evidence(evidence, ends.ids, ends.nodes, ends.states, ends.roundness, pairs, joints)
    open_cost = prices(opens, OPEN)
    keep = prices(joints, JOINT) < open_cost[rows] + open_cost[columns] + more
    return rows[keep], columns[keep], joints[keep], opens


def _near_joints(
    rows: IntArray, columns: IntArray, lacking: FloatArray, nodes: IntArray
) -> list[tuple[float, int, int]]:
    """List the pairs of free ends that cost little more than both ends open, the least difference first."""
    if len(rows) == 0:
        return []
    near = (lacking >= 0.0) & (lacking < UNCLEAR) & (nodes[rows] < 0) & (nodes[columns] < 0)
    return sorted(zip(*(given[near].tolist() for given in (lacking, rows, columns)), strict=True))


def list_ends(graph: Graph, duplicates: IntArray, partial: IntArray) -> Ends:
    """List the ends of a graph, those of duplicates of branches last; a branch shared in part ends inside."""
    count = len(graph.nodes)
    if len(duplicates) == 0:
        return Ends(
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
    return Ends(
        nodes,
        ids,
        graph.end_states[ids],
        graph.end_roundness[ids],
        np.concatenate((graph.spurs, np.zeros(len(duplicates), dtype=np.bool_))),
        graph.bordering[ids],
        graph.corners[ids],
    )


def _own_points(
    graph: Graph, duplicates: IntArray, partial: IntArray, reach: IntArray
) -> tuple[FloatArray, FloatArray, list[tuple[int, int]]]:
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
    graph: Graph, mask: ByteArray, open_there: float, unshared: Sequence[int], *, branched: bool
) -> tuple[IntArray, IntArray, FloatArray, IntArray, FloatArray | None]:
    """Find the branches that two cables share.

    Parameters
    ----------
    graph : Graph
    mask : (H, W) uint8
    open_there : float
        Cost of an end that stays open at a junction, nats.
    unshared : sequence of int
        Branches that are not shared.
    branched : bool
        Whether objects may branch: then none ends inside of a branch.

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
    spans, width = graph.spans, graph.width
    junctions = first, members, _, _ = junction_costs(graph.nodes, graph.spurs, graph.corners, graph.end_states, width)
    open_cost = np.full(len(graph.nodes), open_there)
    open_cost[graph.spurs.repeat(2)] = 0.0
    is_cable = ~graph.spurs[branch_of(members)]
    sets, slots = np.concatenate(([0], np.cumsum(is_cable)))[first], members[is_cable]
    unresolved = end_matching.least_costs(sets, slots, graph.nodes, open_cost, *junctions) >= open_there
    none = np.empty(0, dtype=np.int64)
    if not unresolved.any():
        return none, none, np.empty(0), none, None
    # Not smoothed: the width of re-centring is limited to that of one cable where two lie side by side.
    raw_radius = measure_radius(mask, graph.pixels, graph.offsets)
    reach, widths = wide_reach(spans, raw_radius, width)
    paths, inside, path_cost = branch_overlap.list_paths(
        graph.nodes, graph.spurs, unresolved, reach, spans, widths, width, *junctions
    )
    if branched:
        keep = ~inside & ~np.isin(branch_of(paths), unshared).any(axis=1)  # behind the last one is branch -1
        paths, path_cost, inside = paths[keep], path_cost[keep], inside[keep]
    if len(paths) == 0:
        return none, none, np.empty(0), none, None
    sets, slots, changes = branch_overlap.changed_junctions(paths, inside, graph.nodes, first, members)
    totals = end_matching.least_costs(sets, slots, graph.nodes, open_cost, *junctions)
    return *branch_overlap.choose_paths(paths, inside, path_cost, changes, totals, graph.nodes), reach, raw_radius
