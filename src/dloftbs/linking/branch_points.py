"""Branch points: where an end stays open at a junction, the cable that runs through is cut into branches."""

from __future__ import annotations

import math
from itertools import accumulate

import numpy as np

from dloftbs.data.graph import POSITION, TANGENT, Graph, branch_of, is_start, start_of, stop_of
from dloftbs.kernels.tracing import measure_radius
from dloftbs.linking.branch_weights import NODE
from dloftbs.linking.hidden_ends import free_ends
from dloftbs.linking.kernels.branch_places import branch_place
from dloftbs.linking.matched_ends import EndMatching
from dloftbs.support.arrays import ByteArray, FloatArray

_MIN_ENDS = 3
"""Least number of ends at a branch point.

Source: by definition.
"""

_OWN_WIDTHS = 4.0
"""Length of a branch along which a cable does not cross itself any more, widths.

Source: geometry; two that cross at a sixth of a right angle have as much in common.
"""

_BUNDLE = 1.4
"""Width of a branch over that of another from which no single cable is both, but one of them a bundle.

Source: geometry; two cables side by side, seen from between both sides and along both, are 1.4 wide.
"""

_AROUND_WIDTHS = 6.0
"""Length of a branch from a joint on that is looked at, widths.

Source: geometry; a branch that leaves along another one is clear of it after some four.
"""

_CENTRE_WIDTHS = 1.0
"""Distance from a junction's centre that counts as much as a ray that misses by `_RAY_WIDTHS`, widths.

Source: geometry; a branch that leaves at a small angle parts from the mask of another one to two widths further on.
"""

_RAY_WIDTHS = 0.1
"""Distance by which the axis of an end misses its branch point, widths.

Source: by hand; the noise of a skeleton's direction over the width of a junction.
"""


def shared_by_none(graph: Graph, matching: EndMatching) -> list[int]:
    """List the branches that two cables are said to share, where rather a bundle branches.

    One cable is said to run along it twice, and farther than across itself, or one that is wider on one side of it.
    """
    branches = matching.branches
    if not branches.duplicate_of:
        return []
    chain_of = {branch_of(end): k for k, (chain, _) in enumerate(matching.chains()) for end in chain}
    found = []
    for branch, twin in branches.duplicate_of.items():
        start, stop = branches.spans[branch]
        is_one = branch in chain_of and chain_of[branch] == chain_of.get(twin)
        is_long = stop - start > _OWN_WIDTHS * graph.width
        if (is_one and is_long) or _widens(matching, branch):
            found.append(branches.branch_id[branch])
    return sorted(set(found))


def _widens(matching: EndMatching, branch: int) -> bool:
    """Return whether the cable along a branch is wider on one side of it than on the other."""
    ends = [matching.partner[end] for end in (start_of(branch), stop_of(branch))]
    if min(ends) < 0:
        return False
    low, high = sorted([_radius(matching, end) for end in ends])
    return low > 0.0 and high > _BUNDLE * low


def find_branch_points(
    mask: ByteArray, graph: Graph, matching: EndMatching, least_px: float
) -> dict[int, tuple[FloatArray, float]]:
    """Make a branch point of each junction at which an end stays open beside two others, and cut what runs through.

    Parameters
    ----------
    mask : numpy.ndarray, shape (H, W), uint8
        In the orientation of the crop.
    graph : Graph
    matching : EndMatching
        Changed: the ends of branch points have no partner. A branch between two points that is too short to be an
        object joins them, unless a longer one leads from the one to the other, too.
    least_px : float
        Length below which a branch between two branch points is none.

    Returns
    -------
    dict of int to (numpy.ndarray, float)
        From each end at a branch point to its place, shape (2,), in the orientation of the crop, and its confidence.
    """
    branches = matching.branches
    found: list[list[int]] = []
    for node in sorted({node for node in branches.nodes if node >= 0}):
        ends = _members(matching, node)
        if len(ends) >= _MIN_ENDS:
            found.append(ends)
    found += _under_cover(graph, matching)
    for end in [end for ends in found for end in ends]:
        matching.open(end)
    places = {}
    for ends in _joined(matching, found, least_px):
        place = _place_by_outline(mask, graph, matching, ends)
        if place is None:
            place = _place(branches.end_states[ends])
        shortest = min([len(_points_of(graph, matching, end)) for end in ends])
        sure = confidence_of(math.log(max(shortest, 1) / graph.width))
        places.update(dict.fromkeys(ends, (place, sure)))
    return places


def confidence_of(shortest: float) -> float:
    """Return the probability that a branch point is one, and lies where it is said to.

    Parameters
    ----------
    shortest : float
        Logarithm of the length of its shortest branch, in widths.
    """
    none, per_shortest = NODE
    return 1.0 / (1.0 + math.exp(-(none + per_shortest * shortest)))


def _members(matching: EndMatching, node: int) -> list[int]:
    """List the ends that meet in a branch point at a junction: those that stay open, and those of what runs through."""
    branches, partner = matching.branches, matching.partner
    here = [end for end in matching.at_junction(node) if not branches.spurs[branch_of(end)]]
    loose = [end for end in here if matching.is_open(end) or branches.spurs[branch_of(partner[end])]]
    if not loose:
        return []
    through = [(end, partner[end]) for end in here if partner[end] in here and partner[end] > end]
    if through and len(loose) < _MIN_ENDS:
        through.sort(key=lambda pair: -sum(_radius(matching, end) for end in pair))
        loose += through[0]
    return loose


def _under_cover(graph: Graph, matching: EndMatching) -> list[list[int]]:
    """List the ends around each gap of a cable at which another one ends, too: what hides the one hides the joint."""
    branches, partner = matching.branches, matching.partner
    states = branches.end_states
    gaps = [i for i, j in enumerate(partner) if j > i and not matching.is_crossing(i)]
    if not gaps:
        return []
    free = free_ends(graph, matching)
    found = []
    for i in gaps if free else ():
        start, way = states[i, POSITION], states[partner[i], POSITION] - states[i, POSITION]
        length = float(np.hypot(*way))
        ends = [end for end in free if _points_into(states[end], start, way, length + graph.width, graph.width)]
        if ends:
            found.append([i, partner[i], *ends])
            free = [end for end in free if end not in ends]
    return found


def _points_into(state: FloatArray, start: FloatArray, way: FloatArray, reach: float, width: float) -> bool:
    """Return whether an end that is no farther from a gap than that is wide points into it, to half a width."""
    here, ahead = state[POSITION] - start, state[TANGENT]
    across = ahead[0] * way[1] - ahead[1] * way[0]
    if abs(across) < 1e-9:
        return False
    along = (here[1] * way[0] - here[0] * way[1]) / across
    share = (here[1] * ahead[0] - here[0] * ahead[1]) / across
    slack = 0.5 * width / max(float(np.hypot(*way)), 1e-9)
    return 0.0 < along <= reach and -slack <= share <= 1.0 + slack


def _radius(matching: EndMatching, end: int) -> float:
    """Return half the mean width of the branch of an end, px; 0 where all of it lies in junctions."""
    start, stop = matching.branches.spans[branch_of(end)]
    return float(np.add.reduce(matching.branches.radius[start:stop])) / (stop - start) if stop > start else 0.0


def _joined(matching: EndMatching, found: list[list[int]], least_px: float) -> list[list[int]]:
    """Return the ends of each branch point, where those with a short branch between them, and no long one, are one."""
    branches = matching.branches
    point_of = {end: k for k, ends in enumerate(found) for end in ends}
    points = [list(ends) for ends in found]
    long = [branch for branch, (start, stop) in enumerate(branches.spans) if stop - start >= least_px]
    for branch, (start, stop) in enumerate(branches.spans):
        a, b = point_of.get(2 * branch), point_of.get(2 * branch + 1)
        if a is None or b is None or stop - start >= least_px:
            continue
        if a != b and any({point_of.get(start_of(other)), point_of.get(stop_of(other))} == {a, b} for other in long):
            continue
        kept = [end for end in dict.fromkeys((*points[a], *points[b])) if branch_of(end) != branch]
        if len(kept) < _MIN_ENDS:
            continue
        branches.spurs[branch] = True
        points[a] = kept
        if a != b:
            points[b] = []
            point_of.update(dict.fromkeys(kept, a))
    return [ends for ends in points if ends]


def _place(states: FloatArray) -> FloatArray:
    """Return the place nearest to the axes of some ends, and not far from their middle."""
    middle = np.add.reduce(states[:, POSITION]) / len(states)
    across = states[:, TANGENT][:, ::-1] * (-1.0, 1.0)
    weight = (_RAY_WIDTHS / _CENTRE_WIDTHS) ** 2
    matrix = across.T @ across + weight * np.eye(2)
    vector = across.T @ (across * states[:, POSITION]).sum(axis=1) + weight * middle
    result: FloatArray = np.linalg.solve(matrix, vector)
    return result


def _place_by_outline(mask: ByteArray, graph: Graph, matching: EndMatching, ends: list[int]) -> FloatArray | None:
    """Return where one of three branches leaves the others, if the mask shows it; None of other numbers."""
    parts = [_inward_points(graph, matching, end) for end in ends]
    if len(ends) != _MIN_ENDS or min(map(len, parts)) < 2:  # a point has no direction
        return None
    points, offsets = np.concatenate(parts), np.array([0, *accumulate(map(len, parts))])
    radii = measure_radius(mask, points, offsets)
    is_shown, x, y = branch_place(mask, points, radii, offsets, graph.width)
    return np.array((x, y)) if is_shown else None


def _inward_points(graph: Graph, matching: EndMatching, end: int) -> FloatArray:
    """Return the points of a branch from an end at a junction on, (n, 2), no more than are looked at."""
    own = _points_of(graph, matching, end)
    return (own if is_start(end) else own[::-1])[: int(_AROUND_WIDTHS * graph.width)]


def _points_of(graph: Graph, matching: EndMatching, end: int) -> FloatArray:
    """Return all points of the branch of an end, (n, 2)."""
    branch = matching.branches.branch_id[branch_of(end)]
    return graph.points[graph.offsets[branch] : graph.offsets[branch + 1]]
