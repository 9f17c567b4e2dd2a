"""A known number of cables: pieces that were left apart are joined until there are as many."""

from __future__ import annotations

import numpy as np

from dloftbs.data.graph import UNAVAILABLE, Graph, branch_of, ends_of, other_end, start_of, stop_of
from dloftbs.evidence import EndEvidence
from dloftbs.linking.joint_evidence import add_evidence
from dloftbs.linking.kernels.evidence_weights import MAX_SEEN
from dloftbs.linking.kernels.joint_features import GAP_LENGTH, GAP_ROUND, GAP_SEEN, describe_pairs, prices
from dloftbs.linking.kernels.path_cover import cover
from dloftbs.linking.kernels.weights import JOINT
from dloftbs.linking.matched_ends import EndMatching
from dloftbs.support.arrays import FloatArray, IntArray

_SPECK_WIDTHS = 3.0
"""Length up to which a piece is left out for nothing, widths.

Source: by hand; a shorter piece is rather a speck than a part of a cable.
"""

_DROP_COST_PER_WIDTH = 0.5
"""Cost of leaving out a longer piece, nats per width of the rest of its length.

Source: measured; of 59 generated frames of one cable in pieces 47 are right at 0.375, 50 at 0.5, 51 at 1, and of 46
frames of several cables with a piece too many 22, 22 and 21.
"""

_MAX_PAIRS = 4000
"""Number of pairs of ends that may be joined, those that cost the least.

Source: bounds time; of 45 pieces it is all.
"""


def merge_to_count(graph: Graph, matching: EndMatching, objects: int, evidence: EndEvidence | None = None) -> None:
    """Join cables across gaps until no more than a known number is left, at a low total cost.

    A piece may be left out instead, at a cost that grows with its length: no cable takes a detour to a speck, and what
    is too long to be dirt is joined. Gaps may be of any length.

    Parameters
    ----------
    graph : Graph
    matching : EndMatching
        Changed.
    objects : int
        Number of cables that count. Where no more were found, they stay as they are.
    evidence : EndEvidence, optional
        What the frame shows of the gaps.
    """
    chains = matching.chains()
    if len(chains) + len(graph.loops) <= objects:
        return
    spans = matching.branches.spans
    lengths = [sum(stop - start for start, stop in (spans[branch_of(end)] for end in chain)) for chain, _ in chains]
    lengths += [stop - start for start, stop in graph.loops]
    ends = np.full(2 * len(lengths), -1)  # that may be joined, of each cable
    for k, (chain, is_loop) in enumerate(chains):
        if not is_loop:
            ends[start_of(k)], ends[stop_of(k)] = chain[0], other_end(chain[-1])
    pairs, costs, extra = _list_pairs(graph, matching, ends, evidence)
    drop_costs = _DROP_COST_PER_WIDTH * np.maximum(np.array(lengths) / graph.width - _SPECK_WIDTHS, 0.0)
    for k in cover(pairs, extra, drop_costs, objects).tolist():
        i, j = ends[pairs[k]].tolist()
        matching.join(i, j, costs.item(k), 0.0)


def _list_pairs(
    graph: Graph, matching: EndMatching, ends: IntArray, evidence: EndEvidence | None
) -> tuple[IntArray, FloatArray, FloatArray]:
    """List the ends of different cables that may be joined, as linking prices them.

    Parameters
    ----------
    graph : Graph
    matching : EndMatching
    ends : numpy.ndarray, shape (2 n,)
        Both ends of each cable, or -1.
    evidence : EndEvidence, optional

    Returns
    -------
    pairs : numpy.ndarray, shape (k, 2)
        Places in `ends`.
    costs, extra : numpy.ndarray, shape (k,)
        Cost of each pair, and how much more that is than both ends left open, nats.
    """
    branches, width = matching.branches, graph.width
    branch_id, nodes = (np.array(given, np.int64) for given in (branches.branch_id, branches.nodes))
    ids, states = ends_of(branch_id), branches.end_states
    roundness, open_cost = graph.end_roundness[ids], np.array(branches.open_cost)
    pairs = _different_cables(graph, ends, ids, nodes)
    joints = describe_pairs(states, ends[pairs], nodes, roundness, width)
    extra = prices(joints, JOINT) - open_cost[ends[pairs]].sum(axis=1)
    if evidence is not None:  # at best it says as much as it can, and that ends have any shape, covered gaps no length
        extra -= JOINT[GAP_LENGTH] * joints[:, GAP_LENGTH] * evidence.knows_covers
        extra += JOINT[GAP_SEEN] * MAX_SEEN * (joints[:, GAP_LENGTH] > 0.0) - JOINT[GAP_ROUND] * joints[:, GAP_ROUND]
    kept = np.sort(np.argsort(extra, kind="stable")[:_MAX_PAIRS])
    pairs, joints = pairs[kept], joints[kept]
    own = ends[pairs]
    if evidence is not None and len(own):
        add_evidence(evidence, ids, nodes, states, roundness, own, joints)
    costs = prices(joints, JOINT)
    return pairs, costs, np.maximum(costs - open_cost[own].sum(axis=1), 0.0)


def _different_cables(graph: Graph, ends: IntArray, ids: IntArray, nodes: IntArray) -> IntArray:
    """Return the pairs of ends that are not of one cable nor of one branch.

    An end that the image's border cuts goes on beyond it, so that another one must come back from there.
    """
    known = np.flatnonzero(ends >= 0)
    known = known[nodes[ends[known]] != UNAVAILABLE]
    pairs = known[np.column_stack(np.triu_indices(len(known), 1))]
    branches, bordering = branch_of(ids[ends[pairs]]), graph.bordering[ids[ends[pairs]]]
    keep = branch_of(pairs[:, 0]) != branch_of(pairs[:, 1])
    keep &= (branches[:, 0] != branches[:, 1]) & (bordering[:, 0] == bordering[:, 1])
    kept: IntArray = pairs[keep]
    return kept
