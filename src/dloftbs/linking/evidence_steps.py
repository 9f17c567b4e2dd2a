"""With depth or an image: joints along which cables would step in depth or in colour exchange their cables."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations, permutations

import numpy as np

from dloftbs.data.graph import POSITION, Graph, branch_of, ends_of, other_end
from dloftbs.evidence import EndEvidence
from dloftbs.linking.joint_evidence import are_folds, are_shared
from dloftbs.linking.kernels.joint_features import DEPTH_SWERVE, OTHER_COLOUR
from dloftbs.linking.kernels.pair_costs import junction_costs
from dloftbs.linking.kernels.weights import JOINT
from dloftbs.linking.matched_ends import EndMatching
from dloftbs.support.arrays import BoolArray, FloatArray, IntArray

_ROUNDS = 8
"""Largest number of exchanges in a frame.

Source: bounds time.
"""

MIN_GAIN = 1.0
"""Least gain by depth and colour alone that counts, nats.

Source: by definition; odds of e.
"""

_MAX_BRANCHES = 6
"""Number of branches along a cable, without depth or colour of their own, over which either is compared.

Source: by hand; as many crossings in a row are dense.
"""

_Joint = tuple[int, int, float]


class EvidenceSteps:
    """Cost of the joints of a matching by depth and by colour: branches too short to show either take it from the next.

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
        alone, none = ~are_shared(self.own), np.zeros(len(self.own), dtype=np.bool_)
        self._has_depth = evidence.has_depth[self.own] & alone if evidence.tells_swerves else none
        self._has_colour = evidence.has_colour[self.own] & alone if evidence.tells_colours else none
        self._lengths = np.diff(matching.branches.spans, axis=1).ravel()

    def costs(self, pairs: IntArray) -> FloatArray:
        """Return the cost of each pair of ends (k, 2): for a step in depth and another colour, 0 where unknown."""
        costs: FloatArray = np.zeros(len(pairs))
        if self._has_depth.any():
            ends, away = self._behind(pairs, self._has_depth, over_folds=False)
            is_known = (ends >= 0).all(axis=1)  # what is taken for an end of -1 does not count
            positions = self._matching.branches.end_states[pairs, POSITION]
            lengths = np.hypot(*(positions[:, 0] - positions[:, 1]).T) + away.sum(axis=1)
            swerves = self._evidence.swerves(self.own[ends], lengths)
            costs += JOINT[DEPTH_SWERVE] * swerves * (is_known & ~self._are_folds(pairs))
        if self._has_colour.any():
            ends, _ = self._behind(pairs, self._has_colour, over_folds=True)
            costs += JOINT[OTHER_COLOUR] * (self._evidence.differ_in_colour(self.own[ends]) & (ends >= 0).all(axis=1))
        return costs

    def gain(self, end: int, other: int) -> float:
        """Return how much less two joints cost by evidence if two ends exchange their partners."""
        (p, q), signs = (self._matching.partner[end], self._matching.partner[other]), (1.0, 1.0, -1.0, -1.0)
        joints = zip(((end, p), (other, q), (end, q), (other, p)), signs, strict=True)
        closed = [(pair, sign) for pair, sign in joints if pair[1] >= 0]
        if not closed:
            return 0.0
        costs = self.costs(np.array([pair for pair, _ in closed]))
        return float(costs @ np.array([sign for _, sign in closed]))

    def gain_of_second(self, before: list[int], beyond: tuple[int, int], at_start: bool, length: float) -> float:
        """Return how much less it costs by evidence if the second of two cables runs on where the other one has ended.

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
        gain = 0.0
        ends, away = self._behind(np.array(before), self._has_depth, over_folds=False)
        if ends.min() >= 0:
            swerves = self._evidence.swerves_into(self.own[ends].tolist(), beyond, at_start, length + away)
            gain += 0.0 if swerves is None else float(JOINT[DEPTH_SWERVE] * (swerves[0] - swerves[1]))
        ends, _ = self._behind(np.array(before), self._has_colour, over_folds=True)
        if ends.min() >= 0:
            one, two = self._evidence.differ_along(self.own[ends].tolist(), beyond, at_start).tolist()
            gain += float(JOINT[OTHER_COLOUR]) * (one - two)
        return gain

    def _behind(self, ends: IntArray, known: BoolArray, *, over_folds: bool) -> tuple[IntArray, FloatArray]:
        """Return the first known ends from some on, of their shape, -1 for none, and how far away they are, px."""
        found, away = ends.copy(), np.zeros(ends.shape)
        for place in zip(*np.nonzero(~known[ends]), strict=True):
            found[place], away[place] = self._next_known(int(ends[place]), known, over_folds=over_folds)
        return found, away

    def _next_known(self, end: int, known: BoolArray, *, over_folds: bool) -> tuple[int, float]:
        """Return the first known end along a cable, behind the branch of an end, and how far away it is, px; else -1.

        At a fold depth may change by any amount, and a colour does not.
        """
        length = 0.0
        for _ in range(_MAX_BRANCHES):
            length += float(self._lengths[branch_of(end)])
            last, end = other_end(end), self._matching.partner[other_end(end)]
            if end < 0 or (not over_folds and self._are_folds(np.array([[last, end]]))[0]):
                return -1, length
            if known[end]:
                return end, length
        return -1, length

    def _are_folds(self, pairs: IntArray) -> BoolArray:
        return are_folds(self._matching.branches.end_states, pairs)


def exchange_by_evidence(graph: Graph, matching: EndMatching, steps: EvidenceSteps) -> None:
    """Exchange the partners of ends at junctions where that saves more by evidence than it costs in bending.

    Parameters
    ----------
    graph : Graph
    matching : EndMatching
        Changed.
    steps : EvidenceSteps
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
    matching: EndMatching, steps: EvidenceSteps, link_costs: dict[tuple[int, int], float], one: int, other: int
) -> tuple[float, list[_Joint]]:
    """Return what two ends save by an exchange of partners, in bending and by evidence, and their joints then.

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
    by_evidence = steps.gain(one, other)
    if by_evidence < MIN_GAIN:
        return 0.0, []
    return sum(joint[2] for joint in now) - sum(joint[2] for joint in then) + by_evidence, then


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
