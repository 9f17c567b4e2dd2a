"""Lumps in the mask, as a coiled worm, a knot or a hand leave them, and ends that the mask does not show."""

from __future__ import annotations

import math

import numpy as np
from numba import boolean, float64, int64, uint8

from dloftbs.kernels.compiler import Bools, Bytes, Floats, Ints, helper, kernel, read
from dloftbs.linking.kernels.end_extension import is_inside

_CROSSING_WIDTHS = 2.0**0.5
"""Diameter of the disc up to which the mask is one cable, or another one across it, widths.

Source: geometry; the disc in a crossing at a right angle reaches the corners of a square, at any other less far.
"""

_PASSES = 2.0
"""Number of passes, side by side in a disc, of which linking knows.

Source: by definition; two cables that touch are distinguished, of more the middle one has no edge.
"""

_SAMPLE = 0.125
"""Distance from one place at which the mask is measured to the next, a share of the disc there, or of the least lump.

Source: numerics; the disc at the nearest place is smaller than the largest by an eighth at most.
"""

_STEP_PX = 0.5
"""Growth of a disc's radius from one look at its edge to the next, px.

Source: numerics; half a pixel, as the edge of a mask is known.
"""

_TANGENT_WIDTHS = 1.5
"""Length from an end over which its direction is measured, widths.

Source: geometry; long enough for a frayed end, short enough for a bend.
"""

_AROUND_WIDTHS, _AROUND_PX = 1.2, 1.0
"""Distance from an end at which ground about it shows that it is one: widths, and px.

Source: geometry; beyond the cap of a cable that is nearer, and thicker, there, and within a cable that lies across.
"""

_AROUND = tuple([(math.cos(math.radians(angle)), math.sin(math.radians(angle))) for angle in range(-80, 90, 10)])
"""Directions in which it is looked for, cosine and sine from that of the end.

Source: geometry; a cable across it reaches from 65 to 115 degrees.
"""

_ON_ANOTHER = 0.35
"""Share of the ends at which the mask goes on ahead that are ends: mostly one goes on above, below or along another.

Source: measured; of ends on the mask of another cable, of curves that are sure but for that, .2 to .6 in real and
simulated motion.
"""

_NEAR, _FAR, _DIAGONAL = 0.382683, 0.92388, 0.707107
"""Sine and cosine of an eighth of pi, and of a quarter of it, radii.

Source: geometry.
"""

_RING = (
    (1.0, 0.0),
    (0.0, 1.0),
    (_DIAGONAL, _DIAGONAL),
    (-_DIAGONAL, _DIAGONAL),
    (_FAR, _NEAR),
    (_NEAR, _FAR),
    (-_NEAR, _FAR),
    (-_FAR, _NEAR),
)
"""Directions, and their opposites, in which a disc's edge is looked at, radii.

Source: numerics; of sixteen one leads across a cable, longer than its width by a fiftieth at most.
"""


@helper
def _disc(mask: Bytes, x: float, y: float, width: float) -> float:
    """Return the diameter of the largest disc about a point that lies in the mask, or the width if that is no lump."""
    radius = 0.5 * _CROSSING_WIDTHS * width
    while True:
        for dx, dy in _RING:
            if not is_inside(mask, x + radius * dx, y + radius * dy) or not is_inside(
                mask, x - radius * dx, y - radius * dy
            ):
                measured = 2.0 * radius - _STEP_PX  # the edge lies within the last step
                return measured if measured > _CROSSING_WIDTHS * width else width
        radius += _STEP_PX


@helper
def _passage(places: Floats, discs: Floats, at: int, around: float) -> float:
    """Return the probability that a curve is right in the disc at a place, by those as far off as that one is wide.

    An end is no passage, and a lump is measured in its middle. Around a loop, of a length other than 0, places go on.
    """
    beside = 0.0
    for way in (1, -1):
        j, gone = at, 0.0
        while gone < discs[at]:
            j += way
            if around > 0.0:
                j %= len(places)
                gone = (places[j] - places[at]) * way % around
            elif 0 <= j < len(places):
                gone = (places[j] - places[at]) * way
            if not 0 <= j < len(places) or j == at or (gone < discs[at] and discs[j] > discs[at]):
                return 1.0
        beside = max(beside, discs[j])
    return min(_PASSES * beside / discs[at], 1.0)


@helper
def _goes_on(mask: Bytes, points: Floats, order: Ints, way: int, width: float) -> bool:
    """Return whether the mask goes on ahead of the first of some points in order, the last if `way` is -1.

    In a lump it does not say so.
    """
    at = 0 if way > 0 else len(order) - 1
    x, y = points[order[at], 0], points[order[at], 1]
    if _disc(mask, x, y, width) > _PASSES * width:
        return False
    dx, dy, length = 0.0, 0.0, 0.0
    while length < _TANGENT_WIDTHS * width and 0 <= at + way < len(order):
        at += way
        dx, dy = x - points[order[at], 0], y - points[order[at], 1]
        length = np.hypot(dx, dy)
    if length == 0.0:
        return False
    reach = (_AROUND_WIDTHS * width + _AROUND_PX) / length
    for ahead, aside in _AROUND:
        if is_inside(mask, x + reach * (ahead * dx - aside * dy), y + reach * (ahead * dy + aside * dx)):
            return True
    return False


@kernel(
    read(uint8, 2), read(float64, 2), read(int64, 2), read(int64, 1), int64, read(float64, 1), read(boolean, 2)
)  # fmt: skip
def course_confidence(
    mask: Bytes, points: Floats, spans: Ints, parts: Ints, n_open: int, widths: Floats, meets: Bools
) -> Floats:
    """Return the probability that the course of each line is that of one object, by the shape of the mask about it.

    What is as long as wide has no course, and what is much longer is sure of it: of an ellipse with the line's length
    and the largest width of the mask as axes, this is the square of the eccentricity. In a lump on the way, a disc that
    is much wider than the mask before and behind it, passes lie side by side: linking knows of two, the straight one
    and one that touches or crosses it, and as likely as these is any other. An end on the mask of another cable rather
    is where the line was lost.

    Parameters
    ----------
    mask : (H, W) uint8
    points : (m, 2) float64
        ``(x, y)``
    spans : (k, 3) int64
        First point, the one after the last, step; line after line.
    parts : (n + 1,) int64
        Start of each line in `spans`, and the end.
    n_open : int
        The first `n_open` lines have ends, the rest are loops.
    widths : (n,) float64
        Of the lines, px.
    meets : (n_open, 2) bool
        Whether a line's start and its end lie in a branch point, where the mask goes on.

    Returns
    -------
    (n,) float64
    """
    sure = np.ones(len(parts) - 1, dtype=np.float64)
    places, discs = np.empty(len(points), dtype=np.float64), np.empty(len(points), dtype=np.float64)
    order = np.empty(len(points), dtype=np.int64)
    for line in range(len(sure)):
        length, due, count, visited, previous = 0.0, 0.0, 0, 0, -1
        first = spans[parts[line], 0]
        for span in range(parts[line], parts[line + 1]):
            for i in range(spans[span, 0], spans[span, 1], spans[span, 2]):
                if previous >= 0:
                    length += np.hypot(points[i, 0] - points[previous, 0], points[i, 1] - points[previous, 1])
                previous = order[visited] = i
                visited += 1
                if length >= due:
                    places[count], discs[count] = length, _disc(mask, points[i, 0], points[i, 1], widths[line])
                    due = length + _SAMPLE * max(discs[count], _PASSES * widths[line])
                    count += 1
        around = 0.0
        if line >= n_open:
            length += np.hypot(points[first, 0] - points[previous, 0], points[first, 1] - points[previous, 1])
            around = length
        else:
            for way in (1, -1):
                if meets[line, (1 - way) // 2]:
                    continue
                sure[line] *= _ON_ANOTHER if _goes_on(mask, points, order[:visited], way, widths[line]) else 1.0
        widest, passage = widths[line], 1.0
        for k in range(count):
            widest = max(widest, discs[k])
            if discs[k] > _PASSES * widths[line]:
                passage = min(passage, _passage(places[:count], discs[:count], k, around))
        sure[line] *= passage * max(1.0 - (widest / length) ** 2, 0.0) if length > 0.0 else 0.0
    return sure
