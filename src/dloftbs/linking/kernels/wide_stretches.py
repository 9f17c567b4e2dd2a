"""Stretches of branches on which the mask is wider than one cable."""

from __future__ import annotations

import numpy as np
from numba import float64, int64

from dloftbs.kernels.compiler import Floats, Ints, kernel, read
from dloftbs.kernels.shared.graph_ends import branch_of, inward

_WIDE = 1.3
"""Width of the mask, in widths of a cable, above which two cables lie side by side.

Source: by hand; cables that overlap by more cannot be distinguished.
"""

_NARROW = 1.2
"""Width of the mask, in widths of a cable, below which there is one cable.

Source: by hand; below `_WIDE`, so that noise does not cut a stretch.
"""

_LASTING_WIDTHS = 2.0
"""Length of a narrow place that ends a wide stretch, widths.

Source: by hand; two cables that cross are narrow for less.
"""


@kernel(read(int64, 2), read(float64, 1), float64)
def wide_reach(spans: Ints, radii: Floats, width: float) -> tuple[Ints, Floats]:
    """Count the points from each end of each branch on over which the mask is wider than one cable; return mean widths.

    Parameters
    ----------
    spans : (n, 2) int64
        As `clear_spans` makes them.
    radii : (m,) float64
        Half the mask's width at each point, px.
    width : float
        Of one cable, px.

    Returns
    -------
    reach : (2 n,) int64
    widths : (n,) float64
        Of the branches, px; that of one cable where a branch has no clear points.
    """
    reach = np.zeros(2 * len(spans), dtype=np.int64)
    widths = np.full(len(spans), width)
    for branch in range(len(spans)):
        if spans[branch, 1] > spans[branch, 0]:
            widths[branch] = 2.0 * radii[spans[branch, 0] : spans[branch, 1]].mean()
    for end in range(len(reach)):
        start, stop = spans[branch_of(end)]
        step = inward(end)
        first = start if step == 1 else stop - 1
        thin = 0
        for k in range(stop - start):
            r = radii[first + step * k]
            if r > 0.5 * _WIDE * width:
                reach[end] = k + 1
            thin = thin + 1 if r < 0.5 * _NARROW * width else 0
            if thin >= _LASTING_WIDTHS * width:
                break
    return reach, widths
