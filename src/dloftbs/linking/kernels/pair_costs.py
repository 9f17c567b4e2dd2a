"""The pairs of ends that may be joined, with what is measured of each, and of each end that stays open."""

from __future__ import annotations

import numpy as np
from numba import boolean, float64, int64

from dloftbs.kernels.compiler import Bools, Floats, Ints, helper, kernel, read
from dloftbs.kernels.shared.copying import copy_to, longer, longer_rows
from dloftbs.kernels.shared.graph_ends import FORBIDDEN, UNAVAILABLE, branch_of
from dloftbs.linking.kernels.end_matching import group_by_key
from dloftbs.linking.kernels.evidence_weights import MAX_SEEN
from dloftbs.linking.kernels.joint_features import (
    GAP_LENGTH,
    GAP_ROUND,
    GAP_SEEN,
    OPEN_FREE,
    OPEN_JUNCTION,
    OPEN_KINK,
    describe_gap,
    describe_link,
    price,
    prices,
)
from dloftbs.linking.kernels.near_ends import near_ends
from dloftbs.linking.kernels.weights import JOINT, OPEN

_CHEAP_LINK = 0.6
"""Cost of a link below which no gap is sought from its ends, nats.

Source: by hand; it saves time, and lies below half the least cost of two open ends.
"""

_BEND_COST = float(OPEN[OPEN_KINK])
"""Most that a joint of the only two ends at a sharp turn costs, nats: the mask shows that it goes on there.

Source: measured; as much as one end left open there. From two to that, cables in tight turns side by side that are
right become 21 from 5 of 27, and random scenes 109 from 96 of 300; below it, fewer covered crossings are right.
"""

FOLD_COST = 1.5 * float(OPEN[OPEN_JUNCTION])
"""Most that a turn costs where other ends meet, too, nats: a cable may fold back there, as seen from its side.

Source: measured; less than two open ends. From one to two of them, right curves of recorded motion change by less than
a hundredth; at one and a half, .61 of 64 folds are right to 3 px, and their confidence says .57.
"""


@helper
def _list_junction_ends(nodes: Ints) -> tuple[Ints, Ints]:
    """List the ends at each junction: the start of each junction's ends in the list, and the list."""
    count = 0
    for node in nodes:
        count = max(count, node + 1)
    return group_by_key(nodes, count)


@helper
def _link_costs(
    first: Ints, members: Ints, degree: Ints, corners: Ints, end_id: Ints, spur: Bools, states: Floats, width: float
) -> tuple[Ints, Floats, Floats]:
    """Return the costs of links between the ends at each junction, and their columns.

    One cable bends around a corner however sharply, so that this link is free. No other one costs more than the fold
    that it may be, unless a spur is joined.

    Returns
    -------
    starts : (junctions + 1,) int64
        Start of each junction's costs: a square matrix, row by row.
    costs : (k,) float64
    links : (k, columns) float64
        In the upper triangle.
    """
    starts = np.zeros(len(first), dtype=np.int64)
    for node in range(len(first) - 1):
        starts[node + 1] = starts[node] + (first[node + 1] - first[node]) ** 2
    costs = np.full(starts[len(first) - 1], FORBIDDEN)
    links = np.zeros((len(costs), len(JOINT)))
    for node in range(len(first) - 1):
        size = first[node + 1] - first[node]
        most = _BEND_COST if degree[node] == 2 else FOLD_COST
        for a in range(size):
            for b in range(a + 1, size):
                i, j = members[first[node] + a], members[first[node] + b]
                if end_id[i] == end_id[j] or (spur[branch_of(i)] and spur[branch_of(j)]):
                    continue
                here, there = starts[node] + a * size + b, starts[node] + b * size + a
                if corners[i] >= 0 and corners[i] == corners[j]:
                    costs[here] = costs[there] = 0.0
                    continue
                describe_link(states, i, j, width, links[here])
                cost = price(links[here], JOINT)
                if not spur[branch_of(i)] and not spur[branch_of(j)]:
                    links[here] *= most / max(cost, most)
                    cost = min(cost, most)
                costs[here] = costs[there] = cost
    return starts, costs, links


@helper
def _degrees(first: Ints, members: Ints, spur: Bools) -> Ints:
    """Count the ends at each junction that are no spurs."""
    degree = np.zeros(len(first), dtype=np.int64)
    for node in range(len(first) - 1):
        for end in members[first[node] : first[node + 1]]:
            degree[node] += not spur[branch_of(end)]
    return degree


@kernel(read(int64, 1), read(boolean, 1), read(int64, 1), read(float64, 2), float64)
def junction_costs(
    nodes: Ints, spur: Bools, corners: Ints, states: Floats, width: float
) -> tuple[Ints, Ints, Ints, Floats]:
    """List the ends at every junction and the cost of each pair of them.

    Parameters
    ----------
    nodes : (2 n,) int64
        The junction at each end, negative where there is none.
    spur : (n,) bool
    corners : (2 n,) int64
        As `pair_costs` takes them.
    states : (2 n, 6) float64
    width : float
        px.

    Returns
    -------
    first : (junctions + 1,) int64
        Start of each junction's ends in `members`.
    members : (m,) int64
        Ends, junction after junction.
    starts : (junctions + 1,) int64
        Start of each junction's costs: a square matrix of its ends, row by row.
    costs : (k,) float64
        nats; `FORBIDDEN` where there is no pair.
    """
    first, members = _list_junction_ends(nodes)
    degree, end_id = _degrees(first, members, spur), np.arange(len(nodes))
    starts, costs, _ = _link_costs(first, members, degree, corners, end_id, spur, states, width)
    return first, members, starts, costs


@helper
def _find_decided(first: Ints, members: Ints, starts: Ints, costs: Floats, spur: Bools) -> Bools:
    """Return which ends have a mutual, nearly straight junction link: they take part in no gap."""
    n = 2 * len(spur)
    best = np.full(n, -1, dtype=np.int64)
    best_cost = np.full(n, _CHEAP_LINK)
    for node in range(len(first) - 1):
        size = first[node + 1] - first[node]
        for a in range(size):
            for b in range(a + 1, size):
                i, j = members[first[node] + a], members[first[node] + b]
                cost = costs[starts[node] + a * size + b]
                if spur[branch_of(i)] or spur[branch_of(j)]:
                    continue
                if cost < best_cost[i]:
                    best[i], best_cost[i] = j, cost
                if cost < best_cost[j]:
                    best[j], best_cost[j] = i, cost
    decided = np.zeros(n, dtype=np.bool_)
    for i in range(n):
        decided[i] = best[i] >= 0 and best[best[i]] == i
    return decided


@helper
def _describe_open(nodes: Ints, degree: Ints, spur: Bools) -> Floats:
    """Return the columns of each end that stays open, by how many ends that are no spurs its junction has."""
    ends = np.zeros((len(nodes), len(OPEN)))
    for end in range(len(nodes)):
        if spur[branch_of(end)]:
            continue
        if nodes[end] < 0:
            ends[end, OPEN_FREE] = 1.0
        else:
            ends[end, OPEN_KINK if degree[nodes[end]] == 2 else OPEN_JUNCTION] = 1.0
    return ends


@kernel(
    read(int64, 1), read(int64, 1), read(boolean, 1), read(float64, 1), read(float64, 2), float64,
    read(boolean, 1), read(int64, 1), float64, boolean, boolean, float64,
)  # fmt: skip
def pair_costs(
    nodes: Ints,
    end_id: Ints,
    spur: Bools,
    end_roundness: Floats,
    states: Floats,
    width: float,
    bordering: Bools,
    corners: Ints,
    max_gap: float,
    asked: bool,
    covers: bool,
    more: float,
) -> tuple[Ints, Ints, Floats, Floats]:
    """List the pairs of ends that cost less joined than open, with what is measured of them and of each open end.

    Parameters
    ----------
    nodes : (n,) int64
        The junction at each end, -1 where it is free, less where it cannot be joined.
    end_id : (n,) int64
        End of the graph that each end stands for: equal on duplicates of a branch.
    spur : (n / 2,) bool
        Branches that need no explanation, but may be the tip of another one.
    end_roundness : (n,) float64
        As `branch_ends.measure_roundness` makes them.
    states : (n, 6) float64
    width : float
        px.
    bordering : (n,) bool
        Ends cut by the image's border: they take part in no gap.
    corners : (n,) int64
        Equal for two ends that meet in one sharp bend; else -1.
    max_gap : float
        Longest gap, px; where more than `near_ends.MAX_GAPS` pairs of ends are so near, only shorter ones are sought.
    asked : bool
        Whether evidence will be asked: it may say for a gap as much as it says at most.
    covers : bool
        Whether it may say as well that a gap is covered all along.
    more : float
        Largest extra cost of pairs over two open ends, nats.

    Returns
    -------
    rows, columns : (k,) int64
        The ends, the lower one first, in ascending order.
    joints : (k, columns) float64
        As `joint_features` has them.
    opens : (n, columns) float64
    """
    n = len(nodes)
    first, members = _list_junction_ends(nodes)
    degree = _degrees(first, members, spur)
    opens = _describe_open(nodes, degree, spur)
    open_cost = prices(opens, OPEN)
    starts, costs, links = _link_costs(first, members, degree, corners, end_id, spur, states, width)
    is_bound = _find_decided(first, members, starts, costs, spur) | bordering  # to take part in no gap
    for end in range(n):
        is_bound[end] |= spur[branch_of(end)]
    loose = np.flatnonzero((nodes > UNAVAILABLE) & ~is_bound)
    first_near, near = near_ends(states, loose, max_gap)
    capacity = 4 * n + 16
    rows = np.empty(capacity, dtype=np.int64)
    columns = np.empty(capacity, dtype=np.int64)
    joints = np.empty((capacity, len(JOINT)))
    gap = np.empty(len(JOINT))
    count, next_loose = 0, 0
    for i in range(n):
        if nodes[i] <= UNAVAILABLE:
            continue
        at_gap = last_gap = 0  # the ends that a gap may lead to
        if next_loose < len(loose) and loose[next_loose] == i:
            at_gap, last_gap = first_near[next_loose], first_near[next_loose + 1]
            next_loose += 1
        at_link = last_link = row = 0  # the ends of its junction that come after it, and its row of costs there
        if nodes[i] >= 0:
            at_link, last_link = first[nodes[i]], first[nodes[i] + 1]
            row = starts[nodes[i]] - at_link
            while members[at_link] < i:
                at_link += 1
                row += last_link - first[nodes[i]]
            at_link += 1
        while at_gap < last_gap or at_link < last_link:
            across = near[at_gap] if at_gap < last_gap else n
            onward = members[at_link] if at_link < last_link else n
            j = min(across, onward)
            at_gap += across == j
            bound = open_cost[i] + open_cost[j]
            if onward == j:
                cost, measured = costs[row + at_link], links[row + at_link]  # `FORBIDDEN` where there is none
                at_link += 1
            else:
                if branch_of(end_id[i]) == branch_of(end_id[j]):  # the two ends of a branch, or those of its duplicates
                    continue
                describe_gap(states, i, j, width, end_roundness[i] + end_roundness[j], gap)
                cost, measured = price(gap, JOINT), gap
                if asked:
                    bound += JOINT[GAP_ROUND] * gap[GAP_ROUND] - JOINT[GAP_SEEN] * MAX_SEEN
                    bound += JOINT[GAP_LENGTH] * gap[GAP_LENGTH] * covers
            if cost >= bound + more:
                continue
            if count == capacity:
                capacity *= 2
                rows = longer(rows)
                columns = longer(columns)
                joints = longer_rows(joints)
            rows[count], columns[count] = i, j
            copy_to(joints[count], measured)
            count += 1
    return rows[:count].copy(), columns[:count].copy(), joints[:count].copy(), opens
