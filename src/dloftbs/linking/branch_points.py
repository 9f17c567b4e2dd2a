"""Branch points: where an end stays open at a junction, the cable that runs through is cut into branches."""

from __future__ import annotations

import numpy as np

from dloftbs.data.graph import POSITION, TANGENT, Graph, branch_of, is_start, other_end
from dloftbs.linking.matched_ends import EndMatching
from dloftbs.support.arrays import FloatArray

_MIN_ENDS = 3
"""Least number of ends at a branch point.

Source: by definition.
"""

_OWN_WIDTHS = 4.0
"""Length of a branch along which a cable does not cross itself any more, widths.

Source: geometry; two that cross at a sixth of a right angle have as much in common.
"""

_ASIDE = -0.5
"""Cosine of the angle between the branch that holds both and each of two that part, up to which they lead on.

Source: geometry; three equal angles between the branches at a junction.
"""

_WIDER = 1.06
"""Width of the mask where two branches begin to part, in widths of the branch that holds both.

Source: by hand; above the noise of an edge.
"""

_LEAST_REACH_WIDTHS = 0.75
"""Length of a wide stretch below which branches part at once, widths.

Source: geometry; a junction widens the mask for half a width.
"""

_MOST_REACH_WIDTHS = 3.0
"""Length of a wide stretch above which it is that of a bundle, widths.

Source: by hand; a branch parts from another one within two widths.
"""

_CENTRE_WIDTHS = 1.0
"""Distance from a junction's centre that counts as much as a ray that misses by `_RAY_WIDTHS`, widths.

Source: geometry; a branch that leaves at a small angle parts from the mask of another one to two widths further on.
"""

_RAY_WIDTHS = 0.1
"""Distance by which the axis of an end misses its branch point, widths.

Source: by hand; the noise of a skeleton's direction over the width of a junction.
"""


def shared_with_itself(graph: Graph, matching: EndMatching) -> list[int]:
    """List the branches that one cable is said to run along twice, and farther than across itself.

    Rather a bundle branches there, and the branch comes back to it.
    """
    branches = matching.branches
    if not branches.duplicate_of:
        return []
    chain_of = {branch_of(end): k for k, (chain, _) in enumerate(matching.chains()) for end in chain}
    found = []
    for branch, twin in branches.duplicate_of.items():
        start, stop = branches.spans[branch]
        is_one = branch in chain_of and chain_of[branch] == chain_of.get(twin)
        if branch < graph.branch_count and is_one and stop - start > _OWN_WIDTHS * graph.width:
            found.append(branch)
    return found


def find_branch_points(graph: Graph, matching: EndMatching, least_px: float) -> dict[int, tuple[FloatArray, float]]:
    """Make a branch point of each junction at which an end stays open beside two others, and cut what runs through.

    Parameters
    ----------
    graph : Graph
    matching : EndMatching
        Changed: the ends of branch points have no partner. A branch between two points that is too short to be an
        object joins them.
    least_px : float
        Length below which a branch is none.

    Returns
    -------
    dict of int to (numpy.ndarray, float)
        From each end at a branch point to its place, shape (2,), in the orientation of the crop, and its confidence.
    """
    branches = matching.branches
    found: list[list[int]] = []
    for node in sorted({node for node in branches.nodes if node >= 0}):
        ends = _members(graph, matching, node, least_px)
        if len(ends) >= _MIN_ENDS:
            found.append(ends)
    for end in [end for ends in found for end in ends]:
        matching.open(end)
    places = {}
    for ends in _joined(matching, found, least_px):
        merged = _start_of_merge(graph, matching, ends)
        place = _place(branches.end_states[ends], graph.width) if merged is None else merged
        places.update(dict.fromkeys(ends, (place, 1.0)))
    return places


def _members(graph: Graph, matching: EndMatching, node: int, least_px: float) -> list[int]:
    """List the ends that meet in a branch point at a junction: those that stay open, and those of what runs through."""
    branches, partner = matching.branches, matching.partner
    here = [end for end in matching.at_junction(node) if not branches.spurs[branch_of(end)]]
    loose = [end for end in here if matching.is_open(end)]
    for end in list(loose):
        if _is_stub(graph, matching, end, least_px):
            loose.remove(end)
            branches.spurs[branch_of(end)] = True
    if not loose:
        return []
    through = [(end, partner[end]) for end in here if partner[end] > end and matching.is_crossing(end)]
    if through and len(loose) < _MIN_ENDS:
        through.sort(key=lambda pair: -sum(_radius(matching, end) for end in pair))
        loose += through[0]
    return loose


def _is_stub(graph: Graph, matching: EndMatching, end: int, least_px: float) -> bool:
    """Return whether a branch with one end at a junction is too short to be an object."""
    branches, branch = matching.branches, branch_of(end)
    if branch >= graph.branch_count or branches.nodes[other_end(end)] >= 0 or not matching.is_open(other_end(end)):
        return False
    return bool(graph.offsets[branch + 1] - graph.offsets[branch] < least_px)


def _radius(matching: EndMatching, end: int) -> float:
    start, stop = matching.branches.spans[branch_of(end)]
    return float(np.median(matching.branches.radius[start:stop])) if stop > start else 0.0


def _joined(matching: EndMatching, found: list[list[int]], least_px: float) -> list[list[int]]:
    """Return the ends of each branch point, where those with too short a branch between them are one."""
    branches = matching.branches
    point_of = {end: k for k, ends in enumerate(found) for end in ends}
    points = [list(ends) for ends in found]
    for branch, (start, stop) in enumerate(branches.spans):
        a, b = point_of.get(2 * branch), point_of.get(2 * branch + 1)
        if a is None or b is None or stop - start >= least_px:
            continue
        branches.spurs[branch] = True
        kept = [end for end in dict.fromkeys((*points[a], *points[b])) if branch_of(end) != branch]
        points[a] = kept
        if a != b:
            points[b] = []
            point_of.update(dict.fromkeys(kept, a))
    return [ends for ends in points if ends]


def _place(states: FloatArray, width: float) -> FloatArray:
    """Return the place nearest to the axes of some ends, and not far from their middle."""
    middle = states[:, POSITION].mean(axis=0)
    across = np.stack((-states[:, TANGENT][:, 1], states[:, TANGENT][:, 0]), axis=1)
    weight = (_RAY_WIDTHS / _CENTRE_WIDTHS) ** 2
    matrix = np.einsum("ni,nj->ij", across, across) + weight * np.eye(2)
    vector = across.T @ np.einsum("ni,ni->n", across, states[:, POSITION]) + weight * middle
    result: FloatArray = np.linalg.solve(matrix, vector)
    return result


def _start_of_merge(graph: Graph, matching: EndMatching, ends: list[int]) -> FloatArray | None:
    """Return where two branches begin to part that lead on side by side; None where they part at once.

    There the mask begins to be wider than the branch that holds both.
    """
    branches = matching.branches
    if len(ends) != _MIN_ENDS:
        return None
    tangents = branches.end_states[ends][:, TANGENT]
    cosines = tangents @ tangents.T
    for k, end in enumerate(ends):
        branch = branch_of(end)
        if max(cosines[k, j] for j in range(len(ends)) if j != k) > _ASIDE or branch >= graph.branch_count:
            continue
        start, stop = graph.offsets[branch], graph.offsets[branch + 1]
        own = np.arange(start, stop) if is_start(end) else np.arange(stop - 1, start - 1, -1)
        radius = graph.radius[own]
        far = radius[len(own) // 2 :]
        wide = np.flatnonzero(radius < _WIDER * np.median(far))
        reach = int(wide[0]) if len(wide) else 0
        if _LEAST_REACH_WIDTHS * graph.width < reach <= _MOST_REACH_WIDTHS * graph.width and reach < len(own) // 2:
            result: FloatArray = graph.points[own[reach]].copy()
            return result
    return None
