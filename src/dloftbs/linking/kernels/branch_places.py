"""The place at which a branch leaves a trunk, by the outline of the mask around both."""

from __future__ import annotations

import math

import numpy as np
from numba import float64, int64, uint8

from dloftbs.kernels.compiler import Bytes, Floats, Ints, helper, kernel, read
from dloftbs.kernels.shared.polyline import chord_direction, polyline_length
from dloftbs.kernels.shared.selection import falling_order, median_of

_BENDING = 0.1
"""Share by which the squares of the outline's distances count more, per bend of the branch.

The bend is its width times the integral of the squared curvature. It is a share, since the noise of an outline is not
known.

Source: measured with `benchmarks.branched_motion` and on drawn harnesses; of .05, .1 and .2, .91 of the branch points
of five sources are within 10 px. Under tape, .69, .76 and .88 of them are.
"""

_UNEXPLAINED_WIDTHS = 0.1
"""Distance from a cable's edge from which on the outline is that of something else, widths.

Source: measured, as `_BENDING`; of .25 as many are within 10 px, to a hundredth, but fewer under ties and tape.
"""

_WIDER_WIDTHS = 0.08
"""Excess of a branch's radius over what it is farther out up to which it lies beside no other, widths.

Source: numerics; a pixel of a cable of twelve.
"""

_EDGE_PX = 1.0
"""Least value of both, px.

Source: numerics; to half a pixel the edge of a mask is known, and so is the axis of a branch.
"""

_CLEAR_WIDTHS = 1.0
"""Length over which a branch lies beside no other before it is clear of the joint, widths.

Source: geometry; the mask around a cable's axis reaches half as far to each side.
"""

_COVERED_WIDTHS = 0.9
"""Length along two of three branches over which the mask is wider, above which something covers the joint, widths.

Source: measured, as `_BENDING`; of bare joints without noise one in a hundred has .8 to .9, under tape all have more.
"""

_AROUND_WIDTHS = 2.0
"""Distance from the places where the branches are clear of the joint within which the outline is looked at, widths.

Source: measured; within one width, a branch that leaves along the trunk is placed 18 px off, in place of 15.
"""

_SAMPLES_PER_WIDTH = 6.0
"""Number of pixels of the outline that are looked at, per width and line; all of them in narrower cables.

Source: numerics; every other pixel of a cable of twelve, where as many branch points are right as with each.
"""

_PARTS = 12
"""Number of straight parts of an axis.

Source: numerics; an arc of a right angle differs from twelve chords by two thousandths of its radius.
"""

_PLACES_PER_WIDTH = 2.0
"""First guesses of the place on the trunk, per width.

Source: numerics; the next guesses are between these.
"""

_TURNS_RAD = (-1.0, -0.5, 0.0, 0.5, 1.0)
"""First guesses of the turn of a branch from its chord, where it leaves the trunk, rad.

Source: numerics; the next guesses are between these.
"""

_PULLS = (0.5, 1.0, 2.0, 3.0)
"""Guesses of how far a branch goes on in its first direction, a share of how far an even bend does.

Source: numerics; without .5, up to a twelfth fewer branch points are within 5 px.
"""

_HALVINGS = 3
"""Number of times that the steps of the guesses are halved.

Source: numerics; down to a sixteenth of a width.
"""


@helper
def _clear_ray(ray: Floats, points: Floats, radii: Floats, width: float) -> tuple[float, float]:
    """Fill a ray (4,) towards the joint from where a branch is clear of it.

    Return half the branch's width, and the length over which the mask is wider, px.
    """
    radius = median_of(radii[len(radii) // 2 :])
    at, wider, gone = len(points) - 1, 0.0, 0.0
    for k in range(1, len(points)):
        gone += np.hypot(points[k, 0] - points[k - 1, 0], points[k, 1] - points[k - 1, 1])
        if radii[k] > radius + max(_WIDER_WIDTHS * width, _EDGE_PX):
            wider = gone
        if gone - wider >= _CLEAR_WIDTHS * width:
            at = k
            break
    reach = max(int(radius), 1)
    ray[0], ray[1] = points[at]
    ray[2], ray[3] = chord_direction(points, min(at + reach, len(points) - 1), max(at - reach, 0))
    return radius, wider


@helper
def _hermite(line: Floats, x: float, y: float, dx: float, dy: float, ray: Floats) -> None:
    """Fill a line (n, 2) from a place along a direction to a ray's place, against its direction.

    Of a unit direction, the line bends as evenly as it can; along a longer one it goes on farther.
    """
    length = np.hypot(ray[0] - x, ray[1] - y)
    for k in range(len(line)):
        s = k / (len(line) - 1)
        to = s * s * (3.0 - 2.0 * s)
        out, back = length * s * (1.0 - s) * (1.0 - s), length * s * s * (1.0 - s)
        line[k, 0] = x + to * (ray[0] - x) + out * dx + back * ray[2]
        line[k, 1] = y + to * (ray[1] - y) + out * dy + back * ray[3]


@helper
def _place_on(line: Floats, at: float) -> tuple[float, float]:
    """Return the place on a line (n, 2) at a number of its points, and a share of the way to the next one."""
    low = min(int(at), len(line) - 2)
    share = at - low
    x = (1.0 - share) * line[low, 0] + share * line[low + 1, 0]
    return x, (1.0 - share) * line[low, 1] + share * line[low + 1, 1]


@helper
def _away(line: Floats, x: float, y: float) -> float:
    """Return the distance of a place from a line (n, 2), px."""
    nearest = np.inf
    for k in range(len(line) - 1):
        dx, dy = line[k + 1, 0] - line[k, 0], line[k + 1, 1] - line[k, 1]
        px, py = x - line[k, 0], y - line[k, 1]
        t = min(max((px * dx + py * dy) / (dx * dx + dy * dy + 1e-9), 0.0), 1.0)
        px, py = px - t * dx, py - t * dy
        nearest = min(nearest, px * px + py * py)
    return math.sqrt(nearest)


@helper
def _outline(mask: Bytes, rays: Floats, radii: Floats, width: float) -> Floats:
    """Return places of the outline between the rays, and room for their distance from the trunk's edge (n, 3), px."""
    margin = _AROUND_WIDTHS * width
    left = max(int(rays[:, 0].min() - margin), 0)
    right = min(int(rays[:, 0].max() + margin), mask.shape[1] - 2)
    top = max(int(rays[:, 1].min() - margin), 0)
    bottom = min(int(rays[:, 1].max() + margin), mask.shape[0] - 2)
    spacing = max(int(width / _SAMPLES_PER_WIDTH), 1)
    found = np.empty((2 * max(right - left, 1) * max(bottom - top, 1) // spacing + 1, 3), dtype=np.float64)
    count, seen = 0, 0
    for row in range(top, bottom):
        for column in range(left, right):
            for down in range(2):
                if (mask[row, column] != 0) == (mask[row + down, column + 1 - down] != 0):
                    continue
                seen += 1
                if seen % spacing != 0:
                    continue
                x, y = column + 0.5 * (1 - down), row + 0.5 * down
                beyond = False
                for k in range(len(rays)):
                    px, py = x - rays[k, 0], y - rays[k, 1]
                    beyond |= (
                        px * rays[k, 2] + py * rays[k, 3] < 0.0
                        and abs(px * rays[k, 3] - py * rays[k, 2]) < 2.0 * radii[k]
                    )
                if not beyond:
                    found[count, 0], found[count, 1] = x, y
                    count += 1
    return found[:count]


@helper
def _lay_trunk(trunk: Floats, outline: Floats, rays: Floats, radii: Floats, branch: int) -> Floats:
    """Lay the trunk between the two rays that are not the branch's; return the outline, what is far from it first."""
    start, stop = (branch + 1) % 3, (branch + 2) % 3
    _hermite(trunk, rays[start, 0], rays[start, 1], rays[start, 2], rays[start, 3], rays[stop])
    for k in range(len(outline)):
        outline[k, 2] = _away(trunk, outline[k, 0], outline[k, 1]) - max(radii[start], radii[stop])
    return outline[falling_order(np.abs(outline[:, 2]))]  # so that bad guesses show early


@helper
def _cost(
    outline: Floats,
    trunk: Floats,
    branch: Floats,
    ray: Floats,
    radius: float,
    width: float,
    at: float,
    turn: float,
    pull: float,
    most: float,
) -> float:
    """Return how badly a branch explains the outline: squares of the distances from its edge, and how much it bends.

    It leaves the trunk at a number of the trunk's points, with a turn from the chord, rad, and a pull. What costs more
    than `most` costs more by any amount.
    """
    x, y = _place_on(trunk, at)
    angle = math.atan2(ray[1] - y, ray[0] - x) + turn
    _hermite(branch, x, y, pull * math.cos(angle), pull * math.sin(angle), ray)
    bending = 0.0
    for k in range(1, len(branch) - 1):
        ax, ay = branch[k, 0] - branch[k - 1, 0], branch[k, 1] - branch[k - 1, 1]
        bx, by = branch[k + 1, 0] - branch[k, 0], branch[k + 1, 1] - branch[k, 1]
        a, b = math.sqrt(ax * ax + ay * ay) + 1e-9, math.sqrt(bx * bx + by * by) + 1e-9
        turned = 2.0 - 2.0 * (ax * bx + ay * by) / (a * b)  # the square of the angle, nearly
        bending += 2.0 * turned / (a + b)
    weight = max(int(width / _SAMPLES_PER_WIDTH), 1) / width * (1.0 + _BENDING * width * bending)
    total, unexplained = 0.0, max(_UNEXPLAINED_WIDTHS, _EDGE_PX / width)
    for k in range(len(outline)):
        if total >= most:
            break
        off = min(outline[k, 2], _away(branch, outline[k, 0], outline[k, 1]) - radius) / width
        total += weight * min(off * off, unexplained * unexplained)
    return total


@kernel(read(uint8, 2), read(float64, 2), read(float64, 1), read(int64, 1), float64)
def branch_place(mask: Bytes, points: Floats, radii: Floats, offsets: Ints, width: float) -> tuple[bool, float, float]:
    """Return the place at which one of three branches leaves the other two, the trunk.

    The trunk is a cubic from where the one is clear of the joint to where the other is. The branch is another cubic,
    from the trunk to where it is clear. Of all such branches of each of the three trunks, that is taken whose edge,
    with that of the trunk, is nearest to the outline of the mask, and that bends little.

    Parameters
    ----------
    mask : (H, W) uint8
    points : (n, 2) float64
        Axes ``(x, y)`` of three branches, from the joint on.
    radii : (n,) float64
        Half the mask's width there, px.
    offsets : (4,) int64
        Start of each branch in `points`, and the end.
    width : float
        Of a cable, px.

    Returns
    -------
    shown : bool
        Whether the outline shows the place. It does not where something covers the joint.
    x, y : float
        0 where it does not.
    """
    rays, radius, wider = np.empty((3, 4)), np.empty(3), np.empty(3)
    for k in range(3):
        own = slice(offsets[k], offsets[k + 1])
        radius[k], wider[k] = _clear_ray(rays[k], points[own], radii[own], width)
    if median_of(wider) > _COVERED_WIDTHS * width:
        return False, 0.0, 0.0
    trunk, branch = np.empty((_PARTS + 1, 2)), np.empty((_PARTS + 1, 2))
    outline = _outline(mask, rays, radius, width)
    least, first, step, at, turn, pull = np.inf, 0, 0.0, 0.0, 0.0, 1.0
    for one in range(3):
        outline = _lay_trunk(trunk, outline, rays, radius, one)
        count = max(int(_PLACES_PER_WIDTH * polyline_length(trunk) / width), 2)
        apart = _PARTS / count
        for guess in _PULLS:
            for k in range(1, count):
                for way in _TURNS_RAD:
                    cost = _cost(outline, trunk, branch, rays[one], radius[one], width, k * apart, way, guess, least)
                    if cost < least:
                        least, first, step, at, turn, pull = cost, one, apart, k * apart, way, guess
    outline = _lay_trunk(trunk, outline, rays, radius, first)
    turning = _TURNS_RAD[1] - _TURNS_RAD[0]
    for _ in range(_HALVINGS):
        step, turning = 0.5 * step, 0.5 * turning
        middle, ahead = at, turn
        for k in range(-1, 2):
            for n in range(-1, 2):
                x, way = middle + k * step, ahead + n * turning
                if 0.0 <= x <= _PARTS:
                    cost = _cost(outline, trunk, branch, rays[first], radius[first], width, x, way, pull, least)
                    if cost < least:
                        least, at, turn = cost, x, way
    x, y = _place_on(trunk, at)
    return True, x, y
