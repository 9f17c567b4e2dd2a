"""Holes in a mask that lie within one cable, as a highlight on a glossy one, told from ground."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import boolean, int64, uint64

from dloftbs.cleaning.kernels.ground_distances import measure_depths, measure_widths, single_width
from dloftbs.cleaning.kernels.ground_runs import fill, find_ground, thin_out
from dloftbs.cleaning.kernels.hole_widths import find_narrow
from dloftbs.kernels.compiler import kernel, read

_DEEPEST_WIDTHS = 0.85
"""Distance to the ground of a hole's deepest pixel, in widths, up to which the hole lies within a cable.

Within one cable it is at most a half, at a crossing of two at most 0.71 (half of the diagonal of a square); between two
cables, or in a loop of one, it is more than 1. This is the middle.
"""

_WIDEST_DEPTHS = 1.0
"""Largest width of a hole, in distances of its deepest pixel to the ground: half a cable's width, as that distance.

The mean width of the mask, by which holes are chosen first, grows with a hand that holds the cable; this does not.

Source: geometry; beside a hole of half its width in the middle, a cable has a quarter on either side.
"""

_COARSE_PX = 2
"""Step between the pixels that are looked at first, to save time; the opening leaves nothing narrower."""

_MOST_OUTLINES = 500
"""More outlines than this are noise, of which nothing is filled: it bounds the cost."""

_SAMPLING_ERROR = 0.5
"""Largest excess of a distance between two edges where every other pixel is left out, in steps."""

_Bitmask = npt.NDArray[np.uint64]


@kernel(read(uint64, 2, "C"), int64, int64, boolean, boolean)
def fill_holes(framed: _Bitmask, h: int, w: int, flip_x: bool, flip_y: bool) -> _Bitmask:
    """Fill the holes of a mask that are narrower than its cables and lie within one of them.

    Every other pixel tells whether there may be any: most holes are ground between cables, and this is soon seen.

    Parameters
    ----------
    framed : (n, R) uint64
        As `dloftbs.kernels.bitmask.frame` makes it.
    h, w : int
        Size of the box.
    flip_x, flip_y : bool
        Whether the pixels that are looked at first are counted from the last column and the last row.

    Returns
    -------
    (n, R) uint64
        (0, 0) where there is nothing to fill.
    """
    nothing = np.empty((0, 0), dtype=np.uint64)
    top, left = (h + 1) % _COARSE_PX if flip_y else 0, (w + 1) % _COARSE_PX if flip_x else 0
    coarse = thin_out(framed, h + 2, top, left)
    rows, columns = coarse.shape[1], (w + 3 - left) // _COARSE_PX
    first, start, end, part, pixels, sides, outlines = find_ground(coarse, rows, columns)
    if len(pixels) == 1 or outlines > _MOST_OUTLINES:
        return nothing
    narrow, width = find_narrow(coarse, rows, first, start, end, part, pixels, sides)
    if not narrow.any():
        return nothing
    deepest = _DEEPEST_WIDTHS * width + _SAMPLING_ERROR
    depth = measure_depths(first, start, end, part, narrow, deepest)
    likely = narrow & (depth <= deepest)
    if not likely.any():
        return nothing
    single = single_width(fill(coarse, first, start, end, part, likely), rows, columns)
    if not (likely & (depth <= _DEEPEST_WIDTHS * single + _SAMPLING_ERROR)).any():
        return nothing
    first, start, end, part, pixels, sides, outlines = find_ground(framed, h + 2, w + 2)
    if outlines > _MOST_OUTLINES:
        return nothing
    narrow, width = find_narrow(framed, h + 2, first, start, end, part, pixels, sides)
    deepest = _DEEPEST_WIDTHS * min(width, _COARSE_PX * single)
    depth = measure_depths(first, start, end, part, narrow, deepest)
    within = narrow & (depth <= deepest)
    if within.any():
        within &= measure_widths(h + 2, w + 2, first, start, end, part, within) <= _WIDEST_DEPTHS * depth
    return fill(framed, first, start, end, part, within) if within.any() else nothing
