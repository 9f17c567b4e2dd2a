"""After the parallel runs: ends inside of shared branches, and gaps to those that a cable joins unseen."""

from __future__ import annotations

import numpy as np

from dloftbs.data.graph import (
    FREE,
    POSITION,
    UNAVAILABLE,
    Graph,
    branch_of,
    inward,
    is_start,
    other_end,
    same_side,
    start_of,
    stop_of,
)
from dloftbs.linking.evidence_steps import EvidenceSteps
from dloftbs.linking.kernels.joint_features import OPEN_FREE
from dloftbs.linking.kernels.weights import OPEN
from dloftbs.linking.matched_ends import EndMatching, turn_costs
from dloftbs.support.arrays import FloatArray, IntArray

_DIRECTION_WIDTHS = 1.0
"""Length to both sides of a hidden end over which its direction is taken, widths.

Source: by hand; as long as the skeleton needs to be smooth.
"""


def link_hidden_ends(
    graph: Graph, matching: EndMatching, max_gap_widths: float, steps: EvidenceSteps | None = None
) -> None:
    """Join the ends of cables inside of shared branches with free ends of others, where that bends little.

    A cable that seems to end beside another one may have come to lie there while it was hidden.

    Parameters
    ----------
    graph : Graph
    matching : EndMatching
        Changed.
    max_gap_widths : float
        Longest gap that is bridged, in widths.
    steps : EvidenceSteps, optional
        Other depth or another colour speaks against such a gap.
    """
    branches = matching.branches
    shared = [end for branch in branches.duplicate_of for end in (start_of(branch), stop_of(branch))]
    inner = [end for end in shared if _is_open(matching, end, UNAVAILABLE)]
    free = free_ends(graph, matching) if inner else []
    if not inner or not free:
        return
    for end in inner:
        _locate(graph, matching, end)
    pairs = np.array([(i, j) for i in inner for j in free])
    gains, costs = _price(graph, matching, pairs, max_gap_widths)
    is_better = gains > 0.0
    pairs, gains, costs = pairs[is_better], gains[is_better], costs[is_better]
    if steps is not None and len(pairs):
        gains -= steps.costs(pairs)
    for gain, cost, (i, j) in sorted(zip(gains.tolist(), costs.tolist(), pairs.tolist(), strict=True), key=_best_first):
        if gain <= 0.0:
            return
        if matching.is_open(i) and matching.is_open(j) and other_end(matching.chain(i)[-1]) != j:
            matching.join(i, j, cost, gain)


def lead_straightest_through(graph: Graph, matching: EndMatching, max_gap_widths: float) -> None:
    """Let the straighter of two cables run on where the other one ends inside of a branch that they share.

    Both enter the branch by the same end, so that the matching cannot decide which one runs on. Where the cable that
    would end then could go on over a gap to its own other end, nothing changes: it is rather one cable than a ring.

    Parameters
    ----------
    graph : Graph
    matching : EndMatching
        Changed.
    max_gap_widths : float
        Longest gap that is bridged, in widths.
    """
    partner = matching.partner
    for branch, twin in matching.branches.duplicate_of.items():
        for entry in (start_of(branch), stop_of(branch)):
            inner, through = other_end(entry), same_side(twin, entry)
            if not _is_open(matching, inner, UNAVAILABLE) or min(partner[entry], partner[through]) < 0:
                continue
            if matching.cost[entry] >= matching.cost[through] or other_end(through) in matching.chain(inner):
                continue
            far = other_end(matching.chain(partner[through])[-1])
            if _is_open(matching, far, FREE) and not graph.bordering[far]:
                _locate(graph, matching, inner)
                gains, _ = _price(graph, matching, np.array([(inner, far)]), max_gap_widths)
                if gains[0] > 0.0:
                    continue
            matching.trade_places(entry, through)


def free_ends(graph: Graph, matching: EndMatching) -> list[int]:
    """List the free ends of cables that are open and not cut by the image's border."""
    return [end for end in range(len(graph.nodes)) if _is_open(matching, end, FREE) and not graph.bordering[end]]


def _price(
    graph: Graph, matching: EndMatching, pairs: IntArray, max_gap_widths: float
) -> tuple[FloatArray, FloatArray]:
    """Return what each gap from an end inside of a branch to a free end gains over both left open, and its cost."""
    branches = matching.branches
    positions = branches.end_states[:, POSITION]
    distance = np.hypot(*(positions[pairs[:, 0]] - positions[pairs[:, 1]]).T)
    costs = turn_costs(branches, pairs, graph.width)
    open_cost = OPEN[OPEN_FREE] + np.array(branches.open_cost)[pairs[:, 1]]
    return np.where(distance <= max_gap_widths * graph.width, open_cost - costs, 0.0), costs


def _best_first(option: tuple[float, float, list[int]]) -> tuple[float, list[int]]:
    return -option[0], option[2]


def _is_open(matching: EndMatching, end: int, node: int) -> bool:
    branches = matching.branches
    return branches.nodes[end] == node and matching.is_open(end) and not branches.spurs[branch_of(end)]


def _locate(graph: Graph, matching: EndMatching, end: int) -> None:
    """Set the state of an end inside of a branch: its position, and the tangent of the branch there."""
    branches = matching.branches
    start, stop = branches.spans[branch_of(end)]
    own = branches.points[start if is_start(end) else stop - 1]
    first, last = graph.spans[branches.branch_id[branch_of(end)]].tolist()
    whole = graph.points[first:last]
    nearest = int(np.argmin(((whole - own) ** 2).sum(axis=1)))
    few = max(int(_DIRECTION_WIDTHS * graph.width), 2)
    along = whole[min(nearest + few, len(whole) - 1)] - whole[max(nearest - few, 0)]
    along *= -inward(end) / max(float(np.hypot(*along)), 1e-9)
    branches.end_states[end] = (*own, *along, 0.0, 0.0)
