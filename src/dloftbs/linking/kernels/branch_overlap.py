"""Branch overlap: series of branches that two cables may share, side by side or one over the other.

At a junction whose ends, in pairs, leave some open, as an odd number does, a cable stops, or one of the branches holds
two cables. Shared branches lead from one such junction to another one, straight through others in between; or to a
point at which one of the two cables ends and the mask gets narrow.
"""

from __future__ import annotations

import numpy as np
from numba import boolean, float64, int64

from dloftbs.kernels.compiler import Bools, Floats, Ints, helper, kernel, read
from dloftbs.kernels.shared.copying import copy_to
from dloftbs.kernels.shared.graph_ends import branch_of, other_end
from dloftbs.kernels.shared.selection import falling_order

MAX_RUNS = 6
"""Largest number of branches of a path that two cables share.

Source: bounds time and memory.
"""

_MAX_TRIALS = 32
"""Largest number of paths tried from each branch end.

Source: bounds time.
"""

_MAX_SLOTS = 64
"""Largest number of paths and of branch ends of a junction kept at a time.

Source: bounds memory.
"""

_MAX_ARMS = 14
"""Largest number of branch ends of a junction that a path may lead through.

Source: bounds time; all ways to pair them are compared.
"""

_STRAIGHT_ON = 5.6
"""Largest cost of a pass by which a path may go on through a junction, nats.

Source: by hand; above the cost of stopping there.
"""

_COST_PER_WIDTH = 0.08
"""Cost of sharing a branch, nats per width of its length.

Source: by hand; it prefers the shorter of two paths that are alike otherwise. Of 658 generated and simulated frames
none is read otherwise at half or twice as much.
"""

_THIN_COST = 1.4
"""Extra cost of sharing a branch, nats per width of its length, where the mask is as narrow as one cable.

Source: by hand.
"""

_THIN = 1.15
"""Mean width of a branch, in widths of a cable, below which it looks like one cable.

Source: by hand; above the noise of a median width.
"""

_BONUS_WIDE = 0.6
"""Discount for sharing a branch, nats per width of its length and width by which the mask is wider than `_THIN`.

Source: by hand.
"""

_INNER_END_COST = 0.8
"""Extra cost of a cable that ends inside of a shared branch, nats.

Source: by hand; less than an end left open anywhere, since the mask gets narrow there.
"""

_MIN_WIDE_WIDTHS = 0.75
"""Least length for which a branch must be wide, where a cable ends inside, widths.

Source: by hand; a junction widens the mask for half a width.
"""


@helper
def _overlap_cost(length: float, branch_width: float, width: float) -> float:
    """Return the cost of two cables sharing a branch: lower where the mask is wider than one cable."""
    ratio, share = branch_width / width, length / width
    overlap_cost = _COST_PER_WIDTH * share
    if ratio < _THIN:
        return overlap_cost + _THIN_COST * share * min((_THIN - ratio) / (_THIN - 1.0), 1.0)
    return overlap_cost - _BONUS_WIDE * share * min(ratio - _THIN, 0.5)


@kernel(
    read(int64, 1), read(boolean, 1), read(boolean, 1), read(int64, 1), read(int64, 2), read(float64, 1), float64,
    read(int64, 1), read(int64, 1), read(int64, 1), read(float64, 1),
)  # fmt: skip
def list_paths(
    nodes: Ints,
    spur: Bools,
    unresolved: Bools,
    reach: Ints,
    spans: Ints,
    widths: Floats,
    width: float,
    first: Ints,
    members: Ints,
    starts: Ints,
    costs: Floats,
) -> tuple[Ints, Bools, Floats]:
    """List the series of branches that two cables may share.

    Parameters
    ----------
    nodes : (2 n,) int64
    spur : (n,) bool
    unresolved : (j,) bool
        Junctions whose ends, in pairs, leave some open.
    reach : (2 n,) int64
        As `wide_stretches.wide_reach` makes it.
    spans : (n, 2) int64
        Points of each branch.
    widths : (n,) float64
        Of the branches, px.
    width : float
        Of one cable, px.
    first, members, starts, costs
        As `pair_costs.junction_costs` makes them.

    Returns
    -------
    paths : (k, MAX_RUNS) int64
        The ends at which each branch is entered, in order; -1 after the last one.
    inside : (k,) bool
        Whether a cable ends inside the last one.
    overlap_cost : (k,) float64
        Cost of sharing them, besides its effect on the junctions.
    """
    count = len(first) - 1
    lengths = (spans[:, 1] - spans[:, 0]).astype(np.float64)
    may_share = np.zeros(count, dtype=np.bool_)
    has_spur = np.zeros(count, dtype=np.bool_)
    for node in range(count):
        ends = members[first[node] : first[node + 1]]
        may_share[node] = unresolved[node] and len(ends) <= _MAX_ARMS
        for end in ends:
            has_spur[node] = has_spur[node] or spur[branch_of(end)]  # it may be the tip of the second cable
    room = 2 * len(nodes) + 64
    paths = np.full((room, MAX_RUNS), -1, dtype=np.int64)
    inside = np.zeros(room, dtype=np.bool_)
    overlap_cost = np.empty(room)
    found = 0
    stack = np.full((_MAX_SLOTS, MAX_RUNS), -1, dtype=np.int64)
    depth = np.empty(_MAX_SLOTS, dtype=np.int64)
    for start in range(len(nodes)):
        if nodes[start] < 0 or spur[branch_of(start)] or not may_share[nodes[start]]:
            continue
        stack[0, 0], depth[0] = start, 1
        height, trials = 1, 0
        while height > 0 and trials < _MAX_TRIALS and found + 2 < room:
            height -= 1
            trials += 1
            steps = depth[height]
            path = stack[height].copy()
            end = path[steps - 1]
            branch, node = branch_of(end), nodes[other_end(end)]
            blocked = node == nodes[start]
            so_far = 0.0
            for s in range(steps - 1):
                before = branch_of(path[s])
                blocked = blocked or before == branch
                so_far += _overlap_cost(lengths[before], widths[before], width)
            if blocked:
                continue
            drops = reach[end] + 0.5 * width < lengths[branch] and lengths[branch] > width
            if drops and reach[end] >= _MIN_WIDE_WIDTHS * width:
                copy_to(paths[found], path[:steps])
                inside[found] = True
                overlap_cost[found] = so_far + _INNER_END_COST + _COST_PER_WIDTH * reach[end] / width
                found += 1
            if node < 0:
                continue
            may_stop = may_share[node]
            if may_stop or has_spur[node]:
                copy_to(paths[found], path[:steps])
                overlap_cost[found] = so_far + _overlap_cost(lengths[branch], widths[branch], width)
                found += 1
            if may_stop:
                continue
            size = first[node + 1] - first[node]
            if steps == MAX_RUNS or size > _MAX_ARMS:
                continue
            here = 0
            while members[first[node] + here] != other_end(end):
                here += 1
            for k in range(size):
                onward = members[first[node] + k]
                if branch_of(onward) == branch or spur[branch_of(onward)] or height == _MAX_SLOTS:
                    continue
                if costs[starts[node] + here * size + k] < _STRAIGHT_ON:
                    copy_to(stack[height], path)
                    stack[height, steps] = onward
                    depth[height] = steps + 1
                    height += 1
    return paths[:found].copy(), inside[:found].copy(), overlap_cost[:found].copy()


@kernel(read(int64, 2), read(boolean, 1), read(int64, 1), read(int64, 1), read(int64, 1))
def changed_junctions(paths: Ints, inside: Bools, nodes: Ints, first: Ints, members: Ints) -> tuple[Ints, Ints, Ints]:
    """List the ends at every junction on the paths, before and after their branches are shared.

    Parameters
    ----------
    paths, inside, nodes, first, members
        As `list_paths` takes and makes them.

    Returns
    -------
    sets : (s + 1,) int64
        Start of each set of ends in `slots`; sets that paths have in common are mostly listed once.
    slots : (m,) int64
        Ends, which may stand twice.
    changes : (k, 3) int64
        For each junction on each path: the set before, the set after, and the path.
    """
    most = len(paths) * (MAX_RUNS + 1)
    sets = np.zeros(2 * most + 1, dtype=np.int64)
    slots = np.empty(2 * most * _MAX_SLOTS, dtype=np.int64)
    changes = np.empty((most, 3), dtype=np.int64)
    before = np.full(len(first), -1, dtype=np.int64)  # the set of each junction
    with_one = np.full(len(nodes), -1, dtype=np.int64)  # that of its junction with one end more
    count, found = 0, 0
    for p in range(len(paths)):
        steps = 0
        while steps < MAX_RUNS and paths[p, steps] >= 0:
            steps += 1
        # The first and the last junction get one end more, those between two.
        for s in range(steps if inside[p] else steps + 1):
            node = nodes[paths[p, s]] if s < steps else nodes[other_end(paths[p, s - 1])]
            if before[node] < 0:
                size = min(first[node + 1] - first[node], _MAX_SLOTS - 2)
                slots[sets[found] : sets[found] + size] = members[first[node] : first[node] + size]
                sets[found + 1] = sets[found] + size
                before[node] = found
                found += 1
            only = other_end(paths[p, s - 1]) if s == steps else (paths[p, s] if s == 0 else -1)
            after = with_one[only] if only >= 0 else -1
            if after < 0:
                after, at = found, sets[found]
                for k in range(sets[before[node]], sets[before[node] + 1]):
                    slots[at] = slots[k]
                    at += 1
                if s > 0:
                    slots[at] = other_end(paths[p, s - 1])
                    at += 1
                if s < steps:
                    slots[at] = paths[p, s]
                    at += 1
                sets[found + 1] = at
                found += 1
                if only >= 0:
                    with_one[only] = after
            changes[count, 0], changes[count, 1], changes[count, 2] = before[node], after, p
            count += 1
    return sets[: found + 1].copy(), slots[: sets[found]].copy(), changes[:count].copy()


@kernel(
    read(int64, 2), read(boolean, 1), read(float64, 1), read(int64, 2), read(float64, 1), read(int64, 1)
)  # fmt: skip
def choose_paths(
    paths: Ints, inside: Bools, overlap_cost: Floats, changes: Ints, totals: Floats, nodes: Ints
) -> tuple[Ints, Ints, Floats]:
    """Take the paths that save cost, the highest gain first, as far as they do not touch each other's junctions.

    Parameters
    ----------
    paths, inside, overlap_cost
        As `list_paths` makes them.
    changes : (k, 3) int64
        As `changed_junctions` makes them.
    totals : (s,) float64
        Least cost of each of its sets of ends.
    nodes : (2 n,) int64

    Returns
    -------
    duplicates, partial : (c,) int64
        Branches to duplicate, and for each the end from which it is shared in part, or -1.
    gains : (c,) float64
        Gain in cost by the path of each.
    """
    gain_of = np.zeros(len(paths))
    for k in range(len(changes)):
        gain_of[changes[k, 2]] += totals[changes[k, 0]] - totals[changes[k, 1]]
    count = 0
    for node in nodes:
        count = max(count, node + 1)
    touched = np.zeros(count, dtype=np.bool_)
    duplicates = np.empty(len(paths) * MAX_RUNS, dtype=np.int64)
    partial = np.full(len(duplicates), -1, dtype=np.int64)
    gains = np.empty(len(duplicates))
    found = 0
    gain_of -= overlap_cost
    for p in falling_order(gain_of):  # stable: of equal gains, the first path
        if not gain_of[p] > 0.0:
            break
        steps, is_free = 0, True
        while steps < MAX_RUNS and paths[p, steps] >= 0:
            for end in (paths[p, steps], other_end(paths[p, steps])):
                is_free = is_free and (nodes[end] < 0 or not touched[nodes[end]])
            steps += 1
        if not is_free:
            continue
        for s in range(steps):
            for end in (paths[p, s], other_end(paths[p, s])):
                if nodes[end] >= 0:
                    touched[nodes[end]] = True
            duplicates[found], gains[found] = branch_of(paths[p, s]), gain_of[p]
            found += 1
        if inside[p]:
            partial[found - 1] = paths[p, steps - 1]
    return duplicates[:found].copy(), partial[:found].copy(), gains[:found].copy()
