"""Path cover: pieces of cables are joined to as many cables as there are, or left out, at a low total cost.

Piece ``p`` has the ports ``2 p`` and ``2 p + 1``, as a branch has ends.
"""

from __future__ import annotations

import numpy as np
from numba import float64, int64

from dloftbs.kernels.compiler import Floats, Ints, helper, kernel, read
from dloftbs.kernels.shared.graph_ends import branch_of
from dloftbs.kernels.shared.selection import falling_order
from dloftbs.kernels.shared.union_find import find_root, unite


@helper
def _total_cost(pairs: Ints, joins: Ints, costs: Floats, drop_costs: Floats, most: int) -> float:
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


@kernel(read(int64, 2), read(float64, 1), read(float64, 1), int64)
def cover(pairs: Ints, costs: Floats, drop_costs: Floats, most: int) -> Ints:
    """Choose joins between pieces, so that no more than `most` cables remain beside the pieces that are left out.

    The cheapest pairs are joined first; then those joins are undone that cost more than to leave out what comes off.

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
