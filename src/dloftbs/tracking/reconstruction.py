"""A whole curve from the parts that are seen and the shape that is remembered, in the plane or in space.

What is hidden keeps the shape that it had, and is carried and turned as what is seen beside it: at an end by that side
alone, in between by both sides, the one fading into the other.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from dloftbs._arrays import FloatArray
from dloftbs.curve import BSplineCurve
from dloftbs.kernels import least_squares

_PLACES = 193
_POINTS_A_SPAN = 4
_U = np.linspace(0.0, 1.0, _PLACES)
_KNOTS = least_squares.open_knots(_U, _PLACES // _POINTS_A_SPAN)
_WINDOW = 0.15  # of the whole length: at least so much of what is seen tells how its neighbourhood has turned
_LEAST_POINTS = 4
_STEPS = 20
_CLOSED_PX = 0.05
_MOST_BEND = 0.5 * math.pi


class Stretch(NamedTuple):
    """A part that is seen: the stretch `of` a curve, in its ``u``, lies at the stretch `at` of the whole."""

    curve: BSplineCurve
    at: tuple[float, float]
    of: tuple[float, float]


class _Motion(NamedTuple):
    """A turn about the origin (d, d) and a shift (d,)."""

    turn: FloatArray
    shift: FloatArray

    def __call__(self, points: FloatArray) -> FloatArray:
        result: FloatArray = points @ self.turn.T + self.shift
        return result


def assemble(before: BSplineCurve, scope: tuple[float, float], stretches: Sequence[Stretch]) -> BSplineCurve:
    """Return the whole curve.

    Parameters
    ----------
    before : BSplineCurve
        Open; the remembered shape.
    scope : (float, float)
        The stretch of its ``u`` that is the whole.
    stretches : sequence of Stretch
        In order; at least one, none overlaps another.
    """
    old = before(scope[0] + _U * (scope[1] - scope[0]))
    new = np.full_like(old, np.nan)
    runs = []
    for stretch in stretches:
        (low, high), (first, last) = stretch.at, stretch.of
        start, stop = int(_U.searchsorted(low - 1e-9)), int(_U.searchsorted(high + 1e-9, side="right"))
        if start < stop:
            share = np.minimum(np.maximum((_U[start:stop] - low) / (high - low), 0.0), 1.0)
            new[start:stop] = stretch.curve(first + share * (last - first))
            runs.append((start, stop - 1))
    if not runs:
        return before
    edges = [-1, *(edge for run in runs for edge in run), _PLACES]
    for k, (left, right) in enumerate(zip(edges[::2], edges[1::2], strict=True)):
        hidden = slice(left + 1, right)
        if left + 1 >= right:
            continue
        reach = max(right - left, round(_WINDOW * _PLACES))
        by_left = _carried(old, new, runs[k - 1], reach, left) if k > 0 else None
        by_right = _carried(old, new, runs[k], reach, right) if k < len(runs) else None
        between = by_left is not None and by_right is not None and old.shape[1] == 2
        bent = _bent(old[left : right + 1], new[left], new[right], by_left, by_right) if between else None
        new[hidden] = _faded(by_left, by_right, old[hidden]) if bent is None else bent
    return BSplineCurve._unchecked(_KNOTS, least_squares.fit_open(_U, new, _KNOTS), 3, False)


def _faded(left: _Motion | None, right: _Motion | None, points: FloatArray) -> FloatArray:
    if left is None or right is None:
        motion = left or right
        assert motion is not None  # something is seen on one side
        return motion(points)
    t = np.arange(1, len(points) + 1)[:, None] / (len(points) + 1)
    weight = t * t * (3.0 - 2.0 * t)
    result: FloatArray = (1.0 - weight) * left(points) + weight * right(points)
    return result


def _bent(
    points: FloatArray, start: FloatArray, end: FloatArray, left: _Motion | None, right: _Motion | None
) -> FloatArray | None:
    """Bend a stretch of the plane, its length kept, from a start to an end, so that it goes on smoothly on both sides.

    The headings turn by what each side has turned, by a mixture in between, and by two smooth waves that bring the end
    to its place. None where that would need more than a quarter turn.
    """
    assert left is not None
    assert right is not None
    steps = np.diff(points, axis=0)
    length = np.sqrt((steps * steps).sum(axis=1))
    heading = np.arctan2(steps[:, 1], steps[:, 0])
    one, other = (math.atan2(motion.turn[1, 0], motion.turn[0, 0]) for motion in (left, right))
    other = one + math.remainder(other - one, 2.0 * math.pi)
    t = (np.arange(len(steps)) + 0.5) / len(steps)
    weight = t * t * (3.0 - 2.0 * t)
    turned = heading + (1.0 - weight) * one + weight * other
    waves = np.stack((np.sin(math.pi * t), np.sin(2.0 * math.pi * t)))
    gain = np.zeros(2)
    target = end - start
    step, across = np.empty((2, len(steps))), np.empty((2, len(steps)))
    for _ in range(_STEPS):
        angle = turned + gain @ waves
        np.cos(angle, out=step[0])
        np.sin(angle, out=step[1])
        step *= length
        missing = target - step.sum(axis=1)
        if float(missing @ missing) < _CLOSED_PX**2:
            return start + np.cumsum(step, axis=1).T[:-1]
        np.negative(step[1], out=across[0])
        across[1] = step[0]
        slope = across @ waves.T
        (a, b), (c, d) = slope.tolist()
        if abs(a * d - b * c) < 1e-9:
            return None
        gain = gain + np.linalg.solve(slope, missing).clip(-_MOST_BEND / 3.0, _MOST_BEND / 3.0)
        if np.abs(gain).max() > _MOST_BEND:
            return None
    return None


def _carried(old: FloatArray, new: FloatArray, run: tuple[int, int], reach: int, edge: int) -> _Motion:
    """Return how the points of a run near its edge have moved; the point at the edge exactly."""
    first, last = (run[0], min(run[0] + reach, run[1])) if edge == run[0] else (max(run[1] - reach, run[0]), run[1])
    a, b = old[first : last + 1], new[first : last + 1]
    turn = np.eye(old.shape[1])
    if len(a) >= _LEAST_POINTS:
        u, _, vt = np.linalg.svd((b - b.sum(axis=0) / len(b)).T @ (a - a.sum(axis=0) / len(a)))
        flip = np.ones(len(turn))
        flip[-1] = math.copysign(1.0, float(np.linalg.det(u @ vt)))
        turn = (u * flip) @ vt
    return _Motion(turn, new[edge] - turn @ old[edge])
