"""End states of branches: position clear of the junction, outward tangent and curvature; shapes of free ends."""

from __future__ import annotations

import numpy as np
from numba import float64, int64, uint8

from dloftbs.kernels.compiler import Bytes, Floats, Ints, helper, kernel, read
from dloftbs.kernels.shared.graph_ends import (
    CURVATURE,
    FREE,
    HAS_CURVATURE,
    TANGENT_X,
    TANGENT_Y,
    X,
    Y,
    branch_of,
    inward,
    other_end,
    start_of,
    stop_of,
)

_REACH_WIDTHS = 2.0
"""Length of a branch over which its end's direction and curvature are fitted, widths.

Source: by hand.
"""

_CLEAR_WIDTHS = 0.25
"""Distance outside of a junction at which the fit starts, widths.

Source: by hand; the skeleton bends near a junction.
"""

_BLUNT_WIDTHS = 0.5
"""Distance inside of a free end at which the fit starts, widths.

Source: geometry; thinning bends ends into corners within half a width.
"""

_STRAIGHT_WIDTHS = 1.0
"""Length below which a branch end is fitted as straight, widths.

Source: by hand; over less, noise bends a parabola more than cables do.
"""

_MIN_POINTS = 3
"""Smallest number of points of a fit.

Source: by definition; a parabola has three coefficients.
"""

_TAPERED = 0.92
"""Ratio of a place's width to the usual one below which a free end tapers there.

Source: by hand.
"""

_TAPER_WIDTHS = 2.2
"""Largest length of a taper, widths; a longer narrow stretch is a narrow cable.

Source: geometry; a cut at an angle of 25 degrees to the axis is as long.
"""

_WIDENED = 1.05
"""Ratio of a place's width to the usual one above which another cable widens the mask there, before a junction.

Source: by hand; more than pixels and a changing distance make of a cable within a few widths.
"""

_WIDENED_PX = 0.1
"""Length that half the width at such a place exceeds that by, px.

Source: by hand; about the noise of half a width, smoothed along the branch.
"""

_WIDENED_WIDTHS = 4.0
"""Largest length of such a stretch, widths.

Source: geometry; two cables that part at 14 degrees are a width apart after it.
"""

_ACROSS = np.linspace(-0.75, 0.75, 11)
"""Places across an end at which the mask ahead is measured, radii.

Source: by hand; eleven places, short of the edge, whose pixels are ragged.
"""

# How far the mask goes ahead there, in radii, is about c + slant * k + roundness * sqrt(1 - k^2): least squares.
_, _TO_SLANT, _TO_ROUND = np.linalg.pinv(np.stack([np.ones_like(_ACROSS), _ACROSS, np.sqrt(1.0 - _ACROSS**2)], axis=1))

_CAP_WIDTHS = 0.8
"""Distance before a free end from which its roundness is measured, widths.

Source: by hand; past the part that thinning bends.
"""

_TOLD_WIDTHS = 3.0
"""Least length of a branch for its end's roundness to show anything, widths.

Source: by hand; shorter pieces have ends of their own rather than a cable's.
"""

_SLANT = 0.25
"""Slant of an end, a ratio, above which it counts against roundness.

Source: by hand; more than a cable's own end has.
"""

_NOTCH = 4
"""Length of a notch in the mask that is passed, in steps of half a pixel.

Source: by hand; two pixels.
"""

_DUMB_PX = 4.0
"""Width up to which an end's shape shows nothing, px; at twice that it shows all.

Source: by hand; the cap of a thinner cable is two rows of pixels.
"""

UNTOLD = 0.65
"""Roundness of an end of which nothing is known, in 0..1.

Source: by hand; between flat and round, nearer to a cable's own end.
"""

_NOISE_PX = 0.3
"""Standard deviation of a point of the centre line, px.

Source: by hand; about that of rounding to pixels, 0.29.
"""

_USUAL_BEND = 0.25
"""Curvature times width, a ratio, that is usual of a cable; it damps noisy fits.

Source: by hand; a radius of four widths.
"""


@helper
def _is_clear(points: Floats, i: int, node: int, centres: Floats, radii: Floats, more: float) -> bool:
    """Return whether a point lies outside of a junction, by `more` px."""
    if node < 0:
        return True
    away = np.sqrt((points[i, 0] - centres[node, 0]) ** 2 + (points[i, 1] - centres[node, 1]) ** 2)
    return away >= radii[node] + more


@helper
def _tapered(half: Floats, first: int, step: int, count: int, width: float) -> int:
    """Count the points from a free end on over which the mask tapers.

    Thinning leads into the corner of a slanting cut. A branch that is narrow for longer is a narrow cable.
    """
    most = int(_TAPER_WIDTHS * width)
    if count < 2 * most or most == 0:
        return 0
    usual = 0.0
    for k in range(most, 2 * most):
        usual += half[first + step * k] / most
    narrow = 0
    for k in range(most):
        if half[first + step * k] < _TAPERED * usual:
            narrow = k + 1
    return narrow if narrow < most else 0


@helper
def _widened(half: Floats, first: int, step: int, count: int, width: float) -> int:
    """Count the points from an end at a junction on over which another cable widens the mask.

    Two cables that part at a small angle have one skeleton between them before it, which turns aside.
    """
    most = min(int(_WIDENED_WIDTHS * width), count // 2)
    usual = 0.0
    for k in range(most, 2 * most):
        usual += half[first + step * k] / most
    wide = 0
    for k in range(most):
        if half[first + step * k] > _WIDENED * usual + _WIDENED_PX:
            wide = k + 1
    return wide if wide < most else 0


@kernel(read(int64, 1), read(float64, 2), read(float64, 1), read(float64, 2), read(float64, 1), read(int64, 1), float64)
def clear_spans(
    nodes: Ints, centres: Floats, radii: Floats, points: Floats, half: Floats, offsets: Ints, width: float
) -> Ints:
    """Find the points of each branch that lie clear of the junctions and the slanting cuts at its ends.

    Parameters
    ----------
    nodes : (2 n,) int64
    centres, radii : (k, 2), (k,) float64
    points : (m, 2) float64
    half : (m,) float64
        Half the mask's width at each point, px.
    offsets : (n + 1,) int64
        Of the branches with ends, and more.
    width : float
        Of the cables, px.

    Returns
    -------
    (n, 2) int64
        Indices into `points`, the second one excluded; an empty span lies in the middle of its branch.
    """
    n = len(nodes) // 2
    spans = np.empty((n, 2), dtype=np.int64)
    for branch in range(n):
        start, stop = offsets[branch], offsets[branch + 1]
        while start < stop and not _is_clear(points, start, nodes[start_of(branch)], centres, radii, 0.0):
            start += 1
        while stop > start and not _is_clear(points, stop - 1, nodes[stop_of(branch)], centres, radii, 0.0):
            stop -= 1
        if start >= stop:
            start = stop = (offsets[branch] + offsets[branch + 1]) // 2
        count = stop - start
        if nodes[start_of(branch)] == FREE:
            start += _tapered(half, start, 1, count, width)
        if nodes[stop_of(branch)] == FREE:
            stop -= _tapered(half, stop - 1, -1, count, width)
        spans[branch, 0], spans[branch, 1] = start, stop
    return spans


@helper
def _fit_end(points: Floats, first: int, step: int, count: int, width: float, state: Floats, at: int) -> None:
    """Fit a parabola to `count` points from `first` on, away from the end; write the state at the point `at`.

    The curvature is damped by prior knowledge: a cable bends little, and points are noisy.
    """
    middle = 0.5 * (count - 1)
    squares, quartics, mean_square = 0.0, 0.0, 0.0
    for k in range(count):
        mean_square += (k - middle) ** 2 / count
    lin_x, lin_y, quad_x, quad_y = 0.0, 0.0, 0.0, 0.0
    for k in range(count):
        x, y = points[first + step * k, 0], points[first + step * k, 1]
        p = k - middle
        q = p * p - mean_square
        squares += p * p
        quartics += q * q
        lin_x += p * x
        lin_y += p * y
        quad_x += q * x
        quad_y += q * y
    lin_x /= squares
    lin_y /= squares
    if count > _STRAIGHT_WIDTHS * width:
        pitch_squared = lin_x * lin_x + lin_y * lin_y  # px a point, squared
        damping = quartics + (2.0 * _NOISE_PX * width / (_USUAL_BEND * pitch_squared)) ** 2
        quad_x /= damping
        quad_y /= damping
        state[HAS_CURVATURE] = 1.0
    else:
        quad_x, quad_y = 0.0, 0.0
    p = at - middle
    dx, dy = lin_x + 2.0 * quad_x * p, lin_y + 2.0 * quad_y * p
    speed = max(np.sqrt(dx * dx + dy * dy), 1e-9)
    state[TANGENT_X], state[TANGENT_Y] = -dx / speed, -dy / speed  # outwards is against the order of the points
    # Seen while moving outwards, a bend to the left stays one to the right inwards: the sign turns with the direction.
    state[CURVATURE] = -2.0 * (lin_x * quad_y - lin_y * quad_x) / max(lin_x * lin_x + lin_y * lin_y, 1e-9) ** 1.5


@kernel(
    read(int64, 1),
    read(float64, 2),
    read(float64, 1),
    read(float64, 2),
    read(float64, 1),
    read(int64, 1),
    read(int64, 2),
    float64,
)
def describe_ends(
    nodes: Ints, centres: Floats, radii: Floats, points: Floats, half: Floats, offsets: Ints, spans: Ints, width: float
) -> Floats:
    """Describe each end of each branch by its state at the first point clear of its junction.

    Parameters
    ----------
    nodes : (2 n,) int64
    centres, radii : (k, 2), (k,) float64
    points : (m, 2) float64
    half : (m,) float64
        Half the mask's width at each point, px.
    offsets : (n + 1,) int64
    spans : (n, 2) int64
        As `clear_spans` makes them.
    width : float
        Of the cables, px.

    Returns
    -------
    (2 n, 6) float64
        Columns as in `graph_ends`: position, outward unit tangent, curvature when moving outwards, 1 / px, positive
        for a turn from x to y, and 1 where the curvature was measured, else 0. The tangent of a branch without any
        extent is 0.
    """
    states = np.zeros((len(nodes), 6), dtype=np.float64)
    for end in range(len(nodes)):
        branch, node, far = branch_of(end), nodes[end], nodes[other_end(end)]
        start, stop = spans[branch]
        step = inward(end)
        count = stop - start
        first = start if step == 1 or count == 0 else stop - 1  # of the clear points, as seen from this end
        states[end, X], states[end, Y] = points[first, 0], points[first, 1]
        # Leave out what the junction or the tip distorts, as far as enough is left.
        skip = 0
        if node >= 0:
            while skip < count and not _is_clear(
                points, first + step * skip, node, centres, radii, _CLEAR_WIDTHS * width
            ):
                skip += 1
            skip = max(skip, _widened(half, first, step, count, width))
        else:
            skip = int(_BLUNT_WIDTHS * width)
        blunt = int(_BLUNT_WIDTHS * width) if far < 0 else 0
        most = int(max(_REACH_WIDTHS * width, _MIN_POINTS + 1))
        usable = min(count - skip - blunt, most)
        if usable >= max(0.75 * width, _MIN_POINTS):
            _fit_end(points, first + step * skip, step, usable, width, states[end], -skip)
            continue
        # Too short for that: straight from one end to the other, junctions counted from their centres.
        ax, ay = states[end, X], states[end, Y]
        if node >= 0:
            ax, ay = centres[node, 0], centres[node, 1]
        last = offsets[branch + 1] - 1 if step == 1 else offsets[branch]
        bx, by = points[last, 0], points[last, 1]
        if far >= 0:
            bx, by = centres[far, 0], centres[far, 1]
        dx, dy = ax - bx, ay - by
        norm = np.sqrt(dx * dx + dy * dy)
        if norm > 0.0:
            states[end, TANGENT_X], states[end, TANGENT_Y] = dx / norm, dy / norm
    return states


@helper
def _reach_along(
    mask: Bytes, x: float, y: float, dx: float, dy: float, curvature: float, aside: float, most: float
) -> float:
    """Measure the mask ahead on a parabola beside an end, to half a pixel; small notches are passed."""
    t, found, missed = 0.0, 0, 0
    while t < most and missed < _NOTCH:
        across = aside + 0.5 * curvature * t * t
        row, column = int(y + t * dy + across * dx + 0.5), int(x + t * dx - across * dy + 0.5)
        if 0 <= row < mask.shape[0] and 0 <= column < mask.shape[1] and mask[row, column] != 0:
            found += 1
            missed = 0
        else:
            missed += 1
        t += 0.5
    return 0.5 * found


@kernel(read(int64, 1), read(float64, 2), read(int64, 2), read(float64, 2), read(uint8, 2), float64)
def measure_roundness(nodes: Ints, points: Floats, spans: Ints, states: Floats, mask: Bytes, width: float) -> Floats:
    """Measure the roundness of each free end: 1 for half a disc, 0 for a cut, straight, slanting or hollow.

    The reach of the mask ahead, at several places across the end, is fitted with a length, a slant and a multiple of a
    half circle.

    Parameters
    ----------
    nodes : (2 n,) int64
    points : (m, 2) float64
    spans : (n, 2) int64
        As `clear_spans` makes them.
    states : (2 n, 6) float64
        As `describe_ends` makes them.
    mask : (H, W) uint8
    width : float
        px.

    Returns
    -------
    (2 n,) float64
        In 0..1; `UNTOLD` for an end that shows no shape or is not free.
    """
    radius = 0.5 * width
    sure = min(max((width - _DUMB_PX) / _DUMB_PX, 0.0), 1.0)  # a thin cable has no shape
    back, chord = int(_CAP_WIDTHS * width), int(width)
    end_roundness = np.full(len(nodes), UNTOLD)
    for end in range(len(nodes)):
        start, stop = spans[branch_of(end)]
        step = inward(end)
        at = (start if step == 1 else stop - 1) + step * back
        along = min(chord, stop - start - back - 1)
        if nodes[end] != FREE or along < max(radius, _MIN_POINTS) or stop - start < _TOLD_WIDTHS * width:
            continue
        dx, dy = points[at, 0] - points[at + step * along, 0], points[at, 1] - points[at + step * along, 1]
        length = max(np.sqrt(dx * dx + dy * dy), 1e-9)
        angle = np.arctan2(dy, dx) + 0.5 * states[end, CURVATURE] * length  # from the chord to the tangent
        dx, dy = np.cos(angle), np.sin(angle)
        roundness, slant = 0.0, 0.0
        for k in range(len(_ACROSS)):
            aside = _ACROSS[k] * radius
            ahead = (
                _reach_along(mask, points[at, 0], points[at, 1], dx, dy, states[end, CURVATURE], aside, 3.0 * width)
                / radius
            )
            roundness += _TO_ROUND[k] * ahead
            slant += _TO_SLANT[k] * ahead
        cap = min(max(roundness - max(abs(slant) - _SLANT, 0.0), 0.0), 1.0)
        end_roundness[end] = sure * cap + (1.0 - sure) * UNTOLD
    return end_roundness
