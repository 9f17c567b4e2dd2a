"""Two cables that share branches: the offset axis of each, and the points at which they swap sides."""

from __future__ import annotations

import numpy as np
from numba import float64, int64

from dloftbs.kernels.compiler import Bools, Floats, helper, kernel, read
from dloftbs.kernels.shared.copying import copy_to

_TERMS = 4
"""Number of coefficients of a cubic.

Source: by definition.
"""

_NARROW = 0.4
"""Distance of two offset axes below which their cables may cross, widths; `_PIXEL` is added.

Source: by hand; axes of cables side by side are one width apart.
"""

_WIDE = 0.7
"""Distance of two offset axes above which their cables do not cross, widths; `_PIXEL` is added.

Source: by hand; above `_NARROW`, so that noise does not make two places of one.
"""

WINDOW = 3.0
"""Length to both sides of a narrow place that is compared, widths.

Source: by hand.
"""

MIN_WINDOW_PX = 24
"""Least length to both sides of a narrow place that is compared, px.

Source: by hand; thin cables are as coarse as their pixels.
"""

_PIXEL = 1.0
"""Error of the distance of two offset axes, px.

Source: geometry; half a pixel at each edge of the mask.
"""

_BEFORE_END = 5.0
"""Length compared before the end of one of two cables, widths.

Source: by hand.
"""

_AFTER_END = 4.0
"""Length compared beyond the end of one of two cables, widths.

Source: by hand.
"""

_FLOOR_END_PX2 = 0.01
"""Mean squared residual left by pixels in any case, where one of two cables ends, squares of a px.

Source: by hand.
"""

_INDEPENDENT = 4.0
"""Number of residuals that count as independent of each other.

Source: by hand; neighbouring points of an axis are wrong together.
"""

_FLOOR_PX2 = 0.04
"""Mean squared residual left by pixels in any case, squares of a px.

Source: by hand; about half of 1/12, the variance of rounding to pixels.
"""


@helper
def _misfit(x: Floats, y: Floats, first: int, last: int) -> float:
    """Return the mean squared residual of the best cubic through ``(x[i], y[i])``, first <= i < last, x in [-1, 1]."""
    matrix = np.zeros((_TERMS, _TERMS))
    right = np.zeros(_TERMS)
    base = np.empty(_TERMS)
    squares = 0.0
    for i in range(first, last):
        t = x[i]
        base[0], base[1], base[2], base[3] = 1.0, t, 1.5 * t * t - 0.5, (2.5 * t * t - 1.5) * t
        for a in range(_TERMS):
            right[a] += base[a] * y[i]
            for b in range(a + 1):
                matrix[a, b] += base[a] * base[b]
        squares += y[i] * y[i]
    n = last - first
    for a in range(_TERMS):  # Cholesky; a little on the diagonal keeps too few points from breaking it
        matrix[a, a] += 1e-6 * n
        for k in range(a):
            matrix[a, a] -= matrix[a, k] * matrix[a, k]
        matrix[a, a] = np.sqrt(max(matrix[a, a], 1e-12))
        for b in range(a + 1, _TERMS):
            for k in range(a):
                matrix[b, a] -= matrix[b, k] * matrix[a, k]
            matrix[b, a] /= matrix[a, a]
    for a in range(_TERMS):
        for k in range(a):
            right[a] -= matrix[a, k] * right[k]
        right[a] /= matrix[a, a]
        squares -= right[a] * right[a]
    return max(squares, 0.0) / n


@helper
def _roughness(points: Floats, n: int) -> float:
    """Return the mean squared distance of points from the best cubic curve along them, px^2."""
    if n < 2 * _TERMS:
        return 0.0
    t = np.empty(n)
    t[0] = 0.0
    for i in range(1, n):
        t[i] = t[i - 1] + np.sqrt((points[i, 0] - points[i - 1, 0]) ** 2 + (points[i, 1] - points[i - 1, 1]) ** 2)
    for i in range(n):
        t[i] = 2.0 * t[i] / max(t[n - 1], 1e-9) - 1.0
    return _misfit(t, points[:, 0].copy(), 0, n) + _misfit(t, points[:, 1].copy(), 0, n)


@helper
def _gather(
    before: Floats,
    axis_in: Floats,
    first: int,
    place: int,
    axis_out: Floats,
    last: int,
    after: Floats,
    most: int,
    points: Floats,
) -> int:
    """Write the points of a route through a narrow place; `before` and `after` lead away from the shared branches."""
    n = 0
    if first == 0:
        extra = min(len(before), max(most - place, 0))
        for i in range(extra - 1, -1, -1):
            copy_to(points[n], before[i])
            n += 1
    for i in range(first, place):
        copy_to(points[n], axis_in[i])
        n += 1
    for i in range(place, last):
        copy_to(points[n], axis_out[i])
        n += 1
    if last == len(axis_out):
        extra = min(len(after), max(most - (last - place), 0))
        for i in range(extra):
            copy_to(points[n], after[i])
            n += 1
    return n


@kernel(
    read(float64, 2),
    read(float64, 2),
    read(float64, 1),
    read(float64, 1),
    read(float64, 2),
    read(float64, 2),
    read(float64, 2),
    read(float64, 2),
    float64,
)
def find_swaps(
    one: Floats,
    two: Floats,
    arc: Floats,
    separation: Floats,
    before_one: Floats,
    before_two: Floats,
    after_one: Floats,
    after_two: Floats,
    width: float,
) -> tuple[Bools, float, int]:
    """Find the points at which two cables that share branches swap axes.

    Where the axes come close, the cables either cross or touch and part again: the smoother pair of curves is taken.

    Parameters
    ----------
    one, two : (n, 2) float64
        Axis of the cable on the one side, and on the other, px.
    arc, separation : (n,) float64
        Distance along the branches, and between the axes, px.
    before_one, before_two, after_one, after_two : (m, 2) float64
        Continuation of the axes before the first and after the last point, leading away from there; may be empty.
    width : float
        Of one cable, px.

    Returns
    -------
    swapped : (n + 1,) bool
        Whether the cable that starts on axis one lies on axis two, at each point and after the last.
    margin : float
        Log-odds of the least clear decision, by the ratio of the mean squared residuals, nats; infinity where there
        was none to take.
    weakest : int
        Point of that decision; -1 where there was none.
    """
    n = len(arc)
    swapped = np.zeros(n + 1, dtype=np.bool_)
    margin, weakest = np.inf, -1
    most = max(int(WINDOW * width) + 4, MIN_WINDOW_PX)
    narrow_px, wide_px = _NARROW * width + _PIXEL, _WIDE * width + _PIXEL
    room = 2 * most + n + 16
    points = np.empty((room, 2))
    at = 0
    while at <= n:
        narrow = at < n and separation[at] < narrow_px
        edge = (at == 0 and separation[0] < wide_px) or (at == n and separation[n - 1] < wide_px)
        if not (narrow or edge):
            at += 1
            continue
        place = at
        at += 1
        if place < n:
            while at < n and separation[at] < wide_px:
                if separation[at] < separation[place]:
                    place = at
                at += 1
            if at == n and n > 0 and separation[n - 1] <= separation[place]:
                place = n
            if at == n:
                at = n + 1
        first, last = max(place - most, 0), min(place + most, n)
        stay = 0.0
        cross = 0.0
        for k in range(2):
            axis, other = (one, two) if k == 0 else (two, one)
            before = before_one if k == 0 else before_two
            m = _gather(before, axis, first, place, axis, last, after_one if k == 0 else after_two, most, points)
            stay += _roughness(points, m)
            m = _gather(before, axis, first, place, other, last, after_two if k == 0 else after_one, most, points)
            cross += _roughness(points, m)
        evidence = 0.5 * _INDEPENDENT * np.log((stay + _FLOOR_PX2) / (cross + _FLOOR_PX2))
        if abs(evidence) < margin:
            margin, weakest = abs(evidence), place
        if evidence > 0.0:
            swapped[place:] = ~swapped[place:]
    return swapped, margin, weakest


@kernel(read(float64, 2), read(float64, 1), float64)
def offset_axes(middle: Floats, radius: Floats, width: float) -> tuple[Floats, Floats, Floats]:
    """Offset the axes of two cables of known width from the middle of the mask that they share.

    The outer edges of the two are the mask's: each axis lies half a width inside of its own. Two that touch lie a width
    apart: where the mask is wider still, as in a blob, their edges are not to be seen.

    Parameters
    ----------
    middle : (n, 2) float64
        The middle of the mask, px; two points or more.
    radius : (n,) float64
        Half of its width, px.
    width : float
        Of one cable, px.

    Returns
    -------
    shift : (n, 2) float64
        From the middle to the axis on the side to which x turns into y; the other axis lies on the other side.
    arc, separation : (n,) float64
        Distance along the middle, and between the axes, px.
    """
    n = len(middle)
    shift = np.empty((n, 2))
    arc = np.zeros(n)
    separation = np.empty(n)
    reach = max(int(0.5 * width), 1)
    for i in range(n):
        if i > 0:
            arc[i] = arc[i - 1] + np.sqrt(
                (middle[i, 0] - middle[i - 1, 0]) ** 2 + (middle[i, 1] - middle[i - 1, 1]) ** 2
            )
        low, high = max(i - reach, 0), min(i + reach, n - 1)
        dx, dy = middle[high, 0] - middle[low, 0], middle[high, 1] - middle[low, 1]
        norm = max(np.sqrt(dx * dx + dy * dy), 1e-9)
        separation[i] = min(max(2.0 * radius[i] - width, 0.0), width)
        shift[i, 0], shift[i, 1] = -0.5 * separation[i] * dy / norm, 0.5 * separation[i] * dx / norm
    return shift, arc, separation


@kernel(read(float64, 2), read(float64, 2), int64, float64)
def continuing_axis(middle: Floats, shift: Floats, end: int, width: float) -> float:
    """Return which of two axes continues beyond the end of the other cable: the one with the smoother curve.

    Parameters
    ----------
    middle : (n, 2) float64
        The middle of the mask, beyond the end, too, px.
    shift : (n, 2) float64
        From there to the first axis.
    end : int
        Index of the point where the other cable ends.
    width : float
        Of one cable, px.

    Returns
    -------
    float
        Above 0 for the first axis, below for the other: half the logarithm of the ratio of the mean squared residuals.
        0 where too little is left beyond the end to show.
    """
    low, high = max(end - int(_BEFORE_END * width), 0), min(end + int(_AFTER_END * width), len(middle))
    points = np.empty((high - low, 2))
    rough = np.zeros(2)
    for k in range(2):
        count, beyond = 0, 0
        for i in range(low, high):
            if end - 0.25 * width <= i <= end + 0.5 * width:
                continue  # there the mask is neither as wide as two nor as wide as one
            sign = 0.0 if i > end else (1.0 if k == 0 else -1.0)
            points[count, 0] = middle[i, 0] + sign * shift[i, 0]
            points[count, 1] = middle[i, 1] + sign * shift[i, 1]
            count += 1
            beyond += i > end
        if beyond <= width or count < 2 * _TERMS:
            return 0.0
        rough[k] = _roughness(points, count)
    return 0.5 * np.log((rough[1] + _FLOOR_END_PX2) / (rough[0] + _FLOOR_END_PX2))
