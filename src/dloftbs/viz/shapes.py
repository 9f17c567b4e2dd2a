"""Lines and polygons at sub-pixel places, each with a dark halo."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from dloftbs.support.arrays import ByteArray, FloatArray
from dloftbs.viz.style import Colour, Style

Picture = ByteArray
"""Shape (H, W, 3), BGR."""

# OpenCV takes fixed-point coordinates: 1/16 px is finer than the eye, and leaves 2^27 px of range.
_SHIFT = 4
_FAR_PX = 1 << 20


@dataclass(frozen=True, eq=False)
class Shape:
    """A line or a polygon.

    Parameters
    ----------
    points : numpy.ndarray, shape (n, 2)
        ``(x, y)`` px.
    colour : colour
    width : float
        Of the line, px; drawn as a whole number of at least 1.
    closed : bool
        Whether the last point is joined to the first.
    filled : bool
        Whether the inside is painted too.
    """

    points: FloatArray
    colour: Colour
    width: float
    closed: bool = False
    filled: bool = False


def paint(picture: Picture, shapes: Sequence[Shape], style: Style) -> None:
    """Paint shapes into a picture: all halos first, so that none cuts another shape's line."""
    halos = picture.copy()
    for shape in shapes:
        # At least a whole pixel on either side, or the rim would vanish in the anti-aliasing.
        _trace(halos, shape, style.ink, _whole(shape.width) + 2 * _whole(style.halo_px))
    cv2.addWeighted(halos, style.halo_opacity, picture, 1.0 - style.halo_opacity, 0.0, dst=picture)
    for shape in shapes:
        _trace(picture, shape, shape.colour, _whole(shape.width))


def _trace(picture: Picture, shape: Shape, colour: Colour, width: int) -> None:
    points = np.rint(np.clip(shape.points, -_FAR_PX, _FAR_PX) * (1 << _SHIFT)).astype(np.int32)
    if shape.filled:
        cv2.fillPoly(picture, [points], colour, cv2.LINE_AA, _SHIFT)
    cv2.polylines(picture, [points], shape.closed, colour, width, cv2.LINE_AA, _SHIFT)


def _whole(width: float) -> int:
    return max(1, round(width))


def line(points: FloatArray, colour: Colour, width: float) -> Shape:
    """Return an open line through points (n, 2)."""
    return Shape(points, colour, width)


def disc(centre: FloatArray, radius: float, colour: Colour) -> Shape:
    """Return a filled circle."""
    return Shape(_circle(centre, radius - 0.5), colour, 1.0, closed=True, filled=True)


def ring(centre: FloatArray, radius: float, colour: Colour, width: float) -> Shape:
    """Return a circle."""
    return Shape(_circle(centre, radius), colour, width, closed=True)


def diamond(centre: FloatArray, radius: float, colour: Colour, width: float) -> Shape:
    """Return a hollow square that stands on a corner."""
    return Shape(centre + radius * np.array([[0, -1], [1, 0], [0, 1], [-1, 0]]), colour, width, closed=True)


def square(centre: FloatArray, radius: float, colour: Colour, width: float) -> Shape:
    """Return a hollow upright square."""
    return Shape(centre + radius * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]), colour, width, closed=True)


def arrow(tip: FloatArray, direction: FloatArray, length: float, colour: Colour) -> Shape:
    """Return a notched arrowhead whose middle is at `tip`; `direction` is a unit vector (2,)."""
    along, across = direction * length, np.array([-direction[1], direction[0]]) * length
    corners = (0.5 * along, -0.5 * along + 0.5 * across, -0.2 * along, -0.5 * along - 0.5 * across)
    return Shape(tip + np.array(corners), colour, 1.0, closed=True, filled=True)


def bounds(shapes: Iterable[Shape]) -> FloatArray:
    """Return all points of the shapes, shape (n, 2)."""
    return np.concatenate([np.empty((0, 2)), *(shape.points for shape in shapes)])


def _circle(centre: FloatArray, radius: float) -> FloatArray:
    angle = np.linspace(0.0, 2.0 * np.pi, 32, endpoint=False)
    return centre + max(radius, 0.5) * np.stack((np.cos(angle), np.sin(angle)), axis=1)
