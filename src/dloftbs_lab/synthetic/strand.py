"""The shape of a cable in the plane: headings integrated along the arc length, so that the length never changes."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.interpolate import make_interp_spline

from dloftbs.data.curve import BSplineCurve
from dloftbs.errors import InputError
from dloftbs.support.arrays import FloatArray

_KNOT_SPACING_PX = 6.0
_MODES = 6
_ATTEMPTS = 200


@dataclass(frozen=True, eq=False)
class Strand:
    """A densely sampled plane curve.

    Parameters
    ----------
    points : numpy.ndarray, shape (n, 2)
        ``(x, y)`` px, evenly spaced along the arc.
    heading : numpy.ndarray, shape (n,)
        Direction of travel in the image, radians.
    spacing : float
        Arc length between two neighbours, px.
    """

    points: FloatArray
    heading: FloatArray
    spacing: float

    @property
    def length(self) -> float:
        """Arc length, px."""
        return self.spacing * (len(self.points) - 1)

    @cached_property
    def tangents(self) -> FloatArray:
        """Unit tangents, shape (n, 2)."""
        return np.stack((np.cos(self.heading), np.sin(self.heading)), axis=1)

    @cached_property
    def bending(self) -> FloatArray:
        """Signed curvature, shape (n,), 1 / px; positive where the heading grows."""
        return np.gradient(self.heading, self.spacing)

    def moved(self, offset: FloatArray) -> Strand:
        """Return the strand shifted by `offset` (2,) px."""
        return Strand(self.points + offset, self.heading, self.spacing)

    def curve(self) -> BSplineCurve:
        """Return the interpolating cubic B-spline, ``u`` being the normalised arc length."""
        knots = max(8, math.ceil(self.length / _KNOT_SPACING_PX))
        picks = np.unique(np.linspace(0, len(self.points) - 1, knots + 1).round().astype(np.intp))
        spline = make_interp_spline(picks / picks[-1], self.points[picks], k=3)
        return BSplineCurve(spline.t, spline.c)


def integrate(heading: FloatArray, length_px: float) -> Strand:
    """Walk from the origin along the headings (n,), in equal steps that add up to `length_px`."""
    spacing = length_px / (len(heading) - 1)
    tangents = np.stack((np.cos(heading), np.sin(heading)), axis=1)
    steps = 0.5 * (tangents[1:] + tangents[:-1]) * spacing
    points = np.concatenate((np.zeros((1, 2)), np.cumsum(steps, axis=0)))
    return Strand(points, heading, spacing)


def random_curve(
    rng: np.random.Generator,
    length_px: float,
    size: tuple[int, int],
    *,
    min_radius_px: float = 24.0,
    margin_px: float = 10.0,
) -> BSplineCurve:
    """Draw a smooth curve of a given length that lies inside an image.

    The heading is a sum of cosines along the arc with random amplitudes, so the curve may cross itself.

    Parameters
    ----------
    rng : numpy.random.Generator
    length_px : float
    size : (int, int)
        ``(H, W)`` of the image.
    min_radius_px : float
        No bend is tighter.
    margin_px : float
        Distance kept from the border.

    Returns
    -------
    BSplineCurve
        In px, ``u`` being the normalised arc length.

    Raises
    ------
    InputError
        If a number is not positive, or no curve of this length fits.
    """
    return random_strand(rng, length_px, size, min_radius_px, margin_px).curve()


def random_strand(
    rng: np.random.Generator, length_px: float, size: tuple[int, int], min_radius_px: float, margin_px: float
) -> Strand:
    """Draw what `random_curve` gives, as a strand."""
    if not (length_px > 0 and min_radius_px > 0 and margin_px >= 0):
        raise InputError(
            f"length_px and min_radius_px must be positive and margin_px not negative, "
            f"got {length_px}, {min_radius_px} and {margin_px}"
        )
    room = np.array([size[1] - 1, size[0] - 1]) - 2.0 * margin_px
    along = np.linspace(0.0, 1.0, max(64, math.ceil(2.0 * length_px)))
    for _ in range(_ATTEMPTS):
        strand = integrate(random_heading(rng, along, length_px, min_radius_px), length_px)
        low, high = strand.points.min(axis=0), strand.points.max(axis=0)
        if (high - low <= room).all():
            return strand.moved(margin_px - low + rng.random(2) * (room - (high - low)))
    raise InputError(f"no curve of {length_px} px with bends of {min_radius_px} px or more fits an image of {size}")


def random_heading(rng: np.random.Generator, along: FloatArray, length_px: float, min_radius_px: float) -> FloatArray:
    """Draw headings at the normalised arc lengths (n,): cosines that bend no more tightly than `min_radius_px`."""
    order = np.arange(1, _MODES + 1)
    amplitude = rng.normal(size=_MODES) * 3.0 / order
    heading = amplitude @ np.cos(np.pi * order[:, None] * along)
    sharpest = np.abs(np.gradient(heading, length_px / (len(along) - 1))).max()
    heading *= min(1.0, 0.98 / (min_radius_px * max(sharpest, 1e-12)))
    return heading + rng.uniform(0.0, 2.0 * np.pi)
