"""Sharp bends: points at which a branch is cut."""

from __future__ import annotations

import numpy as np
from numba import boolean, float64, int64

from dloftbs.kernels.compiler import Bools, Floats, Ints, helper, kernel, read
from dloftbs.kernels.shared.copying import copy_to
from dloftbs.kernels.shared.graph_ends import FREE, branch_of, inward, is_start, start_of, stop_of

_CHORD_WIDTHS = 1.5
"""Length of the chords before and behind a point that show its turn, widths.

Source: by hand; together three widths, more than a mitre's rounding.
"""

_FACING = 0.8
"""Cosine of the angle to a point within which an end points there.

Source: by hand; 37 degrees, as a cover at a slant turns an end.
"""

_FACING_WIDTHS = 8.0
"""Largest distance of such an end, widths.

Source: by hand; what covers a crossing is as large, and farther ends of cables are rarely joined.
"""


@helper
def _list_free_ends(points: Floats, offsets: Ints, nodes: Ints, alive: Bools, reach: int) -> tuple[Ints, Floats]:
    """List the free ends of branches, and position and outward direction (unit) of each."""
    ends = np.empty(2 * len(alive), dtype=np.int64)
    rays = np.empty((2 * len(alive), 4))
    count = 0
    for end in range(2 * len(alive)):
        branch = branch_of(end)
        n = offsets[branch + 1] - offsets[branch]
        if nodes[end] != FREE or not alive[branch] or n < 2:
            continue
        tip = offsets[branch] if is_start(end) else offsets[branch + 1] - 1
        back = tip + inward(end) * min(reach, n - 1)
        dx, dy = points[tip, 0] - points[back, 0], points[tip, 1] - points[back, 1]
        norm = max(np.sqrt(dx * dx + dy * dy), 1e-9)
        ends[count] = end
        rays[count, 0], rays[count, 1], rays[count, 2], rays[count, 3] = (
            points[tip, 0],
            points[tip, 1],
            dx / norm,
            dy / norm,
        )
        count += 1
    return ends[:count], rays[:count]


@helper
def _is_faced(x: float, y: float, branch: int, ends: Ints, rays: Floats, most: float) -> bool:
    """Return whether a free end of another branch lies near a point and points at it."""
    for k in range(len(ends)):
        dx, dy = x - rays[k, 0], y - rays[k, 1]
        far = np.sqrt(dx * dx + dy * dy)
        if branch_of(ends[k]) != branch and far <= most and dx * rays[k, 2] + dy * rays[k, 3] >= _FACING * far:
            return True
    return False


@helper
def _is_largest(turns: Floats, at: int, reach: int) -> bool:
    """Return whether no turn within reach is larger; of equal ones the first counts."""
    for i in range(at - reach, at + reach + 1):
        if turns[i] > turns[at] or (turns[i] == turns[at] and i < at):
            return False
    return True


@kernel(read(float64, 2), read(int64, 1), read(int64, 1), read(boolean, 1), float64, float64, float64)
def find_kinks(
    points: Floats, offsets: Ints, nodes: Ints, alive: Bools, width: float, sharp: float, mild: float
) -> Ints:
    """Find points at which two cables may meet at an angle.

    There a branch turns more sharply than a cable can; or clearly, and another cable's end lies near and points there:
    what covers a part of a crossing leaves that. Of the points within a chord's length the one that turns most counts.

    Parameters
    ----------
    points : (m, 2) float64
    offsets : (branches + 1,) int64
    nodes : (2 n,) int64
    alive : (n,) bool
        Of branches that are no loops.
    width : float
        px; a point's turn is that between the chords over one and a half widths before and after it.
    sharp, mild : float
        The smallest turn, by itself and before the end of another branch, rad.

    Returns
    -------
    (k,) int64
        Indices into `points`, ascending.
    """
    reach = max(int(_CHORD_WIDTHS * width + 0.5), 3)
    blunt = np.cos(mild) ** 2
    ends, rays = _list_free_ends(points, offsets, nodes, alive, reach)
    turns = np.zeros(len(points))
    found = np.empty(len(points), dtype=np.int64)
    count = 0
    for branch in range(len(alive)):
        start, stop = offsets[branch] + reach, offsets[branch + 1] - reach
        for i in range(start, stop):
            ax, ay = points[i, 0] - points[i - reach, 0], points[i, 1] - points[i - reach, 1]
            bx, by = points[i + reach, 0] - points[i, 0], points[i + reach, 1] - points[i, 1]
            along = ax * bx + ay * by
            if along > 0.0 and along * along > blunt * (ax * ax + ay * ay) * (bx * bx + by * by):
                continue
            turn = abs(np.arctan2(ax * by - ay * bx, along))
            if turn > sharp or _is_faced(points[i, 0], points[i, 1], branch, ends, rays, _FACING_WIDTHS * width):
                turns[i] = turn
        for i in range(start, stop):
            if turns[i] > 0.0 and _is_largest(turns, i, reach):
                found[count] = i
                count += 1
    return found[:count].copy()


@kernel(read(int64, 1), read(int64, 1), read(int64, 1), read(boolean, 1), int64)
def split_branches(cuts: Ints, offsets: Ints, nodes: Ints, alive: Bools, count: int) -> tuple[Ints, Ints, Bools]:
    """Cut branches in two, with a new junction of two ends at each cut.

    Parameters
    ----------
    cuts : (k,) int64
        Indices of points, ascending: where the second part starts. Those in branches that are not alive are left out.
    offsets : (branches + 1,) int64
    nodes : (2 n_open,) int64
    alive : (n_open,) bool
    count : int
        Number of junctions; cut ``i`` becomes junction ``count + i``.

    Returns
    -------
    offsets, nodes, alive
        With the parts in the place of each branch.
    """
    n_open = len(alive)
    room = len(cuts)
    new_offsets = np.empty(len(offsets) + room, dtype=np.int64)
    new_nodes = np.empty(len(nodes) + 2 * room, dtype=np.int64)
    new_alive = np.empty(n_open + room, dtype=np.bool_)
    n, k = 0, 0
    for branch in range(n_open):
        new_offsets[n] = offsets[branch]
        new_nodes[start_of(n)] = nodes[start_of(branch)]
        new_alive[n] = alive[branch]
        while k < len(cuts) and cuts[k] < offsets[branch + 1]:
            if alive[branch]:
                new_nodes[stop_of(n)] = count + k
                n += 1
                new_offsets[n] = cuts[k]
                new_nodes[start_of(n)] = count + k
                new_alive[n] = True
            k += 1
        new_nodes[stop_of(n)] = nodes[stop_of(branch)]
        n += 1
    loops = len(offsets) - n_open
    copy_to(new_offsets[n:], offsets[n_open:])
    return new_offsets[: n + loops].copy(), new_nodes[: 2 * n].copy(), new_alive[:n].copy()
