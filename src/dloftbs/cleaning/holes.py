"""Ground in a mask that lies within one cable, as a highlight on a glossy one: holes, and slits that open to a side."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from dloftbs.cleaning.kernels.narrow_ground import (
    DEEPEST_HOLE_WIDTHS,
    DEEPEST_SLIT_WIDTHS,
    MIN_SLIT_WIDTHS,
    close_round,
)
from dloftbs.cleaning.kernels.single_width import SINGLE_SHARE
from dloftbs.kernels.shared.bitmask_layout import WORD_BITS

_Pixels = npt.NDArray[np.uint8]
_Distances = npt.NDArray[np.float32]
_Sides = tuple[bool, bool, bool, bool]

_WIDEST_DEPTHS = 1.0
"""Largest width of a highlight, in distances of its deepest pixel to the ground: half a cable's width.

Source: geometry; beside a highlight of half its width in the middle, a cable has a quarter on either side.
"""

_WIDEST = 2.0
"""Width of a hole over the mean width of the mask.

Source: geometry; a hole of half a cable's width leaves a quarter on either side.
"""

_MAX_PIECES = 500
"""More pieces than this with narrow ground are noise, of which nothing is filled.

Source: bounds the time, by hand; a small piece takes some 0.2 ms.
"""

_MAX_SIDE = (1 << 16) - 1
"""Longest side of a box in which holes are filled, px.

Source: OpenCV fills areas by coordinates of 16 bits.
"""

_MAX_PARTS = 2000
"""More parts of narrow ground than this in a piece are noise, of which nothing is filled.

Source: bounds the time, by hand; a part takes some 0.05 ms, and a phone's photograph with pin-holes has 900.
"""

_AROUND = np.ones((3, 3), np.uint8)
_SEEN = 2
_EDGE_PX = 0.5  # from the middle of a pixel to its edge


def fill_holes(pixels: _Pixels, places: npt.NDArray[np.int64], beyond: _Sides) -> _Pixels | None:
    """Fill the ground that lies within one cable: holes, and long slits that open to a side or at the image's border.

    Each piece of the mask is judged by itself: its narrow ground is filled, and what of it lies no deeper than in the
    middle of one cable stays filled. The width of one cable comes from the narrow part of the piece's ridge, since in a
    bundle most of it is as wide as several.

    Parameters
    ----------
    pixels : numpy.ndarray, shape (h + 2, w + 2)
        A mask of 0 and 1 with an empty margin. Not changed.
    places : numpy.ndarray, shape (n, 3)
        Row and column of pixels in the pieces that are looked at, and whether a slit is to be looked for.
    beyond : (bool, bool, bool, bool)
        Whether the image ends at the top, bottom, left and right of the box.

    Returns
    -------
    numpy.ndarray, shape (h + 2, w + 2), or None
        None where nothing is filled.
    """
    height, width = pixels.shape
    if max(height, width) > _MAX_SIDE:
        return None
    unseen, filled, pieces = pixels.copy(), pixels.copy(), 0
    while len(places):
        pieces += 1
        if pieces > _MAX_PIECES:
            return None
        row, column, has_slit = places[places[:, 2].argmax()].tolist()  # those with slits first
        _, _, _, (x, y, w, h) = cv2.floodFill(unseen, None, (column, row), _SEEN, flags=8)
        box = np.s_[y - 1 : y + h + 1, x - 1 : x + w + 1]
        at = (y == 1 and beyond[0], y + h == height - 1 and beyond[1])
        sides = (*at, x == 1 and beyond[2], x + w == width - 1 and beyond[3])
        filled[box] |= _find_highlights((unseen[box] == _SEEN).astype(np.uint8), sides, bool(has_slit))
        unseen[box][unseen[box] == _SEEN] = 0
        places = places[unseen[places[:, 0], places[:, 1]] != 0]
    return filled if (filled != pixels).any() else None


def _find_highlights(piece: _Pixels, beyond: _Sides, has_slit: bool) -> _Pixels:
    """Return the ground within one cable of a single piece, which has an empty margin."""
    sealed = _seal(piece, beyond)
    holes = _find_narrow_holes(piece, sealed)
    found = np.zeros_like(piece)
    if has_slit:
        slits = _find_slits(sealed | holes, _mean_width(sealed | holes))
        # A bundle may be open over all its length: the width is that of what does not lie beside narrow ground.
        found |= _keep_within(slits, sealed | holes | slits, DEEPEST_SLIT_WIDTHS, apart_from=sealed)
    found |= _keep_within(holes, sealed | holes | found, DEEPEST_HOLE_WIDTHS)
    found[[0, -1]] = found[:, [0, -1]] = 0
    return found


def _keep_within(narrow: _Pixels, solid: _Pixels, deepest: float, apart_from: _Pixels | None = None) -> _Pixels:
    """Return the narrow ground that lies within one cable, by its depth where it is filled, px, in widths."""
    found = np.zeros_like(narrow)
    outlines, _ = cv2.findContours(narrow, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    if not 0 < len(outlines) <= _MAX_PARTS:
        return found
    parts = [_cut_part(outline, narrow) for outline in outlines]
    width = _mean_width(solid)
    depths, away = _measure_depths(parts, solid, deepest * width)
    within = [
        (part, depth)
        for part, depth in zip(parts, depths, strict=True)
        if depth <= deepest * width and part.across() <= _WIDEST_DEPTHS * depth
    ]
    if within:
        away = _distances(solid) if away is None else away
        width = min(width, _single_width(away, None if apart_from is None else _distances(apart_from)))
    for part, depth in within:
        if depth <= deepest * width:
            found[part.box] |= part.pixels
    return found


@dataclass(frozen=True)
class _Part:
    """Narrow ground that hangs together: its box, and its pixels there."""

    box: tuple[slice, slice]
    pixels: _Pixels

    def across(self) -> float:
        """Return the diameter of the largest circle in it, px."""
        around = cv2.copyMakeBorder(self.pixels, 1, 1, 1, 1, cv2.BORDER_CONSTANT, value=0)
        return 2.0 * _inner(_distances(around))


def _cut_part(outline: npt.NDArray[Any], narrow: _Pixels) -> _Part:
    """Return the narrow ground within an outline."""
    x, y, w, h = cv2.boundingRect(outline)
    box = np.s_[y : y + h, x : x + w]
    pixels = np.zeros((h, w), np.uint8)
    cv2.drawContours(pixels, [outline], -1, 1, cv2.FILLED, offset=(-x, -y))
    return _Part(box, pixels & narrow[box])


def _measure_depths(parts: list[_Part], solid: _Pixels, deepest: float) -> tuple[list[float], _Distances | None]:
    """Return how far the deepest pixel of each part is from the ground, px, or something too far; and all distances.

    These are None where windows around the parts are less to look at than all.
    """
    reach = int(deepest) + 2
    windows = [tuple(slice(max(side.start - reach, 0), side.stop + reach) for side in part.box) for part in parts]
    if sum((rows.stop - rows.start) * (columns.stop - columns.start) for rows, columns in windows) > solid.size:
        away = _distances(solid)
        return [_inner(away[part.box][part.pixels != 0]) for part in parts], away
    depths = []
    for part, (rows, columns) in zip(parts, windows, strict=True):
        (h, w), y, x = part.pixels.shape, part.box[0].start - rows.start, part.box[1].start - columns.start
        depths.append(_inner(_distances(solid[rows, columns])[y : y + h, x : x + w][part.pixels != 0]))
    return depths, None


def _seal(piece: _Pixels, beyond: _Sides) -> _Pixels:
    """Return the piece going on beyond the image's border, where slits narrower than both their sides are closed."""
    sealed = piece.copy()
    for margin, line, is_beyond in zip(
        (sealed[0], sealed[-1], sealed[:, 0], sealed[:, -1]),
        (piece[1], piece[-2], piece[:, 1], piece[:, -2]),
        beyond,
        strict=True,
    ):
        if is_beyond:
            margin[:] = line
            runs = np.flatnonzero(np.diff(line)).reshape(-1, 2)
            for (first, gap), (end, last) in pairwise(runs):
                if end - gap <= gap - first + last - end:
                    margin[gap + 1 : end + 1] = 1
    return sealed


def _outline_length(mask: _Pixels) -> int:
    """Return the number of pixels along all outlines of a mask that is not empty."""
    outlines, _ = cv2.findContours(mask, cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
    return sum(map(len, outlines))


def _mean_width(mask: _Pixels) -> float:
    """Return twice the area of a mask over the length of its outlines, px."""
    return 2.0 * int(mask.sum()) / _outline_length(mask)


def _find_narrow_holes(piece: _Pixels, sealed: _Pixels) -> _Pixels:
    """Return the holes of a piece that are narrower than it, by areas over the lengths of outlines."""
    narrow = np.zeros_like(piece)
    share = int(piece.sum()) / _outline_length(piece)
    outlines, hierarchy = cv2.findContours(sealed, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    for outline, above in zip(outlines, hierarchy[0, :, 3], strict=True):
        if above < 0:
            continue
        size = cv2.contourArea(outline) - 0.5 * len(outline) + 1.0  # Pick's theorem: pixels within the outline
        if size < _WIDEST * share * len(outline):
            cv2.drawContours(narrow, [outline], -1, 1, cv2.FILLED)
    return narrow & (1 - sealed)


def _find_slits(sealed: _Pixels, width: float) -> _Pixels:
    """Return the long stretches of ground of a piece that hold no disc of a width, px."""
    slits = _close(sealed, round(0.5 * width)) & (1 - sealed)
    outlines, _ = cv2.findContours(slits, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    long = [outline for outline in outlines if np.hypot(*cv2.boundingRect(outline)[2:]) > MIN_SLIT_WIDTHS * width]
    found = np.zeros_like(sealed)
    cv2.drawContours(found, long, -1, 1, cv2.FILLED)
    return found & slits


def _close(mask: _Pixels, radius: int) -> _Pixels:
    """Close a mask by an octagon; what lies around the array is ground."""
    (h, w), margin = mask.shape, WORD_BITS * (2 + radius // WORD_BITS)
    pixels = np.zeros((h + 2 * margin, -(-w // WORD_BITS) * WORD_BITS + 2 * margin), np.uint8)
    pixels[margin : margin + h, margin : margin + w] = mask
    words = np.packbits(pixels, axis=1, bitorder="little").view(np.uint64)
    closed = np.ascontiguousarray(close_round(np.ascontiguousarray(words.T), radius).T).view(np.uint8)
    return np.unpackbits(closed, axis=1, bitorder="little")[margin : margin + h, margin : margin + w]


def _distances(mask: _Pixels) -> _Distances:
    """Return how far the middle of each pixel of a mask is from that of the nearest one that is none, px."""
    away: _Distances = np.asarray(cv2.distanceTransform(mask, cv2.DIST_L2, cv2.DIST_MASK_PRECISE))
    # OpenCV's last bit depends on where the array lies in memory; squares of distances are whole numbers.
    return np.sqrt(np.rint(np.square(away, out=away), out=away), out=away)


def _inner(away: _Distances) -> float:
    """Return the largest of some distances, px, to the edge of the nearest pixel instead of its middle."""
    return float(away.max()) - _EDGE_PX


def _single_width(away: _Distances, other: _Distances | None) -> float:
    """Return the width of one cable, px, from the ridge of the distances to the ground: most may lie in bundles.

    Only places count whose distance is the same in another mask, where there is one.
    """
    is_ridge = (away > 0.0) & (away >= cv2.dilate(away, _AROUND))
    if other is not None:
        is_ridge &= away == other
    ridge = away[is_ridge]
    if not ridge.size:
        return 0.0
    place = min(int(SINGLE_SHARE * (len(ridge) - 1) + float(ridge.mean())), len(ridge) - 1)
    return 2.0 * (float(np.partition(ridge, place)[place]) - _EDGE_PX)
