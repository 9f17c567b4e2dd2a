"""Stage 5, on whole cables: loops that come from a misread crossing."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from dloftbs.graph import EndMatching, Graph, branch_of
from dloftbs.linking.kernels.joint_features import turn_costs

_MOST_RINGS = 20
"""Largest number of rounds in which rings are opened.

Source: bounds time; each round opens a ring.
"""

_MOST_EXTRA_COST = 2.0
"""Largest extra cost of opening a ring into a cable that crosses it, nats.

Source: by hand; in favour of it is that closed cables are rare.
"""


def open_loops(graph: Graph, matching: EndMatching) -> None:
    """Open the loops among the cables, where another reading of a crossing or a gap makes them part of one with ends.

    A cable that crosses itself has a loop in it; where the crossing is misread, the loop comes apart. Its ends are
    exchanged with those of another cable where that costs the least, at a gap of that cable if the crossing is hidden.
    Otherwise a loop that only a gap closes is opened there. Other loops stay closed.
    """
    for _ in range(_MOST_RINGS):
        loops = [chain for chain, is_loop in matching.chains() if is_loop]
        if not any(_open(graph, matching, loop) for loop in loops):
            return


def _open(graph: Graph, matching: EndMatching, loop: list[int]) -> bool:
    """Open one loop; return whether it was."""
    exchange, extra_cost = _best_exchange(graph, matching, loop)
    gaps = [(matching.cost[end], end) for end in loop if not matching.is_crossing(end)]
    open_cost = matching.branches.open_cost
    if gaps:
        cost, end = max(gaps)
        gain = open_cost[end] + open_cost[matching.partner[end]] - cost
        if exchange is None or extra_cost > gain:
            matching.open(end)
            return True
    elif exchange is None or extra_cost > _MOST_EXTRA_COST:
        return False
    assert exchange is not None
    matching.exchange(*exchange, margin=max(_MOST_EXTRA_COST - extra_cost, 0.0))  # loops are rare: that speaks for it
    return True


def _best_exchange(graph: Graph, matching: EndMatching, loop: list[int]) -> tuple[tuple[int, int] | None, float]:
    """Return the two ends, one of the loop and one of another cable, of the cheapest exchange, and its extra cost."""
    members = {branch_of(end) for end in loop}
    options = [option for end in loop for option in _exchanges(matching, end, members)]
    if not options:
        return None, 0.0
    (mine, other), partner = np.array(options).T, np.array(matching.partner)
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
    return options[best], float((new - old)[best])


def _exchanges(matching: EndMatching, end: int, members: set[int]) -> Iterator[tuple[int, int]]:
    """List the ends of other cables that an end of a loop, or its partner, may exchange partners with."""
    partner, nodes, spurs = matching.partner, matching.branches.nodes, matching.branches.spurs
    others = [e for e in range(len(nodes)) if branch_of(e) not in members and not spurs[branch_of(e)]]
    for other in others:
        if not matching.is_crossing(end):
            if partner[other] >= 0:
                yield end, other
        elif nodes[other] == nodes[end]:
            if matching.is_crossing(other):
                yield end, other
            elif partner[other] < 0:
                # An open end beside the loop is more likely one of the loop's than another cable's.
                yield end, other
                yield partner[end], other
