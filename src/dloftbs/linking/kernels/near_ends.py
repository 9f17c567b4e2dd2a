"""Ends that are so near to each other that a gap may lie between them."""

from __future__ import annotations

import numpy as np

from dloftbs.kernels.compiler import Floats, Ints, helper
from dloftbs.kernels.shared.graph_ends import X, Y
from dloftbs.kernels.shared.selection import falling_order

MAX_GAPS = 50_000
"""Largest number of pairs of ends between which a gap is sought; of more, the nearest ones.

Source: bounds time; it is all pairs of 300 ends.
"""

_STEPS = 64
"""Number of lengths from which that of the longest gap is chosen, where fewer pairs are wanted.

Source: bounds time.
"""


@helper
def _longest_gap(x: Floats, y: Floats, max_gap: float) -> float:
    """Return the length up to which gaps are sought, px: `max_gap`, or less where more than `MAX_GAPS` pairs are near.

    Parameters
    ----------
    x : (m,) float64
        Falling, px.
    y : (m,) float64
    max_gap : float
        px.
    """
    m = len(x)
    if m * (m - 1) // 2 <= MAX_GAPS or max_gap <= 0.0:
        return max_gap
    longest = min(max_gap, max(x[0] - x[m - 1], y.max() - y.min()))
    counts = np.zeros(_STEPS + 1, dtype=np.int64)
    for a in range(m):
        for b in range(a + 1, m):
            if x[a] - x[b] > longest:
                break
            apart = max(x[a] - x[b], abs(y[a] - y[b]))
            if apart <= longest:
                counts[int(_STEPS * apart / longest)] += 1
    total = 0
    for step in range(_STEPS + 1):
        total += counts[step]
        if total > MAX_GAPS:
            return longest * step / _STEPS
    return max_gap


@helper
def near_ends(states: Floats, ends: Ints, max_gap: float) -> tuple[Ints, Ints]:
    """List for each of some ends those after it that a gap may lie between: the start of each list, and the lists.

    Parameters
    ----------
    states : (n, 6) float64
    ends : (m,) int64
        Ascending.
    max_gap : float
        Longest gap along rows and columns, px; less where more than `MAX_GAPS` pairs are so near.

    Returns
    -------
    first : (m + 1,) int64
    near : (k,) int64
        Ends, ascending in each list.
    """
    m = len(ends)
    x, y, place = np.empty(m), np.empty(m), np.empty(m, dtype=np.int64)
    for k in range(m):
        x[k] = states[ends[k], X]
    across = falling_order(x)
    for at in range(m):
        place[across[at]] = at
        x[at], y[at] = states[ends[across[at]], X], states[ends[across[at]], Y]
    longest = _longest_gap(x, y, max_gap)
    first, filled = np.zeros(m + 1, dtype=np.int64), np.zeros(m, dtype=np.int64)
    near = np.empty(0, dtype=np.int64)
    for is_counted in (False, True):
        for late in range(m):
            own = place[late]
            for step in (-1, 1):
                at = own + step
                while 0 <= at < m and abs(x[at] - x[own]) <= longest:
                    early = across[at]
                    if early < late and abs(y[at] - y[own]) <= longest:
                        if is_counted:
                            near[filled[early]] = ends[late]
                        filled[early] += 1
                    at += step
        if not is_counted:
            for k in range(m):
                first[k + 1] = first[k] + filled[k]
                filled[k] = first[k]
            near = np.empty(first[m], dtype=np.int64)
    return first, near
