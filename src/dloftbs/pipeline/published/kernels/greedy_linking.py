"""The published linking: pairs of segment ends, joined greedily by the cost J."""

from __future__ import annotations

import numpy as np
from numba import float64

from dloftbs.kernels.compiler import Floats, Ints, helper, kernel, read


@helper
def link_cost(ends: Floats, directions: Floats, weight: float, i: int, j: int, bound: float) -> float:
    """Return ``J = m J_d + (1 - m) J_o`` for two ends (paper: filter and order), or infinity where it reaches `bound`.

    ``J_d`` is their distance in px; ``J_o = |pi - phi_1 - phi_2|`` comes out as the angle between the first direction
    and the opposite of the second, both pointing outwards: 0 where the ends point at each other along parallel lines,
    pi where they point the same way.

    Parameters
    ----------
    ends : (n, 2) float64
        px.
    directions : (n, 2) float64
        Outwards, of any length.
    weight : float
        The paper's ``m``.
    """
    dx = ends[i, 0] - ends[j, 0]
    dy = ends[i, 1] - ends[j, 1]
    cost = weight * np.sqrt(dx * dx + dy * dy)
    if cost >= bound:
        return np.inf
    ax, ay = directions[i, 0], directions[i, 1]
    bx, by = directions[j, 0], directions[j, 1]
    cost += (1.0 - weight) * np.arctan2(abs(ax * by - ay * bx), -(ax * bx + ay * by))
    return cost if cost < bound else np.inf


@helper
def _best_partner(
    ends: Floats, directions: Floats, weight: float, max_cost: float, mate: Ints, i: int, other_than: int
) -> tuple[int, float]:
    """Return the open end that is cheapest to join to end `i`, the first of equals, and the cost; or -1, infinity."""
    best, best_cost = -1, np.inf
    for j in range(len(ends)):
        if mate[j] < 0 or j in (i, mate[i], other_than):
            continue
        cost = link_cost(ends, directions, weight, i, j, min(best_cost, max_cost))
        if cost < best_cost:
            best, best_cost = j, cost
    return best, best_cost


@kernel(read(float64, 2), read(float64, 2), float64, float64)
def link_greedily(ends: Floats, directions: Floats, weight: float, max_cost: float) -> tuple[Ints, Floats, Floats]:
    """Join the cheapest pair of open ends, again and again, while below `max_cost` (paper: filter and order).

    Ends ``2 i`` and ``2 i + 1`` belong to segment ``i``. The two ends of one chain are never joined: that would close
    a cycle, and leaves at most s - 1 joints. Of equal costs the lower pair of indices wins. Each end keeps its best
    partner, so the memory is linear and the time typically quadratic in the number of ends.

    Parameters
    ----------
    ends, directions : (2 s, 2) float64
        As `link_cost` takes them.
    weight, max_cost : float
        The paper's ``m`` and ``J_th``.

    Returns
    -------
    pairs : (joints, 2) int64
        Ends, in the order in which they were joined.
    costs : (joints,) float64
    margins : (joints,) float64
        Higher cost, at that moment, of the next best partner of either end, or of leaving them open at `max_cost`.
    """
    n = len(ends)
    pairs = np.empty((max(n // 2 - 1, 0), 2), dtype=np.int64)
    costs = np.empty(len(pairs), dtype=np.float64)
    margins = np.empty(len(pairs), dtype=np.float64)
    mate = np.empty(n, dtype=np.int64)  # the other end of the chain, -1 once joined
    for i in range(n):
        mate[i] = i ^ 1
    best = np.empty(n, dtype=np.int64)
    best_cost = np.empty(n, dtype=np.float64)
    for i in range(n):
        best[i], best_cost[i] = _best_partner(ends, directions, weight, max_cost, mate, i, -1)
    count = 0
    while count < len(pairs):
        i = int(np.argmin(best_cost))
        j = best[i]
        if j < 0:
            break
        cost = best_cost[i]
        next_best = max_cost
        for p, q in ((i, j), (j, i)):
            _, other = _best_partner(ends, directions, weight, max_cost, mate, p, q)
            next_best = min(next_best, other)
        pairs[count, 0], pairs[count, 1] = i, j
        costs[count], margins[count] = cost, next_best - cost
        count += 1
        a, b = mate[i], mate[j]
        mate[i] = mate[j] = -1
        best[i] = best[j] = -1
        best_cost[i] = best_cost[j] = np.inf
        mate[a], mate[b] = b, a
        for k in range(n):
            stale = best[k] in (i, j) or (k == a and best[k] == b) or (k == b and best[k] == a)
            if mate[k] >= 0 and stale:
                best[k], best_cost[k] = _best_partner(ends, directions, weight, max_cost, mate, k, -1)
    return pairs[:count], costs[:count], margins[:count]
