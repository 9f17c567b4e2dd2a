"""Hands in space, as spheres in dense rows: two fingers, a thumb, a palm and a forearm."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from dloftbs.support.arrays import FloatArray
from dloftbs_lab.synthetic.signals import Moment, Signal

# Rows of spheres: (along the arm, across it, up from what is gripped, radius), metres, and how far apart, in radii.
_FINGER_M, _ARM_M = 0.008, 0.036
_AWAY_M = 0.75
_DENSITY = 6.0


@dataclass(frozen=True)
class Hand:
    """A hand that pinches a cable from above, or passes over it.

    Parameters
    ----------
    grip : float
        Normalised arc length of the point that it follows.
    bearing : float
        Direction in the plane, from the finger tips to the arm, radians from X to Y.
    follows : bool
        Whether `bearing` counts from the direction in which the cable would run on beyond its nearer end, not from X.
    presence : Signal
        1 where it grips; towards 0 it withdraws along its arm.
    hover : float
        Height of the finger tips above the cable, metres.
    """

    grip: float
    bearing: float
    presence: Signal
    follows: bool = False
    hover: float = 0.0

    def spheres(self, points: FloatArray, radius_m: float, moment: Moment) -> tuple[FloatArray, FloatArray]:
        """Return centres (m, 3) in the frame of the cable's `points` (n, 3), and radii (m,)."""
        away = 1.0 - min(max(self.presence(moment), 0.0), 1.0)
        up = radius_m + _FINGER_M + self.hover
        tips = [(-0.006, -0.011, up), (-0.002, 0.009, up), (0.004, -0.002, -0.001)]
        knuckles = [(0.062, -0.016, 0.034 + up), (0.064, 0.010, 0.036 + up), (0.066, -0.004, 0.018 + up)]
        rows = [_row(tip, knuckle, _FINGER_M, 0.011) for tip, knuckle in zip(tips, knuckles, strict=True)]
        rows.append(_row((0.075, -0.003, 0.034 + up), (0.13, -0.002, 0.04 + up), 0.027, 0.034))
        rows.append(_row((0.13, -0.002, 0.04 + up), (0.95, 0.0, 0.09 + up), 0.03, _ARM_M))
        local = np.concatenate(rows)
        local[:, 0] += away * _AWAY_M
        local[:, 2] += 0.06 * math.sin(0.5 * math.pi * away)
        index = round(self.grip * (len(points) - 1))
        bearing = self.bearing + (self._outward(points, index) if self.follows else 0.0)
        cos, sin = math.cos(bearing), math.sin(bearing)
        turn = np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])
        return points[index] + local[:, :3] @ turn, local[:, 3]

    def _outward(self, points: FloatArray, index: int) -> float:
        run = points[min(index + 1, len(points) - 1)] - points[max(index - 1, 0)]
        sign = -1.0 if self.grip < 0.5 else 1.0
        return math.atan2(sign * run[1], sign * run[0])


def _row(
    first: tuple[float, float, float], last: tuple[float, float, float], thin_m: float, thick_m: float
) -> FloatArray:
    """Return spheres (m, 4), centre and radius, that grow from one end to the other."""
    length = math.dist(first, last)
    x = np.linspace(0.0, 1.0, math.ceil(_DENSITY * length / thin_m) + 1)[:, None]
    return np.concatenate((first + x * (np.asarray(last) - first), thin_m + x * (thick_m - thin_m)), axis=1)
