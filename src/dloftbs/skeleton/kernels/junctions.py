"""Junctions of a skeleton: clusters of branch points, the branches that meet there, and spurs among them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import boolean, float64, int32, int64, uint8

from dloftbs.kernels.compiler import Bools, Bytes, Floats, Ints, helper, inlined, kernel, read, write
from dloftbs.kernels.shared.graph_ends import FREE, UNAVAILABLE, branch_of, is_start, start_of, stop_of
from dloftbs.kernels.shared.union_find import find_root, unite

_RAYS = tuple((float(np.cos(angle)), float(np.sin(angle))) for angle in np.arange(16) * (np.pi / 8.0))
"""Directions along which the nearest edge is sought, unit vectors.

Source: geometry; at 16 rays the distance to a straight edge is 2 % too long at most.
"""

_BRANCH, _LABELLED = 2, 3
"""Codes that mark branch points in the grid while a kernel runs: those without a junction yet, and with one.

Source: by definition.
"""

_STRAND_RADIUS = 0.45
"""Radius of a branch, over that of the cable at whose end it is, below which it is a strand of a frayed end.

Source: geometry; two strands that part are half as wide as the cable.
"""

_BESIDE_WIDTHS = 3.0
"""Distance from a junction at which the width of a cable is taken, in that width.

Source: geometry; nearer, a blob over the junction is measured.
"""

_STRAND_AWAY = 0.75
"""Place at which the width of a branch that may be a strand is taken, as a share of its length from the junction.

Source: by hand; nearer, it is within the cable's end.
"""


@inlined
def _index_of(pixels_rc: npt.NDArray[np.int32], row: int, column: int) -> int:
    """Return where a pixel stands in an ascending list that holds it."""
    low, high = 0, len(pixels_rc) - 1
    while low < high:
        middle = (low + high) // 2
        r, c = pixels_rc[middle, 0], pixels_rc[middle, 1]
        if r < row or (r == row and c < column):
            low = middle + 1
        else:
            high = middle
    return low


@helper
def _inscribed_radius(mask: Bytes, x: float, y: float) -> float:
    """Return how far the nearest edge of the mask is, looked for along 16 rays, to half a pixel; 0 outside of it."""
    t = 0.0
    for _ in range(2 * len(mask)):  # the margin around the mask ends it before
        for dx, dy in _RAYS:
            row, column = int(y + t * dy + 0.5), int(x + t * dx + 0.5)  # unsigned indices spare a test for the sign
            if mask[np.uint64(row), np.uint64(column)] == 0:
                return max(t - 0.25, 0.0)
        t += 0.5
    return t


@kernel(write(uint8, 2), read(int32, 2), read(uint8, 1), read(float64, 2), read(int64, 1), int64, read(uint8, 2))
def find_junctions(
    grid: Bytes,
    pixels_rc: npt.NDArray[np.int32],
    degrees: Bytes,
    points: Floats,
    offsets: Ints,
    n_open: int,
    mask: Bytes,
) -> tuple[Ints, Floats, Floats]:
    """Collapse adjacent branch points into junctions, and find the junction that each branch end touches.

    Not checked: the outermost rows and columns of `grid` and `mask` are 0, and the list is complete.

    Parameters
    ----------
    grid : (H, W) uint8
        The skeleton, 0 and 1; 0 and 1 again afterwards.
    pixels_rc : (n, 2) int32
        Its foreground, ascending.
    degrees : (n,) uint8
        The number of neighbours of each.
    points : (m, 2) float64
        ``(x, y)`` of the branches between branch points, as `tracing.trace` makes them.
    offsets : (branches + 1,) int64
    n_open : int
        Number of branches with ends; they come first.
    mask : (H, W) uint8
        Mask that the skeleton is of.

    Returns
    -------
    nodes : (2 n_open,) int64
        The junction at the start and at the end of each branch, or `FREE`.
    centres : (k, 2) float64
        ``(x, y)``, the mean of each junction's branch points.
    radii : (k,) float64
        Reach of the mask around each centre, px.
    """
    n = len(pixels_rc)
    size = 0
    for i in range(n):
        size += degrees[i] > 2
    branch_points = np.empty((size, 2), dtype=np.int32)
    size = 0
    for i in range(n):
        if degrees[i] > 2:
            branch_points[size, 0], branch_points[size, 1] = pixels_rc[i, 0], pixels_rc[i, 1]
            grid[pixels_rc[i, 0], pixels_rc[i, 1]] = _BRANCH
            size += 1
    label = np.empty(size, dtype=np.int64)
    stack = np.empty(size, dtype=np.int64)
    centres = np.empty((size, 2), dtype=np.float64)
    count = 0
    for first in range(size):
        if grid[branch_points[first, 0], branch_points[first, 1]] == _LABELLED:
            continue
        grid[branch_points[first, 0], branch_points[first, 1]] = _LABELLED
        stack[0] = first
        height, found = 1, 0
        sum_x, sum_y = 0.0, 0.0
        while height > 0:
            height -= 1
            label[stack[height]] = count
            row, column = branch_points[stack[height], 0], branch_points[stack[height], 1]
            found += 1
            sum_x += column
            sum_y += row
            for r in range(row - 1, row + 2):
                for c in range(column - 1, column + 2):
                    if grid[r, c] == _BRANCH:
                        grid[r, c] = _LABELLED
                        stack[height] = _index_of(branch_points, r, c)
                        height += 1
        centres[count, 0], centres[count, 1] = sum_x / found, sum_y / found
        count += 1

    nodes = np.full(2 * n_open, FREE, dtype=np.int64)
    for end in range(2 * n_open):
        branch = branch_of(end)
        i = offsets[branch] if is_start(end) else offsets[branch + 1] - 1
        row, column = int(points[i, 1]), int(points[i, 0])
        for r in range(row - 1, row + 2):
            for c in range(column - 1, column + 2):
                if grid[r, c] == _LABELLED and nodes[end] == FREE:
                    node = label[_index_of(branch_points, r, c)]
                    # A branch of one pixel has its two junctions in order.
                    if is_start(end) or offsets[branch + 1] - offsets[branch] > 1 or node != nodes[end - 1]:
                        nodes[end] = node
    radii = np.empty(count, dtype=np.float64)
    for node in range(count):
        radii[node] = _inscribed_radius(mask, centres[node, 0], centres[node, 1])
    for i in range(size):
        grid[branch_points[i, 0], branch_points[i, 1]] = 1
    return nodes, centres[:count].copy(), radii


@helper
def _width_beside(end: int, points: Floats, radius: Floats, offsets: Ints, mask: Bytes) -> float:
    """Return half the width of a branch beside the junction at one of its ends, px; 0 where it is too short."""
    start, stop = offsets[branch_of(end)], offsets[branch_of(end) + 1]
    k = 0
    while k < stop - start:
        i = start + k if is_start(end) else stop - 1 - k
        beside = radius[i]
        if k > _BESIDE_WIDTHS * 2.0 * beside:
            beside = max(beside, _inscribed_radius(mask, points[i, 0], points[i, 1]))
            if k > _BESIDE_WIDTHS * 2.0 * beside:
                return beside
        k = max(k, int(_BESIDE_WIDTHS * 2.0 * beside)) + 1
    return 0.0


@helper
def _group_cable_ends(nodes: Ints, widest: Floats, offsets: Ints) -> Ints:
    """Group junctions that may be at the end of one cable: branches no longer than its width join them.

    Returned is the lowest junction of the group of each; `widest`, half the width of the widest cable at each junction,
    becomes that at any of the group's.
    """
    group = np.arange(len(widest))
    is_new = True
    while is_new:
        is_new = False
        for branch in range(len(nodes) // 2):
            if nodes[start_of(branch)] < 0 or nodes[stop_of(branch)] < 0:
                continue
            first, second = find_root(group, nodes[start_of(branch)]), find_root(group, nodes[stop_of(branch)])
            both = max(widest[first], widest[second])
            if first != second and offsets[branch + 1] - offsets[branch] <= 2.0 * both:
                unite(group, first, second)
                widest[min(first, second)] = both
                is_new = True
    for node in range(len(widest)):
        group[node] = find_root(group, node)
        widest[node] = widest[group[node]]
    return group


@helper
def _strand_bonus(nodes: Ints, count: int, points: Floats, radius: Floats, offsets: Ints, mask: Bytes) -> Floats:
    """Return the additional length by which each branch may stick out and still be a spur, px.

    For a strand, it is the width of the cable at whose end it is, the only wide one there; for others 0. Strands may
    part at several junctions near each other.
    """
    n = len(nodes) // 2
    beside = np.zeros(2 * n)
    widest = np.zeros(count)
    for end in range(2 * n):
        if nodes[end] >= 0:
            beside[end] = _width_beside(end, points, radius, offsets, mask)
            widest[nodes[end]] = max(widest[nodes[end]], beside[end])
    group = _group_cable_ends(nodes, widest, offsets)
    wide = np.zeros(count, dtype=np.int64)
    bonus = np.zeros(n)
    for end in range(2 * n):
        if nodes[end] >= 0:
            branch, cable = branch_of(end), widest[nodes[end]]
            length = offsets[branch + 1] - offsets[branch]
            away = int(_STRAND_AWAY * length)
            i = offsets[branch] + away if is_start(end) else offsets[branch + 1] - 1 - away
            own = max(beside[end], _inscribed_radius(mask, points[i, 0], points[i, 1]))
            if own < _STRAND_RADIUS * cable:
                bonus[branch] = 2.0 * cable
            elif length > 2.0 * cable:  # a shorter one is in a blob
                wide[group[nodes[end]]] += 1
    for branch in range(n):
        node = max(nodes[start_of(branch)], nodes[stop_of(branch)])
        if node < 0 or wide[group[node]] != 1:
            bonus[branch] = 0.0
    return bonus


@helper
def _sticks_out(
    branch: int, nodes: Ints, centres: Floats, radii: Floats, points: Floats, offsets: Ints, mask: Bytes
) -> float:
    """Return how far a branch with one free end sticks out of its junction, px; infinity for other branches."""
    start, stop = nodes[start_of(branch)], nodes[stop_of(branch)]
    if (start >= 0) == (stop >= 0):
        return np.inf
    node = max(start, stop)
    tip = offsets[branch] if start < 0 else offsets[branch + 1] - 1
    x, y = points[tip, 0], points[tip, 1]
    away = np.sqrt((x - centres[node, 0]) ** 2 + (y - centres[node, 1]) ** 2)
    return away + _inscribed_radius(mask, x, y) - radii[node]


@kernel(
    write(int64, 1), read(float64, 2), read(float64, 1), read(float64, 2), read(float64, 1), read(int64, 1),
    read(uint8, 2), float64,
)  # fmt: skip
def prune_spurs(
    nodes: Ints,
    centres: Floats,
    radii: Floats,
    points: Floats,
    radius: Floats,
    offsets: Ints,
    mask: Bytes,
    least: float,
) -> Bools:
    """Find the branches that are spurs: they end freely, and stick out of their junction by little.

    A branch sticks out by the distance that the mask reaches beyond the junction with its tip. A strand of a frayed
    end, much thinner than the cable, may stick out by as much more as that is wide. The shortest goes first, and a
    junction keeps one branch; where only one is left, its end is free from then on and may be the tip of a spur itself.

    Parameters
    ----------
    nodes : (2 n,) int64
        As `find_junctions` makes them; a junction that is down to one branch becomes `FREE`.
    centres, radii : (k, 2), (k,) float64
    points : (m, 2) float64
    radius : (m,) float64
        Half the mask's width at each.
    offsets : (n + 1,) int64
        Of the branches with ends, and more.
    mask : (H, W) uint8
    least : float
        Least length by which a branch sticks out, px; shorter ones are spurs.

    Returns
    -------
    (n,) bool
        Branches that stay.
    """
    n = len(nodes) // 2
    alive = np.ones(n, dtype=np.bool_)
    degree = np.zeros(len(radii), dtype=np.int64)
    for node in nodes:
        if node >= 0:
            degree[node] += 1
    bonus = _strand_bonus(nodes, len(radii), points, radius, offsets, mask)
    out = np.full(n, np.inf)
    for branch in range(n):
        out[branch] = _sticks_out(branch, nodes, centres, radii, points, offsets, mask) - bonus[branch]
    while n > 0:
        branch = int(np.argmin(out))
        if not out[branch] < least:  # what is struck off is infinite, and comes back once at most
            break
        out[branch] = np.inf
        node = max(nodes[start_of(branch)], nodes[stop_of(branch)])
        if degree[node] == 1:
            continue
        alive[branch] = False
        degree[node] -= 1
        if degree[node] == 1:
            for end in range(2 * n):
                if nodes[end] == node and alive[branch_of(end)]:
                    nodes[end] = FREE
                    other = branch_of(end)
                    away = _sticks_out(other, nodes, centres, radii, points, offsets, mask)
                    out[other] = away - bonus[other]
    return alive


@kernel(read(int64, 1), read(float64, 2), read(int64, 1), read(float64, 2), read(float64, 1), int64, int64, float64)
def find_bordering(
    nodes: Ints,
    points: Floats,
    offsets: Ints,
    matrix: Floats,
    offset: Floats,
    image_height: int,
    image_width: int,
    reach: float,
) -> Bools:
    """Find the free ends that the image's border cuts.

    Parameters
    ----------
    nodes : (2 n,) int64
    points : (m, 2) float64
    offsets : (n + 1,) int64
        And more.
    matrix, offset : (2, 2) and (2,) float64
        Turn a point into the image's.
    image_height, image_width : int
    reach : float
        Skeletons end so near to a border that cuts them, px.

    Returns
    -------
    (2 n,) bool
    """
    bordering = np.zeros(len(nodes), dtype=np.bool_)
    for end in range(len(nodes)):
        if nodes[end] == FREE:
            i = offsets[branch_of(end)] if is_start(end) else offsets[branch_of(end) + 1] - 1
            x = points[i, 0] * matrix[0, 0] + points[i, 1] * matrix[0, 1] + offset[0]
            y = points[i, 0] * matrix[1, 0] + points[i, 1] * matrix[1, 1] + offset[1]
            bordering[end] = min(x, y, image_width - 1.0 - x, image_height - 1.0 - y) <= reach
    return bordering


@kernel(write(boolean, 1), read(int64, 1), read(int64, 1), read(float64, 1), float64)
def drop_specks(alive: Bools, nodes: Ints, offsets: Ints, radius: Floats, least: float) -> None:
    """Drop the branches that touch no junction and cover less than an area of the mask.

    Parameters
    ----------
    alive : (n,) bool
        Changed.
    nodes : (2 n,) int64
    offsets : (n + 1,) int64
        And more.
    radius : (m,) float64
    least : float
        px^2.
    """
    for branch in range(len(alive)):
        alone = nodes[start_of(branch)] == FREE and nodes[stop_of(branch)] == FREE
        if alone and 2.0 * radius[offsets[branch] : offsets[branch + 1]].sum() < least:
            alive[branch] = False


@inlined
def _is_inner(branch: int, nodes: Ints, clear: Ints, alive: Bools, least: float) -> bool:
    """Return whether a branch between two junctions is too short to have a direction of its own."""
    return alive[branch] and nodes[start_of(branch)] >= 0 and nodes[stop_of(branch)] >= 0 and clear[branch] < least


@kernel(read(int64, 1), read(int64, 2), read(boolean, 1), read(boolean, 1), int64, float64)
def assign_junctions(nodes: Ints, spans: Ints, alive: Bools, spurs: Bools, count: int, least: float) -> Ints:
    """Assign a junction to each end of each branch, with near junctions merged.

    Those are merged that are joined by a branch too short to have a direction of its own.

    Parameters
    ----------
    nodes : (2 n,) int64
    spans : (n, 2) int64
        The points of each branch that lie clear of its junctions.
    alive, spurs : (n,) bool
        Runs that are neither are left out.
    count : int
        Number of junctions.
    least : float
        A branch with fewer clear points than this merges its junctions.

    Returns
    -------
    (2 n,) int64
        The junction, by the lowest of those that are merged; `FREE`; or `UNAVAILABLE`: the ends of branches inside a
        junction and of those that are left out, and the free end of a spur.
    """
    clear = spans[:, 1] - spans[:, 0]
    group = np.arange(count)
    for branch in range(len(clear)):
        if _is_inner(branch, nodes, clear, alive, least):
            unite(group, nodes[start_of(branch)], nodes[stop_of(branch)])
    assigned = np.empty_like(nodes)
    for end in range(len(nodes)):
        branch, node = branch_of(end), nodes[end]
        left_out = not (alive[branch] or spurs[branch]) or (spurs[branch] and node == FREE)
        if left_out or _is_inner(branch, nodes, clear, alive, least):
            assigned[end] = UNAVAILABLE
        else:
            assigned[end] = find_root(group, node) if node >= 0 else node
    return assigned
