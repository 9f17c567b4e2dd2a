"""Holes in a mask that lie within one cable, as a highlight on a glossy one, decided by the cable's outer edges."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import boolean, int64, uint64
from numba.types import UniTuple

from dloftbs.cleaning.kernels.ground_runs import fill, find_ground
from dloftbs.cleaning.kernels.ground_widths import look_across
from dloftbs.cleaning.kernels.outer_edges import measure_edges
from dloftbs.kernels.compiler import helper, inlined, kernel, read
from dloftbs.kernels.shared.bitmask_layout import WORD_BITS

_MOST_GROWTH = 0.25
"""Largest growth of the distance from the middle to the outer edges along a hole, in widths of the hole.

Two cables that part move by half of the hole's width each, the edges of one cable not at all. This is the middle.
"""

_WIDEST_SOLID = 1.0
"""Largest width of a hole, in radii of the mask beyond it: what lies between is narrower than the halves together."""

_SMALL_SOLID = 0.5
"""Largest side of a pin-hole, in radii of the mask beside it.

A quarter of the width: between two cables it is shorter than half of the width of either, and hides no way through.
"""

_PROBES = 8
"""Places at which a hole is measured across at first, to save time."""

_Words = npt.NDArray[np.uint64]
_Ints = npt.NDArray[np.int64]
_Bools = npt.NDArray[np.bool_]
_Sides = tuple[bool, bool, bool, bool]


@inlined
def _get(bitmask: _Words, r: int, c: int) -> bool:
    """Tell whether a pixel is set."""
    return (bitmask[(c + WORD_BITS) >> 6, r] >> np.uint64(c & 63)) & np.uint64(1) != 0


@helper
def _find_narrow(
    bitmask: _Words, rows: int, columns: int, first: _Ints, start: _Ints, end: _Ints, part: _Ints, parts: int
) -> tuple[_Bools, _Ints]:
    """Find the holes that may be narrower than the mask beside them, by some places, and the outer widths."""
    count = np.zeros(parts, dtype=np.int64)
    for i in range(len(part)):
        count[part[i]] += 1
    seen, probed = np.zeros(parts, dtype=np.int64), np.zeros(parts, dtype=np.int64)
    across, beside = np.zeros(parts, dtype=np.int64), np.zeros(parts, dtype=np.int64)
    width = np.zeros(parts, dtype=np.int64)
    for r in range(rows):
        for i in range(first[r], first[r + 1]):
            k = part[i]
            if start[i] <= 0 or end[i] >= columns or r == 0 or r == rows - 1:
                count[k] = 0  # ground beyond the mask
            if k == 0 or count[k] == 0:
                continue
            seen[k] += 1
            if probed[k] * count[k] >= seen[k] * _PROBES:
                continue
            probed[k] += 1
            ground, mask = look_across(bitmask, rows, columns, r, (start[i] + end[i] - 1) // 2)
            across[k] += ground
            beside[k] += mask
            width[k] = max(width[k], ground + mask)
    return (count > 0) & (across > 0) & (across <= beside), width


@helper
def _find_boxes(first: _Ints, start: _Ints, end: _Ints, part: _Ints, parts: int) -> _Ints:
    """Return the first row, the one after the last, the first column and the one after the last of each part."""
    boxes = np.empty((parts, 4), dtype=np.int64)
    seen = np.zeros(parts, dtype=np.bool_)
    for r in range(len(first) - 1):
        for i in range(first[r], first[r + 1]):
            k = part[i]
            if not seen[k]:
                seen[k], boxes[k, 0], boxes[k, 2], boxes[k, 3] = True, r, start[i], end[i]
            boxes[k, 1] = r + 1
            boxes[k, 2], boxes[k, 3] = min(boxes[k, 2], start[i]), max(boxes[k, 3], end[i])
    return boxes


@helper
def _leave_beside(narrow: _Bools, boxes: _Ints, reach: _Ints, filled: _Ints) -> None:
    """Leave of some holes those that are so near to a box that has been filled that it may change their measures."""
    for k in range(len(narrow)):
        if narrow[k]:
            narrow[k], far = False, 2 * reach[k]
            for i in range(len(filled)):
                if boxes[k, 0] - far < filled[i, 1] and filled[i, 0] < boxes[k, 1] + far:
                    narrow[k] |= boxes[k, 2] - far < filled[i, 3] and filled[i, 2] < boxes[k, 3] + far


@helper
def _seal(framed: _Words, h: int, w: int, beyond: _Sides) -> _Words:
    """Return the mask with its slits closed where they leave the image: by the margin between what lies beside them.

    A slit is narrower than what lies at both of its sides along the border, together.
    """
    sealed = framed.copy()
    for side in range(4):
        if not beyond[side]:
            continue
        length = w if side < 2 else h
        before, gap, after = 0, 0, 0  # mask, ground, mask
        for p in range(1, length + 2):
            r, c = p, (1 if side == 2 else w)
            if side < 2:
                r, c = (1 if side == 0 else h), p
            is_set = p <= length and _get(framed, r, c)
            if is_set:
                after += 1
                continue
            if after > 0:
                if before > 0 and gap <= before + after:
                    for q in range(p - after - gap, p - after):
                        row, column = q, (0 if side == 2 else w + 1)
                        if side < 2:
                            row, column = (0 if side == 0 else h + 1), q
                        sealed[(column >> 6) + 1, row] |= np.uint64(1) << np.uint64(column & 63)
                before, gap, after = after, 0, 0
            gap += 1
    return sealed


@helper
def _clear_margin(framed: _Words, h: int, w: int) -> None:
    for k in range(len(framed)):
        framed[k, 0] = framed[k, h + 1] = np.uint64(0)
    for r in range(h + 2):
        for c in (0, w + 1):
            framed[(c >> 6) + 1, r] &= ~(np.uint64(1) << np.uint64(c & 63))


@kernel(read(uint64, 2, "C"), int64, int64, UniTuple(boolean, 4))
def fill_holes(framed: _Words, h: int, w: int, beyond: _Sides) -> _Words:
    """Fill the holes of a mask that lie within one cable, and the slits that the image's border opens.

    A cable goes on beyond the end of a highlight as wide as its outer edges are apart along it. Two cables that lie
    side by side are narrower where they touch, and the sides of a loop go nowhere together. All is measured beside
    each hole, so that nothing far away decides about it.

    Parameters
    ----------
    framed : (n, R) uint64
        As `dloftbs.kernels.bitmask.frame` makes it.
    h, w : int
        Size of the box.
    beyond : (bool, bool, bool, bool)
        Whether the image ends at the top, bottom, left and right of the box.

    Returns
    -------
    (n, R) uint64
        (0, 0) where there is nothing to fill.
    """
    mask = _seal(framed, h, w, beyond)
    rows, columns, changed = h + 2, w + 2, False
    filled = np.empty((0, 4), dtype=np.int64)
    while (
        True
    ):  # what is filled counts as solid for the holes beside it: pin-holes first, rows of holes from their ends
        first, start, end, part, pixels = find_ground(mask, rows, columns)
        if len(pixels) == 1:
            break
        narrow, reach = _find_narrow(mask, rows, columns, first, start, end, part, len(pixels))
        boxes = _find_boxes(first, start, end, part, len(pixels))
        if changed:
            _leave_beside(narrow, boxes, reach, filled)
        if not narrow.any():
            break
        across, outer, solid = measure_edges(mask, rows, columns, first, start, end, part, narrow, boxes, beyond)
        longest = np.maximum(boxes[:, 1] - boxes[:, 0], boxes[:, 3] - boxes[:, 2])
        small = narrow & (longest <= _SMALL_SOLID * solid)
        within = narrow & (across <= _WIDEST_SOLID * solid) & (outer - solid < _MOST_GROWTH * across)
        if not (small | within).any():
            break
        filled = boxes[small | within]
        mask, changed = fill(mask, first, start, end, part, small | within), True
    if not changed:
        return np.empty((0, 0), dtype=np.uint64)
    _clear_margin(mask, h, w)
    return mask
