"""The true partner of each branch end: what follows it on its cable."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from benchmarks.fit_linking.scenes import Points, Scene
from dloftbs.data.graph import POSITION, TANGENT, Graph, branch_of, is_start
from dloftbs.data.mask_crop import MaskCrop

OPEN, UNKNOWN = -1, -2

BEFORE_WIDTHS = 4.0  # of a branch before its end, compared with the true curves
_OFF_WIDTHS, _OFF_PX = 0.35, 2.0  # of the mean distance from the true curve, the larger of both
_ALONG = 0.7  # cosine of the angle to the true curve, at least
_BACK_WIDTHS = 1.0  # by which the next end may lie behind on its curve
_STRAND_WIDTHS = 5.0  # strands of frayed ends reach no farther beyond the tip of a true curve
_PURE = 0.9  # share of a branch that has one label

Ints = npt.NDArray[np.int64]


def true_partners(scene: Scene, crop: MaskCrop, graph: Graph) -> Ints:
    """Return the true partner of each end of a graph, `OPEN` or `UNKNOWN`, shape (2 n,)."""
    partner = _by_curves(scene, crop, graph) if scene.labels is None else _by_labels(scene.labels, crop, graph)
    partner[graph.spurs.repeat(2) | (graph.corners >= 0)] = UNKNOWN
    return partner


def _by_curves(scene: Scene, crop: MaskCrop, graph: Graph) -> Ints:
    trees = [(curve, cKDTree(curve)) for curve in scene.curves]
    points, width = crop.to_image(graph.points), graph.width
    places = crop.to_image(graph.end_states[:, POSITION])
    directions = crop.to_image(graph.end_states[:, POSITION] + graph.end_states[:, TANGENT]) - places
    off = max(_OFF_WIDTHS * width, _OFF_PX) + scene.off_px
    partner = np.full(len(places), UNKNOWN)
    on: dict[int, list[tuple[float, int, int]]] = {}
    strands: list[int] = []
    for end in range(len(places)):
        start, stop = graph.spans[branch_of(end)]
        if stop - start < 2:
            continue
        near = next_to(points[start:stop], is_start(end), BEFORE_WIDTHS * width)
        passing = [k for k, (_, tree) in enumerate(trees) if _passes(tree, near, off)]
        if len(passing) == 1:
            curve, tree = trees[passing[0]]
            at = int(tree.query(places[end])[1])
            tangent = curve[min(at + 1, len(curve) - 1)] - curve[max(at - 1, 0)]
            along = float(tangent @ directions[end]) / max(float(np.hypot(*tangent)), 1e-9)
            if abs(along) > _ALONG or not directions[end].any():
                on.setdefault(passing[0], []).append((float(at), end, 1 if along > 0.0 else -1))
        elif not passing and _is_strand(trees, points[start:stop], _STRAND_WIDTHS * width):
            partner[end] = OPEN
            strands.append(end)
    for ends in on.values():
        for here, end, way in ends:
            ahead = [
                (way * (place - here), other)
                for place, other, its_way in ends
                if its_way == -way
                and branch_of(other) != branch_of(end)
                and way * (place - here) > -_BACK_WIDTHS * width
            ]
            partner[end] = min(ahead)[1] if ahead else OPEN
    _lead_into_strands(graph, partner, strands)
    mutual = (partner < 0) | (partner[np.maximum(partner, 0)] == np.arange(len(partner)))
    return np.where(mutual, partner, UNKNOWN)


def next_to(points: npt.NDArray[Any], at_start: bool, reach: float) -> npt.NDArray[Any]:
    """Return the points of a branch within a reach of one of its ends."""
    ordered = points if at_start else points[::-1]
    return ordered[: max(int(reach), 2)]


def _passes(tree: cKDTree, near: Points, off: float) -> bool:
    distances = tree.query(near)[0]
    return bool(distances.mean() < off and distances.max() < 2.0 * off)


def _is_strand(trees: list[tuple[Points, cKDTree]], points: Points, reach: float) -> bool:
    """Tell whether most points of a branch are nearest to the tip of a true curve: nothing but its wires is there."""
    asked = [(*tree.query(points), len(curve) - 1) for curve, tree in trees]
    off, nearest, last = min(asked, key=lambda found: float(found[0].max()))
    return bool(((nearest == 0) | (nearest == last)).mean() > 0.5 and off.max() < reach)


def _lead_into_strands(graph: Graph, partner: Ints, strands: list[int]) -> None:
    """Let a cable that ends at a junction go on in the straightest of its strands."""
    for node in {int(graph.nodes[end]) for end in strands if graph.nodes[end] >= 0}:
        own = [end for end in strands if graph.nodes[end] == node]
        (ending,) = np.nonzero((graph.nodes == node) & (partner == OPEN) & ~np.isin(np.arange(len(partner)), strands))
        if len(ending) == 1:
            tangents = graph.end_states[:, TANGENT]
            straightest = min(own, key=lambda end: float(tangents[end] @ tangents[ending[0]]))
            partner[straightest], partner[ending[0]] = ending[0], straightest


def _by_labels(labels: npt.NDArray[np.uint8], crop: MaskCrop, graph: Graph) -> Ints:
    """Pair the ends at junctions where each label has two; others are unknown."""
    points, partner = crop.to_image(graph.points), np.full(2 * graph.branch_count, UNKNOWN)
    own = np.zeros(len(partner), np.int64)
    for end in range(len(partner)):
        start, stop = graph.spans[branch_of(end)]
        if stop - start >= 2:
            near = np.rint(next_to(points[start:stop], is_start(end), BEFORE_WIDTHS * graph.width)).astype(int)
            values, counts = np.unique(labels[near[:, 1], near[:, 0]], return_counts=True)
            own[end] = values[counts.argmax()] if counts.max() >= _PURE * len(near) else 0
    for node in range(int(graph.nodes.max(initial=-1)) + 1):
        ends = np.flatnonzero(graph.nodes == node)
        values, counts = np.unique(own[ends], return_counts=True)
        if len(values) > 1 and values[0] > 0 and (counts == 2).all():
            for value in values:
                one, other = ends[own[ends] == value]
                partner[one], partner[other] = other, one
    return partner
