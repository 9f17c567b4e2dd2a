"""Depth along a curve in the image: sections across it, the pixels of each, and the nearest surface in each."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import boolean, float64, int64, uint8

from dloftbs.kernels._compile import helper, kernel, read, write

_MOST_ACROSS = 2  # pixels to either side of the axis
_ENOUGH = 15  # pixels in a section
_WIDEST = 0.95  # of the radius: how far off the axis the round surface is still foretold
_CROWD = 3  # one of so many of a section's pixels shows the surface, or more
_KEEP = 3.0  # of the length of that crowd: how far from its middle depth still belongs to the surface
_KEEP_RADII = 0.1  # and this in any case
_AROUND = 3  # changes of depth to either side tell what is usual
_STEP_SIGMAS = 6.0
_MAD = 0.6745  # of a Gaussian's standard deviation
_MOST_IN_BLOCK = 20  # points that tell a block's radius
_LEAST_SHARE = 0.25  # of a section's pixels: so many must have depth

_Floats = npt.NDArray[np.float64]
_Ints = npt.NDArray[np.int64]


@helper
def _level_radius(u: _Floats, radius: _Floats, at: _Floats, block: int) -> _Floats:
    """Return the radius at `at` (n,): medians of blocks of points, and straight lines between their middles."""
    m = len(u)
    blocks = max(m // max(block, 1), 1)
    middle, level = np.empty(blocks), np.empty(blocks)
    for b in range(blocks):
        low, high = b * m // blocks, (b + 1) * m // blocks
        middle[b] = 0.5 * (u[low] + u[high - 1])
        level[b] = np.median(radius[low : high : max((high - low) // _MOST_IN_BLOCK, 1)])
    return np.interp(at, middle, level)


@kernel(read(float64, 1), read(float64, 2), read(float64, 1), read(float64, 1), boolean, float64, int64, int64)
def lay_sections(
    knots: _Floats,
    control: _Floats,
    u: _Floats,
    radius: _Floats,
    closed: bool,
    step: float,
    least: int,
    block: int,
) -> tuple[_Floats, _Floats, _Floats, _Floats, float]:
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
    length = 0.0
    for i in range(1, m):
        length += np.hypot(control[i, 0] - control[i - 1, 0], control[i, 1] - control[i - 1, 1])
    n = max(int(np.rint(length / step)), least)
    at = np.arange(n) / (n if closed else n - 1)
    points, tangents = np.empty((n, 2)), np.zeros((n, 2))
    work, speed = np.empty(4), np.empty(2)
    span = 3
    for i in range(n):
        while span < m - 1 and at[i] >= knots[span + 1]:
            span += 1
        for axis in range(2):
            for k in range(4):
                work[k] = control[span - 3 + k, axis]
            for level in range(1, 4):
                if level == 3:  # what is left are the ends of the last step, along the tangent
                    speed[axis] = work[3] - work[2]
                for k in range(3, level - 1, -1):
                    low = knots[span - 3 + k]
                    share = (at[i] - low) / (knots[span + 1 + k - level] - low)
                    work[k] = work[k - 1] + share * (work[k] - work[k - 1])
            points[i, axis] = work[3]
        norm = np.hypot(speed[0], speed[1])
        if norm > 0.0:
            tangents[i, 0], tangents[i, 1] = speed[0] / norm, speed[1] / norm
    return at, points, tangents, _level_radius(u, radius, at, block), length


@kernel(read(float64, 2), read(float64, 2), read(float64, 1), float64, float64, float64, float64)
def find_rays(
    points: _Floats, tangents: _Floats, radius: _Floats, fx: float, fy: float, cx: float, cy: float
) -> _Floats:
    """Return the rays through the middles of sections and both their ends, for a pinhole camera without a lens.

    Parameters
    ----------
    points, tangents : (n, 2) float64
    radius : (n,) float64
    fx, fy, cx, cy : float
        Focal lengths and principal point, px.

    Returns
    -------
    (3 n, 3) float64
        All middles, then all left ends, then all right ends; z is 1.
    """
    n = len(points)
    rays = np.empty((3 * n, 3))
    for side in range(3):
        for i in range(n):
            off = 0.0 if side == 0 else (-radius[i] if side == 1 else radius[i])
            rays[side * n + i, 0] = (points[i, 0] - off * tangents[i, 1] - cx) / fx
            rays[side * n + i, 1] = (points[i, 1] + off * tangents[i, 0] - cy) / fy
            rays[side * n + i, 2] = 1.0
    return rays


@kernel(
    read(float64, 2),
    read(float64, 2),
    read(float64, 1),
    read(boolean, 1),
    read(uint8, 2),
    int64,
    int64,
    float64,
    float64,
    float64,
)
def choose_pixels(
    points: _Floats,
    tangents: _Floats,
    radius: _Floats,
    used: npt.NDArray[np.bool_],
    mask: npt.NDArray[np.uint8],
    left: int,
    top: int,
    share: float,
    border: float,
    least: float,
) -> tuple[_Ints, _Ints, _Floats, _Ints]:
    """Choose the pixels of sections: the middle of the object, away from its borders, and inside of the mask.

    Parameters
    ----------
    points, tangents : (n, 2) float64
        Where the sections are, and the way on.
    radius : (n,) float64
        Half the width there, px.
    used : (n,) bool
        Sections to look at; the others get no pixels.
    mask : (h, w) uint8
        The mask cut out, not 0 where the object is.
    left, top : int
        The image's column and row of its first pixel.
    share, border, least : float
        Pixels lie within ``share`` of the radius of the axis, and within the radius less ``border`` px, but as far as
        ``least`` of the radius in any case.

    Returns
    -------
    rows, columns : (k,) int64
        In the image.
    across : (k,) float64
        How far off the axis each lies, in radii, -1 to 1.
    first : (n + 1,) int64
        Where each section starts in these, and the end.
    """
    n = len(points)
    most = n * (_ENOUGH + 2 * _MOST_ACROSS + 1)
    rows, columns = np.empty(most, dtype=np.int64), np.empty(most, dtype=np.int64)
    across = np.empty(most)
    first = np.zeros(n + 1, dtype=np.int64)
    count = 0
    for i in range(n):
        first[i] = count
        if not used[i]:
            continue
        a, b = max(i - 1, 0), min(i + 1, n - 1)
        spacing = np.hypot(points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]) / max(b - a, 1)
        half = max(min(share * radius[i], radius[i] - border), least * radius[i])
        side = min(int(half), _MOST_ACROSS)
        lines = min(max(int(np.rint(spacing)), 1), _ENOUGH // (2 * side + 1))
        stride = half / _MOST_ACROSS if half > _MOST_ACROSS + 1.0 else 1.0
        tx, ty = tangents[i, 0], tangents[i, 1]
        for j in range(lines):
            along = spacing * ((j + 0.5) / lines - 0.5)
            for k in range(-side, side + 1):
                x = points[i, 0] + along * tx - k * stride * ty
                y = points[i, 1] + along * ty + k * stride * tx
                column, row = int(np.floor(x + 0.5)), int(np.floor(y + 0.5))
                c, r = column - left, row - top
                if c < 0 or r < 0 or c >= mask.shape[1] or r >= mask.shape[0] or mask[r, c] == 0:
                    continue
                offset = (row - points[i, 1]) * tx - (column - points[i, 0]) * ty
                rows[count], columns[count] = row, column
                across[count] = min(max(offset / radius[i], -1.0), 1.0)
                count += 1
    first[n] = count
    return rows[:count], columns[:count], across[:count], first


@helper
def _sort(values: _Floats, count: int) -> None:
    """Sort the first few values, in place."""
    for i in range(1, count):
        value = values[i]
        k = i
        while k > 0 and values[k - 1] > value:
            values[k] = values[k - 1]
            k -= 1
        values[k] = value


@kernel(read(float64, 1), read(float64, 1), read(int64, 1), read(float64, 1), float64, float64)
def nearest_surface(
    depth_m: _Floats, across: _Floats, first: _Ints, slenderness: _Floats, low_m: float, high_m: float
) -> tuple[_Floats, _Floats, float]:
    """Return for each section the depth of a round object's surface on its middle line.

    Each pixel's depth is led to the middle line, by how far the round surface falls back beside it. What a section's
    depths crowd around is the surface: the shortest interval that holds more than a third of them, the nearer of two.
    What flies between the surface and what is behind it, or belongs to something else, is thinly spread, and is left
    out of the mean, which noise then does not bias.

    Parameters
    ----------
    depth_m : (k,) float64
        Depth of the pixels, as `choose_pixels` chose them.
    across : (k,) float64
    first : (n + 1,) int64
    slenderness : (n,) float64
        Radius over focal length, both px: times the depth, it is the radius in metres.
    low_m, high_m : float
        Depth outside of this range, 0 and what is not finite is missing.

    Returns
    -------
    surface_m : (n,) float64
        NaN where too little is known.
    counts : (n,) float64
        Of how many pixels it is the mean.
    led : float
        How far pixels were led to the middle line, as a share of the radius, on average. That is as seen at a right
        angle; where the object is seen obliquely, the surface falls back by more.
    """
    n = len(first) - 1
    led, all_known = 0.0, 0
    surface, counts = np.full(n, np.nan), np.zeros(n)
    most = 1
    for i in range(n):
        most = max(most, first[i + 1] - first[i])
    values = np.empty(most)
    for i in range(n):
        known = 0
        for k in range(first[i], first[i + 1]):
            z = depth_m[k]
            if z > 0.0 and low_m <= z <= high_m and np.isfinite(z):
                beside = min(abs(across[k]), _WIDEST)
                back = 1.0 - np.sqrt(1.0 - beside * beside)
                values[known] = z - z * slenderness[i] * back
                led += back
                known += 1
        all_known += known
        if known == 0 or known < _LEAST_SHARE * (first[i + 1] - first[i]):
            continue
        _sort(values, known)
        crowd = known // _CROWD + 1
        start = 0
        for k in range(1, known - crowd + 1):
            if values[k + crowd - 1] - values[k] < values[start + crowd - 1] - values[start]:
                start = k
        middle = 0.0
        for k in range(start, start + crowd):
            middle += values[k] / crowd
        reach = _KEEP * (values[start + crowd - 1] - values[start]) + _KEEP_RADII * slenderness[i] * middle
        total = 0.0
        for k in range(known):
            if abs(values[k] - middle) <= reach:
                total += values[k]
                counts[i] += 1.0
        surface[i] = total / counts[i]
    return surface, counts, led / max(all_known, 1)


@kernel(write(float64, 1), read(float64, 1), int64)
def strike_steps(surface_m: _Floats, slenderness: _Floats, most: int) -> int:
    """Strike off short stretches between a step nearer and one back, or farther and back: something else is seen there.

    A step is where the depth changes from one section to the next by more than a radius beyond what it does around it,
    and by more than noise does. What is only steep changes alike for several sections.

    Parameters
    ----------
    surface_m : (n,) float64
        As `nearest_surface` returns it; is set to NaN there.
    slenderness : (n,) float64
        As `nearest_surface` takes it.
    most : int
        Sections that a stretch has at most.

    Returns
    -------
    int
        The number of sections whose depth stays known.
    """
    n = len(surface_m)
    own = np.empty(n, dtype=np.int64)
    known = 0
    for i in range(n):
        if not np.isnan(surface_m[i]):
            own[known] = i
            known += 1
    if known < 2 * _AROUND + 2:
        return known
    excess, around = np.empty(known - 1), np.empty(2 * _AROUND)
    for k in range(known - 1):
        first = min(max(k - _AROUND, 0), known - 2 - 2 * _AROUND)
        count = 0
        for other in range(first, first + 2 * _AROUND + 1):
            if other != k:
                around[count] = surface_m[own[other + 1]] - surface_m[own[other]]
                count += 1
        _sort(around, count)
        usual = 0.5 * (around[_AROUND - 1] + around[_AROUND])
        excess[k] = surface_m[own[k + 1]] - surface_m[own[k]] - usual
    noise = np.median(np.abs(excess)) / _MAD
    came, sign = -1, 0.0
    for k in range(known - 1):
        radius = slenderness[own[k]] * min(surface_m[own[k]], surface_m[own[k + 1]])
        if abs(excess[k]) <= max(radius, _STEP_SIGMAS * noise):
            continue
        if came >= 0 and excess[k] * sign < 0.0 and k - came <= most:
            for other in range(came + 1, k + 1):
                surface_m[own[other]] = np.nan
            came = -1
        else:
            came, sign = k, excess[k]
    left = 0
    for k in range(known):
        left += not np.isnan(surface_m[own[k]])
    return left


@kernel(read(boolean, 1), boolean, int64, read(float64, 1))
def settle(
    explained: npt.NDArray[np.bool_], closed: bool, least: int, line: _Floats
) -> tuple[npt.NDArray[np.bool_], _Ints, int, int, int, float, float]:
    """Strike off single sections that have no neighbour, and list the stretches without any.

    At a step from one surface to another, the wrong one passes through the smooth line by chance.

    Parameters
    ----------
    explained : (n,) bool
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
        How many are seen, the first of them and the last.
    lowest, lowest_seen : float
        Of the line, of all sections and of those that are seen; the latter infinite where none is.
    """
    n = len(explained)
    seen = np.empty(n, dtype=np.bool_)
    for i in range(n):
        before = explained[i - 1] if i > 0 or closed else False
        after = explained[(i + 1) % n] if i < n - 1 or closed else False
        seen[i] = explained[i] and (before or after)
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
