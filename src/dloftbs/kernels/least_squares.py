"""Least-squares cubic B-splines: normal equations with four bands, solved by Cholesky's method."""

from __future__ import annotations

import numpy as np
from numba import float64, int64

from dloftbs.kernels.compiler import Floats, helper, kernel, read
from dloftbs.kernels.shared.copying import copy_rows_to

FITS = 3
"""Number of fits, each with another number of knots."""

_ERROR_ORDER = 4  # a cubic's error falls with the fourth power of the spacing
_SLACK, _MAX_GROWTH = 1.1, 2.0

ORDER = 4
"""Of a cubic: the number of basis functions that are not zero in a knot span."""


_Span = tuple[
    float, float, float, float, float, float,
    float, float, float, float, float, float,
]  # fmt: skip
"""The six knots around a span, and what the recursion divides by there, inverted, in the order in which it needs it."""
_Four = tuple[float, float, float, float]


@helper
def _enter(knots: Floats, span: int) -> _Span:
    """Return what `_basis` needs of the span from ``knots[span]`` to ``knots[span + 1]``, the two different."""
    a, b, c = knots[span - 2], knots[span - 1], knots[span]
    d, e, f = knots[span + 1], knots[span + 2], knots[span + 3]
    return a, b, c, d, e, f, 1.0 / (d - c), 1.0 / (d - b), 1.0 / (e - c), 1.0 / (d - a), 1.0 / (e - b), 1.0 / (f - c)


@helper
def _basis(span: _Span, u: float) -> _Four:
    """Return the four cubic basis functions of one knot span, by the recursion of Cox and de Boor, in the span's order.

    It is unrolled: this is what fitting spends its time in.
    """
    a, b, c, d, e, f, of_line, of_left, of_right, of_first, of_middle, of_last = span
    second, first = (u - c) * of_line, (d - u) * of_line
    share = first * of_left
    first, carry = (d - u) * share, (u - b) * share
    share = second * of_right
    second, third = carry + (e - u) * share, (u - c) * share
    share = first * of_first
    first, carry = (d - u) * share, (u - a) * share
    share = second * of_middle
    second, carry = carry + (e - u) * share, (u - b) * share
    share = third * of_last
    return first, second, carry + (f - u) * share, (u - c) * share


@kernel(read(float64, 1))
def is_ascending(u: Floats) -> bool:
    """Return whether each parameter is larger than the one before."""
    for i in range(1, len(u)):
        if not u[i] > u[i - 1]:
            return False
    return True


@kernel(read(float64, 1), int64)
def open_knots(u: Floats, k: int) -> Floats:
    """Return an open curve's knot vector: ``k`` distinct knots, equidistant in element number (paper: spline fitting).

    The knots lie on the parameters of the points, 0 and 1 at the ends, so that every span holds points and the
    Schoenberg-Whitney conditions hold. There are no more knots than leave two points a span.

    Parameters
    ----------
    u : (n,) float64
        Ascending in [0, 1].
    k : int

    Returns
    -------
    (m + 6,) float64
        With ``m <= k`` distinct knots.
    """
    n = len(u)
    count = min(k, max(n // 2, 2))
    knots = np.zeros(count + 2 * (ORDER - 1), dtype=np.float64)
    knots[-ORDER:] = 1.0
    step = (n - 1) / (count - 1)
    for i in range(1, count - 1):
        knots[ORDER - 1 + i] = u[int(np.rint(i * step))]
    return knots


@helper
def _add_up(u: Floats, points: Floats, knots: Floats, band: Floats, right: Floats) -> None:
    """Write the normal equations; the four rows that a span adds to are held in registers, and move on with it."""
    m, dims = points.shape
    n = len(right)
    span, low = ORDER - 1, 0
    around = _enter(knots, span)
    aa = ab = ac = ad = bb = bc = bd = cc = cd = dd = 0.0
    ax = bx = cx = dx = ay = by = cy = dy = az = bz = cz = dz = 0.0
    for i in range(m + 1):
        while low < n and (i >= m or (span < n - 1 and u[i] >= knots[span + 1])):
            band[low, 0], band[low, 1], band[low, 2], band[low, 3] = aa, ab, ac, ad
            right[low, 0], right[low, 1] = ax, ay
            if dims > 2:
                right[low, 2] = az
            aa, ab, ac, ad, bb, bc, bd, cc, cd, dd = bb, bc, bd, 0.0, cc, cd, 0.0, dd, 0.0, 0.0
            ax, bx, cx, dx, ay, by, cy, dy, az, bz, cz, dz = bx, cx, dx, 0.0, by, cy, dy, 0.0, bz, cz, dz, 0.0
            low += 1
            if i < m:
                span += 1
                around = _enter(knots, span)
        if i >= m:
            break
        a, b, c, d = _basis(around, u[i])
        x, y = points[i, 0], points[i, 1]
        z = points[i, 2] if dims > 2 else 0.0
        aa, ab, ac, ad = aa + a * a, ab + a * b, ac + a * c, ad + a * d
        bb, bc, bd = bb + b * b, bc + b * c, bd + b * d
        cc, cd, dd = cc + c * c, cd + c * d, dd + d * d
        ax, bx, cx, dx = ax + a * x, bx + b * x, cx + c * x, dx + d * x
        ay, by, cy, dy = ay + a * y, by + b * y, cy + c * y, dy + d * y
        if dims > 2:
            az, bz, cz, dz = az + a * z, bz + b * z, cz + c * z, dz + d * z


@kernel(read(float64, 1), read(float64, 2), read(float64, 1))
def fit_open(u: Floats, points: Floats, knots: Floats) -> Floats:
    """Fit a cubic B-spline to points by least squares, each coordinate by itself with the same knots.

    Not checked: `u` ascends within the base interval of the knots, and the Schoenberg-Whitney conditions hold.

    Parameters
    ----------
    u : (m,) float64
    points : (m, d) float64
        In the plane or in space.
    knots : (n + 4,) float64
        Each end four times.

    Returns
    -------
    (n, d) float64
        Control points.
    """
    n, dims = len(knots) - ORDER, points.shape[1]
    band = np.zeros((n, ORDER))  # band[i, k] is the normal matrix at (i, i + k)
    right = np.zeros((n, dims))
    _add_up(u, points, knots, band, right)

    # Cholesky: the matrix is L L', with L stored by columns, L[i + k, i] = band[i, k].
    for i in range(n):
        pivot = np.sqrt(band[i, 0])
        band[i, 0] = pivot
        reach = min(ORDER, n - i)
        for k in range(1, reach):
            band[i, k] /= pivot
        for k in range(1, reach):
            for j in range(k, reach):
                band[i + k, j - k] -= band[i, k] * band[i, j]
    for d in range(dims):
        for i in range(n):
            right[i, d] /= band[i, 0]
            for k in range(1, min(ORDER, n - i)):
                right[i + k, d] -= band[i, k] * right[i, d]
        for i in range(n - 1, -1, -1):
            for k in range(1, min(ORDER, n - i)):
                right[i, d] -= band[i, k] * right[i + k, d]
            right[i, d] /= band[i, 0]
    return right


@kernel(read(float64, 1), read(float64, 2), read(float64, 1))
def fit_closed(u: Floats, points: Floats, knots: Floats) -> Floats:
    """Fit a periodic cubic B-spline to the points of a loop by least squares.

    The matrix is stored whole, since the loop couples its first and last control points. Not checked: as `fit_open`,
    and there are four spans or more.

    Parameters
    ----------
    u : (m,) float64
        In [0, 1).
    points : (m, d) float64
    knots : (s + 7,) float64
        Of period 1: three before 0, ``s + 1`` from 0 to 1, three after 1.

    Returns
    -------
    (s + 3, d) float64
        Control points; the last three repeat the first three.
    """
    m, dims = points.shape
    n = len(knots) - 2 * ORDER + 1
    matrix = np.zeros((n, n))
    right = np.zeros((n, dims))
    values = np.empty(ORDER)
    span = ORDER - 1
    around = _enter(knots, span)
    for i in range(m):
        while span < n + ORDER - 2 and u[i] >= knots[span + 1]:
            span += 1
            around = _enter(knots, span)
        values[0], values[1], values[2], values[3] = _basis(around, u[i])
        first = span - ORDER + 1
        for a in range(ORDER):
            row = (first + a) % n
            for b in range(ORDER):
                matrix[row, (first + b) % n] += values[a] * values[b]
            for d in range(dims):
                right[row, d] += values[a] * points[i, d]

    # Cholesky, over what is not 0: a band of four, and the last three rows, in which the ends meet.
    wide = n - ORDER + 1
    for j in range(n):
        first = max(j - ORDER + 1, 0) if j < wide else 0
        for k in range(first, j):
            matrix[j, j] -= matrix[j, k] * matrix[j, k]
        matrix[j, j] = np.sqrt(matrix[j, j])
        for i in range(j + 1, n):
            if j + ORDER <= i < wide:
                continue
            for k in range(first, j):
                matrix[i, j] -= matrix[i, k] * matrix[j, k]
            matrix[i, j] /= matrix[j, j]
    control = np.empty((n + ORDER - 1, dims))
    for d in range(dims):
        for i in range(n):
            for k in range(i):
                right[i, d] -= matrix[i, k] * right[k, d]
            right[i, d] /= matrix[i, i]
        for i in range(n - 1, -1, -1):
            for k in range(i + 1, n):
                right[i, d] -= matrix[k, i] * right[k, d]
            right[i, d] /= matrix[i, i]
    copy_rows_to(control, right)
    copy_rows_to(control[n:], right[: ORDER - 1])
    return control


@kernel(read(float64, 1), read(float64, 2), read(float64, 1), read(float64, 2), int64)
def misfit(u: Floats, points: Floats, knots: Floats, control: Floats, window: int) -> float:
    """Return how far points lie beside a cubic B-spline over a stretch of them, where that is worst.

    The differences are averaged over `window` points, so that what points have of noise, each by itself, counts little.
    Not checked: `u` ascends within the base interval of the knots.

    Parameters
    ----------
    u : (m,) float64
    points : (m, 2) float64
    knots : (n + 4,) float64
    control : (n, 2) float64
    window : int

    Returns
    -------
    float
    """
    m, n = len(points), len(control)
    dx, dy = 0.0, 0.0
    worst = 0.0
    count = 0
    span = ORDER - 1
    around = _enter(knots, span)
    for i in range(m):
        while span < n - 1 and u[i] >= knots[span + 1]:
            span += 1
            around = _enter(knots, span)
        a, b, c, d = _basis(around, u[i])
        low = span - ORDER + 1
        dx = dx + points[i, 0] - a * control[low, 0] - b * control[low + 1, 0]
        dx = dx - c * control[low + 2, 0] - d * control[low + 3, 0]
        dy = dy + points[i, 1] - a * control[low, 1] - b * control[low + 1, 1]
        dy = dy - c * control[low + 2, 1] - d * control[low + 3, 1]
        count += 1
        if count == window:
            worst = max(worst, dx * dx + dy * dy)
            dx, dy = 0.0, 0.0
            count = 0
    return np.sqrt(worst) / window


@kernel(int64, float64, int64)
def grow(count: int, excess: float, most: int) -> int:
    """Return the number of knots to try next, from the ratio of the misfit to its limit."""
    return min(int(np.ceil(count * min(_SLACK * excess ** (1.0 / _ERROR_ORDER), _MAX_GROWTH))), most)


@kernel(read(float64, 1), read(float64, 2), int64, int64, int64, float64, int64)
def grow_open_knots(u: Floats, points: Floats, count: int, most: int, pick: int, tolerance: float, window: int) -> int:
    """Return how many distinct knots an open curve needs: more, while points lie beside it over a stretch of them.

    Parameters
    ----------
    u : (m,) float64
    points : (m, d) float64
    count, most : int
        Number of knots to start with, and the largest.
    pick : int
        Every so-many-th point is looked at, and the last one.
    tolerance : float
        Largest mean distance of a stretch from the curve, px.
    window : int
        Points in a stretch, of those that are looked at.

    Returns
    -------
    int
    """
    m, dims = points.shape
    n = (m - 2) // pick + 2
    own_u, own_points = np.empty(n), np.empty((n, dims))
    for i in range(n):
        k = min(i * pick, m - 1)
        own_u[i] = u[k]
        for d in range(dims):
            own_points[i, d] = points[k, d]
    for _ in range(FITS):
        if count >= most or n < ORDER:
            break
        knots = open_knots(own_u, count)
        excess = misfit(own_u, own_points, knots, fit_open(own_u, own_points, knots), window) / tolerance
        if excess <= 1.0:
            break
        count = grow(count, excess, most)
    return count
