"""On whole cables: loops that come from a misread crossing."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from dloftbs.data.graph import FREE, POSITION, UNAVAILABLE, Graph, branch_of, other_end
from dloftbs.linking.matched_ends import EndMatching, turn_costs
from dloftbs.support.arrays import IntArray

_MAX_RINGS = 20
"""Largest number of rounds in which rings are opened.

Source: bounds time; each round opens a ring.
"""

_MAX_EXTRA_COST = 2.0
"""Largest extra cost of opening a ring into a cable that crosses it, nats.

Source: by hand; in favour of it is that closed cables are rare.
"""

_MAX_EXCHANGES = 2048
"""Largest number of exchanges that are tried at the gaps of one ring; of more, those with the nearest ends.

Source: bounds time; it is all of a ring with 20 gaps among 25 other branches.
"""

_MAX_UNDER_WIDTHS = 5.0
"""Longest gap that the cable over it explains, widths.

Source: geometry; the cable over it, half a width at both tips of the skeleton, and a width and a half clear on both
sides, as drawings and edges leave it.
"""

_NEAR_TIP = 0.1
"""Share of a gap at both tips in which a cable does not count as over it.

Source: geometry; the branches that the gap joins start there.
"""


def open_loops(graph: Graph, matching: EndMatching) -> None:
    """Open the loops among the cables, where another reading of a crossing or a gap makes them part of one with ends.

    A cable that crosses itself has a loop in it; where the crossing is misread, the loop comes apart. Its ends are
    exchanged with those of a cable with ends where that costs the least, at a gap of that cable if the crossing is
    hidden. Otherwise a loop that only a gap closes is opened there, unless it goes under a cable. Other loops stay
    closed: two that cross are no single one.
    """
    closed: dict[int, set[int]] = {}  # the first end of each loop that stays closed, and its junctions
    for _ in range(_MAX_RINGS):
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


def close_rings(graph: Graph, matching: EndMatching) -> None:
    """Join both ends of a cable that meet under another cable: it is a ring, which its gap cut into one branch.

    The joint must cost less than both ends open by more than closed cables are rare.
    """
    nodes, open_cost = matching.branches.nodes, matching.branches.open_cost
    both = [(chain[0], other_end(chain[-1])) for chain, is_loop in matching.chains() if not is_loop]
    both = [(i, j) for i, j in both if UNAVAILABLE not in (nodes[i], nodes[j]) and not nodes[i] == nodes[j] != FREE]
    if not both:
        return
    costs = turn_costs(matching.branches, np.array(both), graph.width).tolist()
    for (i, j), cost in zip(both, costs, strict=True):
        gain = open_cost[i] + open_cost[j] - cost
        if gain > _MAX_EXTRA_COST and _is_under(graph, matching, i, j):
            matching.join(i, j, cost, gain - _MAX_EXTRA_COST)


def _open(graph: Graph, matching: EndMatching, loop: list[int]) -> set[int]:
    """Open one loop; return the junctions, or `FREE`, of what it becomes a part of, none where it stays closed."""
    exchange, extra_cost = _best_exchange(graph, matching, loop)
    nodes, partner = matching.branches.nodes, matching.partner
    around = {nodes[end] for end in loop}
    gaps = [(_gain(matching, end), end) for end in loop if not matching.is_crossing(end)]
    gaps = [
        (gain, end) for gain, end in gaps if gain < _MAX_EXTRA_COST or not _is_under(graph, matching, end, partner[end])
    ]
    if gaps:
        gain, end = min(gaps)
        if exchange is None or extra_cost > gain:
            matching.open(end)
            return around
    elif exchange is None or extra_cost > _MAX_EXTRA_COST:
        return set()
    assert exchange is not None
    around |= {nodes[end] for one in exchange for end in (one, partner[one]) if end >= 0}
    matching.exchange(*exchange, margin=max(_MAX_EXTRA_COST - extra_cost, 0.0))  # loops are rare: that speaks for it
    return around


def _gain(matching: EndMatching, end: int) -> float:
    """Return how much less the joint at an end costs than both its ends open."""
    open_cost, partner = matching.branches.open_cost, matching.partner[end]
    return open_cost[end] + open_cost[partner] - matching.cost[end]


def _is_under(graph: Graph, matching: EndMatching, i: int, j: int) -> bool:
    """Return whether the gap between two ends leads under a cable, which hides as much as the gap is long."""
    branches = matching.branches
    start, stop = branches.end_states[[i, j], POSITION]
    chord = stop - start
    length = float(np.hypot(*chord))
    if not 0.0 < length <= _MAX_UNDER_WIDTHS * graph.width:
        return False
    steps = np.stack((branches.points[:-1], branches.points[1:]), axis=1)
    # No cable leads from one branch or loop to the next, nor from there to the duplicates, whose points come last.
    duplicates = [first for first, _ in branches.spans[graph.branch_count :]]
    starts = np.array([*graph.offsets[1:-1].tolist(), *duplicates], np.int64)
    steps = np.delete(steps, starts - 1, axis=0)
    # Where the gap starts at the edge of the cable over it, that cable has a junction: no branch has points there.
    through = [(a, b) for a, b in enumerate(matching.partner) if a < b and matching.is_crossing(a)]
    if through:
        steps = np.concatenate((steps, branches.end_states[np.array(through)][:, :, POSITION]))
    way = steps - start
    along = way @ chord / length**2
    is_left = chord[0] * way[..., 1] > chord[1] * way[..., 0]
    within = (along > _NEAR_TIP) & (along < 1.0 - _NEAR_TIP)
    return bool(((is_left[:, 0] != is_left[:, 1]) & within.all(axis=1)).any())


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
    costs = turn_costs(matching.branches, pairs.reshape(-1, 2), graph.width).reshape(-1, 4)
    old = costs[:, 0] + np.where(to_open, 0.0, costs[:, 1])
    new = costs[:, 3] + np.where(to_open, 0.0, costs[:, 2])
    best = int(np.argmin(new - old))
    return (int(mine[best]), int(other[best])), float((new - old)[best])


def _exchanges(matching: EndMatching, loop: list[int]) -> Iterator[IntArray]:
    """List for each end of a loop the exchanges (k, 2) of its partner with that of an end of another cable."""
    branches, partner = matching.branches, matching.partner
    closed = {branch_of(end) for chain, is_loop in matching.chains() if is_loop for end in chain}
    at_gaps = [end for end in loop if not matching.is_crossing(end)]
    joined: IntArray = np.empty(0, dtype=np.int64)
    if at_gaps:
        other = np.ones(len(branches.spurs), dtype=np.bool_)
        other[list(closed)] = False
        other &= ~np.array(branches.spurs)
        joined = np.flatnonzero(other.repeat(2) & (np.array(partner) >= 0))
    positions = branches.end_states[:, POSITION]
    x, y = positions[joined].T.copy()
    for end in loop:
        if matching.is_crossing(end):
            mates = [e for e in matching.at_junction(branches.nodes[end]) if branch_of(e) not in closed]
            yield np.array([option for e in mates for option in _at_crossing(matching, end, e)], dtype=np.int64)
        else:
            (here_x, here_y), near = positions[end], joined
            most = _MAX_EXCHANGES // len(at_gaps)
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
