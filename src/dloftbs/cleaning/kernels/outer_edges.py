"""Distances around a hole in a mask: across it, to the ground beyond its sides, and in the mask at its ends.

Masks are framed bitmasks, see `dloftbs.kernels.bitmask`; column 0 is the first one of the second word. Each hole is
measured in a window of its own. What lies beyond the window, or beyond the image's border, is not ground.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import boolean, int64, uint64
from numba.types import UniTuple

from dloftbs.cleaning.kernels.ground_widths import look_across
from dloftbs.kernels.compiler import helper, inlined, kernel, read

_Words = npt.NDArray[np.uint64]
_Ints = npt.NDArray[np.int64]
_Bools = npt.NDArray[np.bool_]
_Floats = npt.NDArray[np.float64]
_Codes = npt.NDArray[np.uint8]
_Pixels = npt.NDArray[np.int16]
_Sides = tuple[bool, bool, bool, bool]

_GROUND, _MASK, _HOLE, _OTHER = 0, 1, 2, 3  # a pixel's kind: _OTHER is in another hole that may be filled
_DIAGONAL = 1.415
"""Diagonal of a square over its side, rounded up."""

_FAR = 1 << 14
"""Distance that is longer than any window, px."""

_SHARE = 0.9
"""Share of the pixels in and beside a hole that lie less deep than its outer edges: a crossing may be at its ends."""

_STEPS = 4
"""Steps in a pixel by which that is measured."""


@inlined
def _edge_distance(squared: int) -> float:
    """Return how far a pixel is from an edge, px, whose next pixel beyond is so far away, px^2."""
    return max(np.sqrt(np.float64(squared)) - 0.5, 0.0)


@helper
def _draw(
    bitmask: _Words,
    window: tuple[int, int, int, int],
    first: _Ints,
    start: _Ints,
    end: _Ints,
    part: _Ints,
    chosen: _Bools,
    k: int,
    codes: _Codes,
) -> None:
    """Write the kind of each pixel in a window: its first row and column, and the ones after its last."""
    top, bottom, left, right = window
    for r in range(top, bottom):
        for c in range(left, right):
            is_set = (bitmask[(c >> 6) + 1, r] >> np.uint64(c & 63)) & np.uint64(1) != 0
            codes[r - top, c - left] = _MASK if is_set else _GROUND
        for i in range(first[r], first[r + 1]):
            if chosen[part[i]]:
                for c in range(max(start[i], left), min(end[i], right)):
                    codes[r - top, c - left] = _HOLE if part[i] == k else _OTHER


@helper
def _look_up_and_down(
    codes: _Codes, height: int, width: int, least: int, most: int, away: _Pixels, is_hole: _Bools
) -> None:
    """Write how far the nearest pixel outside of some kinds is in each column, px, and whether it is in the hole."""
    for c in range(width):
        for r in range(height):
            if least <= codes[r, c] <= most:
                away[r, c] = min(away[r - 1, c] + 1, _FAR) if r > 0 else _FAR
                is_hole[r, c] = is_hole[r - 1, c] if r > 0 else False
            else:
                away[r, c], is_hole[r, c] = 0, codes[r, c] == _HOLE
        for r in range(height - 2, -1, -1):
            below = away[r + 1, c] + 1
            if below < away[r, c]:
                away[r, c], is_hole[r, c] = below, is_hole[r + 1, c]
            elif below == away[r, c]:
                is_hole[r, c] |= is_hole[r + 1, c]


@inlined
def _nearest(away: _Pixels, is_hole: _Bools, width: int, r: int, c: int, most: int) -> tuple[int, bool]:
    """Return how far the nearest such pixel is, px^2, up to `most` px, and whether one of them is in the hole."""
    best, in_hole, across = np.int64(most) ** 2, False, 0
    while across * across <= best and across <= most:
        for column in (c - across, c + across):
            if 0 <= column < width:
                squared = np.int64(away[r, column]) ** 2 + across * across
                if squared < best:
                    best, in_hole = squared, is_hole[r, column]
                elif squared == best:
                    in_hole |= is_hole[r, column]
        across += 1
    return best, in_hole


@helper
def _make_room(height: int, width: int) -> tuple[_Codes, _Pixels, _Pixels, _Bools, _Bools]:
    """Return arrays for a window."""
    shape = (height, width)
    pixels, more = np.empty(shape, dtype=np.int16), np.empty(shape, dtype=np.int16)
    flags, others = np.empty(shape, dtype=np.bool_), np.empty(shape, dtype=np.bool_)
    return np.empty(shape, dtype=np.uint8), pixels, more, flags, others


@helper
def _look_where_widest(
    bitmask: _Words, rows: int, columns: int, box: _Ints, codes: _Codes, away: _Pixels, is_hole: _Bools
) -> tuple[int, int]:
    """Return how far a pixel of the hole is at most from what is none, px^2, and the outer width there, px.

    The width is 0 where the hole is wider than the mask beside it.
    """
    height, width = box[1] - box[0], box[3] - box[2]
    widest, across, beside, outer = 0, 0, 0, 0
    _look_up_and_down(codes, height, width, _HOLE, _HOLE, away, is_hole)
    for r in range(height):
        for c in range(width):
            if codes[r, c] != _HOLE:
                continue
            far = min(np.int64(away[r, c]), r + 1, height - r, c + 1, width - c)  # beyond the box there is none
            if far * far < widest:
                continue
            squared, _ = _nearest(away, is_hole, width, r, c, far)
            if squared > widest:
                widest, across, beside, outer = squared, 0, 0, 0
            if squared == widest:
                ground, mask = look_across(bitmask, rows, columns, r + box[0], c + box[2])
                across += ground
                beside += mask
                outer = max(outer, ground + mask)
    return widest, outer if across <= beside else 0


@helper
def _holds_square(bitmask: _Words, top: int, bottom: int, left: int, right: int, side: int) -> bool:
    """Return whether a square of the mask lies in a window: most holes are soon seen to have no such mask beside."""
    low, high = (left >> 6) + 1, ((right - 1) >> 6) + 1
    words = bitmask[low : high + 1, top:bottom].copy()
    count, length = words.shape
    if side > length or side > right - left:
        return False
    reached = 1
    while reached < side:
        step = min(reached, side - reached)
        for k in range(count):
            for r in range(length):
                words[k, r] &= words[k, r + step] if r + step < length else np.uint64(0)
        reached += step
    reached = 1
    while reached < side:
        step = min(reached, side - reached)
        jump, shift = step >> 6, np.uint64(step & 63)
        for k in range(count):
            for r in range(length):
                moved = words[k + jump, r] >> shift if k + jump < count else np.uint64(0)
                if shift > 0 and k + jump + 1 < count:
                    moved |= words[k + jump + 1, r] << (np.uint64(64) - shift)
                words[k, r] &= moved
        reached += step
    for k in range(count):
        for r in range(length):
            if words[k, r] != 0:
                return True
    return False


@inlined
def _from_border(r: int, c: int, rows: int, columns: int, beyond: _Sides) -> int:
    """Return how far a pixel is from where the image ends, px."""
    top, bottom, left, right = beyond
    least = _FAR
    if top:
        least = min(least, r)
    if bottom:
        least = min(least, rows - 1 - r)
    if left:
        least = min(least, c)
    if right:
        least = min(least, columns - 1 - c)
    return least


@kernel(
    read(uint64, 2, "C"),
    int64,
    int64,
    read(int64, 1, "C"),
    read(int64, 1, "C"),
    read(int64, 1, "C"),
    read(int64, 1, "C"),
    read(boolean, 1, "C"),
    read(int64, 2, "C"),
    UniTuple(boolean, 4),
)
def measure_edges(
    bitmask: _Words,
    rows: int,
    columns: int,
    first: _Ints,
    start: _Ints,
    end: _Ints,
    part: _Ints,
    chosen: _Bools,
    boxes: _Ints,
    beyond: _Sides,
) -> tuple[_Floats, _Floats, _Floats]:
    """Measure some holes, the outer edges along them, and the mask that goes on beyond their ends.

    Parameters
    ----------
    bitmask : (n, R) uint64
    rows, columns : int
        Size of the mask, its margin included.
    first, start, end, part
        The runs of ground.
    chosen : (parts,) bool
    boxes : (parts, 4) int64
        First row, the one after the last, first column and the one after the last of each part.
    beyond : (bool, bool, bool, bool)
        Whether the image ends at the top, bottom, left and right of the mask.

    Returns
    -------
    across : (parts,) float64
        Diameter of the largest circle in each hole, px; 0 for parts that are not chosen, and where the mask beside a
        hole is too thin for anything.
    outer : (parts,) float64
        Distance to the ground from the middle between the outer edges, px, where all chosen holes are filled: of the
        pixels in a hole, and in the mask no farther beside it than the hole is wide.
    solid : (parts,) float64
        Radius of the largest circle in the mask that touches a hole, px.
    """
    parts = len(chosen)
    across, outer, solid = np.zeros(parts), np.zeros(parts), np.zeros(parts)
    codes = np.empty((1, 1), dtype=np.uint8)
    away, depth = np.empty((1, 1), dtype=np.int16), np.empty((1, 1), dtype=np.int16)
    near, unused = np.empty((1, 1), dtype=np.bool_), np.empty((1, 1), dtype=np.bool_)
    for k in range(parts):
        if not chosen[k]:
            continue
        box = boxes[k]
        if box[1] - box[0] > codes.shape[0] or box[3] - box[2] > codes.shape[1]:
            codes, away, depth, near, unused = _make_room(box[1] - box[0], box[3] - box[2])
        _draw(bitmask, (box[0], box[1], box[2], box[3]), first, start, end, part, chosen, k, codes)
        widest, broad = _look_where_widest(bitmask, rows, columns, box, codes, away, unused)
        if broad == 0:
            continue
        most, thickest = broad // 2 + 2, 0
        least = max(min(max(box[1] - box[0], box[3] - box[2]), np.int64(2.0 * _edge_distance(widest))), 1)
        top, bottom = max(box[0] - 2 * most, beyond[0]), min(box[1] + 2 * most, rows - beyond[1])
        left, right = max(box[2] - 2 * most, beyond[2]), min(box[3] + 2 * most, columns - beyond[3])
        if not _holds_square(bitmask, top, bottom, left, right, 2 * np.int64((least - 1) / _DIAGONAL) + 1):
            continue
        height, width = bottom - top, right - left
        if height > codes.shape[0] or width > codes.shape[1]:
            codes, away, depth, near, unused = _make_room(height, width)
        _draw(bitmask, (top, bottom, left, right), first, start, end, part, chosen, k, codes)
        rows_of_box, columns_of_box = (box[0] - top, box[1] - top), (box[2] - left, box[3] - left)
        _look_up_and_down(codes, height, width, _MASK, _MASK, away, near)
        for r in range(max(rows_of_box[0] - most, 0), min(rows_of_box[1] + most, height)):
            for c in range(max(columns_of_box[0] - most, 0), min(columns_of_box[1] + most, width)):
                if codes[r, c] == _MASK and away[r, c] >= least and np.int64(away[r, c]) ** 2 > thickest:
                    squared, in_hole = _nearest(away, near, width, r, c, most)
                    if in_hole:
                        thickest = max(thickest, squared)
        if thickest < least * least:
            continue
        _look_up_and_down(codes, height, width, _MASK, _OTHER, depth, unused)
        beside = np.int64(2.0 * np.sqrt(widest)) + 1
        counts = np.zeros(_STEPS * most + 1, dtype=np.int64)
        for r in range(max(rows_of_box[0] - beside, 0), min(rows_of_box[1] + beside, height)):
            for c in range(max(columns_of_box[0] - beside, 0), min(columns_of_box[1] + beside, width)):
                if codes[r, c] == _MASK:
                    squared, in_hole = _nearest(away, near, width, r, c, beside)
                    if not in_hole or squared > 4 * widest:
                        continue
                elif codes[r, c] != _HOLE:
                    continue
                squared, _ = _nearest(depth, unused, width, r, c, most)
                if squared <= _from_border(r + top, c + left, rows, columns, beyond) ** 2:
                    counts[np.int64(_STEPS * _edge_distance(squared))] += 1
        across[k], solid[k] = 2.0 * _edge_distance(widest), _edge_distance(thickest)
        more = np.int64((1.0 - _SHARE) * counts.sum())
        place = _STEPS * most
        while place > 0 and counts[place] <= more:
            more -= counts[place]
            place -= 1
        outer[k] = place / _STEPS
    return across, outer, solid
