"""Start of a loop: the same curve with ``u = 0`` at another place."""

from __future__ import annotations

import numpy as np

from dloftbs._arrays import FloatArray
from dloftbs.curve import BSplineCurve

_DEGREE = 3
_SAME = 1e-9


def restarted(curve: BSplineCurve, u: float) -> BSplineCurve:
    """Return the same loop, exactly, with its start where `u` in 0..1 was: a knot is inserted there (Boehm, 1980).

    Loops of another degree than 3 stay as they are.
    """
    if curve.degree != _DEGREE or min(u, 1.0 - u) < _SAME:
        return curve
    spans = len(curve.control_points) - _DEGREE
    k = int(np.searchsorted(curve.knots[: _DEGREE + spans + 1], u + _SAME, side="right")) - 1
    at = np.arange(k - 3, k + spans + 5)  # enough of the endless, periodic sequences
    knots = _endless(curve.knots, spans, at)
    control = curve.control_points[at % spans]
    if abs(u - knots[3]) < _SAME:  # there is a knot already: it comes first
        return _make_loop(knots[: spans + 7] - u, control[:spans])
    share = ((u - knots[1:4]) / (knots[4:7] - knots[1:4]))[:, None]
    mixed = (1.0 - share) * control[:3] + share * control[1:4]
    breaks = np.concatenate((knots[1:4], [u], knots[4 : 4 + spans], [u + 1.0], knots[4:7] + 1.0))
    return _make_loop(breaks - u, np.vstack((mixed, control[3 : spans + 1])))


def _endless(knots: FloatArray, spans: int, at: np.ndarray) -> FloatArray:
    """Return knots at any places of the periodic sequence."""
    rounds, rest = np.divmod(at - _DEGREE, spans)
    result: FloatArray = knots[_DEGREE + rest] + rounds
    return result


def _make_loop(knots: FloatArray, control: FloatArray) -> BSplineCurve:
    """Return the loop of these control points, the first three of which come again at its end."""
    return BSplineCurve._unchecked(knots, np.vstack((control, control[:_DEGREE])), _DEGREE, True)
