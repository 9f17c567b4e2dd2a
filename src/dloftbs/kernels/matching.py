"""Ends paired so that all joints together, and all ends left open, cost the least."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import float64, int64

from dloftbs.kernels._compile import helper, kernel, read

EXACT = 10
"""Up to this many ends that have to do with each other are paired exactly, more by exchanges."""

EXACT_AMONG_MANY = 8
"""The same, where many sets of ends are compared."""

_SWEEPS = 20
_NEVER = 1e6


@helper
def match_exactly(
    cost: npt.NDArray[np.float64], price: npt.NDArray[np.float64], partner: npt.NDArray[np.int64]
) -> float:
    """Find the cheapest pairing by dynamic programming over the subsets.

    Parameters
    ----------
    cost : (n, n) float64
        Of each pair, symmetric.
    price : (n,) float64
        Of leaving each open.
    partner : (n,) int64
        Written: whom each is paired with, -1 where it stays open.

    Returns
    -------
    float
        What all costs together.
    """
    n = len(price)
    value = np.empty(1 << n)
    choice = np.empty(1 << n, dtype=np.int64)
    lowest = np.empty(1 << n, dtype=np.int64)
    value[0] = 0.0
    for members in range(1, 1 << n):
        i = 0
        while not (members >> i) & 1:
            i += 1
        rest = members & ~(1 << i)
        best, chosen = value[rest] + price[i], -1
        for j in range(i + 1, n):
            if (rest >> j) & 1:
                total = value[rest & ~(1 << j)] + cost[i, j]
                if total < best:
                    best, chosen = total, j
        value[members], choice[members], lowest[members] = best, chosen, i
    members = (1 << n) - 1
    while members:
        i, j = lowest[members], choice[members]
        partner[i] = j
        members &= ~(1 << i)
        if j >= 0:
            partner[j] = i
            members &= ~(1 << j)
    return value[(1 << n) - 1]


@helper
def match_by_exchange(
    cost: npt.NDArray[np.float64], price: npt.NDArray[np.float64], partner: npt.NDArray[np.int64]
) -> float:
    """As `match_exactly`, for many: what saves most first, then exchanges of two pairs while they save anything."""
    n = len(price)
    partner[:] = -1
    savings = np.empty(n * (n - 1) // 2)
    rows = np.empty(len(savings), dtype=np.int64)
    columns = np.empty(len(savings), dtype=np.int64)
    count = 0
    for i in range(n):
        for j in range(i + 1, n):
            saving = price[i] + price[j] - cost[i, j]
            if saving > 0.0:
                savings[count], rows[count], columns[count] = saving, i, j
                count += 1
    order = np.argsort(-savings[:count], kind="mergesort")
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
            before = (cost[i, p] if p >= 0 else price[i]) + (cost[j, q] if q >= 0 else price[j])
            after = cost[i, j]
            joined = p >= 0 and q >= 0 and cost[p, q] < price[p] + price[q]
            if joined:
                after += cost[p, q]
            else:
                after += (price[p] if p >= 0 else 0.0) + (price[q] if q >= 0 else 0.0)
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
            total += price[i]
        elif partner[i] > i:
            total += cost[i, partner[i]]
    return total


@helper
def _match(cost: npt.NDArray[np.float64], price: npt.NDArray[np.float64], partner: npt.NDArray[np.int64]) -> float:
    if len(price) <= EXACT:
        return match_exactly(cost, price, partner)
    return match_by_exchange(cost, price, partner)


@helper
def _next_best(
    a: int,
    partner: npt.NDArray[np.int64],
    cost: npt.NDArray[np.float64],
    price: npt.NDArray[np.float64],
    same: npt.NDArray[np.int64],
) -> tuple[float, int]:
    """Return how much dearer it would be to break one pair up, and with whom `a` would be paired then, or -1."""
    b = partner[a]
    margin, other = price[a] + price[b] - cost[a, b], -1
    for c in range(len(price)):
        d = partner[c]
        # The same ways on the other copy of a shared run are no other choice.
        if c in (a, b) or cost[a, c] >= _NEVER or same[c] == same[b] or (d >= 0 and same[d] in (same[a], same[b])):
            continue
        now = cost[a, b] + (cost[c, d] if d >= 0 else price[c])
        then = cost[a, c] + (min(cost[b, d], price[b] + price[d]) if d >= 0 else price[b])
        if then - now < margin:
            margin, other = then - now, c
    return max(margin, 0.0), other


@kernel(read(int64, 1), read(int64, 1), read(float64, 1), read(float64, 1), read(int64, 1))
def pair_ends(
    rows: npt.NDArray[np.int64],
    columns: npt.NDArray[np.int64],
    costs: npt.NDArray[np.float64],
    price: npt.NDArray[np.float64],
    identity: npt.NDArray[np.int64],
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.float64], npt.NDArray[np.float64], npt.NDArray[np.int64]]:
    """Pair ends at the least total cost, each left open at its price.

    Ends that no chain of possible pairs connects have nothing to do with each other: each such piece is matched by
    itself, exactly up to `EXACT` ends.

    Parameters
    ----------
    rows, columns : (k,) int64
        The pairs that are possible, each once.
    costs : (k,) float64
    price : (n,) float64
        Of leaving each end open.
    identity : (n,) int64
        Equal for ends that stand for the same one.

    Returns
    -------
    partner : (n,) int64
        -1 where an end stays open.
    cost, margin : (n,) float64
        Of the joint at each end: what it costs, and how much dearer the next best choice would be.
    other : (n,) int64
        The end that this one would be paired with then, or -1.
    """
    n = len(price)
    group = np.arange(n)
    for k in range(len(rows)):
        a, b = rows[k], columns[k]
        while group[a] != a:
            a = group[a]
        while group[b] != b:
            b = group[b]
        group[max(a, b)] = min(a, b)
    for end in range(n):
        group[end] = group[group[end]]
    partner = np.full(n, -1, dtype=np.int64)
    cost_of = np.zeros(n)
    margin_of = np.full(n, np.inf)
    other_of = np.full(n, -1, dtype=np.int64)
    order = np.argsort(group, kind="mergesort")
    pair_order = np.argsort(group[rows], kind="mergesort")
    local = np.empty(n, dtype=np.int64)
    start, at = 0, 0
    while start < n:
        stop = start
        root = group[order[start]]
        while stop < n and group[order[stop]] == root:
            local[order[stop]] = stop - start
            stop += 1
        ends = order[start:stop]
        start = stop
        size = len(ends)
        if size == 1:
            continue
        cost = np.full((size, size), _NEVER)
        while at < len(rows) and group[rows[pair_order[at]]] == root:
            k = pair_order[at]
            a, b = local[rows[k]], local[columns[k]]
            cost[a, b] = cost[b, a] = costs[k]
            at += 1
        open_price, same = price[ends], identity[ends]
        chosen = np.full(size, -1, dtype=np.int64)
        _match(cost, open_price, chosen)
        for a in range(size):
            b = chosen[a]
            if b >= 0:
                partner[ends[a]] = ends[b]
                cost_of[ends[a]] = cost[a, b]
                margin, c = _next_best(a, chosen, cost, open_price, same)
                margin_of[ends[a]] = margin
                other_of[ends[a]] = ends[c] if c >= 0 else -1
    for i in range(n):
        j = partner[i]
        if j > i:
            margin_of[i] = margin_of[j] = min(margin_of[i], margin_of[j])
    return partner, cost_of, margin_of, other_of


@kernel(
    read(int64, 1), read(int64, 1), read(int64, 1), read(float64, 1),
    read(int64, 1), read(int64, 1), read(int64, 1), read(float64, 1),
)  # fmt: skip
def least_costs(
    sets: npt.NDArray[np.int64],
    slots: npt.NDArray[np.int64],
    nodes: npt.NDArray[np.int64],
    price: npt.NDArray[np.float64],
    first: npt.NDArray[np.int64],
    members: npt.NDArray[np.int64],
    starts: npt.NDArray[np.int64],
    costs: npt.NDArray[np.float64],
) -> npt.NDArray[np.float64]:
    """Return what the best pairing of each set of arms costs.

    Parameters
    ----------
    sets : (s + 1,) int64
        Where each set starts in `slots`.
    slots : (m,) int64
        Ends at one junction each set; an end may stand twice, but is not paired with itself.
    nodes : (n,) int64
        The junction at each end.
    price : (n,) float64
        Of leaving each end open.
    first, members, starts, costs
        As `bending.junction_costs` makes them.

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
        node = nodes[ends[0]]
        stride = first[node + 1] - first[node]
        cost, open_price = np.empty((size, size)), np.empty(size)
        for a in range(size):
            open_price[a] = price[ends[a]]
            for b in range(size):
                cost[a, b] = costs[starts[node] + local[ends[a]] * stride + local[ends[b]]]
        partner = np.empty(size, dtype=np.int64)
        if size <= EXACT_AMONG_MANY:
            totals[s] = match_exactly(cost, open_price, partner)
        else:
            totals[s] = match_by_exchange(cost, open_price, partner)
    return totals
