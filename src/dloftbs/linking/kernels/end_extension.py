"""Extension of a run of the skeleton to the end of the cable's axis.

A cable that is cut off, by a cutter, by an occluder or by the image's border, goes on to the mask's edge. One with a
round cap is the union of discs about its axis, which ends one radius before the tip of the mask. The shape of the cap
shows which it is: so a cable ends in the middle of a ball, and at the face of a plug. The axis of a frayed cable ends
where the mask parts into strands.
"""

from __future__ import annotations

import numpy as np
from numba import float64, int64, uint8

from dloftbs.kernels.compiler import Bytes, Floats, helper, kernel, read
from dloftbs.kernels.shared.ramp import ramp_down

_TAIL_RADII = 1.5
"""Length of a skeleton's end that is left out, since it may veer into a corner, radii.

Source: geometry; thinning bends within a radius of a flat end.
"""

_FIT_RADII = 4.0
"""Length before that over which direction and bending are fitted, radii.

Source: by hand; two widths, as for all branch ends.
"""

_MIN_FIT_PX = 6.0
"""Least length over which direction and bending are fitted, px.

Source: by hand; thin cables are as coarse as their pixels.
"""

_LONGEST_RADII = 4.0
"""Largest length of an extension, radii; a longer one is no end.

Source: geometry; the part left out and a cap, with a margin.
"""

_PULL = 3.0
"""Share of the way to the middle made per step, times the radius, px.

Source: by hand; wide cables have smoother edges and need less.
"""

_MAX_PULL = 0.5
"""Largest share of the way to the middle made per step.

Source: by hand.
"""

_TURN = 0.4
"""Change of heading, rad, per px of the way to the middle and the square of that share.

Source: by hand; a damped controller of heading, the share being its gain.
"""

_HALVINGS = 24
"""Number of halvings of the step that leaves the mask.

Source: numerics; 2^-24 px.
"""

_INNER = (0.1, 0.2, 0.3)
"""Places of the rays at the middle of an end, radii to each side of the axis.

Source: by hand; a mean over both sides is less ragged than one ray, and some ray of each passes the strands of a fray.
"""

_OUTER = (0.5, 0.6, 0.7, 0.8)
"""Places of the rays at the sides of an end, radii beside the axis.

Source: by hand; the outermost fifth mixes with the cable's edge.
"""

_BACK = 0.5
"""Distance before the tip at which the rays start, radii.

Source: by hand; within the mask at the outer rays of a round end.
"""

_FARTHEST = 2.0
"""Largest length of the rays, radii.

Source: geometry; past any cap.
"""

_NARROWINGS = 8
"""Number of times that the width before a cap is measured, since a narrower one is shorter.

Source: numerics; in a cone of one width's length each halves what is left, down to 2^-8 radii.
"""

_TAPERED = 0.8
"""Width before a cap, over the cable's, below which the cable tapers.

Source: by hand; the raggedness of an edge, and a slanting cut, leave more.
"""

_TAPERED_PX = 1.0
"""Least length by which half the mask's width is less there than the cable's, px.

Source: numerics; the edge of a mask is known to a pixel.
"""

_STRAND = 0.45
"""Width of the mask, over the cable's, below which it may be a strand of a frayed end.

Source: geometry; two strands that part are half as wide as the cable.
"""

_SPLIT_RADII = 0.75
"""Longest stretch in which a cable turns into strands, radii; one that tapers takes longer.

Source: geometry; a cone of a width's length from the cable to its point narrows as fast.
"""

_STRAND_RADII = 0.25
"""Length from which a narrow stretch before the mask's edge is a strand and no part of a cap, radii; a pixel is added.

Source: geometry; a round cap is narrow for a tenth of its radius, and a slanting one differs by less beside the axis.
"""

_KNOB = 1.25
"""Radius of a knob at a cable's end, over the cable's, from which it counts; a pixel is added.

Source: by hand; more than a ragged edge, less than a connector.
"""

_LARGEST_KNOB = 4.0
"""Largest radius of a knob, and longest way from its middle to the skeleton's last point, over the cable's radius.

Source: by hand; what is larger has a skeleton of its own.
"""

_AS_WIDE = 0.9
"""Share of a knob's radius below which the skeleton has left its middle.

Source: by hand; ten pixels are known to one.
"""

_DIRECTIONS = (
    (1.0, 0.0),
    (0.0, 1.0),
    (-1.0, 0.0),
    (0.0, -1.0),
    (0.5**0.5, 0.5**0.5),
    (-(0.5**0.5), 0.5**0.5),
    (-(0.5**0.5), -(0.5**0.5)),
    (0.5**0.5, -(0.5**0.5)),
)
"""Unit vectors in which the mask about a point is measured.

Source: geometry; of a stretch without a knob the first two show most.
"""

_FLAT = 0.35
"""Roundness at and below which an end is flat.

Source: by hand; as far below one half as `_ROUND` is above it.
"""

_ROUND = 0.65
"""Roundness at and above which an end is round.

Source: by hand; one half, and a margin for the raggedness of pixels.
"""

_UNSEEN_PX = 1.5
"""Radius below which a cap is too small for its shape to be seen, px.

Source: geometry; such a disc is 3 pixels wide.
"""

_SEEN_PX = 2.25
"""Radius above which a cap's shape is seen, px.

Source: by hand; one and a half times `_UNSEEN_PX`.
"""

_MAX_AHEAD = 0.5
"""Largest correction of an end along the axis, radii.

Source: by hand; a ragged tip is no longer.
"""

_BREAK_WIDTHS = 0.5
"""Longest break of the mask in a stretch that is seen, widths.

Source: geometry; halfway across it the mask is a quarter of a width away, and the fitted curve may be as far again from
the straight line.
"""

_TIE = 1e-6
"""Shift of a place that lies in the middle between two pixels, px.

Source: numerics; such a place belongs to the pixel ahead, from wherever it is looked at.
"""


@helper
def _heading(points: Floats, arc: Floats) -> tuple[float, float]:
    """Fit a parabola to points by least squares, and return heading and curvature where `arc` is 0."""
    m = np.zeros(5)
    right = np.zeros((3, 2))
    for i in range(len(points)):
        power = 1.0
        for k in range(5):
            m[k] += power
            if k < 3:
                right[k, 0] += power * (points[i, 0] - points[0, 0])
                right[k, 1] += power * (points[i, 1] - points[0, 1])
            power *= arc[i]
    # Cramer's rule for the two coefficients that are wanted.
    a, b, c = m[2] * m[4] - m[3] * m[3], m[1] * m[4] - m[2] * m[3], m[1] * m[3] - m[2] * m[2]
    d, e, f = m[0] * m[4] - m[2] * m[2], m[0] * m[3] - m[1] * m[2], m[0] * m[2] - m[1] * m[1]
    scale = 1.0 / (m[0] * a - m[1] * b + m[2] * c)
    vx = scale * (-b * right[0, 0] + d * right[1, 0] - e * right[2, 0])
    vy = scale * (-b * right[0, 1] + d * right[1, 1] - e * right[2, 1])
    ax = scale * (c * right[0, 0] - e * right[1, 0] + f * right[2, 0])
    ay = scale * (c * right[0, 1] - e * right[1, 1] + f * right[2, 1])
    return np.arctan2(vy, vx), 2.0 * (vx * ay - vy * ax) / (vx * vx + vy * vy) ** 1.5


@helper
def is_inside(mask: Bytes, x: float, y: float) -> bool:
    """Return whether the pixel at a point is foreground; beyond the image there is none."""
    column, row = int(np.floor(x + 0.5)), int(np.floor(y + 0.5))
    return 0 <= row < mask.shape[0] and 0 <= column < mask.shape[1] and mask[row, column] != 0


@helper
def _reach(mask: Bytes, x: float, y: float, dx: float, dy: float, most: float) -> float:
    """Return how far the mask goes from a point along a unit vector, to half a pixel, or below 0 how far it is away."""
    ahead_x, ahead_y = x + _TIE * dx, y + _TIE * dy
    t = 0.5
    if is_inside(mask, ahead_x, ahead_y):
        while t < most and is_inside(mask, ahead_x + t * dx, ahead_y + t * dy):
            t += 0.5
        return t - 0.25
    while t < most and not is_inside(mask, ahead_x - t * dx, ahead_y - t * dy):
        t += 0.5
    return 0.25 - t


@helper
def _cap_radius(mask: Bytes, x: float, y: float, dx: float, dy: float, radius: float) -> float:
    """Return half the width of the mask just before the cap at a tip, px: `radius`, or less where the cable tapers."""
    narrowest = radius
    for narrowing in range(_NARROWINGS):
        before_x, before_y = x - narrowest * dx, y - narrowest * dy
        left = _reach(mask, before_x, before_y, -dy, dx, radius + 1.0)
        right = _reach(mask, before_x, before_y, dy, -dx, radius + 1.0)
        half = 0.5 * (left + right)
        if half >= narrowest or min(left, right) < 0.0:
            break
        # A slanting cut narrows one side alone.
        if narrowing == 0 and (max(left, right) >= _TAPERED * radius or half >= radius - _TAPERED_PX):
            break
        narrowest = half
    return narrowest


@helper
def _free_radius(mask: Bytes, x: float, y: float, least: float, most: float) -> float:
    """Return how far the mask goes from a point in all of eight directions, px: 0 where that is below `least`."""
    for dx, dy in _DIRECTIONS:
        if not is_inside(mask, x + (least - 0.5) * dx, y + (least - 0.5) * dy):
            return 0.0
    free = most
    for dx, dy in _DIRECTIONS:
        free = min(free, _reach(mask, x, y, dx, dy, free))
    return free if free >= least else 0.0


@helper
def _find_knob(mask: Bytes, points: Floats, radius: float) -> tuple[int, float]:
    """Find a knob at the tip: the number of points to its middle, and its radius; all and `radius` if there is none."""
    least, most = _KNOB * radius + 1.0, _LARGEST_KNOB * radius
    last, widest = len(points), radius
    for i in range(max(len(points) - int(most), 0), len(points)):
        free = _free_radius(mask, points[i, 0], points[i, 1], least, most)
        if free > 0.0:
            last, widest = i + 1, max(widest, free)
            least = _AS_WIDE * widest
    return last, widest


@helper
def _beyond_axis(mask: Bytes, x: float, y: float, dx: float, dy: float, radius: float) -> float:
    """Return how far before a tip on the mask's edge the axis ends, px; below 0 it goes on.

    The mask's extent is compared along rays beside each other. Its roundness is how much farther it reaches in the
    middle than at the sides, as a share of what it does with half a disc: 1 is round, 0 flat, below 0 hollow. Of the
    two sides the longer one counts, since a slanting cut has a short one.
    """
    x -= _BACK * radius * dx
    y -= _BACK * radius * dy
    most = _FARTHEST * radius + 1.0
    beside = (1.0 + _TIE) * radius
    middle, height = 0.0, 0.0  # the latter of a disc of radius 1, as the rays see it
    reaches = np.empty(len(_INNER))
    for side in (-beside, beside):
        for i, k in enumerate(_INNER):
            reaches[i] = _reach(mask, x - k * side * dy, y + k * side * dx, dx, dy, most)
        farthest = reaches.min() + _STRAND_RADII * radius + 1.0
        mean, disc, count = 0.0, 0.0, 0
        for i, k in enumerate(_INNER):
            if reaches[i] <= farthest:  # others are in a strand
                mean += reaches[i]
                disc += np.sqrt(1.0 - k * k)
                count += 1
        middle += 0.5 * mean / count
        height += 0.5 * disc / count
    longer, fall = -most, height
    for side in (-beside, beside):
        mean = 0.0
        for k in _OUTER:
            mean += _reach(mask, x - k * side * dy, y + k * side * dx, dx, dy, most) / len(_OUTER)
        longer = max(longer, mean)
    for k in _OUTER:
        fall -= np.sqrt(1.0 - k * k) / len(_OUTER)
    share = 1.0 - ramp_down((middle - longer) / (fall * radius), _FLAT, _ROUND)
    share *= 1.0 - ramp_down(radius, _UNSEEN_PX, _SEEN_PX)
    ahead = middle - _BACK * radius  # the middle is less ragged than the edge at the tip
    return share * height * radius - min(max(ahead, -_MAX_AHEAD * radius), _MAX_AHEAD * radius)


@helper
def _way_inside(mask: Bytes, x: float, y: float, dx: float, dy: float) -> float:
    """Return how far the mask goes from a point along a unit vector, at most 1."""
    ahead_x, ahead_y = x + _TIE * dx + 0.5, y + _TIE * dy + 0.5
    if mask[int(ahead_y + dy), int(ahead_x + dx)] != 0:
        return 1.0
    inside, outside = 0.0, 1.0
    for _ in range(_HALVINGS):
        t = 0.5 * (inside + outside)
        if mask[int(ahead_y + t * dy), int(ahead_x + t * dx)] != 0:
            inside = t
        else:
            outside = t
    return inside


@helper
def _shortened(points: Floats, back: float) -> Floats:
    """Return a line without its last stretch of a length in px; its first point stays."""
    count = len(points)
    while count > 1:
        dx, dy = points[count - 2, 0] - points[count - 1, 0], points[count - 2, 1] - points[count - 1, 1]
        step = np.sqrt(dx * dx + dy * dy)
        if step > back:
            shorter = points[:count].copy()
            shorter[count - 1, 0] += back / step * dx
            shorter[count - 1, 1] += back / step * dy
            return shorter
        back -= step
        count -= 1
    return points[:1].copy()


@kernel(read(uint8, 2), read(float64, 2), float64)
def extend_end(mask: Bytes, points: Floats, radius: float) -> tuple[int, Floats]:
    """Lead a free end on to where the axis ends, in the place of the skeleton's tail, which may veer into a corner.

    From one and a half radii before the last point on, the line goes on with the bending that it has there, drawn to
    the middle between the walls while there are two. Where the mask's cap is flat or hollow, as where a cable is cut
    off, hidden or leaves the image, it ends on the mask's edge, taken over the middle of the cap. Where it is round it
    ends a radius before. In between it ends in between, and below a width of 3 px every cap counts as flat. The cap of
    a cable that tapers is as narrow as that is there, and one in a knob is as wide. Where the line leads into a strand
    of a frayed end, it ends where the strands begin. Not checked: the outermost rows and columns of the mask are 0.

    Parameters
    ----------
    mask : (H, W) uint8
    points : (n, 2) float64
        Re-centred, ``(x, y)``, towards the tip.
    radius : float
        Half the width of the mask near the end.

    Returns
    -------
    drop : int
        Number of last points to leave out.
    added : (m, 2) float64
        Points in their place, about 1 px apart. Both are nothing where the points are too few to show a direction,
        or the mask does not end within reach.
    """
    nothing = np.empty((0, 2))
    n, radius = _find_knob(mask, points, radius)
    arc = np.zeros(n)  # from the tip backwards
    for i in range(n - 2, -1, -1):
        arc[i] = arc[i + 1] + np.hypot(points[i + 1, 0] - points[i, 0], points[i + 1, 1] - points[i, 1])
    tail = min(_TAIL_RADII * radius, 0.4 * arc[0])
    stop = n
    while stop > 1 and arc[stop - 1] < tail - _TIE:
        stop -= 1
    start = stop - 1
    while start > 0 and arc[start - 1] <= arc[stop - 1] + max(_FIT_RADII * radius, _MIN_FIT_PX) + _TIE:
        start -= 1
    if stop - start < 4:
        return 0, nothing
    heading, bending = _heading(points[start:stop], arc[stop - 1] - arc[start:stop])
    tightest = 0.5 / radius
    bending = min(max(bending, -tightest), tightest)

    x, y = points[stop - 1]
    pull = min(_PULL / radius, _MAX_PULL)
    too_far = 2.0 * radius + 2.0
    narrow = int(_STRAND_RADII * radius) + 1
    limit = int(_LONGEST_RADII * radius) + 4
    wide_until, narrow_from = -limit, 0  # steps: the last as wide as the cable, the first of those as narrow as strands
    added = np.empty((limit + 1, 2))
    count = 0
    while count < limit:
        heading += bending
        dx, dy = np.cos(heading), np.sin(heading)
        step = _way_inside(mask, x, y, dx, dy)
        x += step * dx
        y += step * dy
        if step == 1.0:
            ahead_x, ahead_y = x + _TIE * dx, y + _TIE * dy
            left = _reach(mask, ahead_x, ahead_y, -dy, dx, too_far)
            right = _reach(mask, ahead_x, ahead_y, dy, -dx, too_far)
            half = 0.5 * (left + right)
            if half >= _TAPERED * radius:
                wide_until = count
            if half >= _STRAND * radius:
                narrow_from = count + 1
            elif count - narrow_from >= narrow and narrow_from - wide_until <= _SPLIT_RADII * radius + 1.0:
                return len(points) - stop, added[: wide_until + 1].copy()
            other = abs(half - radius)
            beside = ramp_down(other, 0.2 * radius + 0.25, 0.4 * radius + 0.5) * 0.5 * (left - right)
            x -= pull * beside * dy
            y += pull * beside * dx
            heading += _TURN * pull * pull * beside
        added[count, 0], added[count, 1] = x, y
        count += 1
        if step < 1.0:
            beyond = _beyond_axis(mask, x, y, dx, dy, _cap_radius(mask, x, y, dx, dy, radius))
            added[count - 1, 0] -= min(beyond, 0.0) * dx
            added[count - 1, 1] -= min(beyond, 0.0) * dy
            return len(points) - stop, _shortened(added[:count], max(beyond, 0.0))
    return 0, nothing


@kernel(read(uint8, 2), read(float64, 2), int64, int64, float64)
def is_seen(mask: Bytes, points: Floats, i: int, j: int, width: float) -> bool:
    """Return whether a cable can be seen all the way between two points: the mask has no long break.

    Parameters
    ----------
    mask : (H, W) uint8
    points : (n, 2) float64
    i, j : int
        The points.
    width : float
        Of the cable, px.

    Returns
    -------
    bool
    """
    way_x, way_y = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1]
    length = np.hypot(way_x, way_y)
    if length <= 2.0 * width:  # half a width at each end is on the mask
        return True
    steps, last, longest = int(length) + 1, -1, _BREAK_WIDTHS * width
    for k in range(steps + 1):
        t = k * (1.0 / steps) if k < steps else 1.0
        column, row = int(np.rint(points[i, 0] + way_x * t)), int(np.rint(points[i, 1] + way_y * t))
        if mask[min(max(row, 0), mask.shape[0] - 1), min(max(column, 0), mask.shape[1] - 1)] != 0:
            if k - last - 1 > longest:
                return False
            last = k
    return steps - last <= longest
