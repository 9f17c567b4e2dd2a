"""Matching of ends: all joints and all ends left open cost the least in sum."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import float64, int64

from dloftbs.kernels.compiler import helper, kernel, read
from dloftbs.kernels.shared.graph_ends import FORBIDDEN
from dloftbs.kernels.shared.selection import falling_order
from dloftbs.kernels.shared.union_find import find_root, unite

EXACT = 10
"""Number of connected ends up to which they are paired exactly; more are paired by exchanges.

Source: bounds time, which doubles with each end.
"""

EXACT_AMONG_MANY = 8
"""Number of ends up to which they are paired exactly where many sets of ends are compared.

Source: bounds time, as `EXACT`.
"""

_SWEEPS = 20
"""Largest number of rounds of exchanges.

Source: bounds time; exchanges end by themselves, as each lowers the cost.
"""


@helper
def match_exactly(
    cost: npt.NDArray[np.float64], open_cost: npt.NDArray[np.float64], partner: npt.NDArray[np.int64]
) -> float:
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
def match_by_exchange(
    cost: npt.NDArray[np.float64], open_cost: npt.NDArray[np.float64], partner: npt.NDArray[np.int64]
) -> float:
    """Match as `match_exactly` for many ends: the highest gain first, then exchanges of two pairs while they gain."""
    n = len(open_cost)
    partner[:] = -1
    savings = np.empty(n * (n - 1) // 2)
    rows = np.empty(len(savings), dtype=np.int64)
    columns = np.empty(len(savings), dtype=np.int64)
    count = 0
    for i in range(n):
        for j in range(i + 1, n):
            saving = open_cost[i] + open_cost[j] - cost[i, j]
            if saving > 0.0:
                savings[count], rows[count], columns[count] = saving, i, j
                count += 1
    order = falling_order(savings[:count])
    for k in order:
        i, j = rows[k], columns[k]
        if partner[i] < 0 and partner[j] < 0:
            partner[i], partner[j] = j, i
    for _ in range(_SWEEPS):
        changed = False
        for k in order:
            i, j = rows[k], columns[k]
            p, q = partner[i], partner[j]
            if p == j:
                continue
            before = (cost[i, p] if p >= 0 else open_cost[i]) + (cost[j, q] if q >= 0 else open_cost[j])
            after = cost[i, j]
            joined = p >= 0 and q >= 0 and cost[p, q] < open_cost[p] + open_cost[q]
            if joined:
                after += cost[p, q]
            else:
                after += (open_cost[p] if p >= 0 else 0.0) + (open_cost[q] if q >= 0 else 0.0)
            if after < before - 1e-9:
                changed = True
                partner[i], partner[j] = j, i
                if p >= 0:
                    partner[p] = q if joined else -1
                if q >= 0:
                    partner[q] = p if joined else -1
        if not changed:
            break
    total = 0.0
    for i in range(n):
        if partner[i] < 0:
            total += open_cost[i]
        elif partner[i] > i:
            total += cost[i, partner[i]]
    return total


@helper
def _match(cost: npt.NDArray[np.float64], open_cost: npt.NDArray[np.float64], partner: npt.NDArray[np.int64]) -> float:
    if len(open_cost) <= EXACT:
        return match_exactly(cost, open_cost, partner)
    return match_by_exchange(cost, open_cost, partner)


@helper
def _best_alternative(
    a: int,
    options: npt.NDArray[np.int64],
    partner: npt.NDArray[np.int64],
    cost: npt.NDArray[np.float64],
    open_cost: npt.NDArray[np.float64],
    same: npt.NDArray[np.int64],
) -> tuple[float, int]:
    """Return the extra cost of the best matching without one pair, and the new partner of `a` in it, or -1."""
    b = partner[a]
    margin, alternative = open_cost[a] + open_cost[b] - cost[a, b], -1
    for c in options:
        d = partner[c]
        # The same link on the other duplicate of a branch is no other choice.
        if c == b or same[c] == same[b] or (d >= 0 and same[d] in (same[a], same[b])):
            continue
        now = cost[a, b] + (cost[c, d] if d >= 0 else open_cost[c])
        then = cost[a, c] + (min(cost[b, d], open_cost[b] + open_cost[d]) if d >= 0 else open_cost[b])
        if then - now < margin:
            margin, alternative = then - now, c
    return max(margin, 0.0), alternative


@helper
def _find_groups(rows: npt.NDArray[np.int64], columns: npt.NDArray[np.int64], n: int) -> npt.NDArray[np.int64]:
    """Return for each end the lowest one connected with it by a chain of pairs."""
    group = np.arange(n)
    for k in range(len(rows)):
        unite(group, rows[k], columns[k])
    for end in range(n):
        group[end] = find_root(group, end)
    return group


@helper
def _group_by_key(keys: npt.NDArray[np.int64], n: int) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Sort indices by their keys, 0 to n - 1: return the start of each key in the order, and the order."""
    first = np.zeros(n + 1, dtype=np.int64)
    for key in keys:
        first[key + 1] += 1
    for key in range(n):
        first[key + 1] += first[key]
    order = np.empty(len(keys), dtype=np.int64)
    filled = first[:n].copy()
    for i in range(len(keys)):
        order[filled[keys[i]]] = i
        filled[keys[i]] += 1
    return first, order


@helper
def _cost_difference(
    partner: npt.NDArray[np.int64],
    alone: npt.NDArray[np.int64],
    cost: npt.NDArray[np.float64],
    open_cost: npt.NDArray[np.float64],
) -> float:
    """Return the extra cost of one matching over another; 0 where they are the same."""
    difference = 0.0
    for i in range(len(open_cost)):
        if partner[i] != alone[i]:
            difference += open_cost[i] if partner[i] < 0 else 0.5 * cost[i, partner[i]]
            difference -= open_cost[i] if alone[i] < 0 else 0.5 * cost[i, alone[i]]
    return difference


@helper
def match_ends(
    rows: npt.NDArray[np.int64],
    columns: npt.NDArray[np.int64],
    costs: npt.NDArray[np.float64],
    bonus: npt.NDArray[np.float64],
    open_cost: npt.NDArray[np.float64],
    end_id: npt.NDArray[np.int64],
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.float64], npt.NDArray[np.float64], npt.NDArray[np.int64], float]:
    """Match ends at the least total cost; an end may stay open.

    Ends that no chain of possible pairs connects are independent: each connected group is matched by itself,
    exactly up to `EXACT` ends.

    Parameters
    ----------
    rows, columns : (k,) int64
        Possible pairs, each once.
    costs : (k,) float64
    bonus : (k,) float64
        Discount on the cost of each.
    open_cost : (n,) float64
        Cost of leaving each end open.
    end_id : (n,) int64
        End of the graph that each end stands for: equal on duplicates of a branch.

    Returns
    -------
    partner : (n,) int64
        -1 where an end stays open.
    cost, margin : (n,) float64
        Cost of the joint at each end, and extra cost of the best alternative, bonuses included.
    alternative : (n,) int64
        Partner of each end in the best alternative, or -1.
    override : float
        Cost saved by the matching without any bonus.
    """
    n, override = len(open_cost), 0.0
    partner = np.full(n, -1, dtype=np.int64)
    cost_of = np.zeros(n)
    margin_of = np.full(n, np.inf)
    alternative_of = np.full(n, -1, dtype=np.int64)
    group = _find_groups(rows, columns, n)
    first, order = _group_by_key(group, n)
    first_pair, pair_order = _group_by_key(group[rows], n)
    local = np.empty(n, dtype=np.int64)
    for root in range(n):
        ends = order[first[root] : first[root + 1]]
        size = len(ends)
        if size < 2:
            continue
        for a in range(size):
            local[ends[a]] = a
        own = pair_order[first_pair[root] : first_pair[root + 1]]
        plain, has_bonus = np.full((size, size), FORBIDDEN), False
        both = np.empty(2 * len(own), dtype=np.int64)  # both ends of each possible pair
        with_whom = np.empty(len(both), dtype=np.int64)
        for p in range(len(own)):
            k = own[p]
            a, b = local[rows[k]], local[columns[k]]
            plain[a, b] = plain[b, a] = costs[k]
            has_bonus = has_bonus or bonus[k] != 0.0
            both[p], both[len(own) + p] = b, a
            with_whom[p], with_whom[len(own) + p] = a, b
        cost = plain
        if has_bonus:
            cost = plain.copy()
            for k in own:
                a, b = local[rows[k]], local[columns[k]]
                cost[a, b] = cost[b, a] = costs[k] - bonus[k]
        own_open_cost, same = open_cost[ends], end_id[ends]
        chosen = np.full(size, -1, dtype=np.int64)
        _match(cost, own_open_cost, chosen)
        if has_bonus:
            alone = np.full(size, -1, dtype=np.int64)
            _match(plain, own_open_cost, alone)
            override += _cost_difference(chosen, alone, plain, own_open_cost)
        start, option = _group_by_key(both, size)
        for a in range(size):
            b = chosen[a]
            if b >= 0:
                partner[ends[a]] = ends[b]
                cost_of[ends[a]] = plain[a, b]
                options = with_whom[option[start[a] : start[a + 1]]]
                margin, c = _best_alternative(a, options, chosen, cost, own_open_cost, same)
                margin_of[ends[a]] = margin
                alternative_of[ends[a]] = ends[c] if c >= 0 else -1
    for i in range(n):
        j = partner[i]
        if j > i:
            margin_of[i] = margin_of[j] = min(margin_of[i], margin_of[j])
    return partner, cost_of, margin_of, alternative_of, override


@kernel(
    read(int64, 1), read(int64, 1), read(int64, 1), read(float64, 1),
    read(int64, 1), read(int64, 1), read(int64, 1), read(float64, 1),
)  # fmt: skip
def least_costs(
    sets: npt.NDArray[np.int64],
    slots: npt.NDArray[np.int64],
    nodes: npt.NDArray[np.int64],
    open_cost: npt.NDArray[np.float64],
    first: npt.NDArray[np.int64],
    members: npt.NDArray[np.int64],
    starts: npt.NDArray[np.int64],
    costs: npt.NDArray[np.float64],
) -> npt.NDArray[np.float64]:
    """Return the least cost of a matching of each set of ends.

    Parameters
    ----------
    sets : (s + 1,) int64
        Start of each set in `slots`.
    slots : (m,) int64
        Ends at one junction each set; an end may stand twice, but is not matched with itself.
    nodes : (n,) int64
        The junction at each end.
    open_cost : (n,) float64
        Cost of leaving each end open.
    first, members, starts, costs
        As `pair_costs.junction_costs` makes them.

    Returns
    -------
    (s,) float64
    """
    local = np.empty(len(nodes), dtype=np.int64)
    for node in range(len(first) - 1):
        for k in range(first[node], first[node + 1]):
            local[members[k]] = k - first[node]
    totals = np.empty(len(sets) - 1)
    for s in range(len(totals)):
        ends = slots[sets[s] : sets[s + 1]]
        size = len(ends)
        if size == 0:
            totals[s] = 0.0
            continue
        node = nodes[ends[0]]
        stride = first[node + 1] - first[node]
        cost, own_open_cost = np.empty((size, size)), np.empty(size)
        for a in range(size):
            own_open_cost[a] = open_cost[ends[a]]
            for b in range(size):
                cost[a, b] = costs[starts[node] + local[ends[a]] * stride + local[ends[b]]]
        partner = np.empty(size, dtype=np.int64)
        if size <= EXACT_AMONG_MANY:
            totals[s] = match_exactly(cost, own_open_cost, partner)
        else:
            totals[s] = match_by_exchange(cost, own_open_cost, partner)
    return totals
