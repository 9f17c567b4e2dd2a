"""As published: segments to centre lines, by greedy linking (paper: filter and order)."""

from __future__ import annotations

import math

import numpy as np

from dloftbs.config import GreedyLinkingConfig
from dloftbs.data.centerline import Centerline, Joint, JointKind, Segment
from dloftbs.data.mask_crop import MaskCrop
from dloftbs.kernels.polyline_lengths import arc_parameter
from dloftbs.kernels.tracing import are_covered
from dloftbs.pipeline.published.kernels import greedy_linking as kernels
from dloftbs.support.arrays import FloatArray, frozen

_Links = dict[int, tuple[int, JointKind, float, float]]  # from an end to its partner, the kind, cost and margin


def link_segments(crop: MaskCrop, segments: list[Segment], config: GreedyLinkingConfig) -> list[Centerline]:
    """Join segments end to end, cheapest pair first, while ``J < J_th``; what stays unconnected is another object.

    Parameters
    ----------
    crop : MaskCrop
        Its mask shows whether a joint runs over foreground.
    segments : list of Segment
        Open ones, in the order of the crop, so that of equal costs the same one wins in every orientation.
    config : GreedyLinkingConfig

    Returns
    -------
    list of Centerline
        By their first segment.
    """
    if not segments:
        return []
    ends, directions = _ends(segments, config.direction_px)
    most = math.inf if config.max_cost is None else config.max_cost
    pairs, costs, margins = kernels.link_greedily(ends, directions, config.distance_weight, most)
    oriented = crop.to_oriented(ends)
    covered = are_covered(crop.oriented(crop.pixels), oriented[pairs[:, 0]], oriented[pairs[:, 1]])
    links: _Links = {}
    for (i, j), seen, cost, margin in zip(
        pairs.tolist(), covered.tolist(), costs.tolist(), margins.tolist(), strict=True
    ):
        kind = JointKind.CROSSING if seen else JointKind.GAP
        links[i], links[j] = (j, kind, cost, margin), (i, kind, cost, margin)
    return [_centerline(segments, chain, links) for chain in _chains(len(segments), links)]


def _ends(segments: list[Segment], direction_px: int) -> tuple[FloatArray, FloatArray]:
    """Return position and outward direction of every end, (2 s, 2) each; ``2 i``, ``2 i + 1`` are of segment ``i``."""
    ends = np.empty((2 * len(segments), 2))
    inner = np.empty_like(ends)
    for i, segment in enumerate(segments):
        reach = min(direction_px, len(segment)) - 1
        ends[2 * i], ends[2 * i + 1] = segment.points[0], segment.points[-1]
        inner[2 * i], inner[2 * i + 1] = segment.points[reach], segment.points[-1 - reach]
    return ends, ends - inner


def _chains(n_segments: int, links: _Links) -> list[list[int]]:
    """List the chains as the ends at which they enter their segments, in the order in which they run."""
    chains = []
    visited = [False] * n_segments
    for first in range(2 * n_segments):
        if first in links or visited[first // 2]:
            continue
        chain = [first]
        visited[first // 2] = True
        while (exit_end := chain[-1] ^ 1) in links:
            chain.append(links[exit_end][0])
            visited[chain[-1] // 2] = True
        chains.append(chain)
    return chains


def _centerline(segments: list[Segment], chain: list[int], links: _Links) -> Centerline:
    ordered = tuple(segments[end // 2] if end % 2 == 0 else segments[end // 2].reversed() for end in chain)
    points = ordered[0].points if len(ordered) == 1 else frozen(np.concatenate([s.points for s in ordered]))
    u = frozen(arc_parameter(points, False))
    joints = []
    stop = 0
    for segment, end in zip(ordered[:-1], chain[1:], strict=True):
        stop += len(segment)
        _, kind, cost, margin = links[end]
        joints.append(Joint(kind, (float(u[stop - 1]), float(u[stop])), cost, margin, ratio_test(cost, margin)))
    return Centerline._unchecked(ordered, tuple(joints), closed=False, points=points, u=u)


def ratio_test(cost: float, margin: float) -> float:
    """Return ``1 - cost / (cost + margin)``: 1 where nothing competes, 0 where the next best choice is as good."""
    next_best = cost + margin
    if math.isinf(next_best):
        return 1.0
    return margin / next_best if next_best > 0.0 else 0.0


def close(loop: Segment) -> Centerline:
    """Make a segment without ends a centre line."""
    return Centerline._unchecked((loop,), (), closed=True, u=frozen(arc_parameter(loop.points, True)))
