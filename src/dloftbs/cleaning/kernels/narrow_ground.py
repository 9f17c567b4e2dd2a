"""Ground in a mask that is so narrow that it may be a highlight on one cable.

Every other pixel shows: most ground within a piece is wide, and this is soon seen.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numba import int64, uint64

from dloftbs.cleaning.kernels.bitmask_growth import DILATE, ERODE, grow_round
from dloftbs.cleaning.kernels.ground_runs import find_ground, label_foreground, thin_out
from dloftbs.cleaning.kernels.single_width import single_widths, squared_distances
from dloftbs.kernels.compiler import Bools, Floats, Ints, Words, helper, inlined, kernel, read
from dloftbs.kernels.shared.bitmask_layout import WORD_BITS

_Counts = npt.NDArray[np.int32]

_STEP_PX = 2
"""Step between the pixels that are looked at; the opening leaves nothing narrower."""

_CROFTON = 0.125 * np.pi
"""Length of an outline over the number of lines that pass it, in four directions, by their distances.

Source: the formula of Cauchy and Crofton; it is right to a twentieth in all directions.
"""

_DIAGONAL = 0.5**0.5
"""Distance between lines through pixels at 45 degrees, px."""

DEEPEST_HOLE_WIDTHS = 0.85
"""Distance to the ground of a hole's deepest pixel, in widths, up to which the hole lies within a cable.

Source: geometry; within one cable it is at most a half, at a crossing of two at most 0.71 (half of the diagonal of a
square); between two cables, or in a loop of one, it is more than 1. This is the middle.
"""

DEEPEST_SLIT_WIDTHS = 0.6
"""The same for a slit.

Source: geometry; that of a cable is at most a half deep, the corner of a crossing 0.71. This is the middle.
"""

MIN_SLIT_WIDTHS = 2.0
"""Least length of a slit, in widths of the cable.

Source: by hand; the sides of a shorter one hardly run along each other.
"""

_MAX_GROUNDS = 5_000
"""More parts of ground than this are noise, in which nothing is found.

Source: bounds the time, by hand; a phone's photograph with pin-holes has 900.
"""

_MIN_SEEN_PX = 16
"""Number of pixels of a hole that every other pixel shows.

Source: geometry; of four by four it has four. Smaller holes are mostly closed before.
"""

_LONGEST_REACH = WORD_BITS - 2
"""Radius of the largest octagon, in steps: the margin is one word wide."""

_ERROR = 1.0
"""Largest error of a distance between two edges where every other pixel is left out, in steps."""


@kernel(read(uint64, 2, "C"), int64)
def close_round(bitmask: Words, radius: int) -> Words:
    """Close a bitmask by an octagon, which is about a disc.

    Parameters
    ----------
    bitmask : (n, R) uint64
        With an empty margin that is wider than the radius, and one empty word more to both sides of each row.
    radius : int
        px.

    Returns
    -------
    (n, R) uint64
    """
    inside = np.full(len(bitmask), ~np.uint64(0), dtype=np.uint64)
    return grow_round(grow_round(bitmask, inside, radius, DILATE), inside, radius, ERODE)


@helper
def _measure_widths(first: Ints, start: Ints, end: Ints, piece: Ints, pieces: int) -> tuple[Ints, Floats]:
    """Return the area of each piece, and its mean width: twice the area over the length of its outlines."""
    area, outline = np.zeros(pieces, dtype=np.int64), np.zeros(pieces)
    for r in range(1, len(first) - 2):
        above, below = first[r - 1], first[r + 1]
        for i in range(first[r], first[r + 1] - 1):
            k, low, high = piece[i], end[i], start[i + 1]
            area[k] += high - low
            outline[k] += 2.0
            while end[above] < low and above + 1 < first[r]:
                above += 1
            while end[below] < low and below + 1 < first[r + 2]:
                below += 1
            for begin, last in ((above, first[r]), (below, first[r + 2])):
                for j in range(begin, last):
                    if start[j] > high:
                        break
                    outline[k] += max(min(end[j], high) - max(start[j], low), 0)
                    for aside in (-1, 1):
                        beside = min(end[j], high + aside) - max(start[j], low + aside)
                        outline[k] += _DIAGONAL * max(beside, 0)
    return area, 2.0 * area / (_CROFTON * outline)


@inlined
def _piece_at(first: Ints, start: Ints, end: Ints, piece: Ints, r: int, c: int) -> int:
    """Return the piece that a pixel belongs to, -1 for ground."""
    if r < 0 or r >= len(first) - 1:
        return -1
    low, high = first[r], first[r + 1] - 1
    while low < high:
        middle = (low + high + 1) >> 1
        if start[middle] <= c:
            low = middle
        else:
            high = middle - 1
    return piece[low] if end[low] <= c else -1


@inlined
def _is_set(bitmask: Words, r: int, c: int) -> bool:
    """Return whether a pixel is set."""
    return (bitmask[(c >> 6) + 1, r] >> np.uint64(c & 63)) & np.uint64(1) != 0


@inlined
def _holds_any(bitmask: Words, r: int, low: int, high: int) -> bool:
    """Return whether some pixel of a row is set, from a column to the one before another."""
    for c in range(low, high):
        if _is_set(bitmask, r, c):
            return True
    return False


@helper
def _draw_pieces(first: Ints, start: Ints, end: Ints, piece: Ints, margin: int, columns: int) -> tuple[Bools, _Counts]:
    """Return a mask with a margin, and the piece of each pixel of it, from the runs of its ground."""
    solid = np.zeros((len(first) - 1 + 2 * margin, columns), dtype=np.bool_)
    owners = np.empty(solid.shape, dtype=np.int32)
    for r in range(len(first) - 1):
        for i in range(first[r], first[r + 1] - 1):
            low, high = end[i] + margin, start[i + 1] + margin
            solid[r + margin, low:high], owners[r + margin, low:high] = True, piece[i]
    return solid, owners


class _Narrow(NamedTuple):
    """Narrow ground: its runs, as `ground_runs` has them, and the piece of the mask that each part of it is in."""

    first: Ints
    start: Ints
    end: Ints
    part: Ints
    owner: Ints


@helper
def _fill(solid: Bools, owners: _Counts, narrow: _Narrow, chosen: Bools) -> None:
    """Fill the chosen parts of narrow ground."""
    first, start, end, part, owner = narrow
    for r in range(len(first) - 1):
        for i in range(first[r], first[r + 1]):
            if chosen[part[i]]:
                solid[r, start[i] : end[i]], owners[r, start[i] : end[i]] = True, owner[part[i]]


@helper
def _drop_deep(solid: Bools, narrow: _Narrow, is_kind: Bools, usable: Bools, deepest: Floats) -> None:
    """Drop parts of one kind that lie deeper in what is solid than a distance of their own."""
    if not is_kind.any():
        return
    first, start, end, part, _ = narrow
    squares = squared_distances(solid)
    for r in range(len(first) - 1):
        for i in range(first[r], first[r + 1]):
            k = part[i]
            for c in range(start[i], end[i]):
                if is_kind[k] and usable[k]:
                    usable[k] = np.sqrt(float(squares[r, c])) <= deepest[k]


@helper
def _keep_within(solid: Bools, owners: _Counts, narrow: _Narrow, is_hole: Bools, usable: Bools, pieces: int) -> None:
    """Drop parts of narrow ground that lie deeper than within one cable of the piece they are in.

    `owners` are the pieces of what is solid. What is usable is filled in both.
    """
    owner, filled = narrow.owner, solid.copy()
    _fill(filled, owners, narrow, owner >= 0)
    widths = single_widths(squared_distances(filled), owners, pieces) + _ERROR
    deepest = np.where(is_hole, DEEPEST_HOLE_WIDTHS, DEEPEST_SLIT_WIDTHS) * widths[owner] + _ERROR
    for is_kind in (usable & is_hole, usable & ~is_hole):  # holes are filled before slits are looked at
        _fill(solid, owners, narrow, is_kind)
        _drop_deep(solid, narrow, is_kind, usable, deepest)


@helper
def _keep_whole(
    framed: Words, size: tuple[int, int, int, int], boxes: Ints, margin: int, usable: Bools, is_hole: Bools
) -> bool:
    """Drop holes of every other pixel that are none in the mask, such as the tip of a wedge between two cables.

    Returns whether every other pixel shows all holes of the mask.
    """
    h, w, top, left = size
    first, _, end, part, pixels = find_ground(framed, h + 2, w + 2)
    for k in range(len(usable)):
        if usable[k] and is_hole[k]:
            r, c = _STEP_PX * (boxes[k, 0] - margin - 1) + top, _STEP_PX * (boxes[k, 4] - WORD_BITS) + left
            i = first[r]
            while end[i] <= c:
                i += 1
            tall, wide = boxes[k, 1] - boxes[k, 0] + 1, boxes[k, 3] - boxes[k, 2] + 1
            usable[k] = part[i] > 0 and pixels[part[i]] <= _STEP_PX**2 * tall * wide
    return len(pixels) == 1 or pixels[1:].min() >= _MIN_SEEN_PX


@helper
def _find_narrow(
    framed: Words,
    size: tuple[int, int, int, int],
    coarse: Words,
    rows: int,
    first: Ints,
    start: Ints,
    end: Ints,
    piece: Ints,
    area: Ints,
    width: Floats,
) -> Ints:
    """Return the pixels of the mask beside holes within a cable, and long slits, that hold no disc of its width."""
    reach = min(np.int64(np.ceil(0.5 * width.max())), _LONGEST_REACH)
    margin = reach + 1
    mask = np.zeros((len(coarse) + 2, rows + 2 * margin), dtype=np.uint64)
    mask[1:-1, margin : margin + rows] = coarse[:, :rows]
    height, columns = mask.shape[1], WORD_BITS * (len(mask) - 2)
    closed = close_round(mask, reach)
    rest = np.zeros_like(mask)  # all but narrow ground
    for k in range(1, len(mask) - 1):
        for r in range(height):
            rest[k, r] = ~closed[k, r] | mask[k, r]
    firsts, starts, ends, part, pixels = find_ground(rest, height, columns)
    parts = part.max() + 1
    owner, boxes = np.full(parts, -1, dtype=np.int64), np.zeros((parts, 5), dtype=np.int64)
    is_hole, is_mixed = np.ones(parts, dtype=np.bool_), np.zeros(parts, dtype=np.bool_)
    for r in range(len(firsts) - 1):
        for i in range(firsts[r], firsts[r + 1]):
            k = part[i]
            if boxes[k, 1] == 0:
                boxes[k, 0], boxes[k, 2], boxes[k, 3], boxes[k, 4] = r, starts[i], ends[i], starts[i]
            boxes[k, 1] = r + 1
            boxes[k, 2], boxes[k, 3] = min(boxes[k, 2], starts[i]), max(boxes[k, 3], ends[i])
            for row in (r - 1, r, r + 1):
                ahead = np.int64(row == r)  # in the run's own row, the pixels before and behind it
                for c in range(max(starts[i] - ahead, 0), min(ends[i] + ahead, columns)):
                    if row < 0 or row >= height or (row == r and starts[i] <= c < ends[i]):
                        continue
                    if not _is_set(mask, row, c):
                        is_hole[k] &= _is_set(closed, row, c)
                        continue
                    beside = _piece_at(first, start, end, piece, row - margin, c - WORD_BITS)
                    if 2 * area[beside] > pixels[k]:  # a speck within is no side
                        is_mixed[k] |= owner[k] >= 0 and beside != owner[k]
                        if owner[k] < 0 or area[beside] > area[owner[k]]:
                            owner[k] = beside
    usable = owner >= 0
    for k in range(parts):
        if usable[k] and not is_hole[k]:
            length = np.hypot(float(boxes[k, 1] - boxes[k, 0]), float(boxes[k, 3] - boxes[k, 2]))
            usable[k] = not is_mixed[k] and length + 2.0 * _ERROR > MIN_SLIT_WIDTHS * width[owner[k]]
    if not usable.any():
        return np.empty((0, 3), dtype=np.int64)
    firsts_closed, starts_closed, ends_closed, _, _ = find_ground(closed, height, columns)
    piece_closed, pieces = label_foreground(firsts_closed, starts_closed, ends_closed)
    widest = _measure_widths(firsts_closed, starts_closed, ends_closed, piece_closed, pieces)[1].max()
    inside = np.full(len(mask), ~np.uint64(0), dtype=np.uint64)
    shallow = np.int64(DEEPEST_SLIT_WIDTHS * widest + _ERROR)
    deeper = np.int64(DEEPEST_HOLE_WIDTHS * widest + _ERROR) - shallow
    beneath = grow_round(closed, inside, shallow, ERODE)
    deepest = grow_round(beneath, inside, deeper, ERODE)
    for r in range(len(firsts) - 1):
        for i in range(firsts[r], firsts[r + 1]):
            k = part[i]
            if usable[k]:
                usable[k] = not _holds_any(deepest if is_hole[k] else beneath, r, starts[i], ends[i])
    if not usable.any():
        return np.empty((0, 3), dtype=np.int64)
    if _keep_whole(framed, size, boxes, margin, usable, is_hole) and usable.any():
        left = WORD_BITS - margin  # the margin is cut to what the closing needs
        solid, owners = _draw_pieces(first, start, end, piece, margin, columns - 2 * left)
        narrow = _Narrow(firsts, starts - left, ends - left, part, owner)
        _keep_within(solid, owners, narrow, is_hole, usable, len(area))
    count = 0
    for i in range(len(starts)):
        if usable[part[i]]:
            count += 2 * (ends[i] - starts[i]) + 2
    places = np.empty((count, 3), dtype=np.int64)
    count = 0
    for r in range(1, len(firsts) - 2):
        for i in range(firsts[r], firsts[r + 1]):
            k = part[i]
            if not usable[k]:
                continue
            for row in (r - 1, r, r + 1):
                ahead = np.int64(row == r)
                for c in range(starts[i] - ahead, ends[i] + ahead):
                    if _is_set(mask, row, c):
                        places[count, 0], places[count, 1], places[count, 2] = (
                            row - margin,
                            c - WORD_BITS,
                            not is_hole[k],
                        )
                        count += 1
    return places[:count]


@kernel(read(uint64, 2, "C"), int64, int64, int64, int64)
def find_narrow_ground(framed: Words, h: int, w: int, top: int, left: int) -> Ints:
    """Find ground that may lie within one cable: narrow holes of a piece of the mask, and long narrow slits.

    Parameters
    ----------
    framed : (n, R) uint64
        As `dloftbs.kernels.bitmask.frame` makes it.
    h, w : int
        Size of the box.
    top, left : int
        The first row and column, with the margin, to look at, 0 or 1.

    Returns
    -------
    (n, 3) int64
        Row and column of the pixels of the mask beside it, with the margin, and whether they are beside a slit. All of
        them, since where every other pixel is left out, pieces are not those of the mask.
    """
    coarse = thin_out(framed, h + 2, top, left)
    rows, columns = coarse.shape[1], (w + 3 - left) // _STEP_PX
    first, start, end, _, pixels = find_ground(coarse, rows, columns)
    if len(pixels) > _MAX_GROUNDS:
        return np.empty((0, 3), dtype=np.int64)
    piece, pieces = label_foreground(first, start, end)
    if pieces == 0:
        return np.empty((0, 3), dtype=np.int64)
    area, width = _measure_widths(first, start, end, piece, pieces)
    places = _find_narrow(framed, (h, w, top, left), coarse, rows, first, start, end, piece, area, width)
    for i in range(len(places)):
        places[i, 0], places[i, 1] = _STEP_PX * (places[i, 0] - 1) + top, _STEP_PX * places[i, 1] + left
    return places
