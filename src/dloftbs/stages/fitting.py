"""Stage 6: centre line to cubic B-spline (paper: spline fitting)."""

from __future__ import annotations

import numpy as np

from dloftbs._arrays import FloatArray
from dloftbs.config import FittingConfig
from dloftbs.curve import BSplineCurve
from dloftbs.kernels import fitting as kernels

_DEGREE = 3


def fit(points: FloatArray, u: FloatArray, closed: bool, config: FittingConfig) -> BSplineCurve:
    """Fit one cubic B-spline by least squares, all coordinates with the same knots.

    Parameters
    ----------
    points : numpy.ndarray, shape (n, d)
        Two or more, px or metres.
    u : numpy.ndarray, shape (n,)
        Their parameters, ascending in [0, 1].
    closed : bool
        Whether the curve is to be periodic.
    config : FittingConfig

    Returns
    -------
    BSplineCurve
    """
    if closed:
        knots = closed_knots(u, config.knots)
        control = kernels.fit_closed(u, points, knots)
    else:
        points, u = _at_least_order(points, u)
        knots = kernels.open_knots(u, config.knots)
        control = kernels.fit_open(u, points, knots)
    return BSplineCurve.trusted(knots, control, _DEGREE, closed)


def closed_knots(u: FloatArray, k: int) -> FloatArray:
    """Return the knot vector for a loop: ``k`` distinct knots from 0 to 1, equidistant in element number, periodic.

    There are five or more, since a periodic cubic needs four spans, and no more than leave two points a span.
    """
    n = len(u)
    spans = max(min(k, n // 2) - 1, _DEGREE + 1)
    breaks = np.append(u[np.rint(np.linspace(0, n, spans + 1)[:-1]).astype(np.intp)], 1.0)
    return np.concatenate((breaks[-1 - _DEGREE : -1] - 1.0, breaks, breaks[1 : _DEGREE + 1] + 1.0))


def _at_least_order(points: FloatArray, u: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Put more points on the line through two or three, since a cubic needs four."""
    if len(points) > _DEGREE:
        return points, u
    denser = np.linspace(0.0, 1.0, _DEGREE + 1)
    return np.stack([np.interp(denser, u, column) for column in points.T], axis=1), denser
