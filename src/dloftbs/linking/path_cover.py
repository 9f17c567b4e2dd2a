"""Path cover: pieces of cables are joined to as many cables as there are, or left out, at a low total cost.

Piece ``p`` has the ports ``2 p`` and ``2 p + 1``, as a branch has ends.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from dloftbs._arrays import FloatArray
from dloftbs.graph import branch_of

_Ints = npt.NDArray[np.int64]


def cover(pairs: _Ints, costs: FloatArray, drop_costs: FloatArray, most: int) -> list[int]:
    """Choose joins between pieces, so that no more than `most` cables remain beside the pieces that are left out.

    The cheapest pairs are joined first; then those joins are undone that cost more than to leave out what comes off.

    Parameters
    ----------
    pairs : numpy.ndarray, shape (k, 2)
        Ports of different pieces that may be joined.
    costs : numpy.ndarray, shape (k,)
        Cost of joining each pair, not negative.
    drop_costs : numpy.ndarray, shape (n,)
        Cost of leaving out each piece, not negative.
    most : int
        Number of cables.

    Returns
    -------
    list of int
        Pairs that are joined.
    """
    joins: list[int] = []
    cable, taken = np.arange(len(drop_costs)), np.zeros(2 * len(drop_costs), np.bool_)
    for k in np.argsort(costs, kind="stable").tolist():
        if len(drop_costs) - len(joins) <= most:
            break
        one, other = cable[branch_of(pairs[k])]
        if one != other and not taken[pairs[k]].any():
            cable[cable == other], taken[pairs[k]] = one, True
            joins.append(k)
    total = _total_cost(pairs, joins, costs, drop_costs, most)
    for k in joins[::-1]:  # the one that costs the most first
        fewer = [other for other in joins if other != k]
        without = _total_cost(pairs, fewer, costs, drop_costs, most)
        if without < total:
            total, joins = without, fewer
    return joins


def _total_cost(pairs: _Ints, joins: list[int], costs: FloatArray, drop_costs: FloatArray, most: int) -> float:
    """Return the cost of joins, and of leaving out the cheapest cables beyond `most`."""
    size, joined = len(drop_costs), branch_of(pairs[joins])
    count, cable = connected_components(coo_array((np.ones(len(joins)), joined.T), (size, size)), directed=False)
    left_out = np.sort(np.bincount(cable, drop_costs))[: max(count - most, 0)]
    return float(costs[joins].sum() + left_out.sum())
