"""Reconstruction of a whole curve from its visible parts and its last shape, in the plane or in space.

Hidden spans keep their shape and follow the rigid motion of the visible parts beside them: at an end that of one side,
in between those of both sides, blended.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from dloftbs._arrays import FloatArray
from dloftbs.curve import BSplineCurve
from dloftbs.kernels import least_squares
from dloftbs.tracking.partial_match import SAME_U

_SAMPLES = 193
"""Number of samples of the reconstructed curve, at even parameters.

Source: by hand; three to each of a curve's `SAMPLES`.
"""

_SAMPLES_PER_SPAN = 4
"""Number of samples to a span of the reconstructed spline.

Source: by hand; fewer do not determine it against noise.
"""

_U = np.linspace(0.0, 1.0, _SAMPLES)
"""Parameters of the samples, units of ``u``.

Source: by definition.
"""

_KNOTS = least_squares.open_knots(_U, _SAMPLES // _SAMPLES_PER_SPAN)

_WINDOW_SHARE = 0.15
"""Least visible share of the whole length that determines a rigid motion.

Source: by hand.
"""

_MIN_POINTS = 4
"""Least number of points of a visible part that determine a rotation.

Source: by hand; two do, without noise.
"""

_MAX_ITERATIONS = 20
"""Number of steps of the search for a wave of headings.

Source: bounds time.
"""

_END_TOLERANCE_PX = 0.05
"""Distance of an end from where it should be at which that search is over, px.

Source: numerics; below what a curve is known to.
"""

_MAX_TURN = 0.5 * math.pi
"""Largest turn of a wave of headings, rad.

Source: by hand; beyond a right angle the span winds up.
"""


class VisiblePart(NamedTuple):
    """A visible part: the span `curve_span` of a curve lies at the span `track_span` of the whole, both in ``u``."""

    curve: BSplineCurve
    track_span: tuple[float, float]
    curve_span: tuple[float, float]


class _RigidMotion(NamedTuple):
    """A rotation about the origin (d, d), then a translation (d,)."""

    rotation: FloatArray
    translation: FloatArray

    def __call__(self, points: FloatArray) -> FloatArray:
        result: FloatArray = points @ self.rotation.T + self.translation
        return result


def reconstruct(before: BSplineCurve, scope: tuple[float, float], parts: Sequence[VisiblePart]) -> BSplineCurve:
    """Return the whole curve.

    Parameters
    ----------
    before : BSplineCurve
        Last known shape, open.
    scope : (float, float)
        Span of its ``u`` that is the whole.
    parts : sequence of VisiblePart
        One or more, in order, without overlaps.
    """
    old = before(scope[0] + _U * (scope[1] - scope[0]))
    new = np.full_like(old, np.nan)
    visible: list[tuple[int, int]] = []  # first and last sample
    for part in parts:
        (low, high), (first, last) = part.track_span, part.curve_span
        start, stop = int(_U.searchsorted(low - SAME_U)), int(_U.searchsorted(high + SAME_U, side="right"))
        if start < stop:
            share = np.minimum(np.maximum((_U[start:stop] - low) / (high - low), 0.0), 1.0)
            new[start:stop] = part.curve(first + share * (last - first))
            visible.append((start, stop - 1))
    if not visible:
        return before
    edges = [-1, *(edge for bounds in visible for edge in bounds), _SAMPLES]
    for k, (left, right) in enumerate(zip(edges[::2], edges[1::2], strict=True)):
        hidden = slice(left + 1, right)
        if left + 1 >= right:
            continue
        window = max(right - left, round(_WINDOW_SHARE * _SAMPLES))
        by_left = _estimate_motion(old, new, visible[k - 1], window, left) if k > 0 else None
        by_right = _estimate_motion(old, new, visible[k], window, right) if k < len(visible) else None
        between = by_left is not None and by_right is not None and old.shape[1] == 2
        bent = _bend(old[left : right + 1], new[left], new[right], by_left, by_right) if between else None
        new[hidden] = _blend_motions(by_left, by_right, old[hidden]) if bent is None else bent
    return BSplineCurve._unchecked(_KNOTS, least_squares.fit_open(_U, new, _KNOTS), 3, False)


def _blend_motions(left: _RigidMotion | None, right: _RigidMotion | None, points: FloatArray) -> FloatArray:
    """Return the points of a hidden span, moved by one side or by a blend of both."""
    if left is None or right is None:
        motion = left or right
        assert motion is not None  # one side is visible
        return motion(points)
    t = np.arange(1, len(points) + 1)[:, None] / (len(points) + 1)
    weight = t * t * (3.0 - 2.0 * t)
    result: FloatArray = (1.0 - weight) * left(points) + weight * right(points)
    return result


def _bend(
    points: FloatArray, start: FloatArray, end: FloatArray, left: _RigidMotion | None, right: _RigidMotion | None
) -> FloatArray | None:
    """Bend a span of a plane curve between two points, so that its length is kept and both sides continue smoothly.

    The headings turn as the sides have turned, blended in between, and by two sine waves that bring the end to its
    place. None if that would need more than a quarter turn.
    """
    assert left is not None
    assert right is not None
    steps = np.diff(points, axis=0)
    length = np.sqrt((steps * steps).sum(axis=1))
    heading = np.arctan2(steps[:, 1], steps[:, 0])
    one, other = (math.atan2(motion.rotation[1, 0], motion.rotation[0, 0]) for motion in (left, right))
    other = one + math.remainder(other - one, 2.0 * math.pi)
    t = (np.arange(len(steps)) + 0.5) / len(steps)
    weight = t * t * (3.0 - 2.0 * t)
    turned = heading + (1.0 - weight) * one + weight * other
    waves = np.stack((np.sin(math.pi * t), np.sin(2.0 * math.pi * t)))
    gain = np.zeros(2)
    target = end - start
    step, across = np.empty((2, len(steps))), np.empty((2, len(steps)))
    for _ in range(_MAX_ITERATIONS):
        angle = turned + gain @ waves
        np.cos(angle, out=step[0])
        np.sin(angle, out=step[1])
        step *= length
        missing = target - step.sum(axis=1)
        if float(missing @ missing) < _END_TOLERANCE_PX**2:
            return start + np.cumsum(step, axis=1).T[:-1]
        np.negative(step[1], out=across[0])
        across[1] = step[0]
        slope = across @ waves.T
        (a, b), (c, d) = slope.tolist()
        if abs(a * d - b * c) < 1e-9:
            return None
        gain = gain + np.linalg.solve(slope, missing).clip(-_MAX_TURN / 3.0, _MAX_TURN / 3.0)
        if np.abs(gain).max() > _MAX_TURN:
            return None
    return None


def _estimate_motion(
    old: FloatArray, new: FloatArray, visible: tuple[int, int], window: int, edge: int
) -> _RigidMotion:
    """Fit the motion of a visible part near one of its edges; it is exact for the sample at the edge (Kabsch, 1976)."""
    low, high = visible
    first, last = (low, min(low + window, high)) if edge == low else (max(high - window, low), high)
    a, b = old[first : last + 1], new[first : last + 1]
    rotation = np.eye(old.shape[1])
    if len(a) >= _MIN_POINTS:
        u, _, vt = np.linalg.svd((b - b.sum(axis=0) / len(b)).T @ (a - a.sum(axis=0) / len(a)))
        flip = np.ones(len(rotation))
        flip[-1] = math.copysign(1.0, float(np.linalg.det(u @ vt)))
        rotation = (u * flip) @ vt
    return _RigidMotion(rotation, new[edge] - rotation @ old[edge])
