"""Costs of joining two ends: the bending that a cable needs through a junction or across a gap.

Columns of end states: see `graph_ends`. Costs have no unit; a turn of 90 degrees in a junction costs about 1.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import boolean, float64, int64, uint8

from dloftbs.kernels.compiler import helper, kernel, read
from dloftbs.kernels.shared.graph_ends import (
    CURVATURE,
    FORBIDDEN,
    HAS_CURVATURE,
    TANGENT_X,
    TANGENT_Y,
    UNAVAILABLE,
    X,
    Y,
    branch_of,
)

_LINK_BEND = 1.5
"""Cost of a link through a junction, per rad^2 of bend, times width over length.

Source: by hand; the factor follows the energy of a cubic, which goes with one over its length.
"""

_LINK_TURN = 1.0
"""Cost of a link through a junction, per rad^2 of bend, whatever its length.

Source: by hand; it sets the unit of all costs.
"""

_OUTSIDE = 3.0
"""Cost of a link that lies outside of the mask altogether; less in proportion to the share.

Source: by hand; more than two ends left open in a junction.
"""

_GAP_BEND = 2.0
"""Cost of a gap, per rad^2 of bend, times width over length.

Source: by hand; as `_LINK_BEND`.
"""

_GAP_TURN = 0.4
"""Cost of a gap, per rad^2 of bend, whatever its length.

Source: by hand; below `_LINK_TURN`, since a hidden cable may turn out of sight.
"""

_TIP_WIDTHS = 0.5
"""How far beside each other two ends of one cable may lie where something covers what is between them, widths.

Source: geometry; what covers a cable at a slant leaves a tip at its edge, half a width from the axis.
"""

_MOST_SWERVE = 1.0
"""Most that a swerve towards the camera or away from it costs.

Source: measured; of generated cables that lie over each other none of 892 right joints costs 0.5 by depth, and .37 of
the wrong exchanges do: odds above e to the power of 4, each worth 0.25.
"""

_GAP_JUNCTION = 0.4
"""Extra cost of a gap from a branch end in a junction.

Source: by hand; a cable rarely stops where the mask goes on.
"""

_GAP_JUNCTION_BEND = 1.0
"""Extra cost of a gap from a branch end in a junction, per rad^2 of bend.

Source: by hand; as `_GAP_JUNCTION`.
"""

_EXTRAPOLATED_SHARE = 0.7
"""Share of the branch ends' own curvature that is extrapolated.

Source: by hand; a fitted curvature is noisy, and cables unbend.
"""

_EXTRAPOLATED_WIDTHS = 3.0
"""Length over which that curvature is extrapolated, widths.

Source: by hand.
"""

_UNKNOWN_BEND = 0.25
"""Bend assumed for a branch end without a direction, rad^2.

Source: by hand; that of a turn of 1 rad.
"""

_CHEAP_LINK = 0.15
"""Cost of a link below which no gap is sought from its ends.

Source: by hand; it saves time, and lies below half the least cost of two open ends.
"""

OPEN_JUNCTION = 1.4
"""Cost of an end left open in a junction.

Source: by hand; with the unit of `_LINK_TURN`, a pair in a junction is joined up to a bend of 2.8 rad^2 at most.
"""

OPEN_KINK = 2.0
"""Cost of an end left open at a sharp turn of a branch where nothing else meets.

Source: by hand; above `OPEN_JUNCTION`, since nothing else explains the end.
"""

_ONLY_PAIR = 3.96
"""Most that a joint of the only two ends at a junction costs, units of cost.

Source: derived; a little less than two `OPEN_KINK`, since nothing else explains these two.
"""

OPEN_INSIDE = 0.4
"""Cost of an end left open inside of a branch that two cables share.

Source: by hand; below `OPEN_JUNCTION`, since nothing is seen to go on.
"""

OPEN_ROUND = 0.3
"""Cost of a round free end left open.

Source: measured, against `OPEN_CUT`, by ``python -m benchmarks.end_shapes`` on generated masks, where free ends are
flat, round, frayed and tapered, and others cut by discs and bars: roundness changes the odds by 2.9 to 3.1 nats, each
worth 0.25. How high both lie is a balance, by hand, between generated cables behind discs and others that only face
each other.
"""

OPEN_CUT = 1.1
"""Cost of a cut off free end left open; what hides a cable leaves straight or hollow ends.

Source: as `OPEN_ROUND`.
"""

GAP_LENGTH = 0.09
"""Price of a gap, per width of its length, where nobody knows what lies there.

Source: measured; of generated cables that only face each other .48 are right at 0.06, .59 at 0.09, .62 at 0.1 and .64
at 0.12, of cables behind discs and bars .854, .846, .837 and .804. Two of the authors' masks are split at 0.1.
"""


@helper
def _bend_along(
    states: npt.NDArray[np.float64], i: int, j: int, cx: float, cy: float, width: float
) -> tuple[float, float]:
    """Measure the bend of a curve along a chord from one end into another, and its length.

    For the angles a and b of the two directions against the chord, the curve of least bending energy has
    ``4 (a^2 - a b + b^2) / length`` (a cubic, small angles), which is split here into the part of the turn a + b and
    that of the swerve (a - b) / 2. A turn that continues the ends' own curvature is free.

    Returns
    -------
    bend : float
        ``turn^2 / 4 + 3 swerve^2``, rad^2.
    length : float
        px.
    """
    length = np.sqrt(cx * cx + cy * cy)
    ix, iy, jx, jy = states[i, TANGENT_X], states[i, TANGENT_Y], -states[j, TANGENT_X], -states[j, TANGENT_Y]
    if (ix == 0.0 and iy == 0.0) or (jx == 0.0 and jy == 0.0):
        return _UNKNOWN_BEND, length
    if length < 1.0:
        turn = np.arctan2(ix * jy - iy * jx, ix * jx + iy * jy)
        return 0.25 * turn * turn, length
    a = np.arctan2(ix * cy - iy * cx, ix * cx + iy * cy)
    b = np.arctan2(cx * jy - cy * jx, cx * jx + cy * jy)
    turn, swerve = a + b, 0.5 * (a - b)
    known = max(states[i, HAS_CURVATURE] + states[j, HAS_CURVATURE], 1.0)
    curvature = (
        states[i, HAS_CURVATURE] * states[i, CURVATURE] - states[j, HAS_CURVATURE] * states[j, CURVATURE]
    ) / known
    extrapolated = _EXTRAPOLATED_SHARE * min(length, _EXTRAPOLATED_WIDTHS * width) * curvature
    # A curve that turns less than extrapolated is not charged for the difference.
    turn = max(turn - max(extrapolated, 0.0), 0.0) if turn > 0.0 else min(turn - min(extrapolated, 0.0), 0.0)
    return 0.25 * turn * turn + 3.0 * swerve * swerve, length


@helper
def _bend(states: npt.NDArray[np.float64], i: int, j: int, width: float) -> tuple[float, float]:
    """Measure the bend of a curve from one end into another, and its length."""
    return _bend_along(states, i, j, states[j, X] - states[i, X], states[j, Y] - states[i, Y], width)


@helper
def _outside(mask: npt.NDArray[np.uint8], states: npt.NDArray[np.float64], i: int, j: int) -> float:
    """Return the share of a cubic from one end into another that does not lie on the mask."""
    cx, cy = states[j, X] - states[i, X], states[j, Y] - states[i, Y]
    length = np.sqrt(cx * cx + cy * cy)
    steps = min(int(length / 2.0) + 2, 24)
    out = 0
    for k in range(1, steps):
        t = k / steps
        at_i, at_j = 1.0 - 3.0 * t * t + 2.0 * t**3, 3.0 * t * t - 2.0 * t**3
        of_i, of_j = (t - 2.0 * t * t + t**3) * length, (t * t - t**3) * length
        x = at_i * states[i, X] + of_i * states[i, TANGENT_X] + at_j * states[j, X] + of_j * states[j, TANGENT_X]
        y = at_i * states[i, Y] + of_i * states[i, TANGENT_Y] + at_j * states[j, Y] + of_j * states[j, TANGENT_Y]
        row, column = int(y + 0.5), int(x + 0.5)
        inside = 0 <= row < mask.shape[0] and 0 <= column < mask.shape[1] and mask[row, column] != 0
        out += not inside
    return out / (steps - 1)


@helper
def _link_cost(states: npt.NDArray[np.float64], i: int, j: int, width: float, mask: npt.NDArray[np.uint8]) -> float:
    """Return the cost of a link between two ends at one junction."""
    bend, length = _bend(states, i, j, width)
    return bend * (_LINK_BEND * width / max(length, width) + _LINK_TURN) + _OUTSIDE * _outside(mask, states, i, j)


@helper
def _gap_cost(bend: float, length: float, width: float) -> float:
    """Return the cost of a link across a gap in the mask."""
    return bend * (_GAP_BEND * width / max(length, width) + _GAP_TURN) + GAP_LENGTH * length / width


@kernel(read(float64, 2), read(int64, 2), float64)
def turn_costs(states: npt.NDArray[np.float64], pairs: npt.NDArray[np.int64], width: float) -> npt.NDArray[np.float64]:
    """Return the costs of pairs of ends across a gap, wherever they lie.

    Parameters
    ----------
    states : (n, 6) float64
    pairs : (k, 2) int64
    width : float
        px.

    Returns
    -------
    (k,) float64
    """
    costs = np.empty(len(pairs))
    for k in range(len(pairs)):
        bend, length = _bend(states, pairs[k, 0], pairs[k, 1], width)
        costs[k] = _gap_cost(bend, length, width)
    return costs


@kernel(read(float64, 2), read(int64, 2), float64)
def slant_costs(states: npt.NDArray[np.float64], pairs: npt.NDArray[np.int64], width: float) -> npt.NDArray[np.float64]:
    """Return how much of the costs of gaps is due to tips that a cover leaves where it crosses a cable at a slant.

    The tips lie beside the cable's axis: how far two ends lie beside each other, across their mean direction, is less.

    Parameters
    ----------
    states : (n, 6) float64
    pairs : (k, 2) int64
    width : float
        px.

    Returns
    -------
    (k,) float64
    """
    costs = np.zeros(len(pairs))
    for k in range(len(pairs)):
        i, j = pairs[k]
        cx, cy = states[j, X] - states[i, X], states[j, Y] - states[i, Y]
        mx, my = states[i, TANGENT_X] - states[j, TANGENT_X], states[i, TANGENT_Y] - states[j, TANGENT_Y]
        norm = np.sqrt(mx * mx + my * my)
        if norm == 0.0:
            continue
        mx, my = mx / norm, my / norm
        aside = mx * cy - my * cx
        less = min(max(aside, -_TIP_WIDTHS * width), _TIP_WIDTHS * width)
        bend, length = _bend(states, i, j, width)
        cost = _gap_cost(bend, length, width)
        bend, length = _bend_along(states, i, j, cx + my * less, cy - mx * less, width)
        costs[k] = max(cost - _gap_cost(bend, length, width), 0.0)
    return costs


@kernel(read(float64, 1), read(boolean, 1), read(float64, 1), float64)
def swerve_costs(
    lengths: npt.NDArray[np.float64], gaps: npt.NDArray[np.bool_], swerves: npt.NDArray[np.float64], width: float
) -> npt.NDArray[np.float64]:
    """Return the costs of ways between ends for swerving towards the camera or away from it, as for swerving beside it.

    Parameters
    ----------
    lengths : (k,) float64
        px.
    gaps : (k,) bool
        True where a gap is to be bridged.
    swerves : (k,) float64
        rad.
    width : float
        px.

    Returns
    -------
    (k,) float64
    """
    costs = np.empty(len(lengths))
    for k in range(len(lengths)):
        bend, turn = (_GAP_BEND, _GAP_TURN) if gaps[k] else (_LINK_BEND, _LINK_TURN)
        costs[k] = min(3.0 * swerves[k] ** 2 * (bend * width / max(lengths[k], width) + turn), _MOST_SWERVE)
    return costs


@helper
def _list_junction_ends(nodes: npt.NDArray[np.int64]) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """List the ends at each junction: the start of each junction's ends in the list, and the list."""
    count = 0
    for node in nodes:
        count = max(count, node + 1)
    first = np.zeros(count + 1, dtype=np.int64)
    for node in nodes:
        if node >= 0:
            first[node + 1] += 1
    for node in range(count):
        first[node + 1] += first[node]
    members = np.empty(first[count], dtype=np.int64)
    filled = first[:count].copy()
    for end in range(len(nodes)):
        if nodes[end] >= 0:
            members[filled[nodes[end]]] = end
            filled[nodes[end]] += 1
    return first, members


@kernel(read(int64, 1), read(boolean, 1), read(float64, 2), float64, read(uint8, 2))
def junction_costs(
    nodes: npt.NDArray[np.int64],
    spur: npt.NDArray[np.bool_],
    states: npt.NDArray[np.float64],
    width: float,
    mask: npt.NDArray[np.uint8],
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64], npt.NDArray[np.int64], npt.NDArray[np.float64]]:
    """List the ends at every junction and the cost of each pair of them.

    Parameters
    ----------
    nodes : (2 n,) int64
        The junction at each end, negative where there is none.
    spur : (n,) bool
    states : (2 n, 6) float64
    width : float
        px.
    mask : (H, W) uint8

    Returns
    -------
    first : (junctions + 1,) int64
        Start of each junction's ends in `members`.
    members : (m,) int64
        Ends, junction after junction.
    starts : (junctions + 1,) int64
        Start of each junction's costs: a square matrix of its states, row by row.
    costs : (k,) float64
    """
    first, members = _list_junction_ends(nodes)
    count = len(first) - 1
    starts = np.zeros(count + 1, dtype=np.int64)
    for node in range(count):
        starts[node + 1] = starts[node] + (first[node + 1] - first[node]) ** 2
    costs = np.empty(starts[count])
    for node in range(count):
        size = first[node + 1] - first[node]
        for a in range(size):
            for b in range(size):
                i, j = members[first[node] + a], members[first[node] + b]
                if b <= a:
                    cost = FORBIDDEN if a == b else costs[starts[node] + b * size + a]
                elif spur[branch_of(i)] and spur[branch_of(j)]:
                    cost = FORBIDDEN
                else:
                    cost = _link_cost(states, i, j, width, mask)
                costs[starts[node] + a * size + b] = cost
    return first, members, starts, costs


@helper
def _place_link_costs(
    first: npt.NDArray[np.int64], members: npt.NDArray[np.int64], starts: npt.NDArray[np.int64], ends: int
) -> npt.NDArray[np.int64]:
    """Return the start of each end's row in the costs of its junction, and its column."""
    place = np.zeros((ends, 2), dtype=np.int64)
    for node in range(len(first) - 1):
        size = first[node + 1] - first[node]
        for k in range(size):
            end = members[first[node] + k]
            place[end, 0], place[end, 1] = starts[node] + k * size, k
    return place


@helper
def _expand_link_costs(
    first: npt.NDArray[np.int64],
    members: npt.NDArray[np.int64],
    end_id: npt.NDArray[np.int64],
    spur: npt.NDArray[np.bool_],
    states: npt.NDArray[np.float64],
    width: float,
    mask: npt.NDArray[np.uint8],
    place: npt.NDArray[np.int64],
    link_costs: npt.NDArray[np.float64],
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.float64]]:
    """Return the costs of links between the ends at each junction, those of duplicates among them.

    The costs of the graph's own ends are taken over where the order of the two is the same: then they are bit-equal.

    Returns
    -------
    starts : (junctions + 1,) int64
        Start of each junction's costs: a square matrix, of which the upper triangle counts.
    costs : (k,) float64
    """
    starts = np.zeros(len(first), dtype=np.int64)
    for node in range(len(first) - 1):
        starts[node + 1] = starts[node] + (first[node + 1] - first[node]) ** 2
    costs = np.empty(starts[len(first) - 1])
    for node in range(len(first) - 1):
        size = first[node + 1] - first[node]
        for a in range(size):
            for b in range(a + 1, size):
                i, j = members[first[node] + a], members[first[node] + b]
                if end_id[i] == end_id[j] or (spur[branch_of(i)] and spur[branch_of(j)]):
                    cost = FORBIDDEN
                elif end_id[i] < end_id[j]:
                    cost = link_costs[place[end_id[i], 0] + place[end_id[j], 1]]
                else:
                    cost = _link_cost(states, i, j, width, mask)
                costs[starts[node] + a * size + b] = cost
    return starts, costs


@helper
def _free_corners(
    first: npt.NDArray[np.int64],
    members: npt.NDArray[np.int64],
    corners: npt.NDArray[np.int64],
    end_id: npt.NDArray[np.int64],
    starts: npt.NDArray[np.int64],
    costs: npt.NDArray[np.float64],
) -> None:
    """Make the link around a corner free: one cable bends there, however sharply."""
    for node in range(len(first) - 1):
        size = first[node + 1] - first[node]
        for a in range(size):
            for b in range(a + 1, size):
                i, j = members[first[node] + a], members[first[node] + b]
                if corners[i] >= 0 and corners[i] == corners[j] and end_id[i] != end_id[j]:
                    costs[starts[node] + a * size + b] = 0.0


@helper
def _find_decided(
    first: npt.NDArray[np.int64],
    members: npt.NDArray[np.int64],
    starts: npt.NDArray[np.int64],
    costs: npt.NDArray[np.float64],
    spur: npt.NDArray[np.bool_],
) -> npt.NDArray[np.bool_]:
    """Tell which ends have a mutual, nearly straight junction link: they take part in no gap."""
    n = 2 * len(spur)
    best = np.full(n, -1, dtype=np.int64)
    best_cost = np.full(n, _CHEAP_LINK)
    for node in range(len(first) - 1):
        size = first[node + 1] - first[node]
        for a in range(size):
            for b in range(a + 1, size):
                i, j = members[first[node] + a], members[first[node] + b]
                cost = costs[starts[node] + a * size + b]
                if spur[branch_of(i)] or spur[branch_of(j)]:
                    continue
                if cost < best_cost[i]:
                    best[i], best_cost[i] = j, cost
                if cost < best_cost[j]:
                    best[j], best_cost[j] = i, cost
    decided = np.zeros(n, dtype=np.bool_)
    for i in range(n):
        decided[i] = best[i] >= 0 and best[best[i]] == i
    return decided


@helper
def _open_costs(
    nodes: npt.NDArray[np.int64],
    degree: npt.NDArray[np.int64],
    spur: npt.NDArray[np.bool_],
    end_roundness: npt.NDArray[np.float64],
) -> npt.NDArray[np.float64]:
    """Return the cost of leaving each end open, by how many ends that are no spurs its junction has."""
    cost = np.empty(len(nodes))
    for end in range(len(nodes)):
        if spur[branch_of(end)]:
            cost[end] = 0.0
        elif nodes[end] < 0:
            cost[end] = OPEN_CUT - (OPEN_CUT - OPEN_ROUND) * end_roundness[end]
        else:
            cost[end] = OPEN_KINK if degree[nodes[end]] == 2 else OPEN_JUNCTION
    return cost


@kernel(
    read(int64, 1), read(int64, 1), read(boolean, 1), read(float64, 1), read(float64, 2), float64, read(uint8, 2),
    read(int64, 1), read(int64, 1), read(int64, 1), read(float64, 1), read(boolean, 1), read(int64, 1),
    float64, float64, float64,
)  # fmt: skip
def pair_costs(
    nodes: npt.NDArray[np.int64],
    end_id: npt.NDArray[np.int64],
    spur: npt.NDArray[np.bool_],
    end_roundness: npt.NDArray[np.float64],
    states: npt.NDArray[np.float64],
    width: float,
    mask: npt.NDArray[np.uint8],
    first: npt.NDArray[np.int64],
    members: npt.NDArray[np.int64],
    starts: npt.NDArray[np.int64],
    link_costs: npt.NDArray[np.float64],
    bordering: npt.NDArray[np.bool_],
    corners: npt.NDArray[np.int64],
    max_gap: float,
    least_bound: float,
    more: float,
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64], npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """List the pairs of ends that cost less joined than open, and the cost of leaving each end open.

    Parameters
    ----------
    nodes : (n,) int64
        The junction at each end, -1 where it is free, less where it cannot be joined.
    end_id : (n,) int64
        End of the graph that each end stands for: equal on duplicates of a branch.
    spur : (n / 2,) bool
        Branches that need no explanation, but may be the tip of another one.
    end_roundness : (n,) float64
        As `branch_ends.measure_roundness` makes them.
    states : (n, 6) float64
    width : float
        px.
    mask : (H, W) uint8
    first, members, starts, link_costs
        As `junction_costs` makes them of the graph's ends.
    bordering : (n,) bool
        Ends cut by the image's border: they take part in no gap.
    corners : (n,) int64
        Equal for two ends that meet in one sharp bend; else -1.
    max_gap : float
        Longest gap, px.
    least_bound : float
        Gaps that cost less are listed even where leaving both ends open costs less than that.
    more : float
        Largest extra cost of pairs over that.

    Returns
    -------
    rows, columns : (k,) int64
        The ends, the lower one first, in ascending order.
    costs : (k,) float64
    open_cost : (n,) float64
        Cost of leaving each end open.
    """
    n = len(nodes)
    own_first, own_members = _list_junction_ends(nodes)
    degree = np.zeros(len(own_first), dtype=np.int64)
    for end in own_members:
        degree[nodes[end]] += not spur[branch_of(end)]
    open_cost = _open_costs(nodes, degree, spur, end_roundness)
    place = _place_link_costs(first, members, starts, n)
    own_starts, own_costs = _expand_link_costs(
        own_first, own_members, end_id, spur, states, width, mask, place, link_costs
    )
    _free_corners(own_first, own_members, corners, end_id, own_starts, own_costs)
    is_bound = _find_decided(own_first, own_members, own_starts, own_costs, spur) | bordering  # to take part in no gap
    for end in range(n):
        is_bound[end] |= spur[branch_of(end)]
    loose = np.flatnonzero((nodes > UNAVAILABLE) & ~is_bound)
    looking = len(loose)
    capacity = 4 * n + 16
    rows = np.empty(capacity, dtype=np.int64)
    columns = np.empty(capacity, dtype=np.int64)
    costs = np.empty(capacity)
    count, next_loose = 0, 0
    for i in range(n):
        if nodes[i] <= UNAVAILABLE:
            continue
        while next_loose < looking and loose[next_loose] <= i:
            next_loose += 1
        at_gap = looking if is_bound[i] else next_loose
        at_link = last_link = row = 0  # the ends of its junction that come after it, and its row of costs there
        if nodes[i] >= 0:
            at_link, last_link = own_first[nodes[i]], own_first[nodes[i] + 1]
            row = own_starts[nodes[i]] - at_link
            while own_members[at_link] < i:
                at_link += 1
                row += last_link - own_first[nodes[i]]
            at_link += 1
        while at_gap < looking or at_link < last_link:
            across = loose[at_gap] if at_gap < looking else n
            onward = own_members[at_link] if at_link < last_link else n
            j = min(across, onward)
            at_gap += across == j
            bound = open_cost[i] + open_cost[j]
            if onward == j:
                cost = own_costs[row + at_link]
                at_link += 1
                if end_id[i] == end_id[j] or (spur[branch_of(i)] and spur[branch_of(j)]):
                    continue
                if degree[nodes[i]] == 2 and not spur[branch_of(i)] and not spur[branch_of(j)]:
                    cost = min(cost, _ONLY_PAIR)
            else:
                if branch_of(end_id[i]) == branch_of(end_id[j]):  # the two ends of a branch, or those of its duplicates
                    continue
                if abs(states[i, X] - states[j, X]) > max_gap or abs(states[i, Y] - states[j, Y]) > max_gap:
                    continue
                bend, length = _bend(states, i, j, width)
                cost = _gap_cost(bend, length, width)
                if nodes[i] >= 0 or nodes[j] >= 0:
                    cost += _GAP_JUNCTION + _GAP_JUNCTION_BEND * bend
                bound = max(bound, least_bound)
            if cost >= bound + more:
                continue
            if count == capacity:
                capacity *= 2
                rows = np.concatenate((rows, np.empty_like(rows)))
                columns = np.concatenate((columns, np.empty_like(columns)))
                costs = np.concatenate((costs, np.empty_like(costs)))
            rows[count], columns[count], costs[count] = i, j, cost
            count += 1
    return rows[:count].copy(), columns[:count].copy(), costs[:count].copy(), open_cost
