"""Stage 5: segments to centre lines: the published, greedy linking (paper, section III-D)."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from dloftbs._arrays import FloatArray
from dloftbs.centerline import Centerline, Joint, JointKind, Segment
from dloftbs.config import LinkingConfig
from dloftbs.kernels import linking as kernels
from dloftbs.kernels.tracing import is_covered
from dloftbs.patch import Patch

_Links = dict[int, tuple[int, float, float]]  # from an end to the end it is joined to, with cost and margin


def link(patch: Patch, segments: list[Segment], config: LinkingConfig) -> list[Centerline]:
    """Join segments end to end, cheapest pair first, while ``J < J_th``; what stays unconnected is another object.

    Parameters
    ----------
    patch : Patch
        Its mask tells whether a joint runs over foreground.
    segments : list of Segment
        Open ones, in the patch's pose.
    config : LinkingConfig

    Returns
    -------
    list of Centerline
        In the patch's pose, by their first segment.
    """
    if not segments:
        return []
    ends, directions = _ends(segments, config.direction_px)
    pairs, costs, margins = kernels.link_greedily(ends, directions, config.distance_weight, config.max_cost)
    links: _Links = {}
    for (i, j), cost, margin in zip(pairs.tolist(), costs.tolist(), margins.tolist(), strict=True):
        links[i] = (j, cost, margin)
        links[j] = (i, cost, margin)
    mask = patch.posed(patch.pixels)
    return [_centerline(mask, segments, chain, links) for chain in _chains(len(segments), links)]


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


def _centerline(mask: npt.NDArray[np.uint8], segments: list[Segment], chain: list[int], links: _Links) -> Centerline:
    ordered = tuple(segments[end // 2] if end % 2 == 0 else segments[end // 2].reversed() for end in chain)
    bare = Centerline.trusted(ordered, (), closed=False)
    stops = np.cumsum([len(segment) for segment in ordered])[:-1].tolist()
    joints = []
    for stop, end in zip(stops, chain[1:], strict=True):
        _, cost, margin = links[end]
        covered = is_covered(mask, bare.points[stop - 1], bare.points[stop])
        kind = JointKind.CROSSING if covered else JointKind.GAP
        joints.append(Joint(kind, (float(bare.u[stop - 1]), float(bare.u[stop])), cost, margin))
    return Centerline.trusted(ordered, tuple(joints), closed=False)
