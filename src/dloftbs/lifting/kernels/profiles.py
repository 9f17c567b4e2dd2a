"""Depth across objects and beyond their borders: the ground beside them, its noise, and where edges of depth lie."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from numba import boolean, float32, float64, int64, uint8, uint16

from dloftbs.kernels.compiler import Bools, Bytes, Floats, helper, kernel, read
from dloftbs.kernels.shared.copying import copy_to
from dloftbs.kernels.shared.gaussian import MEDIAN_DEVIATION
from dloftbs.kernels.shared.selection import nth_least
from dloftbs.lifting.kernels.columns import medians_of_columns
from dloftbs.lifting.kernels.surfaces import MIN_CONTRAST

_INSIDE_PX = 4.0
"""Distance inside of a border from which a profile goes, px.

Source: by hand; displacements of up to 3 px show, and noise beside them.
"""

_EDGE_PX = 6.0
"""Distance outside of a border within which depth may still be the object's, px.

Source: by hand; edges are fattened by 4 px at the most, and displaced by 2.
"""

_GROUND_PLACES = 6
"""Number of places on each side that show the ground.

Source: bounds time; enough for a median.
"""

PLACES = 2 * int(_INSIDE_PX + _EDGE_PX + _GROUND_PLACES)
"""Number of places of a profile.

Source: by definition; about a pixel apart.
"""

_MIN_GROUND = 3
"""Smallest number of places with depth that show the ground on a side.

Source: by definition; a median is robust from three on.
"""

_MIN_NOISE = 1e-4
"""Least noise of depth, 1 / m: its deviation is this times the depth squared.

Source: numerics; far below any camera's.
"""

_HUBER_PX = 0.5
"""Distance of a profile's edges from where the others show from which it counts less, px.

Source: by hand; half a pixel is what sampling alone does.
"""

_PRIOR_PX = 1.0
"""Deviation of the displacement, and of the fattening, that is expected without evidence, px.

Source: by hand; cameras are registered to 1 to 2 px.
"""

_ROUNDS = 6
"""Number of rounds of the robust mean.

Source: numerics; it has settled by then.
"""


@kernel(
    read(float64, 2),
    read(float64, 2),
    read(float64, 1),
    read(uint8, 2),
    int64,
    int64,
    (read(float32, 2), read(float64, 2), read(uint16, 2)),
    float64,
    float64,
    float64,
)
def lay_profiles(
    points: Floats,
    tangents: Floats,
    radius: Floats,
    mask: Bytes,
    left: int,
    top: int,
    depth: npt.NDArray[Any],
    unit_m: float,
    low_m: float,
    high_m: float,
) -> tuple[Floats, Floats, Bools]:
    """Read depth in rows of places across an object, from inside of both borders to far beyond them.

    Parameters
    ----------
    points, tangents : (n, 2) float64
        Places of the profiles, and the way on.
    radius : (n,) float64
        Half the width there, px.
    mask : (h, w) uint8
        The mask cut out, not 0 where an object is.
    left, top : int
        The image's column and row of its first pixel.
    depth : (H, W) float32, float64 or uint16
        The depth image.
    unit_m : float
        Metres of one count of the depth.
    low_m, high_m : float
        Depth outside of this range, not 0, is missing.

    Returns
    -------
    metres : (n, PLACES) float64
        Depth; NaN where it is missing and outside of the image.
    offsets : (n, PLACES) float64
        Distance from the middle line, px, ascending; positive on the right of the way on, as seen on screen.
    on : (n, PLACES) bool
        Whether the mask has the pixel.
    """
    n = len(points)
    half = PLACES // 2
    offsets, metres = np.empty((n, PLACES)), np.empty((n, PLACES))
    rows, columns = np.empty((n, PLACES), dtype=np.int64), np.empty((n, PLACES), dtype=np.int64)
    on = np.zeros((n, PLACES), dtype=np.bool_)
    for i in range(n):
        outer = radius[i] + _EDGE_PX + _GROUND_PLACES - 0.5
        inner = max(radius[i] - _INSIDE_PX + 0.5, outer / (2 * half - 1))
        step = (outer - inner) / (half - 1)
        for k in range(PLACES):
            offset = -outer + k * step if k < half else inner + (k - half) * step
            offsets[i, k] = offset
            columns[i, k] = int(np.floor(points[i, 0] - offset * tangents[i, 1] + 0.5))
            rows[i, k] = int(np.floor(points[i, 1] + offset * tangents[i, 0] + 0.5))
    height, width = depth.shape
    for i in range(n):  # loops of their own, since they wait for memory, and so for many pixels at once
        for k in range(PLACES):
            metres[i, k] = depth[min(max(rows[i, k], 0), height - 1), min(max(columns[i, k], 0), width - 1)]
    for i in range(n):
        for k in range(PLACES):
            row, column = rows[i, k], columns[i, k]
            inside = 0 <= row < height and 0 <= column < width
            z = metres[i, k] * unit_m
            metres[i, k] = z if inside and low_m <= z <= high_m else np.nan
            r, c = row - top, column - left
            on[i, k] = inside and 0 <= r < mask.shape[0] and 0 <= c < mask.shape[1] and mask[r, c] != 0
    return metres, offsets, on


@helper
def _grounds_beside(metres: Floats, on: Bools, low: int) -> Floats:
    """Return the median of the depths in some places of each profile, off the mask; NaN where there are too few."""
    n = len(metres)
    places = np.empty((_GROUND_PLACES, n))
    for i in range(n):
        for k in range(_GROUND_PLACES):
            value = metres[i, low + k]
            places[k, i] = np.inf if on[i, low + k] or np.isnan(value) else value
    grounds = medians_of_columns(places)
    for i in range(n):
        if places[_MIN_GROUND - 1, i] == np.inf:
            grounds[i] = np.nan
    return grounds


@helper
def _noise_of(metres: Floats, on: Bools) -> float:
    """Return the noise's deviation over the depth squared, from places next to each other that show the ground.

    Where depth comes in steps above the noise, most neighbours are equal: then the step counts.
    """
    n = len(metres)
    changes = np.empty(n * 2 * _GROUND_PLACES)
    count = 0
    for i in range(n):
        for start in (0, PLACES - _GROUND_PLACES):
            for k in range(start, start + _GROUND_PLACES - 1):
                a, b = metres[i, k], metres[i, k + 1]
                if not on[i, k] and not on[i, k + 1] and not np.isnan(a) and not np.isnan(b):
                    changes[count] = abs(a - b) / (a * b)
                    count += 1
    if count == 0:
        return _MIN_NOISE
    changes = changes[:count]
    usual = nth_least(changes, count // 2) / (np.sqrt(2.0) * MEDIAN_DEVIATION)
    first = 0
    for k in range(count):
        first += changes[k] == 0.0
    step = nth_least(changes, first + (count - first) // 4) if first < count else 0.0
    return float(max(usual, step, _MIN_NOISE))


@helper
def _third_nearest(metres: Floats, offsets: Floats, reach: float) -> float:
    """Return the third nearest depth within a distance of the middle line; NaN if there are not as many.

    One flying or noisy pixel is nearer than an object at times, three hardly ever are.
    """
    first = second = third = np.inf
    for k in range(len(metres)):
        value = metres[k] if abs(offsets[k]) <= reach and not np.isnan(metres[k]) else np.inf
        third = min(third, max(second, value))
        second = min(second, max(first, value))
        first = min(first, value)
    return third if third < np.inf else np.nan


@helper
def _middle_of_three(before: float, own: float, after: float) -> float:
    """Return the median of a value and those before and after it; what is known of these where not all are."""
    if np.isnan(own):
        return after if np.isnan(before) else (before if np.isnan(after) else 0.5 * (before + after))
    if np.isnan(before) or np.isnan(after):
        return own  # the mean with one of them would lag behind on a slope
    return max(min(before, own), min(max(before, own), after))


@kernel(read(float64, 2), read(float64, 2), read(boolean, 2), read(float64, 1))
def read_profiles(metres: Floats, offsets: Floats, on: Bools, radius: Floats) -> tuple[Floats, float, Floats, Floats]:
    """Measure the ground beside an object, its noise, and where the object's edges of depth lie against the mask's.

    Between an object's depth and the ground's lies the edge of depth, to both sides: halfway between these two edges
    is the object's middle in the depth image, and half their distance is its radius there.

    Parameters
    ----------
    metres, offsets, on
        As `lay_profiles` returns them.
    radius : (n,) float64
        Half the width of the object, px.

    Returns
    -------
    ground : (n,) float64
        Depth of the ground under the middle line, m: the mean of both sides, or the median of this and what the
        profiles before and after show; NaN where it is not known.
    noise : float
        Of the ground, 1 / m: the deviation over the depth squared.
    aside : (n,) float64
        Distance from the middle line of the mask to that of depth, px, as `offsets`; NaN where the edges are not known.
    wider : (n,) float64
        How much farther from the middle the edges of depth lie than those of the mask, px; NaN where `aside` is.
    """
    n = len(metres)
    sides = np.empty((n, 2))
    sides[:, 0], sides[:, 1] = _grounds_beside(metres, on, 0), _grounds_beside(metres, on, PLACES - _GROUND_PLACES)
    noise = _noise_of(metres, on)
    aside, wider = np.full(n, np.nan), np.full(n, np.nan)
    for i in range(n):
        level = _third_nearest(metres[i], offsets[i], radius[i] + _EDGE_PX)
        if not min(sides[i, 0], sides[i, 1]) - level > MIN_CONTRAST * noise * level * level:  # not: NaN too
            continue
        step = offsets[i, 1] - offsets[i, 0]
        between = offsets[i, PLACES // 2] - offsets[i, PLACES // 2 - 1] - step  # not looked at, all of it the object's
        total, length = 0.0, max(between, 0.0)
        alone = True
        for k in range(_GROUND_PLACES, PLACES - _GROUND_PLACES):
            value, offset = metres[i, k], offsets[i, k]
            alone = alone and not np.isnan(value) and not (on[i, k] and abs(offset) > radius[i] + 1.0)
            if value < 0.5 * (level + sides[i, 0 if offset < 0.0 else 1]):
                total += offset * step
                length += step
        if alone and length > 0.0:
            aside[i] = total / length
            wider[i] = 0.5 * length - radius[i]
    middles = np.empty(n)
    for i in range(n):
        a, b = sides[i]
        middles[i] = a if np.isnan(b) else (b if np.isnan(a) else 0.5 * (a + b))
    ground = np.empty(n)
    for i in range(n):
        before, after = middles[i - 1] if i > 0 else np.nan, middles[i + 1] if i < n - 1 else np.nan
        if i == 0 and n > 2:
            before = 2.0 * middles[1] - middles[2]
        if i == n - 1 and n > 2:
            after = 2.0 * middles[n - 2] - middles[n - 3]
        ground[i] = _middle_of_three(before, middles[i], after)
    return ground, noise, aside, wider


@kernel(read(float64, 1), int64, int64)
def spread(values: Floats, count: int, every: int) -> Floats:
    """Return values of all of some sections, given those of some of them.

    Parameters
    ----------
    values : (n,) float64
        Of the sections 0, `every`, ``2 * every`` and so on; NaN where unknown.
    count : int
        Number of sections.
    every : int

    Returns
    -------
    (count,) float64
        Linear between known values, else the nearer one; that of the last goes on.
    """
    spread_out = np.empty(count)
    for i in range(count):
        k = min(i // every, len(values) - 1)
        t = (i - k * every) / every
        a, b = values[k], values[min(k + 1, len(values) - 1)]
        if np.isnan(a) or np.isnan(b):
            spread_out[i] = a if t < 0.5 else b
        else:
            spread_out[i] = a + min(t, 1.0) * (b - a)
    return spread_out


@helper
def edges_of(sums: Floats) -> tuple[float, float, float]:
    """Return the displacement ``(x, y)`` and by how much edges are farther out, px, that the sums of `add_edges` show.

    Without evidence they are 0: as much is expected by `_PRIOR_PX`.
    """
    prior = 1.0 / _PRIOR_PX**2
    xx, yy = sums[0] + prior, sums[2] + prior
    determinant = xx * yy - sums[1] * sums[1]
    x, y = (yy * sums[3] - sums[1] * sums[4]) / determinant, (xx * sums[4] - sums[1] * sums[3]) / determinant
    return x, y, sums[6] / (sums[5] + prior)


@kernel(read(float64, 2), read(float64, 1), read(float64, 1), read(float64, 1), float64)
def add_edges(tangents: Floats, aside: Floats, wider: Floats, past: Floats, memory: float) -> Floats:
    """Return what is known of where depth has its edges: displaced against the mask's, and farther apart.

    A profile's distance aside is the displacement's part along the profile. These are the sums of the normal equations,
    robustly weighted (Huber): several frames' are added up.

    Parameters
    ----------
    tangents : (n, 2) float64
    aside, wider : (n,) float64
        As `read_profiles` returns them.
    past : (7,) float64
        What is known already: the sums xx, xy, yy of the normals' products, x, y of these with `aside`, of weights, and
        of these with `wider`.
    memory : float
        Share of it that stays, if this frame shows something.

    Returns
    -------
    (7,) float64
        With this frame's.
    """
    if np.isnan(aside).all():
        return past.copy()
    kept = memory * past
    sums = kept.copy()
    for _ in range(_ROUNDS):
        x, y, fattened = edges_of(sums)
        copy_to(sums, kept)
        for i in range(len(aside)):
            if np.isnan(aside[i]):
                continue
            nx, ny = -tangents[i, 1], tangents[i, 0]
            weight = 1.0 / max(abs(aside[i] - nx * x - ny * y), _HUBER_PX) / _HUBER_PX
            sums[0] += weight * nx * nx
            sums[1] += weight * nx * ny
            sums[2] += weight * ny * ny
            sums[3] += weight * nx * aside[i]
            sums[4] += weight * ny * aside[i]
            weight = 1.0 / max(abs(wider[i] - fattened), _HUBER_PX) / _HUBER_PX
            sums[5] += weight
            sums[6] += weight * wider[i]
    return sums
