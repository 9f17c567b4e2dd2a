"""Start of a loop: the same closed curve with ``u = 0`` at another place."""

from __future__ import annotations

import numpy as np

from dloftbs.data.curve import BSplineCurve
from dloftbs.data.curve_samples import sample_curve
from dloftbs.data.u_mapping import is_in_front
from dloftbs.support.arrays import FloatArray
from dloftbs.tracking.observation import Observation
from dloftbs.tracking.partial_match import SAME_U

_DEGREE = 3
"""Degree of the splines.

Source: by definition; cubic, as in the paper.
"""


def restart_loop(observation: Observation, u: float) -> Observation:
    """Return a loop that starts at the former `u`; its detection stays as the frame has it."""
    curve = move_start(observation.curve, u)
    if curve is observation.curve:
        return observation
    points, length = sample_curve(curve)
    gaps = []
    for low, high in observation.gaps:
        first, last = (low - u) % 1.0, (low - u) % 1.0 + high - low
        gaps += [(first, last)] if last <= 1.0 else [(first, 1.0), (0.0, last - 1.0)]
    return observation._replace(curve=curve, points=points, length=length, gaps=tuple(sorted(gaps)))


def restart_in_space(observation: Observation, u: float) -> BSplineCurve | None:
    """Return the curve in space of a loop, starting where its curve in the image has `u`."""
    detection, curve_3d = observation.detection, observation.curve_3d
    if detection is None or detection.camera is None or curve_3d is None:
        return curve_3d
    if not (curve_3d.closed and is_in_front(curve_3d)):
        return curve_3d
    start = detection.u_3d(observation.curve.u_at(u % 1.0))
    return move_start(curve_3d, float(curve_3d.t_at(start)))


def move_start(curve: BSplineCurve, u: float) -> BSplineCurve:
    """Return exactly the same loop, starting at the former `u` in 0..1: a knot is inserted there (Boehm, 1980).

    Loops of another degree than 3 are returned unchanged.
    """
    if curve.degree != _DEGREE or min(u, 1.0 - u) < SAME_U:
        return curve
    spans = len(curve.control_points) - _DEGREE
    k = int(np.searchsorted(curve.knots[: _DEGREE + spans + 1], u + SAME_U, side="right")) - 1
    indices = np.arange(k - 3, k + spans + 5)  # enough of the infinite, periodic sequences
    knots = _periodic_knots(curve.knots, spans, indices)
    control = curve.control_points[indices % spans]
    if abs(u - knots[3]) < SAME_U:  # there is a knot already: it becomes the first
        return _make_loop(knots[: spans + 7] - u, control[:spans])
    weight = ((u - knots[1:4]) / (knots[4:7] - knots[1:4]))[:, None]
    mixed = (1.0 - weight) * control[:3] + weight * control[1:4]
    breaks = np.concatenate((knots[1:4], [u], knots[4 : 4 + spans], [u + 1.0], knots[4:7] + 1.0))
    return _make_loop(breaks - u, np.vstack((mixed, control[3 : spans + 1])))


def _periodic_knots(knots: FloatArray, spans: int, indices: np.ndarray) -> FloatArray:
    """Return knots of the infinite periodic sequence."""
    turns, rest = np.divmod(indices - _DEGREE, spans)
    result: FloatArray = knots[_DEGREE + rest] + turns
    return result


def _make_loop(knots: FloatArray, control: FloatArray) -> BSplineCurve:
    """Return the loop of these control points, the first three of which are repeated at its end."""
    return BSplineCurve._unchecked(knots, np.vstack((control, control[:_DEGREE])), _DEGREE, True)
