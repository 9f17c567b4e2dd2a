"""Faults that cameras, codecs, gloss and thresholds leave in the mask of a cable, drawn along and across it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from dloftbs.data.curve import BSplineCurve
from dloftbs.support.arrays import BoolArray, ByteArray, FloatArray
from dloftbs_lab.synthetic.edge_case_drawings import Drawn
from dloftbs_lab.synthetic.generated import visible_tubes
from dloftbs_lab.synthetic.strand import Strand, integrate
from dloftbs_lab.synthetic.tube import Footprint, footprint
from dloftbs_lab.synthetic.video_coding import coded, thresholded

Mask = BoolArray
Image = ByteArray
Size = tuple[int, int]
Range = tuple[float, float]

_DYES = np.array([(20.0, 190.0, 235.0), (40.0, 40.0, 210.0), (60.0, 200.0, 70.0), (215.0, 90.0, 40.0)])
_GROUNDS = np.array([(60.0, 56.0, 50.0), (74.0, 70.0, 76.0), (48.0, 60.0, 56.0)])
"""Colours of cables and grounds, BGR: yellow, red, green and blue plastic on dark cloth."""
_MIN_SATURATION, _MIN_VALUE = 90, 110
"""Of a tolerant colour range that still shows these cables from these grounds."""
_GRAIN = 1.0  # grey levels
_RIM_PX = (1.2, 2.5)  # from the edge to the middle of the dark line beside it, as a lens' halo or a shadow leaves it
_RIM_STRENGTH = (0.3, 1.5)
_RIM_CHANGES_PX = 60.0
_RIM_HALF_PX = (0.6, 1.3)
_CODEC_STEPS = (8, 25)
_BRIDGE_PX = (1.0, 4.0)
_PINHOLE_PX = (3.0, 14.0)  # length of a hole between two bridges
_PINHOLE_CELL_PX, _PIERCED = 6, 0.9
"""Grid of the pin-holes, and the share of its cells that have one."""
_SLIT_PX = 1.2
"""Least width of a highlight: a narrower one is closed by the smallest opening and tests nothing."""


@dataclass(frozen=True, eq=False)
class Cable:
    """A cable of a scene: its course, its width px, and whether it is a loop without ends."""

    strand: Strand
    width_px: float
    ring: bool = False

    def curve(self) -> BSplineCurve:
        """Return the centre line."""
        return Drawn(self.strand.points, ring=True).curve() if self.ring else self.strand.curve()

    def cover(self, size: Size) -> Footprint:
        """Return the pixels within 2 px of the cable, with their places along and across it."""
        return footprint(self.strand, self.width_px / 2.0 + 2.0, size)


def visible_masks(cables: Sequence[Cable], size: Size) -> tuple[Mask, ...]:
    """Return the visible part of each cable as perfect masks, shapes (H, W); a later one lies over an earlier one."""
    return visible_tubes([cable.strand for cable in cables], [cable.width_px for cable in cables], size)


def along_noise(rng: np.random.Generator, length_px: float, correlation_px: float) -> FloatArray:
    """Return smooth noise in -1..1 for each px of a cable, shape (n,), that varies over some px."""
    places = np.arange(math.ceil(length_px) + 1, dtype=np.float64)
    knots = np.arange(-1.0, length_px / correlation_px + 2.0)
    return np.interp(places / correlation_px, knots, rng.uniform(-1.0, 1.0, len(knots)))


def at_arc(values: FloatArray, arc: FloatArray) -> FloatArray:
    """Return what `values` (n,), one for each px, are at arc lengths (m,)."""
    return values[np.clip(arc.round(), 0, len(values) - 1).astype(np.intp)]


def filmed(rng: np.random.Generator, look: np.random.Generator, cables: Sequence[Cable], size: Size) -> Mask:
    """Return the mask (H, W) of coloured cables in a coded video by a tolerant colour range.

    Parameters
    ----------
    rng : numpy.random.Generator
        Of the frame: grain, and where the rim beside the edges is dark.
    look : numpy.random.Generator
        Of the sequence: colours and the codec's quality.
    cables : sequence of Cable
    size : (int, int)
        ``(H, W)`` px.
    """
    dye, ground = _DYES[look.integers(len(_DYES))], _GROUNDS[look.integers(len(_GROUNDS))]
    step, rim_px, half_px = int(look.integers(*_CODEC_STEPS)), look.uniform(*_RIM_PX), look.uniform(*_RIM_HALF_PX)
    picture = np.broadcast_to(ground, (size[0] * size[1], 3)).copy()
    for cable in cables:
        cover = cable.cover(size)
        inside = cable.width_px / 2.0 - np.abs(cover.offset)
        alpha = np.clip(inside + 0.5, 0.0, 1.0)[:, None]
        picture[cover.pixel] += alpha * (dye - picture[cover.pixel])
        change = along_noise(rng, cable.strand.length, _RIM_CHANGES_PX)
        strength = np.interp(change, (-1.0, 1.0), _RIM_STRENGTH).clip(max=1.0)
        dark = at_arc(strength, cover.arc) * np.clip(0.5 + half_px - np.abs(inside - rim_px), 0.0, 1.0)
        picture[cover.pixel] += dark[:, None] * (ground - picture[cover.pixel])
    picture += rng.normal(0.0, _GRAIN, picture.shape)
    whole = picture.reshape(*size, 3).clip(0.0, 255.0).round().astype(np.uint8)
    return thresholded(coded(whole, step), _MIN_SATURATION, _MIN_VALUE)


@dataclass(frozen=True, eq=False)
class Highlight:
    """A bright line along a cable that is missing in the mask.

    Parameters
    ----------
    span : (float, float)
        Where it begins and ends, px along the cable.
    offset : (float, float)
        Distance from the centre line at its begin and end, as a share of the width.
    half_width : float
        As a share of the width.
    bridged : bool
        Whether mask goes across every few pixels, so that a row of holes is left.
    """

    span: Range
    offset: Range
    half_width: float
    bridged: bool = False

    def cut(self, mask: Mask, cable: Cable, rng: np.random.Generator) -> None:
        """Take the highlight out of a mask (H, W); its border is ragged by half a pixel."""
        cover = cable.cover((mask.shape[0], mask.shape[1]))
        middle = cable.width_px * np.interp(cover.arc, self.span, self.offset)
        half = max(cable.width_px * self.half_width, _SLIT_PX / 2.0)
        rough = 0.5 * at_arc(along_noise(rng, cable.strand.length, 2.0), cover.arc)
        gone = (
            (np.abs(cover.offset - middle) <= half + rough) & (cover.arc >= self.span[0]) & (cover.arc <= self.span[1])
        )
        if self.bridged:
            gone &= at_arc(dash_pattern(rng, cable.strand.length, _PINHOLE_PX, _BRIDGE_PX), cover.arc) > 0.0
        mask.reshape(-1)[cover.pixel[gone]] = False


def dash_pattern(rng: np.random.Generator, length_px: float, dashes_px: Range, gaps_px: Range) -> FloatArray:
    """Return 1 in dashes and 0 in the gaps between them, for each px of a length, shape (n,)."""
    pattern = np.zeros(math.ceil(length_px) + 1)
    place = -float(rng.uniform(0.0, dashes_px[1]))
    while place < len(pattern):
        end = place + float(rng.uniform(*dashes_px))
        pattern[max(round(place), 0) : max(round(end), 0)] = 1.0
        place = end + float(rng.uniform(*gaps_px))
    return pattern


def ragged(rng: np.random.Generator, cable: Cable, share: float, correlation_px: float, size: Size) -> Mask:
    """Return a cable's mask (H, W) whose edges lie up to a share of the width further in."""
    cover = cable.cover(size)
    half = np.full(len(cover.pixel), cable.width_px / 2.0)
    for right in (False, True):
        side = (cover.offset > 0.0) == right
        noise = along_noise(rng, cable.strand.length, correlation_px)
        half[side] -= share * cable.width_px * (0.5 + 0.5 * at_arc(noise, cover.arc[side]))
    mask = np.zeros(size[0] * size[1], np.bool_)
    mask[cover.pixel[np.abs(cover.offset) <= half]] = True
    return mask.reshape(size)


def dashed(rng: np.random.Generator, cable: Cable, dashes_px: Range, gaps_px: Range, size: Size) -> Mask:
    """Return a thin line's mask (H, W), broken into dashes."""
    cover = cable.cover(size)
    pattern = at_arc(dash_pattern(rng, cable.strand.length, dashes_px, gaps_px), cover.arc) > 0.0
    kept = pattern & (np.abs(cover.offset) <= cable.width_px / 2.0)
    mask = np.zeros(size[0] * size[1], np.bool_)
    mask[cover.pixel[kept]] = True
    return mask.reshape(size)


def sprinkle(mask: Mask, rng: np.random.Generator, count: int, sides_px: tuple[int, int], value: bool) -> None:
    """Draw small upright boxes anywhere into a mask (H, W): salt, or of ground pin-holes."""
    height, width = mask.shape
    sides = rng.integers(sides_px[0], sides_px[1] + 1, (count, 2))
    places = rng.integers(0, (width, height), (count, 2))
    for (x, y), (across, down) in zip(places.tolist(), sides.tolist(), strict=True):
        mask[y : y + down, x : x + across] = value


def pierce(mask: Mask, cable: Cable, rng: np.random.Generator) -> None:
    """Take pin-holes of 3 px out of a cable, hundreds in HD; each stays by itself, and the edges stay whole."""
    cover = cable.cover((mask.shape[0], mask.shape[1]))
    deep = cover.pixel[np.abs(cover.offset) <= cable.width_px / 2.0 - _PINHOLE_CELL_PX]
    rows, columns = np.divmod(deep, mask.shape[1])
    # A hole for each cell of a grid: no closing of 3 px fills it, and no opening of 3 px takes the bridges away.
    centres = (rows % _PINHOLE_CELL_PX == 1) & (columns % _PINHOLE_CELL_PX == 1) & (rng.random(len(deep)) < _PIERCED)
    for y, x in zip(rows[centres].tolist(), columns[centres].tolist(), strict=True):
        mask[y - 1 : y + 2, x - 1 : x + 2] = False


def speck(mask: Mask, centre: FloatArray, length_px: float, width_px: float, angle: float) -> None:
    """Draw a straight or gently bent speck of some length around a place (2,) px into a mask (H, W)."""
    steps = max(3, math.ceil(2.0 * length_px))
    strand = integrate(angle + np.linspace(-0.3, 0.3, steps), max(length_px - width_px, 0.5))
    moved = strand.moved(centre - strand.points.mean(axis=0))
    cover = footprint(moved, width_px / 2.0, (mask.shape[0], mask.shape[1]))
    mask.reshape(-1)[cover.pixel] = True


def lump(mask: Mask) -> Mask:
    """Return a mask (H, W) without holes, as a threshold leaves a body that lies on itself."""
    outlines, _ = cv2.findContours(mask.view(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    filled = np.zeros(mask.shape, np.uint8)
    cv2.drawContours(filled, outlines, -1, 1, -1)
    return filled.astype(np.bool_)
