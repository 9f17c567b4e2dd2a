"""The matching of the ends of branches: which end continues which."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from dloftbs.data.graph import UNAVAILABLE, branch_of, is_start, other_end, start_of, stop_of
from dloftbs.linking.kernels.joint_features import describe_pairs, prices
from dloftbs.linking.kernels.weights import JOINT
from dloftbs.support.arrays import FloatArray, IntArray


class Branches(NamedTuple):
    """Branches of a graph with ends, and after them the duplicates of those that two cables share.

    Parameters
    ----------
    points : numpy.ndarray, shape (m, 2)
        As the graph's; duplicates have points of their own.
    radius : numpy.ndarray, shape (m,)
        Half a cable's width at each point, px.
    branch_id : list of int
        Branch of the graph that each branch stands for.
    nodes : list of int
        Junction at each end, as the graph's.
    open_cost : list of float
        Cost of leaving each end open.
    spans : list of (int, int)
        Own points of each branch.
    spurs : list of bool
    end_states : numpy.ndarray, shape (2 n, 6)
    duplicate_of : dict of int to int
        From each shared branch to the other one with the same id, both ways.
    raw_radius : numpy.ndarray, shape (m,), or None
        Half the mask's width at each point of the graph, not smoothed; None where no branch can be shared.
    """

    points: FloatArray
    radius: FloatArray
    branch_id: list[int]
    nodes: list[int]
    open_cost: list[float]
    spans: list[tuple[int, int]]
    spurs: list[bool]
    end_states: FloatArray
    duplicate_of: dict[int, int]
    raw_radius: FloatArray | None = None

    def shift(self, end: int, by: FloatArray, radius: float) -> None:
        """Move the points of a shared branch in place, the first one at the given end, and set their radius."""
        start, stop = self.spans[branch_of(end)]
        own = slice(start, start + len(by)) if is_start(end) else slice(stop - len(by), stop)
        self.points[own] += by if is_start(end) else by[::-1]
        self.radius[own] = radius


def turn_costs(branches: Branches, pairs: IntArray, width: float) -> FloatArray:
    """Return the costs (k,) of pairs of ends (k, 2) by themselves, through a junction or across a gap, nats."""
    nodes = np.array(branches.nodes, np.int64)
    return prices(describe_pairs(branches.end_states, pairs, nodes, np.zeros(len(nodes)), width), JOINT)


class EndMatching:
    """Joints between the ends of branches: the partner of each end, and the cost and the margin of their joint.

    Joints change by the methods alone. Partners are always mutual; `join` and `limit_margin` write both ends of a
    joint. After an `exchange` without a margin, each end keeps the cost and the margin of the joint that it had.

    Parameters
    ----------
    branches : Branches
    partner : list of int
        End that each end is joined to, or -1.
    cost, margin : list of float
        Cost and margin of the joint at each end.
    alternative : list of int
        Partner of each end in the best alternative, or -1.
    near_joints : list of (float, int, int)
        Pairs of free ends that were left open by a small difference in cost: the difference, and the two ends; the
        least difference first. It is negative for a gap that gains, but rather is none.
    """

    def __init__(
        self,
        branches: Branches,
        partner: list[int],
        cost: list[float],
        margin: list[float],
        alternative: list[int],
        near_joints: Sequence[tuple[float, int, int]] = (),
    ) -> None:
        self.branches = branches
        self.near_joints: Sequence[tuple[float, int, int]] = near_joints
        self._partner, self._cost, self._margin, self._alternative = partner, cost, margin, alternative
        self._chains: list[tuple[list[int], bool]] | None = None
        self._at_junctions: dict[int, list[int]] | None = None
        assert all(j < 0 or (partner[j] == i and i != j) for i, j in enumerate(partner))

    @property
    def partner(self) -> Sequence[int]:
        """End that each end is joined to, or -1."""
        return self._partner

    @property
    def cost(self) -> Sequence[float]:
        """Cost of the joint at each end."""
        return self._cost

    @property
    def margin(self) -> Sequence[float]:
        """Margin of the joint at each end."""
        return self._margin

    @property
    def alternative(self) -> Sequence[int]:
        """Partner of each end in the best alternative, or -1."""
        return self._alternative

    def join(self, i: int, j: int, cost: float, margin: float) -> None:
        """Join two open ends."""
        assert i != j
        assert self._partner[i] < 0
        assert self._partner[j] < 0
        self._chains = None
        self._partner[i], self._partner[j] = j, i
        for end in (i, j):
            self._cost[end], self._margin[end], self._alternative[end] = cost, margin, -1

    def open(self, i: int) -> None:
        """Open the joint at an end."""
        self._chains = None
        j = self._partner[i]
        if j >= 0:
            self._partner[j] = -1
        self._partner[i] = -1
        assert self._is_mutual(i, j)

    def leave_open(self, i: int) -> None:
        """Open the gap at an end, and keep it as a near joint."""
        j = self._partner[i]
        near = -self._margin[i], min(i, j), max(i, j)
        self.open(i)
        self.near_joints = sorted([*self.near_joints, near])

    def exchange(self, i: int, k: int, margin: float | None = None) -> None:
        """Give two ends each other's partner, open or not; both joints get the margin, if one is given."""
        self._chains = None
        p, q = self._partner[i], self._partner[k]
        self._partner[i], self._partner[k] = q, p
        for end, partner in ((i, q), (k, p)):
            if partner >= 0:
                self._partner[partner] = end
                if margin is not None:
                    self._margin[end] = self._margin[partner] = margin
        assert self._is_mutual(i, k, p, q)

    def trade_places(self, i: int, k: int) -> None:
        """Give two ends that lie at the same place each other's joint, with its cost and margin."""
        self.exchange(i, k)
        for given in (self._cost, self._margin):
            given[i], given[k] = given[k], given[i]
        self._alternative[i], self._alternative[k] = self._alternative[k], self._alternative[i]

    def limit_margin(self, end: int, most: float) -> None:
        """Lower the margin of the joint at an end, if there is one, to at most this."""
        partner = self._partner[end]
        if partner >= 0:
            self._margin[end] = self._margin[partner] = min(self._margin[end], most)

    def _is_mutual(self, *ends: int) -> bool:
        partner = self._partner
        return all(end < 0 or partner[end] < 0 or (partner[partner[end]] == end != partner[end]) for end in ends)

    def is_open(self, end: int) -> bool:
        """Return whether an end has no partner."""
        return self._partner[end] < 0

    def is_crossing(self, end: int) -> bool:
        """Return whether the joint at an end runs through a junction."""
        nodes = self.branches.nodes
        return nodes[end] >= 0 and nodes[self._partner[end]] == nodes[end]

    def at_junction(self, node: int) -> list[int]:
        """List the ends at a junction, ascending."""
        if self._at_junctions is None:
            self._at_junctions = {}
            for end, at in enumerate(self.branches.nodes):
                self._at_junctions.setdefault(at, []).append(end)
        return self._at_junctions[node]

    def chain(self, start: int) -> list[int]:
        """List the ends at which a cable enters its branches, from one end on, until it stops or is back."""
        ends = [start]
        while (end := self._partner[other_end(ends[-1])]) >= 0 and end != start:
            ends.append(end)
        return ends

    def chains(self) -> list[tuple[list[int], bool]]:
        """List all cables as chains, and whether each is a loop, in a fixed order, without branches of no cable."""
        if self._chains is None:
            self._chains = self._list_chains()
        return self._chains

    def _list_chains(self) -> list[tuple[list[int], bool]]:
        found = []
        nodes, partner, spurs = self.branches.nodes, self._partner, self.branches.spurs
        visited = [False] * len(spurs)
        live = []
        for branch, is_spur in enumerate(spurs):
            first, last = start_of(branch), stop_of(branch)
            if is_spur:
                if partner[first] >= 0 or partner[last] >= 0:
                    live.append(branch)
            elif nodes[first] != UNAVAILABLE or nodes[last] != UNAVAILABLE:
                live.append(branch)
        starts = [end for branch in live for end in (start_of(branch), stop_of(branch)) if partner[end] < 0]
        for start in starts + [start_of(branch) for branch in live]:
            if not visited[branch_of(start)]:
                chain = self.chain(start)
                for end in chain:
                    visited[branch_of(end)] = True
                found.append((chain, partner[start] >= 0))
        return found
