"""Holes in a mask that lie within one cable, as a highlight on a glossy one, told from ground."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

_DEEPEST_WIDTHS = 0.85
"""Distance to the ground of a hole's deepest pixel, in widths, up to which the hole lies within a cable.

Within one cable it is at most a half, at a crossing of two at most 0.71 (half of the diagonal of a square); between two
cables, or in a loop of one, it is more than 1. This is the middle.
"""

_COARSE_PX = 2
"""Step between the pixels that are looked at first, to save time; the opening leaves nothing narrower."""

_WIDEST = 2.0
"""Width of a hole over the mask's mean width: a hole of half a cable's width leaves a quarter on either side."""

_SINGLE_SHARE = 0.15
"""Share of the cables' length that is narrower than what counts as the width of one, for the ends."""

_MOST_OUTLINES = 500
"""More outlines than this are noise, of which nothing is filled: it bounds the cost."""

_SAMPLING_ERROR = 0.5
"""By how much the distance between two edges is too long at most where pixels are left out, in their step."""

_Pixels = npt.NDArray[np.uint8]
_Outline = npt.NDArray[np.int32]


@dataclass(frozen=True)
class _Narrow:
    """Holes that are narrow enough to lie within a cable: their outlines, which run through the foreground around."""

    outlines: list[_Outline]
    width: float  # of the cables without these holes, px: twice the area over the length of the outline


def fill_holes(pixels: _Pixels, flip_x: bool = False, flip_y: bool = False) -> _Pixels | None:
    """Fill the holes of a mask that are narrower than its cables and lie within one of them.

    Parameters
    ----------
    pixels : numpy.ndarray, shape (H, W), uint8
        0 and 1, with an empty margin. Never changed.
    flip_x, flip_y : bool
        Whether the pixels that are looked at first are counted from the last column and the last row.

    Returns
    -------
    numpy.ndarray or None
        None where there is nothing to fill.
    """
    height, width = pixels.shape
    top, left = (height - 1) % _COARSE_PX if flip_y else 0, (width - 1) % _COARSE_PX if flip_x else 0
    coarse = np.ascontiguousarray(pixels[top::_COARSE_PX, left::_COARSE_PX])
    likely = _find_within(coarse, math.inf, _SAMPLING_ERROR)
    if not likely:  # most holes are ground, and this is soon seen
        return None
    single = _single_width(_filled(coarse, likely))
    if not _find_within(coarse, single, _SAMPLING_ERROR):
        return None
    within = _find_within(pixels, _COARSE_PX * single)
    return _filled(pixels, within) if within else None


def _find_within(pixels: _Pixels, single_width: float, error: float = 0.0) -> list[_Outline]:
    """Return the outlines of the holes that lie within a cable, with what distances may be too long by, px."""
    narrow = _find_narrow(pixels)
    if narrow is None:
        return []
    without = _filled(pixels, narrow.outlines)
    deepest = _DEEPEST_WIDTHS * min(narrow.width, single_width) + error
    return [outline for outline in narrow.outlines if _depth(pixels, without, outline, narrow.width) <= deepest]


def _single_width(pixels: _Pixels) -> float:
    """Return how wide one cable is where most lie in bundles, px, from the ridge of the distance to the ground."""
    away = _distances(pixels)
    ridge = away[(away > 0.0) & (away >= cv2.dilate(away, np.ones((3, 3), np.uint8)))]
    return 2.0 * float(np.quantile(ridge, _SINGLE_SHARE))


def _distances(pixels: _Pixels) -> npt.NDArray[np.float32]:
    """Return how far each pixel of the foreground is from the ground's edge, px."""
    away = cv2.distanceTransform(np.ascontiguousarray(pixels), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    # OpenCV rounds by rows first: a mask and its mirror image differ in the last bit; squares are whole numbers.
    return np.maximum(np.sqrt(np.rint(away * away)) - np.float32(0.5), np.float32(0.0))


def _find_narrow(pixels: _Pixels) -> _Narrow | None:
    """Return the holes that are narrow enough to lie within a cable; None where there are none."""
    outlines, hierarchy = cv2.findContours(np.ascontiguousarray(pixels), cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    if hierarchy is None or len(outlines) > _MOST_OUTLINES:
        return None
    inner = np.flatnonzero(hierarchy[0, :, 3] >= 0).tolist()
    if not inner:
        return None
    length = sum(len(outline) for outline in outlines)
    area = float(cv2.countNonZero(np.ascontiguousarray(pixels)))
    sizes = {k: _pixels_inside(outlines[k]) for k in inner}
    narrow = [k for k in inner if sizes[k] * length < _WIDEST * area * len(outlines[k])]
    if not narrow:
        return None
    length -= sum(len(outlines[k]) for k in narrow)
    return _Narrow([outlines[k] for k in narrow], 2.0 * (area + sum(sizes[k] for k in narrow)) / length)


def _pixels_inside(outline: _Outline) -> float:
    """Count the pixels that an outline encloses, by Pick's theorem."""
    return float(cv2.contourArea(outline)) - 0.5 * len(outline) + 1.0


def _filled(pixels: _Pixels, outlines: list[_Outline]) -> _Pixels:
    """Return a mask in which these holes are filled."""
    filled = np.ascontiguousarray(pixels).copy()
    for outline in outlines:
        cv2.drawContours(filled, [outline], -1, 1, cv2.FILLED)
    return filled


def _depth(pixels: _Pixels, without: _Pixels, outline: _Outline, width: float) -> float:
    """Return how far a hole's deepest pixel is from the ground around the cable, px, looked for within a width."""
    x, y, w, h = cv2.boundingRect(outline)
    reach = math.ceil(width) + 1
    top, left = max(y - reach, 0), max(x - reach, 0)
    around = slice(top, y + h + reach), slice(left, x + w + reach)
    away = _distances(without[around])
    hole = np.zeros_like(away, dtype=np.uint8)
    cv2.drawContours(hole, [outline], -1, 1, cv2.FILLED, offset=(-left, -top))
    return float(away[(hole != 0) & (pixels[around] == 0)].max())
