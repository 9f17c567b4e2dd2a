"""Stage 5, after the lanes: gaps that end inside a run, where a cable comes to lie along another one unseen."""

from __future__ import annotations

import numpy as np

from dloftbs.graph import FREE, UNAVAILABLE, Graph, Pairing
from dloftbs.linking.kernels.bending import OPEN_INSIDE, turn_costs

_DIRECTION_WIDTHS = 1.0  # of the run, to both sides, that tell where a cable inside of it points


def join_inside(graph: Graph, pairing: Pairing, max_gap_widths: float) -> None:
    """Join the ends of cables inside of shared runs with free ends of others, where that bends little.

    A cable that seems to end in the lane beside another one may have come into it out of sight.

    Parameters
    ----------
    graph : Graph
    pairing : Pairing
        Changed.
    max_gap_widths : float
        Longest gap that is bridged, in widths.
    """
    inner = [end for run in pairing.twin for end in (2 * run, 2 * run + 1) if _is_open(pairing, end, UNAVAILABLE)]
    free = [end for end in range(2 * graph.runs) if _is_open(pairing, end, FREE) and not graph.bordering[end]]
    if not inner or not free:
        return
    for end in inner:
        _place(graph, pairing, end)
    pairs = np.array([(i, j) for i in inner for j in free])
    away = np.hypot(*(pairing.arms[pairs[:, 0], :2] - pairing.arms[pairs[:, 1], :2]).T)
    costs = turn_costs(pairing.arms, pairs, graph.width)
    price = OPEN_INSIDE + np.array(pairing.price)[pairs[:, 1]]
    worth = np.where(away <= max_gap_widths * graph.width, price - costs, 0.0)
    for gain, cost, (i, j) in sorted(zip(worth.tolist(), costs.tolist(), pairs.tolist(), strict=True), key=_best_first):
        if gain <= 0.0:
            return
        if pairing.partner[i] < 0 and pairing.partner[j] < 0 and pairing.chain(i)[-1] ^ 1 != j:
            pairing.join(i, j)
            for end in (i, j):
                pairing.cost[end], pairing.margin[end], pairing.other[end] = cost, gain, -1


def _best_first(option: tuple[float, float, list[int]]) -> tuple[float, list[int]]:
    return -option[0], option[2]


def _is_open(pairing: Pairing, end: int, node: int) -> bool:
    return pairing.nodes[end] == node and pairing.partner[end] < 0 and not pairing.spurs[end // 2]


def _place(graph: Graph, pairing: Pairing, end: int) -> None:
    """Put the arm of an end inside of a run where it is, along the run."""
    start, stop = pairing.spans[end // 2]
    own = pairing.points[start if end % 2 == 0 else stop - 1]
    first, last = graph.spans[pairing.original[end // 2]].tolist()
    whole = graph.points[first:last]
    nearest = int(np.argmin(((whole - own) ** 2).sum(axis=1)))
    few = max(int(_DIRECTION_WIDTHS * graph.width), 2)
    along = whole[min(nearest + few, len(whole) - 1)] - whole[max(nearest - few, 0)]
    along *= (1.0 if end % 2 else -1.0) / max(float(np.hypot(*along)), 1e-9)
    pairing.arms[end] = (*own, *along, 0.0, 0.0)
