"""Skeleton to graph: junctions kept, spurs found, branches moved to the middle of the mask."""

from __future__ import annotations

import numpy as np

from dloftbs.data.frame_region import distances_to
from dloftbs.data.graph import FREE, Graph
from dloftbs.data.mask_crop import MaskCrop, Skeleton
from dloftbs.kernels import tracing
from dloftbs.skeleton.kernels import branch_ends
from dloftbs.skeleton.kernels import junctions as kernels
from dloftbs.skeleton.kernels.corners import find_corners
from dloftbs.skeleton.kernels.kinks import find_kinks, split_branches
from dloftbs.skeleton.kernels.recentring import recentre

_SPUR_WIDTHS = 0.6
"""Distance by which a branch must stick out of its junction, widths; below it is a spur.

Source: by hand; a bump of a cable's edge is lower, and the paper's 10 px do not scale with the width.
"""

_MERGE_WIDTHS = 1.0
"""Length between two junctions below which they are one, widths.

Source: geometry; a crossing at a right angle is one width long, and thinning splits it.
"""

_SPECK_WIDTHS2 = 0.3
"""Area of a piece of the mask that stands alone below which it is noise, squares of a width.

Source: by hand.
"""

_LONGEST_MITRE_WIDTHS = 3.0
"""Length beyond which a branch between two others is no corner of a cable, where objects may branch, widths.

Source: geometry; the mitre of a bend by 150 degrees is as long.
"""

_BORDER_WIDTHS = 0.5
"""Distance from the image's border within which an end is cut by it, widths; `_BORDER_PX` is added.

Source: geometry; thinning stops half a width before a straight cut.
"""

_BORDER_PX = 2.0
"""Distance from the image's border within which an end is cut by it, px, besides `_BORDER_WIDTHS`.

Source: by hand; cleaning and thinning each move an end by a pixel.
"""

_KINK_RAD = 1.2
"""Turn of a branch within three widths above which it is cut, rad.

Source: by hand; a cable bent to a radius of its width turns by more, but rarely does so.
"""

_MILD_KINK_RAD = 0.6
"""Turn of a branch within three widths above which it is cut where another cable's end points at it, rad.

Source: by hand; half of `_KINK_RAD`.
"""


def build_graph(
    crop: MaskCrop, skeleton: Skeleton, max_branches: int, *, branched: bool = False
) -> tuple[Graph | None, int]:
    """Turn a skeleton into a graph.

    Parameters
    ----------
    crop : MaskCrop
    skeleton : Skeleton
    max_branches : int
        With more branches than this there is no graph: it is noise. Sharp bends that would make more stay uncut.
    branched : bool
        Whether objects may branch: then a branch between two others is no fold of one cable.

    Returns
    -------
    graph : Graph or None
    branch_count : int
        Number of branches, loops among them.
    """
    mask = crop.oriented(crop.pixels)
    pixels, offsets, n = tracing.trace(skeleton.grid, skeleton.pixels_rc, skeleton.degrees)
    branch_count = len(offsets) - 1
    if branch_count == 0 or branch_count > max_branches:
        return None, branch_count
    nodes, centres, radii = kernels.find_junctions(
        skeleton.grid, skeleton.pixels_rc, skeleton.degrees, pixels, offsets, n, mask
    )
    points, radius = recentre(mask, pixels, offsets)
    width = 2.0 * float(np.partition(radius, len(radius) // 2)[len(radius) // 2])  # the median, but faster
    alive = kernels.prune_spurs(nodes, centres, radii, pixels, radius, offsets, mask, _SPUR_WIDTHS * width)
    spurs = ~alive
    kernels.drop_specks(alive, nodes, offsets, radius, _SPECK_WIDTHS2 * width * width)
    kinks = find_kinks(points, offsets, nodes, alive, width, _KINK_RAD, _MILD_KINK_RAD)
    if 0 < len(kinks) <= max_branches - branch_count:  # more are a pattern of bends, not cables that meet
        is_spur = spurs
        offsets_cut, nodes_cut, alive_cut = split_branches(kinks, offsets, nodes, alive, len(radii))
        spurs = np.zeros(len(alive_cut), dtype=np.bool_)
        spurs[np.searchsorted(offsets_cut, offsets[:-1][:n][is_spur])] = True
        offsets, nodes, alive = offsets_cut, nodes_cut, alive_cut
        centres = np.concatenate((centres, points[kinks]))
        radii = np.concatenate((radii, np.minimum(radius[kinks], width)))
    spans = branch_ends.clear_spans(nodes, centres, radii, points, radius, offsets, width)
    states = branch_ends.describe_ends(nodes, centres, radii, points, radius, offsets, spans, width)
    before = alive.copy()
    corners = find_corners(nodes, alive, spurs, states, centres, points, radius, offsets, mask, width)
    if branched:
        folds = np.flatnonzero(before & ~alive & (np.diff(offsets)[: len(alive)] > _LONGEST_MITRE_WIDTHS * width))
        alive[folds], spurs[folds] = True, False
        for fold in folds.tolist():
            corners[(corners >= offsets[fold]) & (corners < offsets[fold + 1])] = -1
    merged = kernels.assign_junctions(nodes, spans, alive, spurs, len(radii), _MERGE_WIDTHS * width)
    roundness = branch_ends.measure_roundness(merged, points, spans, states, mask, width)
    reach = _BORDER_WIDTHS * width + _BORDER_PX
    bordering = kernels.find_bordering(merged, points, offsets, *crop.image_transform, *crop.image_size, reach)
    if crop.outline is not None:
        ends = crop.to_image(points[np.column_stack((offsets[:-1], offsets[1:] - 1)).ravel()])
        bordering |= (merged == FREE) & (distances_to(crop.outline, ends)[: len(merged)] <= reach)
    return Graph(
        points, pixels, radius, offsets, merged, spans, states, roundness, spurs, bordering, corners, width
    ), branch_count
