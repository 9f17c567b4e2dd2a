"""Depth in sections across a curve in the image: the pixels of each, and the nearest surface in each."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from numba import boolean, float32, float64, int64, uint8, uint16

from dloftbs.kernels.compiler import helper, kernel, read, write
from dloftbs.kernels.shared.gaussian import MEDIAN_DEVIATION

DEPTH_TYPES = (np.dtype(np.float32), np.dtype(np.float64), np.dtype(np.uint16))
"""Of depth images that `find_surface` takes."""

_MOST_ACROSS = 2
"""Largest number of pixels to either side of the axis.

Source: bounds time.
"""

_ENOUGH = 15
"""Largest number of pixels of a section.

Source: bounds time; five across by three along, one less than `_WIRES`.
"""

_WIRES = 16
"""Number of values that the sorting network sorts.

Source: by definition; the power of two above `_ENOUGH`.
"""

_WIDEST = 0.95
"""Distance from the axis beyond which a round surface is not foretold further, radii.

Source: numerics; its slope diverges at 1.
"""

_CROWD = 3
"""One in this number of a section's pixels shows the surface, at the least.

Source: by hand.
"""

_KEEP = 3.0
"""Distance from the middle of these pixels' depths, as a multiple of their range, up to which a depth belongs to the
surface.

Source: by hand.
"""

_KEEP_RADII = 0.1
"""Distance from that middle up to which a depth belongs to the surface in any case, radii.

Source: by hand.
"""

_AROUND = 3
"""Number of changes of depth to either side that tell the usual one.

Source: by hand.
"""

_STEP_SIGMAS = 6.0
"""Change of depth, as a multiple of the noise's standard deviation, above which it is a step.

Source: by hand; noise exceeds it once in 500 million.
"""

_LEAST_SHARE = 0.25
"""Share of a section's pixels that must have depth.

Source: by hand.
"""


_Floats = npt.NDArray[np.float64]
_Ints = npt.NDArray[np.int64]


def _network() -> _Ints:
    """Return the pairs (k, 2) that Batcher's odd-even mergesort compares."""
    pairs = []
    run = 1
    while run < _WIRES:
        reach = run
        while reach >= 1:
            pairs += [
                (low, low + reach)
                for start in range(reach % run, _WIRES - reach, 2 * reach)
                for low in range(start, start + reach)
                if low // (2 * run) == (low + reach) // (2 * run)
            ]
            reach //= 2
        run *= 2
    return np.array(pairs, dtype=np.int64)


_NETWORK = _network()


@helper
def _choose_pixels(
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
) -> tuple[npt.NDArray[np.int32], _Ints]:
    """Return the pixels of all sections, (row, column) in the part cut out, and where each section starts in these."""
    n = len(points)
    pixels = np.empty((n * _ENOUGH, 2), dtype=np.int32)
    first = np.zeros(n + 1, dtype=np.int64)
    height, width = mask.shape
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
        x, y, tx, ty = points[i, 0], points[i, 1], tangents[i, 0], tangents[i, 1]
        for j in range(lines):
            along = spacing * ((j + 0.5) / lines - 0.5)
            for k in range(-side, side + 1):
                column = int(np.floor(x + along * tx - k * stride * ty + 0.5)) - left
                row = int(np.floor(y + along * ty + k * stride * tx + 0.5)) - top
                if 0 <= row < height and 0 <= column < width and mask[row, column] != 0:
                    pixels[count, 0], pixels[count, 1] = row, column
                    count += 1
    first[n] = count
    return pixels[:count], first


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


@helper
def _sort_few(values: _Floats, count: int) -> None:
    """Sort the first few of values (16,), in place, by a network: it has no branches to be predicted."""
    values[count:] = np.inf
    for k in range(len(_NETWORK)):
        low, high = _NETWORK[k]
        a, b = values[low], values[high]
        values[low], values[high] = min(a, b), max(a, b)


@helper
def _level(values: _Floats, known: int, slenderness: float) -> tuple[float, int]:
    """Return the mean depth of a section's surface, and the number of its pixels; sorts the values.

    The surface is the shortest interval that holds more than a third of the depths, the nearer of two. Flying pixels,
    between the surface and the ground behind it, and those of other objects are thinly spread. They are left out of the
    mean, so that they do not bias it.
    """
    _sort_few(values, known)
    crowd = known // _CROWD + 1
    start = 0
    for k in range(1, known - crowd + 1):
        if values[k + crowd - 1] - values[k] < values[start + crowd - 1] - values[start]:
            start = k
    middle = 0.0
    for k in range(start, start + crowd):
        middle += values[k] / crowd
    reach = _KEEP * (values[start + crowd - 1] - values[start]) + _KEEP_RADII * slenderness * middle
    total, count = 0.0, 0
    for k in range(known):
        if abs(values[k] - middle) <= reach:
            total += values[k]
            count += 1
    return total / count, count


@kernel(write(float64, 1), read(float64, 1), int64)
def strike_steps(surface_m: _Floats, slenderness: _Floats, most: int) -> int:
    """Strike off short stretches between a step nearer and one back, or farther and back: something else is seen there.

    A step is where the depth changes from one section to the next by more than a radius beyond what it does around it,
    and by more than noise does. A slope changes alike for several sections.

    Parameters
    ----------
    surface_m : (n,) float64
        Depth in each section, NaN where it is not known; is set to NaN there.
    slenderness : (n,) float64
        Radius over focal length, both px: times the depth, it is the radius in metres.
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
    noise = np.median(np.abs(excess)) / MEDIAN_DEVIATION
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


@kernel(
    read(float64, 2),
    read(float64, 2),
    read(float64, 1),
    read(boolean, 1),
    read(uint8, 2),
    (read(float32, 2), read(float64, 2), read(uint16, 2)),
    int64,
    int64,
    float64,
    float64,
    float64,
    float64,
    float64,
    float64,
    float64,
    int64,
)
def find_surface(
    points: _Floats,
    tangents: _Floats,
    radius: _Floats,
    used: npt.NDArray[np.bool_],
    mask: npt.NDArray[np.uint8],
    depth: npt.NDArray[Any],
    left: int,
    top: int,
    unit_m: float,
    low_m: float,
    high_m: float,
    focal_px: float,
    share: float,
    border: float,
    least: float,
    most: int,
) -> tuple[_Floats, _Floats, float, int]:
    """Return for each section 1 / depth of a round object's surface on its middle line.

    It comes from pixels in the middle of the object, away from its borders, and inside of the mask. Each pixel's depth
    is moved to the middle line: the round surface falls back beside it.

    Parameters
    ----------
    points, tangents : (n, 2) float64
        Places of the sections, and the way on.
    radius : (n,) float64
        Half the width there, px.
    used : (n,) bool
        Sections to look at; the others get no depth.
    mask : (h, w) uint8
        The mask cut out, not 0 where the object is.
    depth : (h, w) float32, float64 or uint16
        The depth image cut out in the same way.
    left, top : int
        The image's column and row of their first pixel.
    unit_m : float
        Metres of one count of the depth.
    low_m, high_m : float
        Depth that is 0, not finite, or outside of this range is missing.
    focal_px : float
        The radius over it, times the depth, is the radius in metres.
    share, border, least : float
        Pixels lie within ``share`` of the radius of the axis, and within the radius less ``border`` px, but as far as
        ``least`` of the radius in any case.
    most : int
        As `strike_steps` takes it.

    Returns
    -------
    inverse : (n,) float64
        1 / m; NaN where too little is known, or something else is seen.
    counts : (n,) float64
        Number of pixels that it is the mean of.
    shift : float
        Mean distance that pixels were moved to the middle line, as a share of the radius. That is as seen at a right
        angle; where the object is seen obliquely, the surface falls back by more.
    known : int
        The number of sections whose depth is known.
    """
    n = len(points)
    shift, all_known = 0.0, 0
    surface, counts = np.full(n, np.nan), np.zeros(n)
    pixels, first = _choose_pixels(points, tangents, radius, used, mask, left, top, share, border, least)
    metres = np.empty(len(pixels))
    for k in range(len(pixels)):  # a loop of its own, since it waits for memory, and so for many pixels at once
        metres[k] = depth[pixels[k, 0], pixels[k, 1]]
    values = np.empty(_WIRES)
    for i in range(n):
        x, y, tx, ty = points[i, 0], points[i, 1], tangents[i, 0], tangents[i, 1]
        around, slenderness = radius[i], radius[i] / focal_px
        known = 0
        for k in range(first[i], first[i + 1]):
            z = metres[k] * unit_m
            if z > 0.0 and low_m <= z <= high_m and np.isfinite(z):
                offset = (pixels[k, 0] + top - y) * tx - (pixels[k, 1] + left - x) * ty
                beside = min(abs(offset / around), _WIDEST)
                back = 1.0 - np.sqrt(1.0 - beside * beside)
                if slenderness * back < 1.0:  # else the object would reach behind the camera
                    values[known] = z - z * slenderness * back
                    shift += back
                    known += 1
        all_known += known
        if known > 0 and known >= _LEAST_SHARE * (first[i + 1] - first[i]):
            surface[i], counts[i] = _level(values, known, slenderness)
    known = strike_steps(surface, radius / focal_px, most)
    return 1.0 / surface, counts, shift / max(all_known, 1), known
