"""Occluders that move over the cables in the sequences that tracking is measured on."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np

from dloftbs.support.arrays import FloatArray
from dloftbs_lab.synthetic.motion import smoothstep, window
from dloftbs_lab.synthetic.strand import Strand

CoverShape = Literal["disc", "bar", "hand"]
"""Shape of an occluder that reaches over a cable; bars and hands come from outside of the image."""

_FINGERS = ((-0.75, 0.55), (-0.28, 0.85), (0.2, 1.0), (0.66, 0.8))
"""Fingers of a hand: place across it, and length, multiples of its radius."""
_FINGER_RADIUS = 0.18
_PALM_RADIUS = 0.95


class Cover(Protocol):
    """An occluder: convex polygons that move with the phase."""

    def polygons(self, phase: float, strands: Sequence[Strand]) -> list[FloatArray]:
        """Return the corners (n, 2) px of each; `strands` are the cables at that phase."""


@dataclass(frozen=True)
class Reach:
    """An occluder that comes over a cable, moves along it, and leaves.

    Parameters
    ----------
    cable : int
    along : (float, float)
        Normalised arc length of the cable where it arrives, and where it leaves.
    direction : float
        From the cable to where it comes from, radians.
    radius_px : float
        Of the disc, or half the width of the bar or the hand.
    shape : {"disc", "bar", "hand"}
    away_px : float
        Distance at which it waits.
    """

    cable: int
    along: tuple[float, float]
    direction: float
    radius_px: float
    shape: CoverShape
    away_px: float

    def polygons(self, phase: float, strands: Sequence[Strand]) -> list[FloatArray]:
        """Return the corners of its parts."""
        here = self.along[0] + (self.along[1] - self.along[0]) * float(smoothstep(np.array((phase - 0.2) / 0.6)))
        points = strands[self.cable].points
        away = np.array([math.cos(self.direction), math.sin(self.direction)])
        retreat = 1.0 - window(phase, (0.1, 0.3), (0.75, 0.95))
        centre = points[round(min(max(here, 0.0), 1.0) * (len(points) - 1))] + retreat * self.away_px * away
        base = centre + 2.0 * self.away_px * away
        if self.shape == "disc":
            return [circle(centre, self.radius_px)]
        if self.shape == "bar":
            return [_bar(centre - self.radius_px * away, base, self.radius_px)]
        return _hand(centre, base, away, self.radius_px)


@dataclass(frozen=True)
class Lid:
    """A disc over the whole of a cable, that grows until nothing of it is seen, and shrinks again.

    Parameters
    ----------
    cable : int
    radius_px : float
        At its largest.
    rise, fall : (float, float)
        Phases between which it grows and shrinks.
    """

    cable: int
    radius_px: float
    rise: tuple[float, float]
    fall: tuple[float, float]

    def polygons(self, phase: float, strands: Sequence[Strand]) -> list[FloatArray]:
        """Return its corners."""
        return [circle(middle(strands[self.cable]), self.radius_px * window(phase, self.rise, self.fall))]


def _hand(centre: FloatArray, base: FloatArray, away: FloatArray, radius_px: float) -> list[FloatArray]:
    """Return the corners of a hand with spread fingers whose knuckles are at a place, and of its arm."""
    across = np.array([-away[1], away[0]])
    knuckles = centre + 0.5 * radius_px * away
    fingers = [
        _bar(root - length * radius_px * away, root, _FINGER_RADIUS * radius_px)
        for root, length in ((knuckles + side * radius_px * across, length) for side, length in _FINGERS)
    ]
    palm = circle(knuckles + 0.6 * radius_px * away, _PALM_RADIUS * radius_px)
    return [*fingers, palm, _bar(knuckles + radius_px * away, base, 0.6 * radius_px)]


def _bar(tip: FloatArray, base: FloatArray, radius_px: float) -> FloatArray:
    """Return the corners (4, 2) of a bar from its tip to its base."""
    way = (base - tip) / np.linalg.norm(base - tip)
    across = radius_px * np.array([-way[1], way[0]])
    return np.array([tip - across, tip + across, base + across, base - across])


def middle(strand: Strand) -> FloatArray:
    """Return the middle (2,) of the box around a cable."""
    return (strand.points.min(axis=0) + strand.points.max(axis=0)) / 2.0


def circle(centre: FloatArray, radius_px: float) -> FloatArray:
    """Return the corners (64, 2) of a circle."""
    angle = np.linspace(0.0, 2.0 * math.pi, 64, endpoint=False)
    return centre + radius_px * np.stack((np.cos(angle), np.sin(angle)), axis=1)
