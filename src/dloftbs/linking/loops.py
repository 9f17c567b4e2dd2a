"""Stage 5, on whole cables: loops that come from a misread crossing."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from dloftbs.graph import POSITION, EndMatching, Graph, branch_of
from dloftbs.linking.kernels.joint_features import turn_costs

_MOST_RINGS = 20
"""Largest number of rounds in which rings are opened.

Source: bounds time; each round opens a ring.
"""

_MOST_EXTRA_COST = 2.0
"""Largest extra cost of opening a ring into a cable that crosses it, nats.

Source: by hand; in favour of it is that closed cables are rare.
"""

_MOST_EXCHANGES = 2048
"""Largest number of exchanges that are tried at the gaps of one ring; of more, those with the nearest ends.

Source: bounds time; it is all of a ring with 20 gaps among 25 other branches.
"""

_Ints = npt.NDArray[np.int64]


def open_loops(graph: Graph, matching: EndMatching) -> None:
    """Open the loops among the cables, where another reading of a crossing or a gap makes them part of one with ends.

    A cable that crosses itself has a loop in it; where the crossing is misread, the loop comes apart. Its ends are
    exchanged with those of another cable where that costs the least, at a gap of that cable if the crossing is hidden.
    Otherwise a loop that only a gap closes is opened there. Other loops stay closed.
    """
    closed: dict[int, set[int]] = {}  # the first end of each loop that stays closed, and its junctions
    for _ in range(_MOST_RINGS):
        changed: set[int] = set()
        for loop, is_loop in matching.chains():
            if is_loop and loop[0] not in closed:
                changed = _open(graph, matching, loop)
                if changed:
                    break
                closed[loop[0]] = {matching.branches.nodes[end] for end in loop}
        if not changed:
            return
        closed = {first: junctions for first, junctions in closed.items() if junctions.isdisjoint(changed)}


def _open(graph: Graph, matching: EndMatching, loop: list[int]) -> set[int]:
    """Open one loop; return the junctions, or `FREE`, of the ends that change partners, none where it stays closed."""
    exchange, extra_cost = _best_exchange(graph, matching, loop)
    gaps = [(matching.cost[end], end) for end in loop if not matching.is_crossing(end)]
    nodes, partner, open_cost = matching.branches.nodes, matching.partner, matching.branches.open_cost
    if gaps:
        cost, end = max(gaps)
        gain = open_cost[end] + open_cost[partner[end]] - cost
        if exchange is None or extra_cost > gain:
            changed = {nodes[end], nodes[partner[end]]}
            matching.open(end)
            return changed
    elif exchange is None or extra_cost > _MOST_EXTRA_COST:
        return set()
    assert exchange is not None
    changed = {nodes[end] for one in exchange for end in (one, partner[one]) if end >= 0}
    matching.exchange(*exchange, margin=max(_MOST_EXTRA_COST - extra_cost, 0.0))  # loops are rare: that speaks for it
    return changed


def _best_exchange(graph: Graph, matching: EndMatching, loop: list[int]) -> tuple[tuple[int, int] | None, float]:
    """Return the two ends, one of the loop and one of another cable, of the cheapest exchange, and its extra cost."""
    options = [option for option in _exchanges(matching, loop) if len(option)]
    if not options:
        return None, 0.0
    (mine, other), partner = np.concatenate(options).T, np.array(matching.partner)
    to_open = partner[other] < 0  # its new partner stands for its own
    around = np.stack((mine, partner[mine], other, np.where(to_open, partner[mine], partner[other])), axis=1)
    # Joined now: the first two, and the last two; then: crosswise.
    pairs = around[:, ((0, 1), (2, 3), (0, 3), (2, 1))]
    nodes = np.array(matching.branches.nodes)[pairs]
    gaps = (nodes[..., 0] < 0) | (nodes[..., 0] != nodes[..., 1])
    states = matching.branches.end_states
    costs = turn_costs(states, pairs.reshape(-1, 2), gaps.ravel(), graph.width).reshape(-1, 4)
    old = costs[:, 0] + np.where(to_open, 0.0, costs[:, 1])
    new = costs[:, 3] + np.where(to_open, 0.0, costs[:, 2])
    best = int(np.argmin(new - old))
    return (int(mine[best]), int(other[best])), float((new - old)[best])


def _exchanges(matching: EndMatching, loop: list[int]) -> Iterator[_Ints]:
    """List for each end of a loop the exchanges (k, 2) of its partner with that of an end of another cable."""
    branches, partner = matching.branches, matching.partner
    own = {branch_of(end) for end in loop}
    at_gaps = [end for end in loop if not matching.is_crossing(end)]
    joined: _Ints = np.empty(0, dtype=np.int64)
    if at_gaps:
        other = np.ones(len(branches.spurs), dtype=np.bool_)
        other[list(own)] = False
        other &= ~np.array(branches.spurs)
        joined = np.flatnonzero(other.repeat(2) & (np.array(partner) >= 0))
    positions = branches.end_states[:, POSITION]
    x, y = positions[joined].T.copy()
    for end in loop:
        if matching.is_crossing(end):
            mates = [e for e in matching.at_junction(branches.nodes[end]) if branch_of(e) not in own]
            yield np.array([option for e in mates for option in _at_crossing(matching, end, e)], dtype=np.int64)
        else:
            (here_x, here_y), near = positions[end], joined
            most = _MOST_EXCHANGES // len(at_gaps)
            if len(joined) > most:
                apart = np.maximum(np.abs(x - here_x), np.abs(y - here_y))
                near = joined[apart <= np.partition(apart, most)[most]]
            yield np.stack((np.full(len(near), end), near), axis=1)


def _at_crossing(matching: EndMatching, end: int, other: int) -> list[tuple[int, int]]:
    """List the exchanges of an end of a loop, or of its partner, with an end of another cable at the same junction."""
    if matching.branches.spurs[branch_of(other)]:
        return []
    if matching.is_crossing(other):
        return [(end, other)]
    # An open end beside the loop is more likely one of the loop's than another cable's.
    return [(end, other), (matching.partner[end], other)] if matching.is_open(other) else []
