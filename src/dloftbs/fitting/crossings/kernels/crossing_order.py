"""Order of two objects at a crossing: on top lies the one whose surface there continues that of its two sides.

Every crossing has the same places, in this order: a square grid over the crossing, `ACROSS` lines across the first
object times `ACROSS` across the second, then for each pass, for each of its two sides, `ALONG` rows of `ACROSS` places.
"""

from __future__ import annotations

import numpy as np
from numba import boolean, float64, int64, uint8

from dloftbs.kernels.compiler import Bools, Bytes, Floats, Ints, helper, kernel, read
from dloftbs.kernels.shared.few import median
from dloftbs.kernels.shared.gaussian import MEDIAN_DEVIATION
from dloftbs.kernels.shared.selection import count_up_to, median_of

ACROSS = 7
"""Number of places across a pass.

Source: bounds time; odd, so that one lies on the axis.
"""

ALONG = 6
"""Number of rows of places along a side.

Source: bounds time; enough for the median of the depth.
"""

PLACES = ACROSS * ACROSS + 4 * ALONG * ACROSS
"""Number of places of a crossing.

Source: by definition; a grid and four sides.
"""

_HALF = 0.42
"""Distance from the axis up to which places go, widths; `_BORDER_PX` short of the border.

Source: by hand.
"""

_BORDER_PX = 1.0
"""Distance from the border within which there are no places, px.

Source: geometry; pixels there mix with, or are rounded to, what lies behind.
"""

_MIN_HALF = 0.15
"""Distance from the axis up to which places go at the least, widths.

Source: by hand; thin cables have nothing but border.
"""

_STEP = 0.3
"""Distance from row to row of a side, widths.

Source: by hand; six rows are one and a half widths.
"""

_CLEAR = 0.4
"""Distance from the other object to the first row, widths.

Source: by hand; shadows and mixed pixels lie nearer.
"""

_CHORD = 0.75
"""Distance to either side over which the direction at a crossing is taken, widths.

Source: as `_CHORD_WIDTHS` of `curve_crossings`.
"""

_MIN_SINE = 0.3
"""Sine of the crossing angle below which the upper pass stays unknown.

Source: by hand; more oblique crossings are too long for the sides to foretell them.
"""

_CORE = 2
"""Number of places to either side of the axis that show the depth.

Source: by hand; farther out depth mixes.
"""

_MIN_KNOWN = 6
"""Smallest number of places with depth.

Source: by hand; holes of depth are as large as crossings.
"""

_MIN_NOISE = 1e-4
"""Least noise of depth, 1 / m: its deviation is this times the depth squared.

Source: numerics; far below any camera's.
"""


@helper
def _point(points: Floats, arc: Floats, low: int, high: int, closed: bool, at: float) -> tuple[float, float]:
    """Return the point of a curve, whose vertices are ``low..high - 1``, at an arc length; NaN beyond its ends."""
    length = arc[high - 1]
    if closed:
        at %= length
    if not 0.0 <= at <= length:
        return np.nan, np.nan
    i = min(low + count_up_to(arc[low:high], at) - 1, high - 2)
    step = arc[i + 1] - arc[i]
    share = (at - arc[i]) / step if step > 0.0 else 0.0
    x = points[i, 0] + share * (points[i + 1, 0] - points[i, 0])
    return x, points[i, 1] + share * (points[i + 1, 1] - points[i, 1])


@helper
def _direction(
    points: Floats, arc: Floats, low: int, high: int, closed: bool, at: float, reach: float
) -> tuple[float, float]:
    """Return the unit vector from `reach` before an arc length to as much after it; NaN where the curve ends before."""
    ax, ay = _point(points, arc, low, high, closed, at - reach)
    bx, by = _point(points, arc, low, high, closed, at + reach)
    norm = np.hypot(bx - ax, by - ay)
    if not norm > 0.0:
        return np.nan, np.nan
    return (bx - ax) / norm, (by - ay) / norm


@kernel(
    read(float64, 2),
    read(float64, 1),
    read(int64, 1),
    read(boolean, 1),
    read(float64, 1),
    read(int64, 2),
    read(float64, 2),
)
def choose_places(
    points: Floats, arc: Floats, first: Ints, closed: Bools, widths: Floats, curves: Ints, at: Floats
) -> Floats:
    """Choose where to look at crossings; NaN where a curve ends too early or the crossing is too oblique.

    Parameters
    ----------
    points, arc, first, closed, widths
        The flattened curves, as `select_crossings` takes them.
    curves : (k, 2) int64
    at : (k, 2) float64
        The crossings, as `select_crossings` returns them.

    Returns
    -------
    (k, PLACES, 2) float64
        ``(x, y)`` px.
    """
    places = np.full((len(curves), PLACES, 2), np.nan)
    offsets = np.empty((2, ACROSS))
    direction = np.empty((2, 2))
    for k in range(len(curves)):
        for p in range(2):
            c = curves[k, p]
            half = max(min(_HALF * widths[c], 0.5 * widths[c] - _BORDER_PX), _MIN_HALF * widths[c])
            for i in range(ACROSS):
                offsets[p, i] = -half + i * (2.0 * half / (ACROSS - 1))
            tx, ty = _direction(points, arc, first[c], first[c + 1], closed[c], at[k, p], _CHORD * widths[c])
            direction[p, 0], direction[p, 1] = tx, ty
        sine = direction[0, 0] * direction[1, 1] - direction[0, 1] * direction[1, 0]
        cosine = abs(direction[0, 0] * direction[1, 0] + direction[0, 1] * direction[1, 1])
        if not abs(sine) >= _MIN_SINE:
            continue
        a = curves[k, 0]
        x, y = _point(points, arc, first[a], first[a + 1], closed[a], at[k, 0])
        n = 0
        for i in range(ACROSS):
            for j in range(ACROSS):
                # So far off the first axis along the second, and off the second along the first.
                along_b, along_a = offsets[0, i] / sine, -offsets[1, j] / sine
                places[k, n, 0] = x + along_a * direction[0, 0] + along_b * direction[1, 0]
                places[k, n, 1] = y + along_a * direction[0, 1] + along_b * direction[1, 1]
                n += 1
        for p in range(2):
            c, width, other = curves[k, p], widths[curves[k, p]], widths[curves[k, 1 - p]]
            start = 0.5 * (other + width * cosine) / abs(sine) + _CLEAR * max(width, other)
            for side in (-1.0, 1.0):
                for row in range(ALONG):
                    where = at[k, p] + side * (start + row * _STEP * width)
                    x, y = _point(points, arc, first[c], first[c + 1], closed[c], where)
                    tx, ty = _direction(points, arc, first[c], first[c + 1], closed[c], where, 0.5 * _STEP * width)
                    for i in range(ACROSS):
                        places[k, n, 0] = x - offsets[p, i] * ty
                        places[k, n, 1] = y + offsets[p, i] * tx
                        n += 1
    return places


@kernel(read(float64, 3), int64, int64)
def find_pixels(places: Floats, height: int, width: int) -> tuple[Ints, Ints]:
    """Return the rows and columns of the pixels that places lie in, -1 both outside of the image.

    Parameters
    ----------
    places : (k, n, 2) float64
        ``(x, y)`` px; NaN counts as outside.
    height, width : int
        Of the image.

    Returns
    -------
    rows, columns : (k, n) int64
    """
    rows = np.full(places.shape[:2], -1, dtype=np.int64)
    columns = rows.copy()
    for k in range(len(places)):
        for i in range(places.shape[1]):
            x, y = places[k, i, 0] + 0.5, places[k, i, 1] + 0.5
            if 0.0 <= x < width and 0.0 <= y < height:
                rows[k, i], columns[k, i] = int(y), int(x)
    return rows, columns


@helper
def _median(values: Floats, least: int) -> float:
    """Return the median of those values that are numbers; NaN where these are fewer than `least`."""
    known, count = np.empty(len(values)), 0
    for k in range(len(values)):
        if not np.isnan(values[k]):
            known[count] = values[k]
            count += 1
    return median_of(known[:count]) if count >= least else np.nan


@helper
def _roughness(sides: Floats, low: int, high: int) -> float:
    """Return the noise's standard deviation in some columns of sides (2, ALONG, n), by what no slope shows in.

    These are the second differences.
    """
    second = np.empty(2 * (ALONG - 2) * (high - low))
    count = 0
    for side in range(2):
        for row in range(ALONG - 2):
            for i in range(low, high):
                second[count] = abs(sides[side, row + 2, i] - 2.0 * sides[side, row + 1, i] + sides[side, row, i])
                count += 1
    return _median(second, 1) / (MEDIAN_DEVIATION * np.sqrt(6.0))


@helper
def _read_sides(values: Floats, p: int, sides: Floats) -> None:
    """Write the values (PLACES,) beside a crossing of one of its passes, (2, ALONG, ACROSS)."""
    n = (ACROSS + 2 * p * ALONG) * ACROSS
    for side in range(2):
        for row in range(ALONG):
            for i in range(ACROSS):
                sides[side, row, i] = values[n]
                n += 1


@kernel(read(float64, 2), float64, float64, float64, read(float64, 1), float64)
def judge_depth(
    stored: Floats, unit_m: float, low_m: float, high_m: float, pixels: Floats, resolution_m: float
) -> Floats:
    """Find from depth which pass is on top.

    For each pass the depth at the crossing is predicted from its two sides, from places that are as far from it on the
    one as on the other, so that a slope does not matter, whatever is missing. The one that the depth measured there
    agrees with better is on top.

    Parameters
    ----------
    stored : (k, PLACES) float64
        Depth at the places, counts; NaN where there is none.
    unit_m : float
        Metres of one count.
    low_m, high_m : float
        Depth outside of this range is missing.
    pixels : (k,) float64
        Number of pixels of one side, about.
    resolution_m : float
        Step of the depth's values.

    Returns
    -------
    (k,) float64
        By how much better it agrees with the first pass than with the second, as a multiple of the noise's deviation:
        below 0 where the second is on top, 0 where it cannot be decided.
    """
    result, values = np.zeros(len(stored)), np.empty(PLACES)
    low, high = ACROSS // 2 - _CORE, ACROSS // 2 + _CORE + 1
    predicted, sides = np.empty(2), np.empty((2, ALONG, ACROSS))
    core, pairs = np.empty((high - low) ** 2), np.empty(ALONG * (high - low))
    for k in range(len(stored)):
        for n in range(PLACES):
            metres = stored[k, n] * unit_m
            values[n] = metres if low_m <= metres <= high_m else np.nan
        n = 0
        for i in range(low, high):
            for j in range(low, high):
                core[n] = values[i * ACROSS + j]
                n += 1
        measured = _median(core, _MIN_KNOWN)
        variance = resolution_m**2 / 12.0
        for p in range(2):
            _read_sides(values, p, sides)
            n, known = 0, 0
            for row in range(ALONG):
                for i in range(low, high):
                    pairs[n] = 0.5 * (sides[0, row, i] + sides[1, row, i])
                    known += not np.isnan(pairs[n])
                    n += 1
            predicted[p] = _median(pairs, _MIN_KNOWN)
            # A median's variance is pi / 2 times that of the mean, and a pair's is half that of one.
            share = 1.0 / min(max(pixels[k], 1.0), float(max(known, 1)))
            variance += share * (np.pi / 4.0) * _roughness(sides, low, high) ** 2
        miss = np.abs(predicted - measured)
        if not np.isnan(miss[0] + miss[1] + variance):
            result[k] = (miss[1] - miss[0]) / max(np.sqrt(variance), _MIN_NOISE * measured * measured)
    return result


@kernel(read(uint8, 3), read(int64, 2), read(int64, 2))
def judge_image(image: Bytes, rows: Ints, columns: Ints) -> Floats:
    """Find from colours which pass is on top.

    For each pass its look across is predicted from its two sides: its colour, its shading and its darker borders. At
    the crossing only the one on top looks like that. So where the two differ in colour, the colour decides, and where
    they do not, the borders and highlights that run on.

    Parameters
    ----------
    image : (H, W, 3) uint8
    rows, columns : (k, PLACES) int64
        Pixels of the places; -1 where there is none: then nothing is known.

    Returns
    -------
    (k,) float64
        The share by which the first pass agrees better than the second: from -1 to 1, 0 where it cannot be decided.
    """
    result, values = np.zeros(len(rows)), np.empty((3, PLACES))
    look, sides, few = np.empty((2, ACROSS, 3)), np.empty((3, 2, ALONG, ACROSS)), np.empty(ALONG)
    for k in range(len(rows)):
        if (rows[k] < 0).any():
            continue
        for n in range(PLACES):
            for channel in range(3):
                values[channel, n] = image[rows[k, n], columns[k, n], channel]
        spread = 0.0
        for p in range(2):
            for channel in range(3):
                _read_sides(values[channel], p, sides[channel])
            for i in range(ACROSS):
                for channel in range(3):
                    level, squares = 0.0, 0.0
                    for side in range(2):
                        level += 0.5 * median(sides[channel, side, :, i], few)
                    for side in range(2):
                        for row in range(ALONG):
                            squares += (sides[channel, side, row, i] - level) ** 2
                    look[p, i, channel] = level
                    spread += squares / (2 * ALONG)
        noise = np.sqrt(spread / (2 * ACROSS))
        one, two = 0.0, 0.0
        for i in range(ACROSS):
            for j in range(ACROSS):
                for channel in range(3):
                    value = values[channel, i * ACROSS + j]
                    one += (value - look[0, i, channel]) ** 2
                    two += (value - look[1, j, channel]) ** 2
        one, two = np.sqrt(one / ACROSS**2), np.sqrt(two / ACROSS**2)
        worse = max(one, two) + noise
        if worse > 0.0:
            result[k] = (two - one) / worse
    return result
