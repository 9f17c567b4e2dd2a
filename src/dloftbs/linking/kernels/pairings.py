"""Pairings of ends at the least total cost: of few exactly, of many by exchanges."""

from __future__ import annotations

import numpy as np

from dloftbs.kernels.compiler import Floats, Ints, helper
from dloftbs.kernels.shared.graph_ends import FORBIDDEN
from dloftbs.kernels.shared.selection import falling_order

_SWEEPS = 20
"""Largest number of rounds of exchanges.

Source: bounds time; exchanges end by themselves, as each lowers the cost.
"""


@helper
def match_exactly(cost: Floats, open_cost: Floats, partner: Ints) -> float:
    """Find the matching of least cost by dynamic programming over the subsets that can be left.

    Parameters
    ----------
    cost : (n, n) float64
        Of each pair, symmetric.
    open_cost : (n,) float64
        Cost of leaving each end open.
    partner : (n,) int64
        Written: the partner of each end, -1 where it stays open.

    Returns
    -------
    float
        Total cost.
    """
    n = len(open_cost)
    value = np.empty(1 << n)
    choice = np.empty(1 << n, dtype=np.int64)
    ones = np.zeros(1 << n, dtype=np.int64)
    for members in range(1, 1 << n):
        ones[members] = ones[members >> 1] + (members & 1)
    value[0] = 0.0
    for i in range(n - 1, -1, -1):
        above = n - 1 - i
        for own in range(1 << above):
            # `i` is the lowest end left: those below are open, or joined with ends above.
            if above - ones[own] > i:
                continue
            rest = own << (i + 1)
            best, chosen = value[rest] + open_cost[i], -1
            for j in range(i + 1, n):
                if (rest >> j) & 1:
                    total = value[rest & ~(1 << j)] + cost[i, j]
                    if total < best:
                        best, chosen = total, j
            value[rest | 1 << i], choice[rest | 1 << i] = best, chosen
    members, i = (1 << n) - 1, 0
    while members:
        while not (members >> i) & 1:
            i += 1
        j = choice[members]
        partner[i] = j
        members &= ~(1 << i)
        if j >= 0:
            partner[j] = i
            members &= ~(1 << j)
    return value[(1 << n) - 1]


@helper
def list_pairs_of(rows: Ints, columns: Ints, n: int) -> tuple[Ints, Ints]:
    """List the pairs of each of `n` ends: the start of each end's pairs in the list, and the list.

    Each end's pairs ascend by its other end, where the pairs are given in ascending order.
    """
    first = np.zeros(n + 1, dtype=np.int64)
    for k in range(len(rows)):
        first[rows[k] + 1] += 1
        first[columns[k] + 1] += 1
    for i in range(n):
        first[i + 1] += first[i]
    pairs = np.empty(first[n], dtype=np.int64)
    filled = first[:n].copy()
    for k in range(len(rows)):
        for end in (rows[k], columns[k]):
            pairs[filled[end]] = k
            filled[end] += 1
    return first, pairs


@helper
def cost_of_pair(i: int, j: int, rows: Ints, columns: Ints, costs: Floats, first: Ints, pairs: Ints) -> float:
    """Return the cost of the pair of two ends, found by bisection; `FORBIDDEN` where there is none."""
    low, high = first[i], first[i + 1]
    while low < high:
        middle = (low + high) >> 1
        k = pairs[middle]
        other = rows[k] + columns[k] - i
        if other == j:
            return costs[k]
        if other < j:
            low = middle + 1
        else:
            high = middle
    return FORBIDDEN


@helper
def match_by_exchange(
    rows: Ints, columns: Ints, costs: Floats, open_cost: Floats, first: Ints, pairs: Ints, own: Ints, partner: Ints
) -> None:
    """Match as `match_exactly` for many ends: the highest gain first, then exchanges of two pairs while they gain.

    Parameters
    ----------
    rows, columns : (k,) int64
        Possible pairs, the lower end first, in ascending order.
    costs : (k,) float64
        Of each.
    open_cost : (n,) float64
        Cost of leaving each end open.
    first, pairs
        As `list_pairs_of` makes them.
    own : (m,) int64
        The pairs of the ends to match, in ascending order.
    partner : (n,) int64
        Written: the partner of each of these ends, -1 where it stays open.
    """
    savings, gaining, count = np.empty(len(own)), np.empty(len(own), dtype=np.int64), 0
    for k in own:
        partner[rows[k]] = partner[columns[k]] = -1
        saving = open_cost[rows[k]] + open_cost[columns[k]] - costs[k]
        if saving > 0.0:
            savings[count], gaining[count] = saving, k
            count += 1
    cost_now = open_cost.copy()  # of each end's joint, or of its being open
    order = falling_order(savings[:count])
    for at in order:
        k = gaining[at]
        i, j = rows[k], columns[k]
        if partner[i] < 0 and partner[j] < 0:
            partner[i], partner[j] = j, i
            cost_now[i] = cost_now[j] = costs[k]
    for _ in range(_SWEEPS):
        changed = False
        for at in order:
            k = gaining[at]
            i, j = rows[k], columns[k]
            p, q = partner[i], partner[j]
            if p == j:
                continue
            before = cost_now[i] + cost_now[j]
            after = costs[k]
            crosswise = FORBIDDEN
            if p >= 0 and q >= 0:
                crosswise = cost_of_pair(p, q, rows, columns, costs, first, pairs)
            joined = p >= 0 and q >= 0 and crosswise < open_cost[p] + open_cost[q]
            if joined:
                after += crosswise
            else:
                after += (open_cost[p] if p >= 0 else 0.0) + (open_cost[q] if q >= 0 else 0.0)
            if after < before - 1e-9:
                changed = True
                partner[i], partner[j] = j, i
                cost_now[i] = cost_now[j] = costs[k]
                if p >= 0:
                    partner[p] = q if joined else -1
                    cost_now[p] = crosswise if joined else open_cost[p]
                if q >= 0:
                    partner[q] = p if joined else -1
                    cost_now[q] = crosswise if joined else open_cost[q]
        if not changed:
            break
