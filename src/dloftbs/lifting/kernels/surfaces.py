"""Depth in sections across a curve in the image: the pixels of each, and the nearest surface in each."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from numba import boolean, float32, float64, int64, uint8, uint16

from dloftbs.kernels.compiler import Bools, Bytes, Floats, helper, kernel, read
from dloftbs.kernels.shared.copying import copy_to
from dloftbs.lifting.kernels.columns import sort_columns

SHARE = 0.6
"""Distance from the axis up to which a section looks, radii.

Source: geometry; the surface of a round cable is 0.2 radii farther away there.
"""

BORDER_PX = 1.0
"""Distance from a cable's border within which no depth is taken, px.

Source: geometry; pixels there mix with the background.
"""

LEAST_SHARE = 0.3
"""Distance from the axis up to which a section looks at the least, radii.

Source: by hand; thin cables have nothing but border.
"""

_MAX_ACROSS = 2
"""Largest number of pixels to either side of the axis.

Source: bounds time.
"""

_ENOUGH = 15
"""Largest number of pixels of a section.

Source: bounds time; five across by three along, no more than `MAX_ROWS` of `columns`.
"""

_WIDEST = 0.95
"""Distance from the axis beyond which a round surface is not foretold further, radii.

Source: numerics; its slope diverges at 1.
"""

_CROWD = 3
"""One in this number of a section's pixels shows the surface, at the least.

Source: by hand.
"""

MIN_CONTRAST = 6.0
"""Height over the ground, as a multiple of the noise's deviation, from which an object and its edges stand out.

Source: by hand; halfway, where the ground's pixels are distinguished from the object's, is three deviations.
"""

_MIN_ABOVE = 2
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

_MIN_SHARE = 0.25
"""Share of a section's pixels that must have depth.

Source: by hand.
"""

_NOWHERE = -1e6
"""Coordinate of no pixel of any image, px.

Source: by definition.
"""

_Pixels = npt.NDArray[np.int32]


class _Sections(NamedTuple):
    """Sections of `find_surface`, and the depth of the ground beside them."""

    points: Floats
    tangents: Floats
    radius: Floats
    ground: Floats


class _Samples(NamedTuple):
    """Pixels (`_ENOUGH`, n) of the sections: where the depth was read, what is the object's, and the depth's counts."""

    rows: _Pixels
    columns: _Pixels
    own: Bools
    counts: Floats


class _DepthView(NamedTuple):
    """The depth image and its camera, as `find_surface` takes them."""

    unit_m: float
    low_m: float
    high_m: float
    focal_px: float
    dx: float
    dy: float
    fattened: float
    noise: float


@helper
def _lay_places(points: Floats, tangents: Floats, radius: Floats, used: Bools) -> tuple[Floats, Floats]:
    """Return ``x`` and ``y`` (`_ENOUGH`, n) of the places of each section, and `_NOWHERE` where it has no more."""
    n = len(points)
    x, y = np.full((_ENOUGH, n), _NOWHERE), np.full((_ENOUGH, n), _NOWHERE)
    for i in range(n):
        if not used[i]:
            continue
        a, b = max(i - 1, 0), min(i + 1, n - 1)
        dx, dy = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
        spacing = np.sqrt(dx * dx + dy * dy) / max(b - a, 1)
        half = max(min(SHARE * radius[i], radius[i] - BORDER_PX), LEAST_SHARE * radius[i])
        side = min(int(half), _MAX_ACROSS)
        lines = min(max(int(np.rint(spacing)), 1), _ENOUGH // (2 * side + 1))
        stride = half / _MAX_ACROSS if half > _MAX_ACROSS + 1.0 else 1.0
        tx, ty = tangents[i, 0], tangents[i, 1]
        place = 0
        for j in range(lines):
            along = spacing * ((j + 0.5) / lines - 0.5)
            for k in range(-side, side + 1):
                x[place, i] = points[i, 0] + along * tx - k * stride * ty + 0.5
                y[place, i] = points[i, 1] + along * ty + k * stride * tx + 0.5
                place += 1
    return x, y


@helper
def _pixels_of(places: Floats, shift: float, corner: int, size: int, own: Bools) -> _Pixels:
    """Return the rows or columns of places, moved, within an array; those beyond its border are not the object's."""
    inside = np.empty(places.shape, dtype=np.int32)
    for j in range(places.shape[0]):
        for i in range(places.shape[1]):
            pixel = np.int32(np.floor(places[j, i] + shift)) - np.int32(corner)
            inside[j, i] = min(max(pixel, np.int32(0)), np.int32(size - 1))
            own[j, i] &= inside[j, i] == pixel
    return inside


@helper
def _read(pixels: npt.NDArray[Any], rows: _Pixels, columns: _Pixels, values: Floats) -> None:
    """Write the values of pixels; a loop of its own, since it waits for memory, and so for many pixels at once."""
    for j in range(rows.shape[0]):
        for i in range(rows.shape[1]):
            values[j, i] = pixels[rows[j, i], columns[j, i]]


@helper
def _level(values: Floats, known: int, slenderness: float, ground: float, noise: float) -> tuple[float, int]:
    """Return the mean depth of a section's surface, and the number of its pixels, from its sorted depths.

    The surface is the shortest interval that holds more than a third of the depths, the nearer of two. Flying pixels,
    between the surface and the ground behind it, and those of other objects are thinly spread. They are left out of the
    mean, so that they do not bias it.
    """
    if known >= _MIN_ABOVE:
        height = ground - values[_MIN_ABOVE - 1]
        if height > max(slenderness * ground, MIN_CONTRAST * noise * ground * ground):  # not, where it is NaN
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


@helper
def _judge(sections: _Sections, samples: _Samples, view: _DepthView) -> tuple[Floats, Floats, float]:
    """Return what `find_surface` does; the counts are replaced by what they show, in order."""
    points, tangents, radius, ground = sections
    rows, columns, own, values = samples
    unit_m, low_m, high_m, focal_px, dx, dy, fattened, noise = view
    n = len(points)
    surface, counts = np.full(n, np.nan), np.zeros(n)
    # Of each section: how many of its pixels are the object's, how many of these have depth, how far they were moved.
    asked, known, moved = np.zeros(n), np.zeros(n), np.zeros(n)
    middle_x, middle_y, way_x, way_y = np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    per_px, slenderness = np.empty(n), np.empty(n)
    for i in range(n):
        middle_x[i], middle_y[i], way_x[i], way_y[i] = (
            points[i, 0] + dx,
            points[i, 1] + dy,
            tangents[i, 0],
            tangents[i, 1],
        )
        per_px[i], slenderness[i] = 1.0 / radius[i], radius[i] / focal_px
    for j in range(_ENOUGH):
        for i in range(n):
            z = values[j, i] * unit_m
            offset = abs((rows[j, i] - middle_y[i]) * way_x[i] - (columns[j, i] - middle_x[i]) * way_y[i]) - fattened
            beside = offset * per_px[i] if offset > 0.0 else 0.0
            beside = beside if beside < _WIDEST else _WIDEST
            back = 1.0 - np.sqrt(1.0 - beside * beside)
            # At a slenderness of 1 the object would reach behind the camera.
            has_depth = (
                own[j, i] & (z > 0.0) & (z >= low_m) & (z <= high_m) & (z < np.inf) & (slenderness[i] * back < 1.0)
            )
            values[j, i] = z - z * slenderness[i] * back if has_depth else np.inf
            moved[i] += back if has_depth else 0.0
            known[i] += 1.0 if has_depth else 0.0
            asked[i] += 1.0 if own[j, i] else 0.0
    sort_columns(values)
    few = np.empty(_ENOUGH)
    for i in range(n):
        if known[i] > 0.0 and known[i] >= _MIN_SHARE * asked[i]:
            copy_to(few, values[:, i])
            surface[i], counts[i] = _level(few, int(known[i]), slenderness[i], ground[i], noise)
    return surface, counts, moved.sum() / max(known.sum(), 1.0)


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
    read(float64, 1),
    float64,
)
def find_surface(
    points: Floats,
    tangents: Floats,
    radius: Floats,
    used: Bools,
    mask: Bytes,
    depth: npt.NDArray[Any],
    left: int,
    top: int,
    unit_m: float,
    low_m: float,
    high_m: float,
    focal_px: float,
    dx: float,
    dy: float,
    fattened: float,
    ground: Floats,
    noise: float,
) -> tuple[Floats, Floats, float]:
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
    x, y = _lay_places(points, tangents, radius, used)
    inside = np.ones(x.shape, dtype=np.bool_)
    on_mask, values = np.empty(x.shape), np.empty(x.shape)
    rows, columns = _pixels_of(y, 0.0, top, mask.shape[0], inside), _pixels_of(x, 0.0, left, mask.shape[1], inside)
    _read(mask, rows, columns, on_mask)
    inside &= on_mask != 0.0
    rows, columns = _pixels_of(y, dy, 0, depth.shape[0], inside), _pixels_of(x, dx, 0, depth.shape[1], inside)
    _read(depth, rows, columns, values)
    return _judge(
        _Sections(points, tangents, radius, ground),
        _Samples(rows, columns, inside, values),
        _DepthView(unit_m, low_m, high_m, focal_px, dx, dy, fattened, noise),
    )
