"""Sections across a curve in the image, the rays through them, and those of them that are seen."""

from __future__ import annotations

import numpy as np
from numba import boolean, float64, int64

from dloftbs.kernels.compiler import Bools, Floats, Ints, helper, kernel, read
from dloftbs.kernels.shared.cubic import point_and_slope
from dloftbs.kernels.shared.polyline import polyline_length
from dloftbs.kernels.shared.selection import median_of

_MAX_IN_BLOCK = 20
"""Largest number of points that show the radius of a block.

Source: bounds time.
"""


@helper
def _level_radius(u: Floats, radius: Floats, at: Floats, block: int) -> Floats:
    """Return the radius at `at` (n,): medians of blocks of points, and straight lines between their middles."""
    m = len(u)
    blocks = max(m // max(block, 1), 1)
    middle, level = np.empty(blocks), np.empty(blocks)
    for b in range(blocks):
        low, high = b * m // blocks, (b + 1) * m // blocks
        middle[b] = 0.5 * (u[low] + u[high - 1])
        level[b] = median_of(radius[low : high : max((high - low) // _MAX_IN_BLOCK, 1)])
    out = np.empty(len(at))
    b = 0
    for i in range(len(at)):
        while b < blocks - 1 and at[i] >= middle[b + 1]:
            b += 1
        while b > 0 and at[i] < middle[b]:
            b -= 1
        out[i] = level[b]
        if b < blocks - 1 and at[i] > middle[b]:
            out[i] += (level[b + 1] - level[b]) / (middle[b + 1] - middle[b]) * (at[i] - middle[b])
    return out


@kernel(read(float64, 1), read(float64, 2), read(float64, 1), read(float64, 1), boolean, float64, int64, int64)
def lay_sections(
    knots: Floats, control: Floats, u: Floats, radius: Floats, closed: bool, step: float, least: int, block: int
) -> tuple[Floats, Floats, Floats, Floats, float]:
    """Lay sections across a cubic B-spline in the image, at evenly spaced parameters.

    Not checked: the knots span 0 to 1.

    Parameters
    ----------
    knots : (m + 4,) float64
    control : (m, 2) float64
        Px.
    u, radius : (k,) float64
        The curve's parameter at the points of its centre line, ascending, and half the width there, px.
    closed : bool
        Whether the curve is a loop; otherwise the first and the last section lie at its ends.
    step : float
        From section to section, px, about.
    least : int
        Number of sections that there are at least.
    block : int
        Number of points over which the radius is levelled, so that crossings and a ragged border do not show in it.

    Returns
    -------
    at : (n,) float64
        The sections' parameters.
    points, tangents : (n, 2) float64
        Tangents have length 1; 0 where the curve stands still.
    radii : (n,) float64
    length : float
        Of the control polygon, px: a little more than the curve's.
    """
    m = len(control)
    length = polyline_length(control)
    n = max(int(np.rint(length / step)), least)
    at = np.arange(n) / (n if closed else n - 1)
    points, tangents = np.empty((n, 2)), np.zeros((n, 2))
    span = 3
    for i in range(n):
        while span < m - 1 and at[i] >= knots[span + 1]:
            span += 1
        points[i, 0], points[i, 1], dx, dy = point_and_slope(knots, control, span, at[i])
        norm = np.hypot(dx, dy)
        if norm > 0.0:
            tangents[i, 0], tangents[i, 1] = dx / norm, dy / norm
    return at, points, tangents, _level_radius(u, radius, at, block), length


@kernel(read(float64, 2), read(float64, 2), read(float64, 1), float64, float64, float64, float64)
def find_rays(points: Floats, tangents: Floats, radius: Floats, fx: float, fy: float, cx: float, cy: float) -> Floats:
    """Return the rays through the middles of sections and both their ends, for a pinhole camera without a lens.

    Parameters
    ----------
    points, tangents : (n, 2) float64
    radius : (n,) float64
    fx, fy, cx, cy : float
        Focal lengths and principal point, px.

    Returns
    -------
    (3, n, 3) float64
        The middles, the left ends, and the right ends; z is 1.
    """
    n = len(points)
    rays = np.empty((3, n, 3))
    for side in range(3):
        for i in range(n):
            off = 0.0 if side == 0 else (-radius[i] if side == 1 else radius[i])
            rays[side, i, 0] = (points[i, 0] - off * tangents[i, 1] - cx) / fx
            rays[side, i, 1] = (points[i, 1] + off * tangents[i, 0] - cy) / fy
            rays[side, i, 2] = 1.0
    return rays


@kernel(read(float64, 1), boolean, int64, read(float64, 1))
def confirm_sections(
    surface_m: Floats, closed: bool, least: int, line: Floats
) -> tuple[Bools, Ints, int, int, int, float, float]:
    """Strike off single sections that have no neighbour, and list the stretches without any.

    A single one between sections without depth of their own is as likely what is left of something else's.

    Parameters
    ----------
    surface_m : (n,) float64
        NaN where it is not known.
    closed : bool
        Whether the last is next to the first.
    least : int
        Sections that a stretch must have to be listed.
    line : (n,) float64
        Something known of all sections.

    Returns
    -------
    seen : (n,) bool
    stretches : (k, 2) int64
        The first section that is not seen, and the one after the last; in order, on a loop from the first that is seen,
        and beyond the seam counted on.
    count, first, last : int
        Number of seen ones, the first of them and the last.
    lowest, lowest_seen : float
        Of the line, of all sections and of those that are seen; the latter infinite where none is.
    """
    n = len(surface_m)
    known = ~np.isnan(surface_m)
    seen = np.empty(n, dtype=np.bool_)
    for i in range(n):
        before = known[i - 1] if i > 0 or closed else False
        after = known[(i + 1) % n] if i < n - 1 or closed else False
        seen[i] = known[i] and (before or after)
    stretches = np.empty((n // 2 + 1, 2), dtype=np.int64)
    count = 0
    start = 0
    while closed and start < n and not seen[start]:
        start += 1
    i = start
    while i < start + n:
        k = i
        while k < start + n and not seen[k % n]:
            k += 1
        if k - i >= least and k > i:
            stretches[count, 0], stretches[count, 1] = i, k
            count += 1
        i = k + 1
    how_many, first, last, lowest, lowest_seen = 0, n, -1, np.inf, np.inf
    for k in range(n):
        lowest = min(lowest, line[k])
        if seen[k]:
            how_many += 1
            first, last = min(first, k), k
            lowest_seen = min(lowest_seen, line[k])
    return seen, stretches[:count], how_many, first, last, lowest, lowest_seen
