"""Corners of sharp bends that have a branch of their own: mitres, and folds whose inside is closed."""

from __future__ import annotations

import numpy as np
from numba import boolean, float64, int64, uint8

from dloftbs.kernels.compiler import Bools, Bytes, Floats, Ints, helper, kernel, read, write
from dloftbs.kernels.shared.graph_ends import FREE, TANGENT_X, TANGENT_Y, branch_of, is_start, other_end

_ALONG = 0.85
"""Cosine of the largest angle of a mitre with the middle between its two branches.

Source: by hand; 32 degrees, as short mitres are ragged.
"""

_MIN_ANGLE = 0.1
"""Smallest angle between two branches that is distinguished from parallel ones, rad.

Source: numerics; the length of a mitre diverges at 0.
"""

_LONGER = 1.25
"""Largest length of a mitre, as a multiple of that of its angle and width.

Source: by hand; skeletons are ragged.
"""

_LONGER_WIDTHS = 0.75
"""Length added to this limit, widths.

Source: by hand; skeletons are ragged.
"""

_LONGER_PX = 3.0
"""Length added to this limit, px.

Source: by hand; skeletons are ragged.
"""

_WIDE = 1.15
"""Least mean width along a mitre, widths.

Source: by hand; it narrows from two widths to one, so its mean is about one and a half.
"""

_ASIDE_RAD = (0.52, 0.79, 1.05)
"""Angles of the rays towards the corners of a tip, rad.

Source: by hand; 30, 45 and 60 degrees, where the corner of a flat tip is.
"""

_ROUND = 1.15
"""Ratio of the mask's reach aside to that ahead up to which a tip is round.

Source: measured on drawn bends of 90 to 30 degrees in every rotation, which stay below this; two in three corners of
loops that discs cut do not, as a flat tip reaches up to twice as far aside.
"""

_RAGGED_PX = 0.75
"""Length added to that reach for the pixels of an edge, px.

Source: measured with `_ROUND`.
"""

_SHAPELESS_PX = 6.0
"""Width below which a tip shows no shape, px.

Source: by hand.
"""

_OPEN = -0.5
"""Cosine of the angle between two branches up to which they are no two sides of one bend.

Source: geometry; three equal angles between the branches at a junction.
"""

_ASKEW_RAD = 0.1
"""Angle by which a fold may turn from the middle between its two sides towards one of them, beyond half the way, rad.

Source: by hand; nearer to a side, that runs straight on: to a plug, which is wider than its cable.
"""

_BEYOND_WIDTHS = 0.5
"""Largest length of the skeleton beyond the tip of a fold, widths.

Source: geometry; the skeleton of a round tip ends half a width before the edge, as the cable's axis turns there.
"""

_BEHIND_WIDTHS = 3.0
"""Distance behind a branch's end at which its width is taken, widths; at most half of the branch.

Source: by hand; nearer, what meets there widens the mask.
"""

_TIP = 0.9
"""Ratio of a place's width to the cable's above which a mitre is not yet in the cap.

Source: by hand; beyond it a skeleton is in the cap or in a corner.
"""


@helper
def _mitre_length(states: Floats, a: int, b: int, width: float) -> float:
    """Return the distance from the corner of two ends to the point where their skeletons meet, px.

    There a disc touches both outer sides and the inner corner.
    """
    cosine = states[a, TANGENT_X] * states[b, TANGENT_X] + states[a, TANGENT_Y] * states[b, TANGENT_Y]
    sine = np.sin(0.5 * max(np.arccos(min(cosine, 1.0)), _MIN_ANGLE))
    return 0.5 * width * (1.0 - sine) / (sine * (1.0 + sine))


@helper
def _apex(radius: Floats, first: int, last: int, width: float) -> tuple[int, float]:
    """Return the last point of a branch in this order at which the mask is as wide as a cable, and the mean width."""
    step = 1 if last >= first else -1
    apex, total = first, 0.0
    for k in range(abs(last - first) + 1):
        i = first + step * k
        total += 2.0 * radius[i]
        if 2.0 * radius[i] >= _TIP * width:
            apex = i
    return apex, total / (abs(last - first) + 1)


@helper
def _reach(mask: Bytes, x: float, y: float, dx: float, dy: float, most: float) -> float:
    """Measure the mask from a point along a unit vector, to a quarter of a pixel."""
    t = 0.0
    while t < most:
        row, column = int(y + t * dy + 0.5), int(x + t * dx + 0.5)
        if row < 0 or column < 0 or row >= mask.shape[0] or column >= mask.shape[1] or mask[row, column] == 0:
            break
        t += 0.25
    return t


@helper
def _is_straight(mask: Bytes, start: Floats, stop: Floats) -> bool:
    """Return whether the line between two points lies on the mask."""
    dx, dy = stop[0] - start[0], stop[1] - start[1]
    length = max(np.sqrt(dx * dx + dy * dy), 1e-9)
    return _reach(mask, start[0], start[1], dx / length, dy / length, length) >= length


@helper
def _is_round(mask: Bytes, x: float, y: float, dx: float, dy: float, width: float) -> bool:
    """Return whether the mask ends round ahead of a point, rather than where something cuts it off."""
    if width < _SHAPELESS_PX:
        return True
    ahead, aside = _reach(mask, x, y, dx, dy, 2.0 * width), 0.0
    for angle in _ASIDE_RAD:
        c, s = np.cos(angle), np.sin(angle)
        aside = max(aside, _reach(mask, x, y, c * dx - s * dy, s * dx + c * dy, 2.0 * width))
        aside = max(aside, _reach(mask, x, y, c * dx + s * dy, c * dy - s * dx, 2.0 * width))
    return aside <= _ROUND * ahead + _RAGGED_PX


@helper
def _width_behind(end: int, radius: Floats, offsets: Ints, width: float) -> float:
    """Return the width of a branch behind its end, clear of what meets there, px."""
    branch = branch_of(end)
    k = min(int(_BEHIND_WIDTHS * width), (offsets[branch + 1] - offsets[branch]) // 2)
    return 2.0 * radius[offsets[branch] + k if is_start(end) else offsets[branch + 1] - 1 - k]


@helper
def _is_fold(mask: Bytes, start: Floats, stop: Floats, side: float) -> bool:
    """Return whether two sides of a bend, `side` px wide, lie in the mask from a point up to a tip.

    It is wider than one of them up to a width before the tip, where a cable that ends there alone is as wide as it is.
    """
    dx, dy = stop[0] - start[0], stop[1] - start[1]
    length = np.sqrt(dx * dx + dy * dy)
    if length < side:
        return False
    dx, dy = dx / length, dy / length
    for k in range(int(length - side) + 1):
        x, y = start[0] + k * dx, start[1] + k * dy
        across = _reach(mask, x, y, -dy, dx, 2.0 * side) + _reach(mask, x, y, dy, -dx, 2.0 * side)
        if across < _WIDE * side:
            return False
    return True


@kernel(
    read(int64, 1), write(boolean, 1), write(boolean, 1), read(float64, 2), read(float64, 2), read(float64, 2),
    read(float64, 1), read(int64, 1), read(uint8, 2), float64,
)  # fmt: skip
def find_corners(
    nodes: Ints,
    alive: Bools,
    spurs: Bools,
    states: Floats,
    centres: Floats,
    points: Floats,
    radius: Floats,
    offsets: Ints,
    mask: Bytes,
    width: float,
) -> Ints:
    """Find the corners of bends that have a branch of their own, and make spurs of those branches.

    The skeletons of two ends that meet at a small angle join before the corner and lead there as one branch: a mitre.
    It lies between the two, is straight, has the length that follows from the angle and the width, is wider than a
    cable, since both go through it, and ends round: an occluder over a crossing leaves a corner that is cut off.

    Parameters
    ----------
    nodes : (2 n,) int64
    alive, spurs : (n,) bool
        Changed.
    states : (2 n, 6) float64
    centres : (k, 2) float64
        Of the junctions.
    points : (m, 2) float64
    radius : (m,) float64
        Half the mask's width at each point.
    offsets : (n + 1,) int64
        And more.
    mask : (H, W) uint8
    width : float
        px.

    Returns
    -------
    (2 n,) int64
        The point of the corner, for the two ends that meet there; -1 for others.
    """
    corners = np.full(len(nodes), -1, dtype=np.int64)
    for root in range(len(nodes)):
        stub, node = branch_of(root), nodes[root]
        if node < 0 or nodes[other_end(root)] != FREE or not (alive[stub] or spurs[stub]):
            continue
        count, a, b = 0, -1, -1
        for end in range(len(nodes)):
            if nodes[end] == node and alive[branch_of(end)] and end != root:
                count += 1
                a, b = b, end
        if count != 2 or branch_of(a) == branch_of(b):
            continue
        first, last = offsets[stub], offsets[stub + 1] - 1
        if not is_start(root):
            first, last = last, first
        apex, mean = _apex(radius, first, last, width)
        hx, hy = points[last, 0] - centres[node, 0], points[last, 1] - centres[node, 1]
        length = max(np.sqrt(hx * hx + hy * hy), 1e-9)
        mx, my = states[a, TANGENT_X] + states[b, TANGENT_X], states[a, TANGENT_Y] + states[b, TANGENT_Y]
        cosine = states[a, TANGENT_X] * states[b, TANGENT_X] + states[a, TANGENT_Y] * states[b, TANGENT_Y]
        if cosine <= _OPEN:
            continue
        along = (hx * mx + hy * my) / (length * max(np.sqrt(mx * mx + my * my), 1e-9))
        if along < _ALONG:
            continue
        if not _is_straight(mask, centres[node], points[apex]):
            continue
        if not _is_round(mask, points[apex, 0], points[apex, 1], hx / length, hy / length, width):
            continue
        longest = _LONGER * _mitre_length(states, a, b, width) + _LONGER_WIDTHS * width + _LONGER_PX
        is_mitre = cosine > 0.0 and (spurs[stub] or (length <= longest and mean >= _WIDE * width))
        side = 0.5 * (_width_behind(a, radius, offsets, width) + _width_behind(b, radius, offsets, width))
        askew = np.arccos(min(along, 1.0)) - 0.25 * np.arccos(min(cosine, 1.0))
        beyond = abs(last - apex)  # a thin piece: what a cut leaves of another cable
        if is_mitre or (
            askew <= _ASKEW_RAD
            and beyond <= _BEYOND_WIDTHS * side
            and _is_fold(mask, centres[node], points[apex], side)
        ):
            alive[stub], spurs[stub] = False, True
            corners[a] = corners[b] = apex
    return corners
