"""Temporal smoothing of published curves: a first-order filter, whose lag behind steady motion is its time constant."""

from __future__ import annotations

import numpy as np

from dloftbs.data.curve import BSplineCurve
from dloftbs.data.curve_samples import sample_curve
from dloftbs.support.arrays import FloatArray
from dloftbs.tracking.track_motion import JUMP_SHARE, move_curve

_SAMPLES = 257
"""Number of samples along a curve that is smoothed, at even parameters.

Source: by hand; two to each knot of a cable that is coiled tightly.
"""

_MOVES = 5
"""Number of times that a curve is moved towards its filtered samples.

Source: derived; each move leaves two thirds of what differs from knot to knot, and five an eighth.
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
        """Return the filtered curve, `dt` seconds after the previous one; what stands still stays exactly as it is."""
        points, length = _sample(curve)
        before, self._unfiltered = self._unfiltered, points
        # One that jumped shows another stretch of its object, or another object.
        is_new = before is None or self._closed != curve.closed or np.abs(points - before).max() > JUMP_SHARE * length
        if self._points is None or is_new:
            self._points, self._closed = points, curve.closed
            return curve
        # This weight makes the lag behind steady motion exact at any interval.
        self._points = self._points + dt / (self._lag_s + dt) * (points - self._points)
        for _ in range(_MOVES):
            curve = move_curve(curve, self._points - _sample(curve)[0], 1.0)
        return curve


def _sample(curve: BSplineCurve) -> tuple[FloatArray, float]:
    """Return the samples of a curve (_SAMPLES, d), and its length."""
    return sample_curve(curve, count=_SAMPLES)
