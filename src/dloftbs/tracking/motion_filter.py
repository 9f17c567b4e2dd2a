"""Temporal smoothing of published curves: a first-order filter, whose lag behind steady motion is its time constant."""

from __future__ import annotations

import numpy as np

from dloftbs.data.curve import BSplineCurve
from dloftbs.kernels import least_squares
from dloftbs.support.arrays import FloatArray
from dloftbs.tracking.track_motion import JUMP_SHARE

_SAMPLES = 129
"""Number of samples along a curve that is smoothed, at even parameters.

Source: by hand; four to each of `_KNOTS`.
"""

_KNOTS = 33
"""Number of knots of a smooth curve.

Source: by hand; more than the 25 of the paper.
"""


class CurveFilter:
    """First-order low-pass filter of one curve.

    Parameters
    ----------
    lag_s : float
        Lag, positive.
    """

    def __init__(self, lag_s: float) -> None:
        self._lag_s = lag_s
        self._points: FloatArray | None = None
        self._unfiltered: FloatArray | None = None
        self._closed = False

    def __call__(self, curve: BSplineCurve, dt: float) -> BSplineCurve:
        """Return the filtered curve, `dt` seconds after the previous one."""
        u = np.linspace(0.0, 1.0, _SAMPLES)[: -1 if curve.closed else None]
        points = curve.spline(u)
        before, self._unfiltered = self._unfiltered, points
        # One that jumped shows another stretch of its object, or another object.
        goes_on = before is not None and self._closed == curve.closed
        if self._points is None or not goes_on or np.abs(points - before).max() > JUMP_SHARE * curve.length:
            self._points, self._closed = points, curve.closed
            return curve
        # This weight makes the lag behind steady motion exact at any interval.
        self._points = self._points + dt / (self._lag_s + dt) * (points - self._points)
        if not curve.closed:
            knots = least_squares.open_knots(u, _KNOTS)
            return BSplineCurve._unchecked(knots, least_squares.fit_open(u, self._points, knots), 3, False)
        breaks = np.linspace(0.0, 1.0, _KNOTS)
        knots = np.concatenate((breaks[-4:-1] - 1.0, breaks, breaks[1:4] + 1.0))
        return BSplineCurve._unchecked(knots, least_squares.fit_closed(u, self._points, knots), 3, True)
