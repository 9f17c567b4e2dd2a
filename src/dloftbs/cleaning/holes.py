"""Holes in a mask that lie within one cable, as a highlight on a glossy one, told from ground."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from dloftbs.cleaning.kernels.ground_distances import measure_depths, single_width
from dloftbs.cleaning.kernels.ground_runs import fill, find_ground, thin_out
from dloftbs.cleaning.kernels.hole_widths import find_narrow

_DEEPEST_WIDTHS = 0.85
"""Distance to the ground of a hole's deepest pixel, in widths, up to which the hole lies within a cable.

Within one cable it is at most a half, at a crossing of two at most 0.71 (half of the diagonal of a square); between two
cables, or in a loop of one, it is more than 1. This is the middle.
"""

_COARSE_PX = 2
"""Step between the pixels that are looked at first, to save time; the opening leaves nothing narrower."""

_MOST_OUTLINES = 500
"""More outlines than this are noise, of which nothing is filled: it bounds the cost."""

_SAMPLING_ERROR = 0.5
"""Largest excess of a distance between two edges where every other pixel is left out, in steps."""

_Bitmask = npt.NDArray[np.uint64]
_Ints = npt.NDArray[np.int64]


class _Ground(NamedTuple):
    """The ground of a mask, as `ground_runs.find_ground` returns it."""

    first: _Ints
    start: _Ints
    end: _Ints
    part: _Ints
    pixels: _Ints
    sides: _Ints
    outlines: int

    @property
    def runs(self) -> tuple[_Ints, _Ints, _Ints, _Ints]:
        """The first run of each row; first column, end and part of each run."""
        return self[:4]


def fill_holes(framed: _Bitmask, h: int, w: int, flip_x: bool, flip_y: bool) -> _Bitmask:
    """Fill the holes of a mask that are narrower than its cables and lie within one of them.

    Every other pixel tells whether there may be any: most holes are ground between cables, and this is soon seen.

    Parameters
    ----------
    framed : numpy.ndarray, shape (n, R), uint64
        As `dloftbs.kernels.bitmask.frame` makes it.
    h, w : int
        Size of the box.
    flip_x, flip_y : bool
        Whether the pixels that are looked at first are counted from the last column and the last row.

    Returns
    -------
    numpy.ndarray, shape (n, R), uint64
        (0, 0) where there is nothing to fill.
    """
    nothing = np.empty((0, 0), dtype=np.uint64)
    top, left = (h + 1) % _COARSE_PX if flip_y else 0, (w + 1) % _COARSE_PX if flip_x else 0
    coarse = thin_out(framed, h + 2, top, left)
    rows, columns = coarse.shape[1], (w + 3 - left) // _COARSE_PX
    ground = _Ground(*find_ground(coarse, rows, columns))
    if len(ground.pixels) == 1 or ground.outlines > _MOST_OUTLINES:
        return nothing
    narrow, width = find_narrow(coarse, rows, *ground.runs, ground.pixels, ground.sides)
    if not narrow.any():
        return nothing
    deepest = _DEEPEST_WIDTHS * width + _SAMPLING_ERROR
    depth = measure_depths(*ground.runs, narrow, deepest)
    likely = narrow & (depth <= deepest)
    if not likely.any():
        return nothing
    single = single_width(fill(coarse, *ground.runs, likely), rows, columns)
    if not (likely & (depth <= _DEEPEST_WIDTHS * single + _SAMPLING_ERROR)).any():
        return nothing
    ground = _Ground(*find_ground(framed, h + 2, w + 2))
    if ground.outlines > _MOST_OUTLINES:
        return nothing
    narrow, width = find_narrow(framed, h + 2, *ground.runs, ground.pixels, ground.sides)
    deepest = _DEEPEST_WIDTHS * min(width, _COARSE_PX * single)
    within = narrow & (measure_depths(*ground.runs, narrow, deepest) <= deepest)
    return fill(framed, *ground.runs, within) if within.any() else nothing
