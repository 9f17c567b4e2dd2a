"""With depth: joints along which two cables would step towards the camera and back exchange their cables."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations, permutations

import numpy as np
import numpy.typing as npt

from dloftbs.data.graph import POSITION, Graph, branch_of, ends_of, other_end
from dloftbs.evidence import EndEvidence
from dloftbs.linking.joint_evidence import are_folds, are_shared
from dloftbs.linking.kernels.joint_features import DEPTH_SWERVE
from dloftbs.linking.kernels.pair_costs import junction_costs
from dloftbs.linking.kernels.weights import JOINT
from dloftbs.linking.matched_ends import EndMatching
from dloftbs.support.arrays import FloatArray

_ROUNDS = 8
"""Largest number of exchanges in a frame.

Source: bounds time.
"""

MIN_GAIN = 1.0
"""Least gain by depth alone that counts, nats.

Source: by definition; odds of e.
"""

_MAX_BRANCHES = 6
"""Number of branches along a cable, without depth of their own, over which depth is compared.

Source: by hand; as many crossings in a row are dense.
"""

_Joint = tuple[int, int, float]


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
        self._matching, self._evidence = matching, evidence
        ids = np.array(matching.branches.branch_id)
        self.own = ends_of(ids)
        is_shared = are_shared(self.own)
        self._known = evidence.has_depth[self.own] & ~is_shared
        self._lengths = np.diff(graph.spans, axis=1).ravel()[ids]

    def costs(self, pairs: npt.NDArray[np.int64]) -> FloatArray:
        """Return the cost of a cable's step in depth between the ends of each pair (k, 2), 0 where it is unknown."""
        ends, away = pairs.copy(), np.zeros(pairs.shape)
        for place in zip(*np.nonzero(~self._known[pairs]), strict=True):
            ends[place], away[place] = self._next_known(int(pairs[place]))
        told = (ends >= 0).all(axis=1) & ~self._are_folds(pairs)  # what is taken for an end of -1 does not count
        positions = self._matching.branches.end_states[pairs, POSITION]
        lengths = np.hypot(*(positions[:, 0] - positions[:, 1]).T) + away.sum(axis=1)
        costs: FloatArray = JOINT[DEPTH_SWERVE] * self._evidence.swerves(self.own[ends], lengths) * told
        return costs

    def gain(self, end: int, other: int) -> float:
        """Return how much less two joints cost by depth if two ends exchange their partners."""
        (p, q), signs = (self._matching.partner[end], self._matching.partner[other]), (1.0, 1.0, -1.0, -1.0)
        joints = zip(((end, p), (other, q), (end, q), (other, p)), signs, strict=True)
        closed = [(pair, sign) for pair, sign in joints if pair[1] >= 0]
        if not closed:
            return 0.0
        costs = self.costs(np.array([pair for pair, _ in closed]))
        return float(costs @ np.array([sign for _, sign in closed]))

    def gain_of_second(self, before: list[int], beyond: tuple[int, int], at_start: bool, length: float) -> float:
        """Return how much less it costs by depth if the second of two cables runs on where the other one has ended.

        Parameters
        ----------
        before : list of int
            End of each one before the branches that they share.
        beyond : (int, int)
            The points of the graph along which one of them runs on.
        at_start : bool
            True if the first one of these is nearest to the other one's end, not the last one.
        length : float
            Of what they share, px.
        """
        known = [(end, 0.0) if self._known[end] else self._next_known(end) for end in before]
        ends = [end for end, _ in known]
        if min(ends) < 0:
            return 0.0
        lengths = np.array([length + away for _, away in known])
        swerves = self._evidence.swerves_into(self.own[ends].tolist(), beyond, at_start, lengths)
        if swerves is None:
            return 0.0
        one, two = (JOINT[DEPTH_SWERVE] * swerves).tolist()
        return float(one - two)

    def _next_known(self, end: int) -> tuple[int, float]:
        """Return the first end with depth along a cable, behind the branch of an end, and how far away it is, px.

        There is none behind a fold, at which depth may change by any amount.
        """
        length = 0.0
        for _ in range(_MAX_BRANCHES):
            length += float(self._lengths[branch_of(end)])
            last, end = other_end(end), self._matching.partner[other_end(end)]
            if end < 0 or self._are_folds(np.array([[last, end]]))[0]:
                return -1, length
            if self._known[end]:
                return end, length
        return -1, length

    def _are_folds(self, pairs: npt.NDArray[np.int64]) -> npt.NDArray[np.bool_]:
        return are_folds(self._matching.branches.end_states, pairs)


def exchange_by_depth(graph: Graph, matching: EndMatching, steps: DepthSteps) -> None:
    """Exchange the partners of ends at junctions where that saves more steps in depth than it costs in bending.

    Parameters
    ----------
    graph : Graph
    matching : EndMatching
        Changed.
    steps : DepthSteps
    """
    chosen: list[_Joint] = []
    nodes = np.array(matching.branches.nodes)
    for _ in range(_ROUNDS):
        partner = np.array(matching.partner)
        ends = np.flatnonzero((nodes >= 0) & (partner > np.arange(len(partner))) & (nodes[partner] == nodes))
        if len(ends) == 0:
            return
        by_node = np.bincount(nodes[ends], steps.costs(np.stack((ends, partner[ends]), axis=1)))
        stepping = np.flatnonzero(by_node >= MIN_GAIN).tolist()
        link_costs = _link_costs(graph, stepping) if stepping else {}
        best = 0.0
        for node in stepping:
            for pair in combinations(np.flatnonzero(nodes == node).tolist(), 2):
                gain, joints = _exchange(matching, steps, link_costs, *pair)
                if gain > best:
                    best, chosen = gain, joints
        if best == 0.0:
            return
        for end, _, _ in chosen:
            matching.open(end)
        for end, other, cost in chosen:
            if other >= 0:
                matching.join(end, other, cost, best)


def _exchange(
    matching: EndMatching, steps: DepthSteps, link_costs: dict[tuple[int, int], float], one: int, other: int
) -> tuple[float, list[_Joint]]:
    """Return what two ends save by an exchange of partners, in bending and in depth, and their joints then.

    A joint is an end, its partner or -1, and its cost in bending. Nothing is saved if a partner is at another junction.
    """
    ends, partners = (one, other), (matching.partner[one], matching.partner[other])
    if other in partners:
        return 0.0, []
    now: list[_Joint] = []
    then: list[_Joint] = []
    for joints, order in ((now, partners), (then, partners[::-1])):
        for end, partner in zip(ends, order, strict=True):
            cost = matching.branches.open_cost[end]
            if partner >= 0:
                ids = int(steps.own[end]), int(steps.own[partner])
                if ids not in link_costs:
                    return 0.0, []
                cost = link_costs[ids]
            joints.append((end, partner, cost))
    by_depth = steps.gain(one, other)
    if by_depth < MIN_GAIN:
        return 0.0, []
    return sum(joint[2] for joint in now) - sum(joint[2] for joint in then) + by_depth, then


def _link_costs(graph: Graph, nodes: Sequence[int]) -> dict[tuple[int, int], float]:
    """Return the cost in bending of each pair of ends of the graph at some junctions, in both orders."""
    first, members, starts, costs = junction_costs(
        graph.nodes, graph.spurs, graph.corners, graph.end_states, graph.width
    )
    found = {}
    for node in nodes:
        ends = members[first[node] : first[node + 1]].tolist()
        table = costs[starts[node] : starts[node + 1]].reshape(len(ends), len(ends)).tolist()
        found.update({(ends[a], ends[b]): table[a][b] for a, b in permutations(range(len(ends)), 2)})
    return found
