"""Occluders that move over the cables in the sequences that tracking is measured on."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from dloftbs._arrays import FloatArray
from dloftbs.synthetic.motion import smoothstep, window
from dloftbs.synthetic.strand import Strand


class Cover(Protocol):
    """An occluder: a convex polygon that moves with the phase."""

    def polygon(self, phase: float, strands: Sequence[Strand]) -> FloatArray:
        """Return its corners (n, 2) px; `strands` are the cables at that phase."""


@dataclass(frozen=True)
class Reach:
    """A disc, or a bar from outside of the image, that comes over a cable, moves along it, and leaves.

    Parameters
    ----------
    cable : int
    along : (float, float)
        Normalised arc length of the cable where it arrives, and where it leaves.
    direction : float
        From the cable to where it comes from, radians.
    radius_px : float
        Of the disc, or half the width of the bar.
    bar : bool
    away_px : float
        Distance at which it waits.
    """

    cable: int
    along: tuple[float, float]
    direction: float
    radius_px: float
    bar: bool
    away_px: float

    def polygon(self, phase: float, strands: Sequence[Strand]) -> FloatArray:
        """Return its corners."""
        here = self.along[0] + (self.along[1] - self.along[0]) * float(smoothstep(np.array((phase - 0.2) / 0.6)))
        points = strands[self.cable].points
        away = np.array([math.cos(self.direction), math.sin(self.direction)])
        retreat = 1.0 - window(phase, (0.1, 0.3), (0.75, 0.95))
        centre = points[round(min(max(here, 0.0), 1.0) * (len(points) - 1))] + retreat * self.away_px * away
        if not self.bar:
            return circle(centre, self.radius_px)
        across = self.radius_px * np.array([-away[1], away[0]])
        tip, base = centre - self.radius_px * away, centre + 2.0 * self.away_px * away
        return np.array([tip - across, tip + across, base + across, base - across])


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

    def polygon(self, phase: float, strands: Sequence[Strand]) -> FloatArray:
        """Return its corners."""
        return circle(middle(strands[self.cable]), self.radius_px * window(phase, self.rise, self.fall))


def middle(strand: Strand) -> FloatArray:
    """Return the middle (2,) of the box around a cable."""
    centre: FloatArray = (strand.points.min(axis=0) + strand.points.max(axis=0)) / 2.0
    return centre


def circle(centre: FloatArray, radius_px: float) -> FloatArray:
    """Return the corners (64, 2) of a circle."""
    angle = np.linspace(0.0, 2.0 * math.pi, 64, endpoint=False)
    corners: FloatArray = centre + radius_px * np.stack((np.cos(angle), np.sin(angle)), axis=1)
    return corners
