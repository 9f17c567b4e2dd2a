"""Least-squares cubic B-splines: normal equations with four bands, solved by Cholesky's method."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import boolean, float64, int64

from dloftbs.kernels._compile import helper, kernel, read

FITS = 3
"""How often the number of knots is tried."""

_ERROR_ORDER = 4  # a cubic's error falls with the fourth power of the spacing
_SLACK, _MOST_GROWTH = 1.1, 2.0

ORDER = 4
"""Of a cubic: the number of basis functions that are not zero in a knot span."""


@helper
def _invert_widths(knots: npt.NDArray[np.float64], span: int, inverse: npt.NDArray[np.float64]) -> None:
    """Write what the recursion divides by in one knot span, inverted, in the order in which it needs them."""
    i = 0
    for degree in range(1, ORDER):
        for r in range(degree):
            inverse[i] = 1.0 / (knots[span + r + 1] - knots[span + r + 1 - degree])
            i += 1


@helper
def _evaluate_basis(
    knots: npt.NDArray[np.float64],
    span: int,
    u: float,
    inverse: npt.NDArray[np.float64],
    values: npt.NDArray[np.float64],
) -> None:
    """Evaluate the four cubic basis functions of one knot span, by the recursion of Cox and de Boor.

    Parameters
    ----------
    knots : (n + 4,) float64
    span : int
        ``knots[span] <= u <= knots[span + 1]``, the two different.
    u : float
    inverse : (6,) float64
        As `_invert_widths` writes it for this span.
    values : (4,) float64
        Written: the functions ``span - 3`` to ``span``.
    """
    values[0] = 1.0
    i = 0
    for degree in range(1, ORDER):
        carry = 0.0
        for r in range(degree):
            share = values[r] * inverse[i]
            i += 1
            values[r] = carry + (knots[span + r + 1] - u) * share
            carry = (u - knots[span + r + 1 - degree]) * share
        values[degree] = carry


@helper
def _write_arc(points: npt.NDArray[np.float64], closed: bool, parameter: npt.NDArray[np.float64]) -> None:
    n, dims = points.shape
    parameter[0] = 0.0
    for i in range(1, n):
        squared = 0.0
        for d in range(dims):
            squared += (points[i, d] - points[i - 1, d]) ** 2
        parameter[i] = parameter[i - 1] + np.sqrt(squared)
    total = parameter[n - 1]
    if closed:
        squared = 0.0
        for d in range(dims):
            squared += (points[0, d] - points[n - 1, d]) ** 2
        total += np.sqrt(squared)
    if total > 0.0:
        for i in range(n):
            parameter[i] /= total


@kernel(read(float64, 2), boolean)
def arc_parameter(points: npt.NDArray[np.float64], closed: bool) -> npt.NDArray[np.float64]:
    """Return what `dloftbs.centerline.arc_parameter` returns, faster.

    Parameters
    ----------
    points : (n, d) float64
        One or more.
    closed : bool

    Returns
    -------
    (n,) float64
    """
    parameter = np.empty(len(points), dtype=np.float64)
    _write_arc(points, closed, parameter)
    return parameter


@kernel(read(float64, 2), read(int64, 1), int64)
def arc_parameters(
    points: npt.NDArray[np.float64], first: npt.NDArray[np.int64], n_open: int
) -> npt.NDArray[np.float64]:
    """Return what `arc_parameter` returns, for several lines.

    Parameters
    ----------
    points : (m, d) float64
        Line after line.
    first : (k + 1,) int64
        Where each line starts in these, and the end; each has one point or more.
    n_open : int
        The first so many lines have ends, the rest are loops.

    Returns
    -------
    (m,) float64
    """
    parameter = np.empty(len(points), dtype=np.float64)
    for k in range(len(first) - 1):
        _write_arc(points[first[k] : first[k + 1]], k >= n_open, parameter[first[k] : first[k + 1]])
    return parameter


@kernel(read(float64, 1), int64)
def open_knots(u: npt.NDArray[np.float64], k: int) -> npt.NDArray[np.float64]:
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


@kernel(read(float64, 1), read(float64, 2), read(float64, 1))
def fit_open(
    u: npt.NDArray[np.float64], points: npt.NDArray[np.float64], knots: npt.NDArray[np.float64]
) -> npt.NDArray[np.float64]:
    """Fit a cubic B-spline to points by least squares, each coordinate by itself with the same knots.

    Not checked: `u` ascends within the base interval of the knots, and the Schoenberg-Whitney conditions hold.

    Parameters
    ----------
    u : (m,) float64
    points : (m, d) float64
    knots : (n + 4,) float64
        Each end four times.

    Returns
    -------
    (n, d) float64
        Control points.
    """
    m, dims = points.shape
    n = len(knots) - ORDER
    band = np.zeros((n, ORDER))  # band[i, k] is the normal matrix at (i, i + k)
    right = np.zeros((n, dims))
    values = np.empty(ORDER)
    inverse = np.empty(ORDER * (ORDER - 1) // 2)
    span = ORDER - 1
    _invert_widths(knots, span, inverse)
    for i in range(m):
        while span < n - 1 and u[i] >= knots[span + 1]:
            span += 1
            _invert_widths(knots, span, inverse)
        _evaluate_basis(knots, span, u[i], inverse, values)
        first = span - ORDER + 1
        for a in range(ORDER):
            for b in range(a, ORDER):
                band[first + a, b - a] += values[a] * values[b]
            for d in range(dims):
                right[first + a, d] += values[a] * points[i, d]

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
def fit_closed(
    u: npt.NDArray[np.float64], points: npt.NDArray[np.float64], knots: npt.NDArray[np.float64]
) -> npt.NDArray[np.float64]:
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
    inverse = np.empty(ORDER * (ORDER - 1) // 2)
    span = ORDER - 1
    _invert_widths(knots, span, inverse)
    for i in range(m):
        while span < n + ORDER - 2 and u[i] >= knots[span + 1]:
            span += 1
            _invert_widths(knots, span, inverse)
        _evaluate_basis(knots, span, u[i], inverse, values)
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
    control[:n] = right
    control[n:] = right[: ORDER - 1]
    return control


@kernel(read(float64, 1), read(float64, 2), read(float64, 1), read(float64, 2), int64)
def misfit(
    u: npt.NDArray[np.float64],
    points: npt.NDArray[np.float64],
    knots: npt.NDArray[np.float64],
    control: npt.NDArray[np.float64],
    window: int,
) -> float:
    """Return how far points lie beside a cubic B-spline over a stretch of them, where that is worst.

    The differences are averaged over `window` points, so that what points have of noise, each by itself, counts little.
    Not checked: `u` ascends within the base interval of the knots.

    Parameters
    ----------
    u : (m,) float64
    points : (m, d) float64
    knots : (n + 4,) float64
    control : (n, d) float64
    window : int

    Returns
    -------
    float
    """
    m, dims = points.shape
    n = len(control)
    values = np.empty(ORDER)
    inverse = np.empty(ORDER * (ORDER - 1) // 2)
    total = np.zeros(dims)
    worst = 0.0
    count = 0
    span = ORDER - 1
    _invert_widths(knots, span, inverse)
    for i in range(m):
        while span < n - 1 and u[i] >= knots[span + 1]:
            span += 1
            _invert_widths(knots, span, inverse)
        _evaluate_basis(knots, span, u[i], inverse, values)
        for d in range(dims):
            total[d] += points[i, d]
            for a in range(ORDER):
                total[d] -= values[a] * control[span - ORDER + 1 + a, d]
        count += 1
        if count == window:
            squared = 0.0
            for d in range(dims):
                squared += total[d] * total[d]
                total[d] = 0.0
            worst = max(worst, squared)
            count = 0
    return np.sqrt(worst) / window


@kernel(int64, float64, int64)
def grow(count: int, excess: float, most: int) -> int:
    """Return how many knots to try next, where the misfit is so many times what it may be."""
    return min(int(np.ceil(count * min(_SLACK * excess ** (1.0 / _ERROR_ORDER), _MOST_GROWTH))), most)


@kernel(read(float64, 1), read(float64, 2), int64, int64, int64, float64, int64)
def grow_open_knots(
    u: npt.NDArray[np.float64],
    points: npt.NDArray[np.float64],
    count: int,
    most: int,
    pick: int,
    tolerance: float,
    window: int,
) -> int:
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
        How far beside the curve a stretch may lie, on average, px.
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
