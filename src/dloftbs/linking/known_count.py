"""Stage 5, where the number of cables is known: what was left apart is joined until there are as many."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from dloftbs.evidence import EndEvidence
from dloftbs.graph import UNAVAILABLE, EndMatching, Graph, branch_of, ends_of, other_end
from dloftbs.linking.cable_chains import list_cables
from dloftbs.linking.joint_evidence import add_evidence
from dloftbs.linking.kernels.hidden_gaps import lower_hidden
from dloftbs.linking.kernels.joint_features import GAP_HIDDEN, GAP_LENGTH, GAP_ROUND, describe_pairs, prices
from dloftbs.linking.kernels.path_cover import cover
from dloftbs.linking.kernels.weights import JOINT

_MOST_EXTRA_COST = 4.25
"""Largest extra cost of a join over both ends left open, nats; what costs more is rather another cable, or dirt.

Source: by hand.
"""

_Ints = npt.NDArray[np.int64]
_Floats = npt.NDArray[np.float64]


def merge_to_count(graph: Graph, matching: EndMatching, objects: int, evidence: EndEvidence | None = None) -> None:
    """Join cables across gaps until no more than a known number is left, at the least total cost.

    A cable may be left out instead, at the cost of a gap of its length: what is seen and explained by nothing costs as
    much as what is not seen and inferred. So specks beside the cables stay apart, and long pieces are joined. Cables
    that are far apart, or turn away from each other, stay apart as well: then more are left than are known.

    Parameters
    ----------
    graph : Graph
    matching : EndMatching
        Changed.
    objects : int
        Number of cables that count. Where no more were found, they stay as they are.
    evidence : EndEvidence, optional
        What the frame tells of the gaps.
    """
    chains = list_cables(matching)
    if len(chains) + len(graph.loops) <= objects:
        return
    spans = matching.branches.spans
    lengths = [sum(stop - start for start, stop in (spans[branch_of(end)] for end in chain)) for chain, _ in chains]
    lengths += [stop - start for start, stop in graph.loops]
    ports = np.full((len(lengths), 2), -1)  # the end at each port that may be joined
    for k, (chain, is_loop) in enumerate(chains):
        if not is_loop:
            ports[k] = chain[0], other_end(chain[-1])
    pairs, costs, extra = _list_pairs(graph, matching, ports.ravel(), evidence)
    drop_costs = JOINT[GAP_LENGTH] / graph.width * np.array(lengths, dtype=np.float64)
    for k in cover(pairs, extra, drop_costs, objects).tolist():
        i, j = ports.ravel()[pairs[k]].tolist()
        matching.join(i, j, float(costs[k]), 0.0)


def _list_pairs(
    graph: Graph, matching: EndMatching, ends: _Ints, evidence: EndEvidence | None
) -> tuple[_Ints, _Floats, _Floats]:
    """List the ports of different cables that may be joined, with the cost of each pair and that over both open ends.

    The cost is that of the linking, for gaps of any length.
    """
    branches = matching.branches
    ids, nodes = ends_of(np.array(branches.branch_id)), np.array(branches.nodes)
    states, open_cost = branches.end_states, np.array(branches.open_cost)
    roundness = graph.end_roundness[ids]
    known = np.flatnonzero(ends >= 0)
    known = known[nodes[ends[known]] != UNAVAILABLE]
    at = np.triu_indices(len(known), 1)
    pairs = np.column_stack((known[at[0]], known[at[1]]))
    own = ends[pairs]
    apart = (branch_of(pairs[:, 0]) != branch_of(pairs[:, 1])) & (
        branch_of(ids[own[:, 0]]) != branch_of(ids[own[:, 1]])
    )
    apart &= graph.bordering[ids[own[:, 0]]] == graph.bordering[ids[own[:, 1]]]
    pairs, own = pairs[apart], own[apart]
    joints = describe_pairs(states, own, nodes, roundness, graph.width)
    open_costs = open_cost[own].sum(axis=1)
    spared = (
        0.0 if evidence is None else JOINT[GAP_ROUND] * joints[:, GAP_ROUND] - JOINT[GAP_HIDDEN] * joints[:, GAP_LENGTH]
    )
    keep = prices(joints, JOINT) - spared < open_costs + _MOST_EXTRA_COST
    pairs, own, joints, open_costs = pairs[keep], own[keep], joints[keep], open_costs[keep]
    if evidence is not None and len(own):
        add_evidence(evidence, ids, nodes, states, roundness, own, joints)
    costs = lower_hidden(
        own[:, 0],
        own[:, 1],
        prices(joints, JOINT),
        np.array(matching.partner),
        np.array(matching.margin),
        nodes,
        states,
        graph.width,
    )
    extra = np.maximum(costs - open_costs, 0.0)
    keep = extra < _MOST_EXTRA_COST
    return pairs[keep], costs[keep], extra[keep]
