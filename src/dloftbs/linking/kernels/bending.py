"""Costs of joining two ends: the bending that a cable needs through a junction or across a gap.

An arm is what `arms.locate_arms` makes of the end of a run. Costs have no unit; 1 is about what a turn of 90 degrees in
a junction costs.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import boolean, float64, int64, uint8

from dloftbs.kernels.compiler import helper, kernel, read

_PASS_BEND, _PASS_TURN = 1.5, 1.0  # of a pass: per rad^2 of bend, times width / length, and as it is
_OUTSIDE = 3.0  # of a pass that leaves the mask altogether
_GAP_BEND, _GAP_TURN = 2.0, 0.4  # of a gap, as above
_GAP_ARM = 0.4  # of a gap from an arm of a junction: where the mask goes on, a cable rarely stops
_GAP_ARM_BEND = 1.0  # and per rad^2
_PROMISE = 0.7  # share of the arms' own curvature that is believed to go on
_PROMISE_WIDTHS = 3.0  # over so much of the way
_UNKNOWN_BEND = 0.25  # of an arm without any direction, rad^2
_SETTLED = 0.15  # a pass that costs less is not given up for a gap
_NEVER = 1e3

OPEN_ARM, OPEN_KINK, OPEN_INSIDE = 1.4, 2.0, 0.4
"""Prices of ends left open: in a junction, where a run turns sharply and nothing else meets it, inside a run."""

OPEN_ROUND, OPEN_CUT = 0.3, 1.1
"""Prices of free ends left open, round and cut off ones: what hides a cable leaves straight or hollow ends.

They differ by what ``python -m benchmarks.end_shapes`` measures on generated masks, where free ends are flat, round,
frayed and tapered, and others cut by discs and bars: roundness changes the odds by 2.9 to 3.1 nats, each worth 0.25.
How high both lie is a balance between generated cables behind discs and others that only face each other.
"""

GAP_LENGTH = 0.09
"""Price of a gap, per width of its length, where nobody knows what lies there.

Of generated cables that only face each other .48 are right at 0.06, .59 at 0.09 and .62 at 0.1, of cables behind discs
and bars .85, .85 and .84: the price is as high as costs the hidden ones nothing.
"""


@helper
def _bend(arms: npt.NDArray[np.float64], i: int, j: int, width: float) -> tuple[float, float]:
    """Return how much a curve from one arm into another bends, and how far it is.

    For the angles a and b of the two directions against the chord, the curve of least bending energy has
    ``4 (a^2 - a b + b^2) / length`` (a cubic, small angles), which is split here into the part of the turn a + b and
    that of the swerve (a - b) / 2. A turn that the arms' own curvature promises is free.

    Returns
    -------
    bend : float
        ``turn^2 / 4 + 3 swerve^2``, rad^2.
    length : float
        px.
    """
    cx, cy = arms[j, 0] - arms[i, 0], arms[j, 1] - arms[i, 1]
    length = np.sqrt(cx * cx + cy * cy)
    ix, iy, jx, jy = arms[i, 2], arms[i, 3], -arms[j, 2], -arms[j, 3]
    if (ix == 0.0 and iy == 0.0) or (jx == 0.0 and jy == 0.0):
        return _UNKNOWN_BEND, length
    if length < 1.0:
        turn = np.arctan2(ix * jy - iy * jx, ix * jx + iy * jy)
        return 0.25 * turn * turn, length
    a = np.arctan2(ix * cy - iy * cx, ix * cx + iy * cy)
    b = np.arctan2(cx * jy - cy * jx, cx * jx + cy * jy)
    turn, swerve = a + b, 0.5 * (a - b)
    known = max(arms[i, 5] + arms[j, 5], 1.0)
    curvature = (arms[i, 5] * arms[i, 4] - arms[j, 5] * arms[j, 4]) / known
    promised = _PROMISE * min(length, _PROMISE_WIDTHS * width) * curvature
    # A promise is not held against a curve that turns less.
    turn = max(turn - max(promised, 0.0), 0.0) if turn > 0.0 else min(turn - min(promised, 0.0), 0.0)
    return 0.25 * turn * turn + 3.0 * swerve * swerve, length


@helper
def _outside(mask: npt.NDArray[np.uint8], arms: npt.NDArray[np.float64], i: int, j: int) -> float:
    """Return the share of a cubic from one arm into another that does not lie on the mask."""
    cx, cy = arms[j, 0] - arms[i, 0], arms[j, 1] - arms[i, 1]
    length = np.sqrt(cx * cx + cy * cy)
    steps = min(int(length / 2.0) + 2, 24)
    out = 0
    for k in range(1, steps):
        t = k / steps
        at_i, at_j = 1.0 - 3.0 * t * t + 2.0 * t**3, 3.0 * t * t - 2.0 * t**3
        of_i, of_j = (t - 2.0 * t * t + t**3) * length, (t * t - t**3) * length
        x = at_i * arms[i, 0] + of_i * arms[i, 2] + at_j * arms[j, 0] + of_j * arms[j, 2]
        y = at_i * arms[i, 1] + of_i * arms[i, 3] + at_j * arms[j, 1] + of_j * arms[j, 3]
        row, column = int(y + 0.5), int(x + 0.5)
        inside = 0 <= row < mask.shape[0] and 0 <= column < mask.shape[1] and mask[row, column] != 0
        out += not inside
    return out / (steps - 1)


@helper
def _pass_cost(arms: npt.NDArray[np.float64], i: int, j: int, width: float, mask: npt.NDArray[np.uint8]) -> float:
    """Return what it costs to go on from one arm of a junction into another."""
    bend, length = _bend(arms, i, j, width)
    return bend * (_PASS_BEND * width / max(length, width) + _PASS_TURN) + _OUTSIDE * _outside(mask, arms, i, j)


@helper
def _gap_price(bend: float, length: float, width: float) -> float:
    """Return what it costs to go on from one end into another where no mask is."""
    return bend * (_GAP_BEND * width / max(length, width) + _GAP_TURN) + GAP_LENGTH * length / width


@kernel(read(float64, 2), read(int64, 2), float64)
def turn_costs(arms: npt.NDArray[np.float64], pairs: npt.NDArray[np.int64], width: float) -> npt.NDArray[np.float64]:
    """Return what pairs of ends would cost across a gap, wherever they are.

    Parameters
    ----------
    arms : (n, 6) float64
    pairs : (k, 2) int64
    width : float
        px.

    Returns
    -------
    (k,) float64
    """
    costs = np.empty(len(pairs))
    for k in range(len(pairs)):
        bend, length = _bend(arms, pairs[k, 0], pairs[k, 1], width)
        costs[k] = _gap_price(bend, length, width)
    return costs


@helper
def _list_arms(nodes: npt.NDArray[np.int64]) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Return where the arms of each junction start in a list of ends, and the list."""
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
    arms: npt.NDArray[np.float64],
    width: float,
    mask: npt.NDArray[np.uint8],
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64], npt.NDArray[np.int64], npt.NDArray[np.float64]]:
    """List the arms of every junction, and what each pair of them costs.

    Parameters
    ----------
    nodes : (2 n,) int64
        The junction at each end, negative where there is none.
    spur : (n,) bool
    arms : (2 n, 6) float64
    width : float
        px.
    mask : (H, W) uint8

    Returns
    -------
    first : (junctions + 1,) int64
        Start of each junction's arms in `members`.
    members : (m,) int64
        Ends, junction after junction.
    starts : (junctions + 1,) int64
        Start of each junction's costs: a square matrix of its arms, row by row.
    costs : (k,) float64
    """
    first, members = _list_arms(nodes)
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
                    cost = _NEVER if a == b else costs[starts[node] + b * size + a]
                elif spur[i // 2] and spur[j // 2]:
                    cost = _NEVER
                else:
                    cost = _pass_cost(arms, i, j, width, mask)
                costs[starts[node] + a * size + b] = cost
    return first, members, starts, costs


@helper
def _place_passes(
    first: npt.NDArray[np.int64], members: npt.NDArray[np.int64], starts: npt.NDArray[np.int64], ends: int
) -> npt.NDArray[np.int64]:
    """Return where the row of each end starts in the costs of the junctions, and its column."""
    place = np.zeros((ends, 2), dtype=np.int64)
    for node in range(len(first) - 1):
        size = first[node + 1] - first[node]
        for k in range(size):
            end = members[first[node] + k]
            place[end, 0], place[end, 1] = starts[node] + k * size, k
    return place


@helper
def _expand_passes(
    first: npt.NDArray[np.int64],
    members: npt.NDArray[np.int64],
    identity: npt.NDArray[np.int64],
    spur: npt.NDArray[np.bool_],
    arms: npt.NDArray[np.float64],
    width: float,
    mask: npt.NDArray[np.uint8],
    place: npt.NDArray[np.int64],
    passes: npt.NDArray[np.float64],
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.float64]]:
    """Return what `_pass_cost` says of the arms of each junction, those of copies among them, the lower end first.

    Taken from the originals where that is the same to the last bit: the lower one of a pair goes first.

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
                if identity[i] == identity[j] or (spur[i // 2] and spur[j // 2]):
                    cost = _NEVER
                elif identity[i] < identity[j]:
                    cost = passes[place[identity[i], 0] + place[identity[j], 1]]
                else:
                    cost = _pass_cost(arms, i, j, width, mask)
                costs[starts[node] + a * size + b] = cost
    return starts, costs


@helper
def _join_bends(
    first: npt.NDArray[np.int64],
    members: npt.NDArray[np.int64],
    corners: npt.NDArray[np.int64],
    identity: npt.NDArray[np.int64],
    starts: npt.NDArray[np.int64],
    costs: npt.NDArray[np.float64],
) -> None:
    """Let it cost nothing to go on around a corner: one cable bends there, however sharply."""
    for node in range(len(first) - 1):
        size = first[node + 1] - first[node]
        for a in range(size):
            for b in range(a + 1, size):
                i, j = members[first[node] + a], members[first[node] + b]
                if corners[i] >= 0 and corners[i] == corners[j] and identity[i] != identity[j]:
                    costs[starts[node] + a * size + b] = 0.0


@helper
def _settled(
    first: npt.NDArray[np.int64],
    members: npt.NDArray[np.int64],
    starts: npt.NDArray[np.int64],
    costs: npt.NDArray[np.float64],
    spur: npt.NDArray[np.bool_],
) -> npt.NDArray[np.bool_]:
    """Tell which arms go straight on into another one, and it into them: no gap need be looked for."""
    n = 2 * len(spur)
    best = np.full(n, -1, dtype=np.int64)
    best_cost = np.full(n, _SETTLED)
    for node in range(len(first) - 1):
        size = first[node + 1] - first[node]
        for a in range(size):
            for b in range(a + 1, size):
                i, j = members[first[node] + a], members[first[node] + b]
                cost = costs[starts[node] + a * size + b]
                if spur[i // 2] or spur[j // 2]:
                    continue
                if cost < best_cost[i]:
                    best[i], best_cost[i] = j, cost
                if cost < best_cost[j]:
                    best[j], best_cost[j] = i, cost
    settled = np.zeros(n, dtype=np.bool_)
    for i in range(n):
        settled[i] = best[i] >= 0 and best[best[i]] == i
    return settled


@kernel(
    read(int64, 1), read(int64, 1), read(boolean, 1), read(float64, 1), read(float64, 2), float64, read(uint8, 2),
    read(int64, 1), read(int64, 1), read(int64, 1), read(float64, 1), read(boolean, 1), read(int64, 1),
    float64, float64, float64,
)  # fmt: skip
def pair_costs(
    nodes: npt.NDArray[np.int64],
    identity: npt.NDArray[np.int64],
    spur: npt.NDArray[np.bool_],
    caps: npt.NDArray[np.float64],
    arms: npt.NDArray[np.float64],
    width: float,
    mask: npt.NDArray[np.uint8],
    first: npt.NDArray[np.int64],
    members: npt.NDArray[np.int64],
    starts: npt.NDArray[np.int64],
    passes: npt.NDArray[np.float64],
    bordering: npt.NDArray[np.bool_],
    corners: npt.NDArray[np.int64],
    max_gap: float,
    least_bound: float,
    more: float,
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64], npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """List the pairs of ends that are cheaper joined than left open, and the prices of leaving them open.

    Parameters
    ----------
    nodes : (n,) int64
        The junction at each end, -1 where it is free, less where it cannot be joined.
    identity : (n,) int64
        Equal for ends that are the same, on copies of one run: the end of the original.
    spur : (n / 2,) bool
        Runs that need no explanation, but may be the tip of another one.
    caps : (n,) float64
        As `arms.measure_caps` makes them.
    arms : (n, 6) float64
    width : float
        px.
    mask : (H, W) uint8
    first, members, starts, passes
        As `junction_costs` makes them of the originals.
    bordering : (n,) bool
        Ends that the image's border cuts: no gap leads from them.
    corners : (n,) int64
        Equal for two ends that are the arms of one sharp bend; else -1.
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
    price : (n,) float64
    """
    n = len(nodes)
    own_first, own_members = _list_arms(nodes)
    degree = np.zeros(len(own_first), dtype=np.int64)
    for end in own_members:
        degree[nodes[end]] += not spur[end // 2]
    price = np.empty(n)
    for end in range(n):
        price[end] = OPEN_ARM if nodes[end] >= 0 else OPEN_CUT - (OPEN_CUT - OPEN_ROUND) * caps[end]
        if spur[end // 2]:
            price[end] = 0.0
        elif nodes[end] >= 0 and degree[nodes[end]] == 2:
            price[end] = OPEN_KINK
    place = _place_passes(first, members, starts, n)
    own_starts, own_passes = _expand_passes(own_first, own_members, identity, spur, arms, width, mask, place, passes)
    _join_bends(own_first, own_members, corners, identity, own_starts, own_passes)
    is_settled = _settled(own_first, own_members, own_starts, own_passes, spur)
    loose, looking = np.empty(n, dtype=np.int64), 0  # ends that a gap may lead from
    for end in range(n):
        if nodes[end] >= -1 and not (spur[end // 2] or is_settled[end] or bordering[end]):
            loose[looking] = end
            looking += 1
    capacity = 4 * n + 16
    rows = np.empty(capacity, dtype=np.int64)
    columns = np.empty(capacity, dtype=np.int64)
    costs = np.empty(capacity)
    count, next_loose = 0, 0
    for i in range(n):
        if nodes[i] < -1:
            continue
        while next_loose < looking and loose[next_loose] <= i:
            next_loose += 1
        at_gap = looking if spur[i // 2] or is_settled[i] or bordering[i] else next_loose
        at_pass = last_pass = row = 0  # the arms of its junction that come after it, and its row of costs there
        if nodes[i] >= 0:
            at_pass, last_pass = own_first[nodes[i]], own_first[nodes[i] + 1]
            row = own_starts[nodes[i]] - at_pass
            while own_members[at_pass] < i:
                at_pass += 1
                row += last_pass - own_first[nodes[i]]
            at_pass += 1
        while at_gap < looking or at_pass < last_pass:
            across = loose[at_gap] if at_gap < looking else n
            onward = own_members[at_pass] if at_pass < last_pass else n
            j = min(across, onward)
            at_gap += across == j
            bound = price[i] + price[j]
            if onward == j:
                cost = own_passes[row + at_pass]
                at_pass += 1
                if identity[i] == identity[j] or (spur[i // 2] and spur[j // 2]):
                    continue
                if degree[nodes[i]] == 2 and not spur[i // 2] and not spur[j // 2]:
                    cost = min(cost, 1.98 * OPEN_KINK)  # nothing else explains these two
            else:
                if identity[i] // 2 == identity[j] // 2:  # the two ends of a run, or those of its copies
                    continue
                if abs(arms[i, 0] - arms[j, 0]) > max_gap or abs(arms[i, 1] - arms[j, 1]) > max_gap:
                    continue
                bend, length = _bend(arms, i, j, width)
                cost = _gap_price(bend, length, width)
                if nodes[i] >= 0 or nodes[j] >= 0:
                    cost += _GAP_ARM + _GAP_ARM_BEND * bend
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
    return rows[:count].copy(), columns[:count].copy(), costs[:count].copy(), price
