"""Matching of ends: all joints and all ends left open cost the least in sum."""

from __future__ import annotations

import numpy as np
from numba import float64, int64

from dloftbs.kernels.compiler import Floats, Ints, helper, kernel, read
from dloftbs.kernels.shared.graph_ends import FORBIDDEN
from dloftbs.kernels.shared.union_find import find_root, unite
from dloftbs.linking.kernels.pairings import cost_of_pair, list_pairs_of, match_by_exchange, match_exactly

EXACT = 10
"""Number of connected ends up to which they are paired exactly; more are paired by exchanges.

Source: bounds time, which doubles with each end.
"""

EXACT_AMONG_MANY = 8
"""Number of ends up to which they are paired exactly where many sets of ends are compared.

Source: bounds time, as `EXACT`.
"""


@helper
def _match(
    rows: Ints,
    columns: Ints,
    costs: Floats,
    open_cost: Floats,
    first: Ints,
    pairs: Ints,
    own: Ints,
    ends: Ints,
    local: Ints,
    partner: Ints,
) -> None:
    """Write the partners of a group of ends: `match_exactly` of few, `match_by_exchange` of many.

    Parameters
    ----------
    rows, columns, costs, open_cost, first, pairs, own, partner
        As `match_by_exchange` takes them.
    ends : (m,) int64
        The ends of the group.
    local : (n,) int64
        The place of each of them in it.
    """
    size = len(ends)
    if size > EXACT:
        match_by_exchange(rows, columns, costs, open_cost, first, pairs, own, partner)
        return
    cost, chosen = np.full((size, size), FORBIDDEN), np.empty(size, dtype=np.int64)
    for k in own:
        a, b = local[rows[k]], local[columns[k]]
        cost[a, b] = cost[b, a] = costs[k]
    match_exactly(cost, open_cost[ends], chosen)
    for a in range(size):
        partner[ends[a]] = ends[chosen[a]] if chosen[a] >= 0 else -1


@helper
def _best_alternative(
    a: int,
    rows: Ints,
    columns: Ints,
    costs: Floats,
    open_cost: Floats,
    first: Ints,
    pairs: Ints,
    partner: Ints,
    cost_now: Floats,
    same: Ints,
) -> tuple[float, int]:
    """Return the extra cost of the best matching without one pair, and the new partner of `a` in it, or -1."""
    b = partner[a]
    margin, alternative = open_cost[a] + open_cost[b] - cost_now[a], -1
    for at in range(first[a], first[a + 1]):
        k = pairs[at]
        c = rows[k] + columns[k] - a
        d = partner[c]
        # The same link on the other duplicate of a branch is no other choice.
        if c == b or same[c] == same[b] or (d >= 0 and same[d] in (same[a], same[b])):
            continue
        now = cost_now[a] + (cost_now[c] if d >= 0 else open_cost[c])
        if d >= 0:
            crosswise = cost_of_pair(b, d, rows, columns, costs, first, pairs)
            then = costs[k] + min(crosswise, open_cost[b] + open_cost[d])
        else:
            then = costs[k] + open_cost[b]
        if then - now < margin:
            margin, alternative = then - now, c
    return margin, alternative


@helper
def _find_groups(rows: Ints, columns: Ints, n: int) -> Ints:
    """Return for each end the lowest one connected with it by a chain of pairs."""
    group = np.arange(n)
    for k in range(len(rows)):
        unite(group, rows[k], columns[k])
    for end in range(n):
        group[end] = find_root(group, end)
    return group


@helper
def group_by_key(keys: Ints, n: int) -> tuple[Ints, Ints]:
    """Sort indices by their keys, 0 to n - 1: return the start of each key in the order, and the order.

    Those with keys below 0 are left out.
    """
    first = np.zeros(n + 1, dtype=np.int64)
    for key in keys:
        if key >= 0:
            first[key + 1] += 1
    for key in range(n):
        first[key + 1] += first[key]
    order = np.empty(first[n], dtype=np.int64)
    filled = first[:n].copy()
    for i in range(len(keys)):
        if keys[i] >= 0:
            order[filled[keys[i]]] = i
            filled[keys[i]] += 1
    return first, order


@helper
def match_ends(
    rows: Ints, columns: Ints, costs: Floats, bonus: Floats, open_cost: Floats, end_id: Ints
) -> tuple[Ints, Floats, Floats, Ints]:
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
        Cost of the joint at each end, and extra cost of the best alternative, both without bonuses: negative where
        only these speak for the joint.
    alternative : (n,) int64
        Partner of each end in the best alternative, or -1.
    """
    n = len(open_cost)
    partner, cost_of = np.full(n, -1, dtype=np.int64), np.zeros(n)
    margin_of = np.full(n, np.inf)
    alternative_of = np.full(n, -1, dtype=np.int64)
    group = _find_groups(rows, columns, n)
    first, order = group_by_key(group, n)
    first_pair, pair_order = group_by_key(group[rows], n)
    first_of, pairs_of = list_pairs_of(rows, columns, n)
    discounted = costs - bonus
    local = np.empty(n, dtype=np.int64)
    for root in range(n):
        ends = order[first[root] : first[root + 1]]
        if len(ends) < 2:
            continue
        for a in range(len(ends)):
            local[ends[a]] = a
        own = pair_order[first_pair[root] : first_pair[root + 1]]
        _match(rows, columns, discounted, open_cost, first_of, pairs_of, own, ends, local, partner)
        for k in own:
            if partner[rows[k]] == columns[k]:
                cost_of[rows[k]] = cost_of[columns[k]] = costs[k]
        least = 0.0  # of many ends the matching may not be the best one
        for k in own:
            least = -np.inf if bonus[k] != 0.0 else least
        for a in ends:
            if partner[a] >= 0:
                margin, alternative_of[a] = _best_alternative(
                    a, rows, columns, costs, open_cost, first_of, pairs_of, partner, cost_of, end_id
                )
                margin_of[a] = max(margin, least)
    for i in range(n):
        j = partner[i]
        if j > i:
            margin_of[i] = margin_of[j] = min(margin_of[i], margin_of[j])
    return partner, cost_of, margin_of, alternative_of


@helper
def _least_cost(cost: Floats, open_cost: Floats) -> float:
    """Return the least cost of a matching of ends (n,), from the costs of all their pairs (n, n)."""
    size = len(open_cost)
    partner = np.empty(size, dtype=np.int64)
    if size <= EXACT_AMONG_MANY:
        return match_exactly(cost, open_cost, partner)
    rows, columns = np.empty(size * size, dtype=np.int64), np.empty(size * size, dtype=np.int64)
    costs, count = np.empty(size * size), 0
    for a in range(size):
        for b in range(a + 1, size):
            if cost[a, b] < FORBIDDEN:
                rows[count], columns[count], costs[count] = a, b, cost[a, b]
                count += 1
    rows, columns, costs = rows[:count], columns[:count], costs[:count]
    partner[:] = -1
    first, pairs = list_pairs_of(rows, columns, size)
    match_by_exchange(rows, columns, costs, open_cost, first, pairs, np.arange(count), partner)
    total = 0.0
    for a in range(size):
        if partner[a] < 0:
            total += open_cost[a]
        elif partner[a] > a:
            total += cost[a, partner[a]]
    return total


@kernel(
    read(int64, 1), read(int64, 1), read(int64, 1), read(float64, 1),
    read(int64, 1), read(int64, 1), read(int64, 1), read(float64, 1),
)  # fmt: skip
def least_costs(
    sets: Ints, slots: Ints, nodes: Ints, open_cost: Floats, first: Ints, members: Ints, starts: Ints, costs: Floats
) -> Floats:
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
        totals[s] = _least_cost(cost, own_open_cost)
    return totals
