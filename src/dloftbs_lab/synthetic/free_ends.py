"""Masks of cables of changing width whose free ends are flat, round, frayed or tapered."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from scipy.spatial import cKDTree

from dloftbs.support.arrays import BoolArray, FloatArray
from dloftbs_lab.synthetic.kernels.stamping import stamp_discs

Mask = BoolArray
EndStyle = Literal["flat", "round", "frayed", "tapered"]
END_STYLES: tuple[EndStyle, ...] = get_args(EndStyle)
"""Shapes of a cable's end: cut off, a hemisphere, single wires, a ferrule that gets thinner."""

_SHAPED = 2.0
"""Widths of cable before the tip that are drawn by the end's style; the round cap of the body stays behind it."""
_TAPERED_TO = 0.35
"""Width of a tapered end at its tip, as a share of the cable's."""
_TIP_PX = 0.75
"""Beyond the tip and to its sides, so that the mask has the pixel in which the tip lies."""
_WIRES = (3, 6)
_MIN_WIRE_PX = 1.2
_WIRE = 0.16
"""Diameter of a wire, as a share of the cable's."""
_WIRES_REACH = 2.0
"""Widths beyond the tip that no wire reaches: the longest has 0.8 from at most 0.4 beside it."""


@dataclass(frozen=True)
class FreeEnd:
    """The look of a free end.

    Parameters
    ----------
    style : {"flat", "round", "frayed", "tapered"}
    wires : tuple of (float, float, float)
        Of a frayed end: where across the cable each begins, in half widths, the angle to the cable's direction in
        radians, and the length in widths.
    """

    style: EndStyle
    wires: tuple[tuple[float, float, float], ...] = ()

    @classmethod
    def draw(cls, rng: np.random.Generator, style: EndStyle | None = None) -> FreeEnd:
        """Draw an end; of any style where none is given."""
        style = END_STYLES[int(rng.integers(len(END_STYLES)))] if style is None else style
        if style != "frayed":
            return cls(style)
        count = int(rng.integers(*_WIRES))
        starts = np.linspace(-0.8, 0.8, count)
        angles = 0.4 * starts + rng.uniform(-0.2, 0.2, count)
        lengths = rng.uniform(0.2, 0.8, count)
        return cls(style, tuple(zip(starts.tolist(), angles.tolist(), lengths.tolist(), strict=True)))


ROUND = FreeEnd("round")


def draw_cable_mask(
    points: FloatArray, widths_px: FloatArray, size: tuple[int, int], ends: tuple[FreeEnd, FreeEnd] = (ROUND, ROUND)
) -> Mask:
    """Draw the pixels whose centre lies within half a width of a centre line; nothing is anti-aliased.

    Parameters
    ----------
    points : numpy.ndarray, shape (n, 2)
        ``(x, y)`` px, at most 1 px apart; they may leave the image.
    widths_px : numpy.ndarray, shape (n,)
        Width of the cable at each.
    size : (int, int)
        ``(H, W)``.
    ends : (FreeEnd, FreeEnd)
        At the first and the last point, which are the tips of all but round ends.

    Returns
    -------
    numpy.ndarray, shape (H, W), bool
    """
    arc = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))))
    first, last = (
        0.0 if end.style == "round" else _SHAPED * float(width)
        for end, width in zip(ends, widths_px[[0, -1]], strict=True)
    )
    body = (arc >= first) & (arc <= arc[-1] - last)
    if not body.any():  # what is shorter than both of its ends together is drawn round
        ends, body = (ROUND, ROUND), np.ones_like(body)
    mask = np.zeros(size, np.bool_)
    stamp_discs(points[body], widths_px[body] / 2.0, mask)
    for end, order in zip(ends, (slice(None), slice(None, None, -1)), strict=True):
        if end.style != "round":
            along = arc if order.step is None else arc[-1] - arc
            shaped = along[order] <= _SHAPED * widths_px[order][0] + 1.0
            _draw_end(mask, end, points[order][shaped], along[order][shaped], widths_px[order][shaped] / 2.0)
    return mask


def _draw_end(mask: Mask, end: FreeEnd, points: FloatArray, arc: FloatArray, radii: FloatArray) -> None:
    """Draw the last piece of a cable, given from its tip on: points (n, 2), arc lengths from the tip and radii (n,)."""
    tip, width = points[0], 2.0 * float(radii[0])
    inwards = _unit(points[min(len(points) - 1, max(1, round(0.5 * len(points))))] - tip)
    wires_px = _WIRES_REACH * width if end.wires else 0.0
    pixels = _pixels_around(points, float(radii.max()) + _TIP_PX + wires_px, mask.shape)
    _, nearest = cKDTree(points).query(pixels)
    squared = ((pixels - points[nearest]) ** 2).sum(axis=1)
    half = radii[nearest]
    if end.style == "tapered":
        share = _TAPERED_TO + (1.0 - _TAPERED_TO) * np.minimum(arc[nearest] / (_SHAPED * width), 1.0)
        half = np.maximum(half * share, _TIP_PX)
    inside = squared <= half**2
    # The cut: what lies beyond the tip is nearest to the tip itself.
    inside &= (nearest > 0) | ((pixels - tip) @ inwards >= -_TIP_PX)
    for start, angle, length in end.wires:
        inside |= _in_wire(pixels, tip, -inwards, width, (start, angle, length))
    mask[pixels[inside, 1].astype(np.intp), pixels[inside, 0].astype(np.intp)] = True


def _pixels_around(points: FloatArray, reach: float, size: tuple[int, ...]) -> FloatArray:
    """Return ``(x, y)`` of pixels (m, 2): those of an image ``(H, W)`` in the box of points (n, 2) with a margin."""
    low = np.maximum(np.floor(points.min(axis=0) - reach), 0.0).astype(np.intp)
    high = np.minimum(np.ceil(points.max(axis=0) + reach), np.array(size[::-1]) - 1.0).astype(np.intp)
    columns, rows = (np.arange(start, stop + 1, dtype=np.float64) for start, stop in zip(low, high, strict=True))
    return np.stack((np.tile(columns, len(rows)), np.repeat(rows, len(columns))), axis=1)


def _in_wire(
    pixels: FloatArray, tip: FloatArray, outwards: FloatArray, width: float, wire: tuple[float, float, float]
) -> Mask:
    """Return which pixels (n, 2) a wire covers."""
    start, angle, length = wire
    side = np.array([-outwards[1], outwards[0]])
    direction = math.cos(angle) * outwards + math.sin(angle) * side
    off = pixels - (tip + 0.5 * start * width * side)
    along = np.clip(off @ direction, 0.0, length * width)
    distance = np.linalg.norm(off - along[:, None] * direction, axis=1)
    return distance <= max(_MIN_WIRE_PX, _WIRE * width) / 2.0


def _unit(vector: FloatArray) -> FloatArray:
    return vector / np.linalg.norm(vector)
