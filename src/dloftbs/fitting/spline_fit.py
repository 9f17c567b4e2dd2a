"""Centre line to cubic B-spline (paper: spline fitting)."""

from __future__ import annotations

import numpy as np

from dloftbs.config import FittingConfig
from dloftbs.data.curve import BSplineCurve
from dloftbs.kernels import least_squares as kernels
from dloftbs.support.arrays import FloatArray

_DEGREE = 3
_FIRST_SPACING = 8.0  # from knot to knot, in widths of the object
_MIN_SPACING = 1.5
_MIN_SPACING_PX = 6.0
_PICK = 6  # while knots are counted, every so-many-th point will do, three a span or more


def fit(points: FloatArray, u: FloatArray, closed: bool, config: FittingConfig, width_px: float) -> BSplineCurve:
    """Fit one cubic B-spline by least squares to the points of a centre line in the image.

    Where the configuration does not give the number of knots, it grows from few until the points lie on the curve, or
    the knots one and a half widths apart: no cable bends more often than that, but noise does.

    Parameters
    ----------
    points : numpy.ndarray, shape (n, 2)
        Two or more, px.
    u : numpy.ndarray, shape (n,)
        Their parameters, ascending in [0, 1].
    closed : bool
        Whether the curve is to be periodic.
    config : FittingConfig
    width_px : float
        Of the object.

    Returns
    -------
    BSplineCurve
    """
    points, u = _without_repeats(points, u)
    knots = config.knots
    if knots is None:
        knots = needed_knots(points, u, closed, config.tolerance_px, width_px)
    return _fit_curve(points, u, closed, knots)


def fit_with_knots(points: FloatArray, u: FloatArray, closed: bool, k: int) -> BSplineCurve:
    """Fit one cubic B-spline by least squares, all coordinates with the same knots.

    Parameters
    ----------
    points : numpy.ndarray, shape (n, d)
        Two or more, px or metres.
    u : numpy.ndarray, shape (n,)
    closed : bool
    k : int
        Number of distinct knots; fewer where there are too few points.

    Returns
    -------
    BSplineCurve
    """
    return _fit_curve(*_without_repeats(points, u), closed, k)


def needed_knots(points: FloatArray, u: FloatArray, closed: bool, tolerance_px: float, width_px: float) -> int:
    """Return how many distinct knots a centre line needs; for the parameters see `fit`."""
    n = len(points)
    most = max(int(n / max(_MIN_SPACING * width_px, _MIN_SPACING_PX)), 2) + 1
    count = min(max(int(n / (_FIRST_SPACING * width_px)), 1) + 3, most)
    pick = max(min(_PICK, n // (3 * most)), 1)
    window = max(round(1.5 * width_px / pick), 2)
    if not closed:
        return kernels.grow_open_knots(u, points, count, most, pick, tolerance_px, window) if n > 1 else count
    if pick > 1:
        chosen = np.append(np.arange(0, n - 1, pick), n - 1)
        points, u = points[chosen], u[chosen]
    for _ in range(kernels.FITS):
        if count >= most or len(points) <= _DEGREE:
            break
        excess = kernels.misfit(u, points, *_fit(points, u, closed, count), window) / tolerance_px
        if excess <= 1.0:
            break
        count = kernels.grow(count, excess, most)
    return count


def distinct_knots(curve: BSplineCurve) -> int:
    """Return the number of distinct knots from 0 to 1 of a fitted curve."""
    return len(curve.control_points) - _DEGREE + 1


def closed_knots(u: FloatArray, k: int) -> FloatArray:
    """Return the knot vector for a loop: ``k`` distinct knots from 0 to 1, equidistant in element number, periodic.

    There are five or more, since a periodic cubic needs four spans, and no more than leave two points a span.
    """
    n = len(u)
    spans = max(min(k, n // 2) - 1, _DEGREE + 1)
    breaks = np.append(u[np.rint(np.linspace(0, n, spans + 1)[:-1]).astype(np.intp)], 1.0)
    return np.concatenate((breaks[-1 - _DEGREE : -1] - 1.0, breaks, breaks[1 : _DEGREE + 1] + 1.0))


def _fit_curve(points: FloatArray, u: FloatArray, closed: bool, k: int) -> BSplineCurve:
    """Fit a curve to points whose parameters ascend."""
    if not closed:
        points, u = _at_least_order(points, u)
    knots, control = _fit(points, u, closed, k)
    return BSplineCurve._unchecked(knots, control, _DEGREE, closed)


def _fit(points: FloatArray, u: FloatArray, closed: bool, k: int) -> tuple[FloatArray, FloatArray]:
    """Return knots and control points; open curves need four points or more."""
    if closed:
        knots = closed_knots(u, k)
        return knots, kernels.fit_closed(u, points, knots)
    knots = kernels.open_knots(u, k)
    return knots, kernels.fit_open(u, points, knots)


def _without_repeats(points: FloatArray, u: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Leave out points at the parameter of the one before, as in a gap without length."""
    if kernels.is_ascending(u):
        return points, u
    kept = np.concatenate(([True], u[1:] > u[:-1]))
    return points[kept], u[kept]


def _at_least_order(points: FloatArray, u: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Put more points on the line through two or three, since a cubic needs four."""
    if len(points) > _DEGREE:
        return points, u
    denser = np.linspace(0.0, 1.0, _DEGREE + 1)
    return np.stack([np.interp(denser, u, column) for column in points.T], axis=1), denser
