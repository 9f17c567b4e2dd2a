"""Depth in sections across a curve in the image: the pixels of each, and the nearest surface in each."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from numba import boolean, float32, float64, int64, uint8, uint16

from dloftbs.kernels.compiler import helper, kernel, read
from dloftbs.kernels.shared.copying import copy_to

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

_LEAST_CONTRAST = 6.0
"""Height over the ground, as a multiple of the noise's deviation, from which an object stands out.

Source: by hand; halfway, where the ground's pixels are told from the object's, is three deviations.
"""

_LEAST_ABOVE = 2
"""Smallest number of pixels that stand out from the ground as an object.

Source: by hand; noise hardly makes two of a section's.
"""

_ABOVE = 5
"""One in this number of a section's pixels stands out from the ground, at the least, where an object does.

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
    size: tuple[int, int],
    dx: float,
    dy: float,
    share: float,
    border: float,
    least: float,
) -> tuple[npt.NDArray[np.int32], _Ints]:
    """Return the pixels of the depth image in all sections, (row, column), and where each section starts in these."""
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
                px, py = x + along * tx - k * stride * ty + 0.5, y + along * ty + k * stride * tx + 0.5
                column, row = int(np.floor(px)) - left, int(np.floor(py)) - top
                if 0 <= row < height and 0 <= column < width and mask[row, column] != 0:
                    column, row = int(np.floor(px + dx)), int(np.floor(py + dy))
                    if 0 <= row < size[0] and 0 <= column < size[1]:
                        pixels[count, 0], pixels[count, 1] = row, column
                        count += 1
    first[n] = count
    return pixels[:count], first


@helper
def _sort_columns(values: _Floats) -> None:
    """Sort each column of values (16, n), in place, by a network: each of its steps is done to many columns at once."""
    for k in range(len(_NETWORK)):
        low, high = values[_NETWORK[k, 0]], values[_NETWORK[k, 1]]
        for i in range(values.shape[1]):
            a, b = low[i], high[i]
            low[i] = a if a < b else b
            high[i] = b if a < b else a


@helper
def _level(values: _Floats, known: int, slenderness: float, ground: float, noise: float) -> tuple[float, int]:
    """Return the mean depth of a section's surface, and the number of its pixels, from its sorted depths.

    The surface is the shortest interval that holds more than a third of the depths, the nearer of two. Flying pixels,
    between the surface and the ground behind it, and those of other objects are thinly spread. They are left out of the
    mean, so that they do not bias it.
    """
    if known >= _LEAST_ABOVE:
        height = ground - values[_LEAST_ABOVE - 1]
        if height > max(slenderness * ground, _LEAST_CONTRAST * noise * ground * ground):  # not, where it is NaN
            above = 0
            while above < known and values[above] < ground - 0.5 * height:
                above += 1
            if above * _ABOVE >= known:
                known = above
    crowd = known // _CROWD + 1
    start = 0
    for k in range(1, known - crowd + 1):
        if values[k + crowd - 1] - values[k] < values[start + crowd - 1] - values[start]:
            start = k
    middle = 0.0
    for k in range(start, start + crowd):
        middle += values[k]
    middle /= crowd
    reach = _KEEP * (values[start + crowd - 1] - values[start]) + _KEEP_RADII * slenderness * middle
    total, count = 0.0, 0
    for k in range(known):
        if abs(values[k] - middle) <= reach:
            total += values[k]
            count += 1
    return total / count, count


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
    float64,
    float64,
    float64,
    read(float64, 1),
    float64,
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
    dx: float,
    dy: float,
    fattened: float,
    ground: _Floats,
    noise: float,
) -> tuple[_Floats, _Floats, float]:
    """Return for each section the depth of a round object's surface on its middle line.

    It comes from pixels in the middle of the object, away from its borders, and inside of the mask. Each pixel's depth
    is moved to the middle line: the round surface falls back beside it. Where some pixels clearly stand out from the
    ground, those that do not are not the object's.

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
        The depth image.
    left, top : int
        The image's column and row of the first pixel of the mask.
    unit_m : float
        Metres of one count of the depth.
    low_m, high_m : float
        Depth that is 0, not finite, or outside of this range is missing.
    focal_px : float
        The radius over it, times the depth, is the radius in metres.
    share, border, least : float
        Pixels lie within ``share`` of the radius of the axis, and within the radius less ``border`` px, but as far as
        ``least`` of the radius in any case.
    dx, dy : float
        Displacement of the depth image against the mask, px.
    fattened : float
        How much farther out than it is a camera shows a surface, px; 0 or more. A pixel there shows what lies as much
        nearer to the middle line.
    ground : (n,) float64
        Depth of the ground beside each section, m; NaN where it is not known.
    noise : float
        Of depth, 1 / m: the deviation over the depth squared.

    Returns
    -------
    surface : (n,) float64
        Depth, m; NaN where too little is known.
    counts : (n,) float64
        Number of pixels that it is the mean of.
    shift : float
        Mean distance that pixels were moved to the middle line, as a share of the radius. That is as seen at a right
        angle; where the object is seen obliquely, the surface falls back by more.
    """
    n = len(points)
    shift, all_known = 0.0, 0
    surface, counts = np.full(n, np.nan), np.zeros(n)
    pixels, first = _choose_pixels(
        points, tangents, radius, used, mask, left, top, depth.shape, dx, dy, share, border, least
    )
    metres = np.empty(len(pixels))
    for k in range(len(pixels)):  # a loop of its own, since it waits for memory, and so for many pixels at once
        metres[k] = depth[pixels[k, 0], pixels[k, 1]]
    values, known = np.full((_WIRES, n), np.inf), np.zeros(n, dtype=np.int64)
    for i in range(n):
        x, y, tx, ty = points[i, 0], points[i, 1], tangents[i, 0], tangents[i, 1]
        per_px, slenderness, count = 1.0 / radius[i], radius[i] / focal_px, 0
        for k in range(first[i], first[i + 1]):
            z = metres[k] * unit_m
            if z > 0.0 and low_m <= z <= high_m and np.isfinite(z):
                offset = (pixels[k, 0] - dy - y) * tx - (pixels[k, 1] - dx - x) * ty
                beside = min(max(abs(offset) - fattened, 0.0) * per_px, _WIDEST)
                back = 1.0 - np.sqrt(1.0 - beside * beside)
                if slenderness * back < 1.0:  # else the object would reach behind the camera
                    values[count, i] = z - z * slenderness * back
                    shift += back
                    count += 1
        known[i] = count
        all_known += count
    _sort_columns(values)
    few = np.empty(_WIRES)
    for i in range(n):
        if known[i] > 0 and known[i] >= _LEAST_SHARE * (first[i + 1] - first[i]):
            copy_to(few, values[:, i])
            surface[i], counts[i] = _level(few, known[i], radius[i] / focal_px, ground[i], noise)
    return surface, counts, shift / max(all_known, 1)
