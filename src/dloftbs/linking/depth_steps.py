"""Stage 5, with depth: joints along which two cables would step towards the camera and back exchange their cables."""

from __future__ import annotations

from itertools import combinations, permutations

import numpy as np
import numpy.typing as npt

from dloftbs._arrays import FloatArray
from dloftbs.evidence import EndEvidence
from dloftbs.graph import POSITION, EndMatching, Graph, branch_of, ends_of, other_end, start_of, stop_of
from dloftbs.linking.kernels import bending
from dloftbs.mask_crop import MaskCrop

_ROUNDS = 8
"""Largest number of exchanges in a frame.

Source: bounds time.
"""

_LEAST_GAIN = 0.25
"""Least gain by depth alone that counts, units of cost.

Source: by definition; odds of e.
"""

_MOST_BRANCHES = 6
"""Number of branches along a cable, without depth of their own, over which depth is compared.

Source: by hand; as many crossings in a row are dense.
"""


class DepthSteps:
    """Cost of the joints of a matching by depth: branches too short for depth of their own take it from the next ones.

    Parameters
    ----------
    graph : Graph
    matching : EndMatching
    evidence : EndEvidence

    Attributes
    ----------
    own : numpy.ndarray, shape (n,)
        End of the graph that each end of the matching stands for.
    """

    def __init__(self, graph: Graph, matching: EndMatching, evidence: EndEvidence) -> None:
        self._matching, self._evidence, self._width = matching, evidence, graph.width
        branches = matching.branches
        ids = np.array(branches.branch_id)
        self.own = ends_of(ids)
        self._known = evidence.has_depth[self.own]
        for branch in branches.duplicate_of:  # depth is that of the cable on top
            self._known[[start_of(branch), stop_of(branch)]] = False
        self._lengths = np.diff(graph.spans, axis=1).ravel()[ids]

    def costs(self, pairs: npt.NDArray[np.int64]) -> FloatArray:
        """Return the cost of a cable's step in depth between the ends of each pair (k, 2), 0 where it is unknown."""
        ends, away = pairs.copy(), np.zeros(pairs.shape)
        for place in zip(*np.nonzero(~self._known[pairs]), strict=True):
            ends[place], away[place] = self._next_known(int(pairs[place]))
        told = (ends >= 0).all(axis=1)
        positions = self._matching.branches.end_states[pairs, POSITION]
        lengths = np.hypot(*(positions[:, 0] - positions[:, 1]).T) + away.sum(axis=1)
        swerves = self._evidence.swerves(self.own[ends], lengths) * told
        return bending.swerve_costs(lengths, np.zeros(len(pairs), np.bool_), swerves, self._width)

    def gain(self, end: int, other: int) -> float:
        """Return how much less two joints cost by depth if two ends exchange their partners."""
        (p, q), signs = (self._matching.partner[end], self._matching.partner[other]), (1.0, 1.0, -1.0, -1.0)
        joints = zip(((end, p), (other, q), (end, q), (other, p)), signs, strict=True)
        closed = [(pair, sign) for pair, sign in joints if pair[1] >= 0]
        if not closed:
            return 0.0
        costs = self.costs(np.array([pair for pair, _ in closed]))
        return float(costs @ np.array([sign for _, sign in closed]))

    def _next_known(self, end: int) -> tuple[int, float]:
        """Return the first end with depth along a cable, behind the branch of an end, and how far away it is, px."""
        length = 0.0
        for _ in range(_MOST_BRANCHES):
            length += float(self._lengths[branch_of(end)])
            end = self._matching.partner[other_end(end)]
            if end < 0 or self._known[end]:
                return end, length
        return -1, length


def exchange_by_depth(crop: MaskCrop, graph: Graph, matching: EndMatching, steps: DepthSteps) -> None:
    """Exchange the partners of ends at junctions where that saves more steps in depth than it costs in bending.

    Parameters
    ----------
    crop : MaskCrop
    graph : Graph
    matching : EndMatching
        Changed.
    steps : DepthSteps
    """
    nodes = np.array(matching.branches.nodes)
    for _ in range(_ROUNDS):
        partner = np.array(matching.partner)
        ends = np.flatnonzero((nodes >= 0) & (partner > np.arange(len(partner))) & (nodes[partner] == nodes))
        if len(ends) == 0:
            return
        by_node = np.bincount(nodes[ends], steps.costs(np.stack((ends, partner[ends]), axis=1)))
        best, chosen = 0.0, (-1, -1)
        for node in np.flatnonzero(by_node >= _LEAST_GAIN).tolist():
            own = np.flatnonzero(nodes == node)
            link_costs = _link_costs(crop, graph, node, dict(zip(own.tolist(), steps.own[own].tolist(), strict=True)))
            for one, other in combinations(own.tolist(), 2):
                gain = _gain(matching, steps, link_costs, one, other)
                if gain > best:
                    best, chosen = gain, (one, other)
        if best == 0.0:
            return
        matching.exchange(*chosen, best)


def _gain(
    matching: EndMatching, steps: DepthSteps, link_costs: dict[tuple[int, int], float], one: int, other: int
) -> float:
    """Return what an exchange of partners saves, in bending and in depth; none if a partner is elsewhere."""
    open_cost, (p, q) = matching.branches.open_cost, (matching.partner[one], matching.partner[other])
    joints = (one, p), (other, q), (one, q), (other, p)
    if p == other or any(joint not in link_costs for joint in joints if joint[1] >= 0):
        return 0.0
    by_depth = steps.gain(one, other)
    if by_depth < _LEAST_GAIN:
        return 0.0
    costs = [open_cost[end] if partner < 0 else link_costs[end, partner] for end, partner in joints]
    return costs[0] + costs[1] - costs[2] - costs[3] + by_depth


def _link_costs(crop: MaskCrop, graph: Graph, node: int, own: dict[int, int]) -> dict[tuple[int, int], float]:
    """Return the cost in bending of each pair of ends at a junction, in both orders.

    Parameters
    ----------
    crop : MaskCrop
    graph : Graph
    node : int
    own : dict of int to int
        From each end at the junction to the end of the graph that it stands for.
    """
    mask = crop.oriented(crop.pixels)
    first, members, starts, costs = bending.junction_costs(
        graph.nodes, graph.spurs, graph.end_states, graph.width, mask
    )
    place = {end: k for k, end in enumerate(members[first[node] : first[node + 1]].tolist())}
    table = costs[starts[node] : starts[node + 1]].reshape(len(place), len(place)).tolist()
    return {(one, other): table[place[own[one]]][place[own[other]]] for one, other in permutations(own, 2)}
