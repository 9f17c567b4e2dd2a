"""The axis of a cable in space: directions integrated along the arc length, so that the length never changes."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from scipy.interpolate import make_interp_spline

from dloftbs.camera import PinholeCamera
from dloftbs.data.curve import BSplineCurve
from dloftbs.support.arrays import FloatArray
from dloftbs_lab.synthetic.motion import smoothstep
from dloftbs_lab.synthetic.signals import Moment, Signal, steady

_KNOT_SPACING_M = 0.004
_KNOT_SPACING_PX = 4.0
_STEEPEST = 0.9
_PATH_STEPS = 400


class Term(Protocol):
    """A share of the heading, radians, or of the height, metres, at normalised arc lengths (n,)."""

    def __call__(self, along: FloatArray, moment: Moment) -> FloatArray:
        """Return the share, shape (n,)."""
        ...


@dataclass(frozen=True)
class Wave:
    """``gain cos(pi count along - lag)``; a constant where `count` and `lag` are 0."""

    count: float
    gain: Signal
    lag: float = 0.0

    def __call__(self, along: FloatArray, moment: Moment) -> FloatArray:
        """Return the share, shape (n,)."""
        return self.gain(moment) * np.cos(math.pi * self.count * along - self.lag)


@dataclass(frozen=True)
class Bend:
    """A rise by `turn` from `start` to `end`, even but for both ends, where the slope sets in over `ease`.

    What comes before the bend takes the share `balance` of the turn, the other way.
    """

    start: float
    end: float
    turn: Signal
    ease: float = 0.05
    balance: float = 0.0

    def __call__(self, along: FloatArray, moment: Moment) -> FloatArray:
        """Return the share, shape (n,)."""
        even = self.end - self.start - self.ease
        rise = _eased((along - self.start) / self.ease) - _eased((along - self.start - even) / self.ease)
        return self.turn(moment) * (self.ease / even * rise - self.balance)


@dataclass(frozen=True)
class Step:
    """A smooth rise by `rise` from `start` to `end`."""

    start: float
    end: float
    rise: Signal

    def __call__(self, along: FloatArray, moment: Moment) -> FloatArray:
        """Return the share, shape (n,)."""
        return self.rise(moment) * smoothstep((along - self.start) / (self.end - self.start))


def _eased(x: FloatArray) -> FloatArray:
    """Return the integral of the smooth step."""
    inner = np.clip(x, 0.0, 1.0)
    return inner**4 * (inner * (inner - 3.0) + 2.5) + np.maximum(x - 1.0, 0.0)


@dataclass(frozen=True)
class SpaceMotion:
    """Motion of a cable above a plane; axes X and Y lie in the plane, the height H points upwards from it.

    Parameters
    ----------
    length_m : float
    heading : tuple of Term
        Direction in the plane, radians from X to Y.
    height : tuple of Term
        Metres above the plane. Where it would be steeper than the cable can follow, the cable stays below it.
    place : (Signal, Signal, Signal)
        Place of the point `anchor`: X, Y, and an offset of the height, metres.
    anchor : float
        Normalised arc length of the point that `place` leads.
    travel : Signal, optional
        Distance, in lengths, that the cable has moved along itself: every point follows the one before it, on a path
        that continues `heading` and `height` beyond 0 to 1. `place` then leads the start of the path, not `anchor`.
    """

    length_m: float
    heading: tuple[Term, ...]
    height: tuple[Term, ...] = ()
    place: tuple[Signal, Signal, Signal] = field(default=(steady(0.0), steady(0.0), steady(0.0)))
    anchor: float = 0.5
    travel: Signal | None = None

    def points(self, moment: Moment, count: int) -> FloatArray:
        """Return `count` points (X, Y, H), evenly spaced along the cable, shape (count, 3) m."""
        if self.travel is None:
            points = self._integrated(moment, 0.0, 1.0, count)
            points[:, :2] -= _at(points, self.anchor)
        else:
            begin = self.travel(moment)
            points = self._integrated(moment, begin, begin + 1.0, count)
            if begin != 0.0:
                points[:, :2] += self._integrated(moment, 0.0, begin, _PATH_STEPS)[-1, :2]
        points += [signal(moment) for signal in self.place]
        return points

    def _integrated(self, moment: Moment, begin: float, end: float, count: int) -> FloatArray:
        along = np.linspace(begin, end, count)
        heading, height = (sum((term(along, moment) for term in terms), np.zeros(count)) for terms in self._terms)
        spacing = (end - begin) * self.length_m / (count - 1)
        up = np.clip(np.diff(height) / spacing, -_STEEPEST, _STEEPEST)
        middle = 0.5 * (heading[1:] + heading[:-1])
        level = np.sqrt(1.0 - up * up)
        steps = spacing * np.stack((level * np.cos(middle), level * np.sin(middle), up), axis=1)
        start = np.array([[0.0, 0.0, height[0]]])
        return np.concatenate((start, start + np.cumsum(steps, axis=0)))

    @property
    def _terms(self) -> tuple[tuple[Term, ...], tuple[Term, ...]]:
        return self.heading, self.height


def _at(points: FloatArray, along: float) -> FloatArray:
    """Return X and Y at a normalised arc length, shape (2,); a nearest sample would jump with their number."""
    position = along * (len(points) - 1)
    low = min(int(position), len(points) - 2)
    return points[low, :2] + (position - low) * (points[low + 1, :2] - points[low, :2])


def axis_curve(points_m: FloatArray) -> BSplineCurve:
    """Return the curve through evenly spaced points (n, 3) m; ``u`` is the normalised arc length in space."""
    length = float(np.linalg.norm(np.diff(points_m, axis=0), axis=1).sum())
    pieces = max(4, min(len(points_m) - 1, math.ceil(length / _KNOT_SPACING_M)))
    picks = np.unique(np.linspace(0, len(points_m) - 1, pieces + 1).round().astype(np.intp))
    spline = make_interp_spline(picks / picks[-1], points_m[picks], k=3)
    return BSplineCurve(spline.t, spline.c)


def image_curve(points_m: FloatArray, camera: PinholeCamera) -> BSplineCurve:
    """Return the projection of the curve through points (n, 3) m; ``u`` is the normalised arc length in the image."""
    return curve_through_samples(camera.project(points_m))


def curve_through_samples(points: FloatArray) -> BSplineCurve:
    """Return the curve through dense points (n, 2) px; ``u`` is the normalised arc length."""
    arc = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))))
    pieces = max(4, min(len(points) - 1, math.ceil(arc[-1] / _KNOT_SPACING_PX)))
    picks = np.unique(np.searchsorted(arc, np.linspace(0.0, arc[-1], pieces + 1)))
    spline = make_interp_spline(arc[picks] / arc[-1], points[picks], k=3)
    return BSplineCurve(spline.t, spline.c)
