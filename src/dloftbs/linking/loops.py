"""Stage 5, on whole cables: rings that come from a misread crossing, and a number of cables that is known."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from dloftbs.graph import Graph, Pairing
from dloftbs.linking.kernels.bending import turn_costs

_MOST_RINGS = 20
_WORTH = 0.5  # a ring is opened into a chain that crosses it where this costs less
_LONGER_WIDTHS = 3.0  # what is shorter is rather a speck than a part of a cable
_RATHER_THAN_GAP = 0.3  # how much dearer that may be than opening the ring at a gap


def open_rings(graph: Graph, pairing: Pairing) -> None:
    """Open the rings among the cables, where another reading of a crossing or a gap makes them part of one with ends.

    A cable that crosses itself has a ring in it; where the crossing is misread, the ring comes apart. It is exchanged
    back where that costs the least; where the crossing is hidden, with a gap of another cable. Otherwise a ring that
    only a gap closes is opened there. What remains is a closed loop.
    """
    for _ in range(_MOST_RINGS):
        rings = [chain for chain, is_ring in pairing.chains() if is_ring]
        if not any(_open(graph, pairing, ring) for ring in rings):
            return


def _open(graph: Graph, pairing: Pairing, ring: list[int]) -> bool:
    """Open one ring; return whether it was."""
    exchange, price = _best_exchange(graph, pairing, ring)
    gaps = [(pairing.cost[end], end) for end in ring if not pairing.is_crossing(end)]
    if gaps:
        cost, end = max(gaps)
        saved = pairing.price[end] + pairing.price[pairing.partner[end]] - cost
        if exchange is None or price > saved + _RATHER_THAN_GAP:
            pairing.open(end)
            return True
    elif exchange is None or price > _WORTH:
        return False
    assert exchange is not None
    pairing.exchange(*exchange)
    for end in exchange:
        other = pairing.partner[end]
        if other >= 0:  # what speaks for it is that a ring is rare
            pairing.margin[end] = pairing.margin[other] = max(_WORTH - price, 0.0)
    return True


def _best_exchange(graph: Graph, pairing: Pairing, ring: list[int]) -> tuple[tuple[int, int] | None, float]:
    """Return the two ends, one of the ring and one of another cable, whose exchange costs the least, and what."""
    members = {end // 2 for end in ring}
    options = [option for end in ring for option in _exchanges(pairing, end, members)]
    if not options:
        return None, 0.0
    ends = np.array([around for _, _, around in options])
    # Joined now: the first two, and the last two; then: crosswise. To an open end, its new partner stands for its own.
    pairs = ends[:, ((0, 1), (2, 3), (0, 3), (2, 1))]
    costs = turn_costs(pairing.arms, pairs.reshape(-1, 2), graph.width).reshape(-1, 4)
    to_open = ends[:, 1] == ends[:, 3]
    old = costs[:, 0] + np.where(to_open, 0.0, costs[:, 1])
    new = costs[:, 3] + np.where(to_open, 0.0, costs[:, 2])
    best = int(np.argmin(new - old))
    return options[best][:2], float((new - old)[best])


def _exchanges(pairing: Pairing, end: int, members: set[int]) -> Iterator[tuple[int, int, tuple[int, int, int, int]]]:
    """List with which ends of other cables an end of a ring might be exchanged, and the ends around both joints."""
    partner, nodes = pairing.partner, pairing.nodes
    others = [e for e in range(len(nodes)) if e // 2 not in members and not pairing.spurs[e // 2]]
    for other in others:
        if not pairing.is_crossing(end):
            if partner[other] >= 0:
                yield end, other, (end, partner[end], other, partner[other])
        elif nodes[other] == nodes[end]:
            if partner[other] < 0:
                # An end that lies at the ring is rather one of the ring's than another cable's.
                for mine in (end, partner[end]):
                    yield mine, other, (mine, partner[mine], other, partner[mine])
            elif pairing.is_crossing(other):
                yield end, other, (end, partner[end], other, partner[other])
    twin = pairing.twin.get(end // 2)
    if twin is not None and twin not in members:
        mine, its = end ^ 1, 2 * twin + 1 - end % 2
        before, after, its_before, its_after = (_beyond(pairing, e) for e in (end, mine, its ^ 1, its))
        if min(before, after, its_before, its_after) >= 0:
            yield mine, its, (before, after, its_before, its_after)


def _beyond(pairing: Pairing, end: int) -> int:
    """Return the first end beyond a joint that is not of a shared run, or -1."""
    for _ in range(len(pairing.original)):
        end = pairing.partner[end]
        if end < 0 or end // 2 not in pairing.twin:
            return end
        end ^= 1
    return -1


def join_unclear(graph: Graph, pairing: Pairing, objects: int) -> None:
    """Join ends that were nearly joined, the clearest first, where the longest cables become longer by it.

    Parameters
    ----------
    graph : Graph
    pairing : Pairing
        Changed.
    objects : int
        Number of cables that count. Where no more were found, they stay as they are.
    """
    for _, cost, i, j in pairing.nearly:
        chains = [chain for chain, _ in pairing.chains()]
        if len(chains) + len(graph.loops) <= objects:
            return
        at = {end: k for k, (chain, is_ring) in enumerate(pairing.chains()) if not is_ring for end in _ends_of(chain)}
        if at.get(i) is None or at.get(j) is None or at[i] == at[j]:
            continue
        lengths = [sum(np.subtract(*pairing.spans[end // 2][::-1]) for end in chain) for chain in chains]
        joined = [length for k, length in enumerate(lengths) if k not in (at[i], at[j])]
        joined.append(lengths[at[i]] + lengths[at[j]])
        if _most(joined, objects) < _most(lengths, objects) + _LONGER_WIDTHS * graph.width:
            continue
        pairing.join(i, j)
        for end in (i, j):
            pairing.cost[end], pairing.margin[end], pairing.other[end] = cost, 0.0, -1


def _ends_of(chain: list[int]) -> tuple[int, int]:
    return chain[0], chain[-1] ^ 1


def _most(lengths: list[int], count: int) -> int:
    return sum(sorted(lengths, reverse=True)[:count])
