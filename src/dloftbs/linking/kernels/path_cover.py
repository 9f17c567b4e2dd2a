"""Path cover: pieces of cables are joined to as many cables as there are, or left out, at the least total cost.

Piece ``p`` has the ports ``2 p`` and ``2 p + 1``, as a branch has ends.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import float64, int64

from dloftbs.kernels.compiler import helper, kernel, read
from dloftbs.kernels.shared.graph_ends import branch_of, other_end, start_of, stop_of
from dloftbs.kernels.shared.selection import falling_order
from dloftbs.kernels.shared.union_find import find_root, unite

EXACT = 8
"""Number of pieces up to which the cover is exact; more are covered by exchanges.

Source: bounds time, which triples with each piece.
"""


@helper
def _shortest_paths(
    pair_at: npt.NDArray[np.int64], costs: npt.NDArray[np.float64], n: int
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.int64]]:
    """Return the cost of the cheapest path over each set of pieces that stops at each port, and its last pair.

    The last pair is -1 where the path is one piece.
    """
    path_cost = np.full((1 << n, 2 * n), np.inf)
    through = np.full((1 << n, 2 * n), -1, dtype=np.int64)
    for piece in range(n):
        path_cost[1 << piece, start_of(piece)] = path_cost[1 << piece, stop_of(piece)] = 0.0
    for members in range(1, 1 << n):
        for port in range(2 * n):
            so_far = path_cost[members, port]
            if so_far == np.inf:
                continue
            for onward in range(2 * n):
                k, added = pair_at[port, onward], 1 << branch_of(onward)
                if k < 0 or members & added:
                    continue
                together, stop = members | added, other_end(onward)
                if so_far + costs[k] < path_cost[together, stop]:
                    path_cost[together, stop], through[together, stop] = so_far + costs[k], k
    return path_cost, through


@helper
def _choose_paths(
    path_cost: npt.NDArray[np.float64],
    tail: npt.NDArray[np.int64],
    drop_costs: npt.NDArray[np.float64],
    most: int,
) -> npt.NDArray[np.int64]:
    """Return the set of pieces to take off first, for each number of paths and set of pieces.

    A path's set is positive; a piece that is left out is negative.
    """
    sets = len(path_cost)
    value = np.full((most + 1, sets), np.inf)
    chosen = np.zeros((most + 1, sets), dtype=np.int64)
    value[:, 0] = 0.0
    for left in range(1, sets):
        first = 0
        while not left & (1 << first):
            first += 1
        rest = left ^ (1 << first)
        for slots in range(most + 1):
            value[slots, left] = drop_costs[first] + value[slots, rest]
            chosen[slots, left] = -(1 << first)
        others = rest
        while True:  # all sets with the first piece
            members = others | (1 << first)
            cost = path_cost[members, tail[members]]
            if cost < np.inf:
                for slots in range(1, most + 1):
                    total = cost + value[slots - 1, left ^ members]
                    if total < value[slots, left]:
                        value[slots, left], chosen[slots, left] = total, members
            if others == 0:
                break
            others = (others - 1) & rest
    return chosen


@helper
def _cover_exactly(
    pairs: npt.NDArray[np.int64], costs: npt.NDArray[np.float64], drop_costs: npt.NDArray[np.float64], most: int
) -> npt.NDArray[np.int64]:
    """Find the cover of least cost by dynamic programming over sets of pieces: paths first, then sets of paths."""
    n = len(drop_costs)
    pair_at = np.full((2 * n, 2 * n), -1, dtype=np.int64)
    for k in range(len(pairs)):
        i, j = pairs[k]
        if pair_at[i, j] < 0 or costs[k] < costs[pair_at[i, j]]:
            pair_at[i, j] = pair_at[j, i] = k
    path_cost, through = _shortest_paths(pair_at, costs, n)
    tail = np.zeros(1 << n, dtype=np.int64)  # the open port at which the cheapest path over each set stops
    for members in range(1, 1 << n):
        tail[members] = np.argmin(path_cost[members])
    chosen = _choose_paths(path_cost, tail, drop_costs, most)
    joins = np.empty(n, dtype=np.int64)
    count, left, slots = 0, (1 << n) - 1, most
    while left:
        members = chosen[slots, left]
        left ^= abs(members)
        if members < 0:  # left out
            continue
        slots -= 1
        port = tail[members]
        while through[members, port] >= 0:
            k = through[members, port]
            joins[count] = k
            count += 1
            members ^= 1 << branch_of(port)
            port = pairs[k, 0] if branch_of(pairs[k, 1]) == branch_of(port) else pairs[k, 1]
    return joins[:count].copy()


@helper
def _total_cost(
    pairs: npt.NDArray[np.int64],
    joins: npt.NDArray[np.int64],
    costs: npt.NDArray[np.float64],
    drop_costs: npt.NDArray[np.float64],
    most: int,
) -> float:
    """Return the cost of joins, those that are -1 left out, and of leaving out the cheapest cables beyond `most`."""
    n, total = len(drop_costs), 0.0
    parent = np.arange(n)
    for k in joins:
        if k >= 0:
            total += costs[k]
            unite(parent, branch_of(pairs[k, 0]), branch_of(pairs[k, 1]))
    cables = np.zeros(n)
    for piece in range(n):
        cables[find_root(parent, piece)] += drop_costs[piece]
    count = 0
    for piece in range(n):
        if find_root(parent, piece) == piece:
            cables[count] = cables[piece]
            count += 1
    order, left_out = falling_order(cables[:count]), 0.0
    for place in range(count - 1, most - 1, -1):
        left_out += cables[order[place]]
    return total + left_out


@helper
def _cover_by_exchanges(
    pairs: npt.NDArray[np.int64], costs: npt.NDArray[np.float64], drop_costs: npt.NDArray[np.float64], most: int
) -> npt.NDArray[np.int64]:
    """Join the cheapest pairs first, then break the joins that cost more than to leave out what comes off by it."""
    n = len(drop_costs)
    joins = np.empty(n, dtype=np.int64)
    taken = np.zeros(2 * n, dtype=np.bool_)
    parent = np.arange(n)
    count = 0
    for k in falling_order(-costs):
        if n - count <= most:
            break
        i, j = pairs[k]
        if taken[i] or taken[j] or find_root(parent, branch_of(i)) == find_root(parent, branch_of(j)):
            continue
        taken[i] = taken[j] = True
        unite(parent, branch_of(i), branch_of(j))
        joins[count] = k
        count += 1
    total = _total_cost(pairs, joins[:count], costs, drop_costs, most)
    for at in range(count - 1, -1, -1):  # the one that costs the most first
        broken, joins[at] = joins[at], -1
        without = _total_cost(pairs, joins[:count], costs, drop_costs, most)
        if without < total:
            total = without
        else:
            joins[at] = broken
    kept = joins[:count]
    return kept[kept >= 0]


@kernel(read(int64, 2), read(float64, 1), read(float64, 1), int64)
def cover(
    pairs: npt.NDArray[np.int64], costs: npt.NDArray[np.float64], drop_costs: npt.NDArray[np.float64], most: int
) -> npt.NDArray[np.int64]:
    """Choose joins between pieces, so that no more than `most` cables remain beside the pieces that are left out.

    Parameters
    ----------
    pairs : (k, 2) int64
        Ports of different pieces that may be joined.
    costs : (k,) float64
        Cost of joining each pair, not negative.
    drop_costs : (n,) float64
        Cost of leaving out each piece, not negative.
    most : int
        Number of cables.

    Returns
    -------
    (j,) int64
        Pairs that are joined.
    """
    if len(drop_costs) <= most or len(pairs) == 0:
        return np.empty(0, dtype=np.int64)
    if len(drop_costs) <= EXACT:
        return _cover_exactly(pairs, costs, drop_costs, most)
    return _cover_by_exchanges(pairs, costs, drop_costs, most)
