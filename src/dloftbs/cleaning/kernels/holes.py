"""Holes in a mask that lie within one cable, as a highlight on a glossy one, told from ground.

The ground is taken as runs, the stretches of a row between foreground: column by column would take ten times as long.
Masks are framed stripes, see `dloftbs.kernels.bitmask`; column 0 is the first one of stripe 1.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numba import boolean, int64, uint64

from dloftbs.kernels.compiler import helper, inlined, kernel, read

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
"""Largest excess of a distance between two edges where every other pixel is left out, in steps."""

_BITS = 64
_FIRST_RIDGE = 1024

_Words = npt.NDArray[np.uint64]
_Ints = npt.NDArray[np.int64]
_Bools = npt.NDArray[np.bool_]


class _Ground(NamedTuple):
    """The runs of ground of a mask, and what is known of the parts that hang together by their sides.

    Parameters
    ----------
    first : (rows + 1,) int64
        Where the runs of each row start.
    start, end : (n,) int64
        First column of each run, and the one after its last; -1 and one more than the columns at the margin.
    part : (n,) int64
        That each run belongs to; part 0 lies around the mask, all others are holes.
    pixels, sides : (parts,) int64
        Of each part, and its pixels' sides that touch foreground.
    outlines : int
        Of the foreground's pieces, and of its holes.
    """

    first: _Ints
    start: _Ints
    end: _Ints
    part: _Ints
    pixels: _Ints
    sides: _Ints
    outlines: int


@inlined
def _count(word: int) -> int:
    """Return the number of ones."""
    word -= (word >> np.uint64(1)) & np.uint64(0x5555555555555555)
    word = (word & np.uint64(0x3333333333333333)) + ((word >> np.uint64(2)) & np.uint64(0x3333333333333333))
    word = (word + (word >> np.uint64(4))) & np.uint64(0x0F0F0F0F0F0F0F0F)
    return (word * np.uint64(0x0101010101010101)) >> np.uint64(56)


@inlined
def _lowest(word: int) -> int:
    """Return the place of the lowest one of a word that has any."""
    return np.int64(_count(~word & (word - np.uint64(1))))


@inlined
def _get(words: _Words, row: int, column: int) -> bool:
    """Tell whether a pixel is set; there may be one column more on either side."""
    return (words[(column + _BITS) >> 6, row] >> np.uint64(column & 63)) & np.uint64(1) != 0


@inlined
def _every_other(word: int) -> int:
    """Return the bits 0, 2, 4, ... of a word next to each other."""
    word &= np.uint64(0x5555555555555555)
    word = (word | (word >> np.uint64(1))) & np.uint64(0x3333333333333333)
    word = (word | (word >> np.uint64(2))) & np.uint64(0x0F0F0F0F0F0F0F0F)
    word = (word | (word >> np.uint64(4))) & np.uint64(0x00FF00FF00FF00FF)
    word = (word | (word >> np.uint64(8))) & np.uint64(0x0000FFFF0000FFFF)
    return (word | (word >> np.uint64(16))) & np.uint64(0x00000000FFFFFFFF)


@helper
def _thinned(words: _Words, rows: int, top: int, left: int) -> _Words:
    """Return every other pixel of a mask from a row and a column on, with an empty margin."""
    n = len(words) - 2
    height = (rows - top + 1) // 2
    result = np.zeros(((n + 1) // 2 + 2, height + 2), dtype=np.uint64)
    for k in range(n):
        for r in range(height):
            word = words[k + 1, top + 2 * r]
            if word != 0:
                half = _every_other(word >> np.uint64(left))
                result[k // 2 + 1, r + 1] |= half << np.uint64(32 * (k % 2))
    return result


@inlined
def _changes(words: _Words, k: int, r: int) -> int:
    """Return which pixels of a word differ from the one before."""
    word = words[k, r]
    return word ^ ((word << np.uint64(1)) | (words[k - 1, r] >> np.uint64(_BITS - 1)))


@helper
def _list_runs(words: _Words, rows: int, columns: int) -> tuple[_Ints, _Ints, _Ints]:
    """Return the runs of ground, see `_Ground`."""
    one = np.uint64(1)
    changes = np.uint64(0)
    for k in range(1, len(words)):
        for r in range(rows):
            changes += _count(_changes(words, k, r))
    first = np.zeros(rows + 1, dtype=np.int64)
    start = np.empty(np.int64(changes) // 2 + rows, dtype=np.int64)
    end = np.empty_like(start)
    count = np.uint64(0)  # unsigned indices spare a test for the sign
    for r in range(rows):
        first[r] = count
        start[count] = -1
        for k in range(1, len(words)):
            change = _changes(words, k, r)
            while change != 0:
                j = _lowest(change)
                change &= change - one
                if (words[k, r] >> np.uint64(j)) & one != 0:
                    end[count] = _BITS * (k - 1) + j
                    count += one
                else:
                    start[count] = _BITS * (k - 1) + j
        end[count] = columns + 1
        count += one
    first[rows] = count
    return first, start, end


@inlined
def _root(parent: _Ints, i: int) -> int:
    while parent[i] != i:
        parent[i] = parent[parent[i]]
        i = parent[i]
    return i


@helper
def _find_ground(words: _Words, rows: int, columns: int) -> _Ground:
    """Find the parts of the ground that hang together by their sides."""
    first, start, end = _list_runs(words, rows, columns)
    count, contacts = len(start), 0
    parent = np.arange(count)
    above = np.zeros(count, dtype=np.int64)  # pixels of each run below ground
    for r in range(1, rows):
        i, j = first[r - 1], first[r]
        while i < first[r] and j < first[r + 1]:
            common = min(end[i], end[j]) - max(start[i], start[j])
            if common > 0:
                contacts += 1
                above[j] += common
                a, b = _root(parent, i), _root(parent, j)
                parent[max(a, b)] = min(a, b)
            if end[i] < end[j]:
                i += 1
            else:
                j += 1
    part = np.empty(count, dtype=np.int64)
    parts = 0
    for i in range(count):
        if parent[i] == i:
            part[i] = parts
            parts += 1
        else:
            part[i] = part[_root(parent, i)]
    pixels = np.zeros(parts, dtype=np.int64)
    sides = np.zeros(parts, dtype=np.int64)
    for i in range(count):
        pixels[part[i]] += end[i] - start[i]
        sides[part[i]] += 2 + 2 * (end[i] - start[i] - above[i])
    # Runs less contacts are the parts less what they enclose, and each piece of the foreground is enclosed by one.
    pieces = parts - (count - contacts)
    return _Ground(first, start, end, part, pixels, sides, pieces + parts - 1)


@helper
def _measure(words: _Words, rows: int) -> tuple[int, int]:
    """Return the area of a mask and the length of all its outlines, in pixels as often as these pass them.

    An outline passes a pixel once for each stretch of ground around it that holds one of its sides.
    """
    one, last = np.uint64(1), np.uint64(_BITS - 1)
    area, length = np.uint64(0), np.uint64(0)
    for k in range(1, len(words) - 1):
        for r in range(1, rows - 1):
            here = words[k, r]
            if here == 0:
                continue
            n, s = words[k, r - 1], words[k, r + 1]
            e, w = (here >> one) | (words[k + 1, r] << last), (here << one) | (words[k - 1, r] >> last)
            area += _count(here)
            if here & ~(n & s & e & w) == 0:
                continue
            ne, nw = (n >> one) | (words[k + 1, r - 1] << last), (n << one) | (words[k - 1, r - 1] >> last)
            se, sw = (s >> one) | (words[k + 1, r + 1] << last), (s << one) | (words[k - 1, r + 1] >> last)
            length += _count(here & ~e & (ne | n)) + _count(here & ~n & (nw | w))
            length += _count(here & ~w & (sw | s)) + _count(here & ~s & (se | e))
            length += _count(here & ~(n | s | e | w | ne | nw | se | sw))
    return np.int64(area), np.int64(length)


@helper
def _measure_outline(words: _Words, r: int, start: int, end: int) -> int:
    """Return how often outlines pass foreground along a run of ground, counted where their stretch of ground ends."""
    length = 0
    if _get(words, r - 1, start) or _get(words, r - 1, start - 1):
        length += 1
    if _get(words, r + 1, end - 1) or _get(words, r + 1, end):
        length += 1
    for c in range(start, end):
        length += _get(words, r - 1, c) and (_get(words, r, c + 1) or _get(words, r - 1, c + 1))
        length += _get(words, r + 1, c) and (_get(words, r, c - 1) or _get(words, r + 1, c - 1))
    return length


@helper
def _find_narrow(words: _Words, rows: int, ground: _Ground) -> tuple[_Bools, float]:
    """Return which holes are narrow enough to lie within a cable, and the cables' width without these, px.

    The width is twice the area over the length of the outlines.
    """
    parts = len(ground.pixels)
    narrow = np.zeros(parts, dtype=np.bool_)
    area, length = _measure(words, rows)
    for k in range(1, parts):  # an outline passes a pixel for one of its sides at least
        narrow[k] = ground.pixels[k] * length < _WIDEST * area * ground.sides[k]
    if not narrow.any():
        return narrow, 0.0
    outline = np.zeros(parts, dtype=np.int64)
    for r in range(1, rows - 1):
        for i in range(ground.first[r], ground.first[r + 1]):
            if narrow[ground.part[i]]:
                outline[ground.part[i]] += _measure_outline(words, r, ground.start[i], ground.end[i])
    filled, left = area, length
    for k in range(1, parts):
        narrow[k] = narrow[k] and ground.pixels[k] * length < _WIDEST * area * outline[k]
        if narrow[k]:
            filled += ground.pixels[k]
            left -= outline[k]
    return narrow, 2.0 * filled / max(left, 1)


@inlined
def _edge_distance(squared: int) -> float:
    """Return how far a pixel is from an edge, px, whose next pixel beyond is so far away, px^2."""
    return np.sqrt(np.float32(squared)) - np.float32(0.5)


@helper
def _nearest(ground: _Ground, narrow: _Bools, r: int, c: int, most: int, enough: int) -> int:
    """Return how far the nearest ground is that is no narrow hole, px^2; it need not be nearer than `enough`."""
    rows, best = len(ground.first) - 1, most
    for step in range(rows):
        if step * step >= best or best <= enough:
            break
        for row in (r - step, r + step):
            if row < 0 or row >= rows:
                continue
            for i in range(ground.first[row], ground.first[row + 1]):
                if narrow[ground.part[i]]:
                    continue
                across = max(ground.start[i] - c, c - ground.end[i] + 1, 0)
                best = min(best, step * step + across * across)
                if ground.start[i] > c:
                    break
    return best


@helper
def _measure_depths(ground: _Ground, narrow: _Bools, deepest: float) -> npt.NDArray[np.float64]:
    """Return how far each narrow hole's deepest pixel is from the ground's edge, px; more than the limit if it is."""
    parts = len(narrow)
    squared = np.zeros(parts, dtype=np.int64)
    most = np.int64((deepest + 1.0) ** 2) + 2
    longest = np.full(parts, -1, dtype=np.int64)
    for i in range(len(ground.part)):
        k = ground.part[i]
        if narrow[k] and (
            longest[k] < 0 or ground.end[i] - ground.start[i] > ground.end[longest[k]] - ground.start[longest[k]]
        ):
            longest[k] = i
    for only_middle in (True, False):  # of the longest run: most holes are soon seen to be too deep
        for r in range(len(ground.first) - 1):
            for i in range(ground.first[r], ground.first[r + 1]):
                k = ground.part[i]
                if not narrow[k] or (only_middle and i != longest[k]):
                    continue
                low, high = ground.start[i], ground.end[i]
                if only_middle:
                    low = (low + high) // 2
                    high = low + 1
                for c in range(low, high):
                    if _edge_distance(squared[k]) <= deepest:
                        squared[k] = max(squared[k], _nearest(ground, narrow, r, c, most, squared[k]))
    depth = np.empty(parts)
    for k in range(parts):
        depth[k] = max(_edge_distance(squared[k]), 0.0)
    return depth


@helper
def _fill(words: _Words, ground: _Ground, within: _Bools) -> _Words:
    """Return a mask in which these parts of the ground are foreground."""
    filled = words.copy()
    for r in range(len(ground.first) - 1):
        for i in range(ground.first[r], ground.first[r + 1]):
            if within[ground.part[i]]:
                for c in range(ground.start[i], ground.end[i]):
                    filled[(c >> 6) + 1, r] |= np.uint64(1) << np.uint64(c & 63)
    return filled


@helper
def _measure_away(words: _Words, rows: int, columns: int) -> npt.NDArray[np.int64]:
    """Return how far each pixel is from the nearest one of the ground, px^2, in columns one higher."""
    one = np.uint64(1)
    above = np.zeros((rows, columns + 2), dtype=np.int32)  # in its column, px
    for r in range(1, rows - 1):
        for k in range(1, len(words) - 1):
            word = words[k, r]
            while word != 0:
                c = np.uint64(_BITS * (k - 1) + _lowest(word) + 1)
                word &= word - one
                above[r, c] = above[r - 1, c] + 1
    away = np.zeros((rows, columns + 2), dtype=np.int64)
    for r in range(rows - 2, 0, -1):
        for k in range(1, len(words) - 1):
            word = words[k, r]
            while word != 0:
                c = np.uint64(_BITS * (k - 1) + _lowest(word) + 1)
                word &= word - one
                above[r, c] = min(above[r, c], above[r + 1, c] + 1)
        for k in range(1, len(words) - 1):
            word = words[k, r]
            while word != 0:
                c = np.uint64(_BITS * (k - 1) + _lowest(word) + 1)
                word &= word - one
                best, across = np.int64(above[r, c]) ** 2, 1
                while across * across < best:
                    nearer = np.int64(min(above[r, c - np.uint64(across)], above[r, c + np.uint64(across)]))
                    best = min(best, nearer * nearer + across * across)
                    across += 1
                away[r, c] = best
    return away


@inlined
def _is_ridge(away: _Ints, r: int, c: int) -> bool:
    """Tell whether no neighbour of a pixel is farther from the ground."""
    one = np.uint64(1)
    here = away[r, c]
    if here < max(away[r, c - one], away[r, c + one]) or here < max(away[r - one, c], away[r + one, c]):
        return False
    return here >= max(away[r - one, c - one], away[r - one, c + one], away[r + one, c - one], away[r + one, c + one])


@helper
def _single_width(words: _Words, rows: int, columns: int) -> float:
    """Return how wide one cable is where most lie in bundles, px, from the ridge of the distance to the ground."""
    away = _measure_away(words, rows, columns)
    ridge = np.empty(_FIRST_RIDGE, dtype=np.int64)
    count = 0
    for r in range(1, rows - 1):
        for k in range(1, len(words) - 1):
            word = words[k, r]
            while word != 0:
                c = np.uint64(_BITS * (k - 1) + _lowest(word) + 1)
                word &= word - np.uint64(1)
                if _is_ridge(away, np.uint64(r), c):
                    if count == len(ridge):
                        ridge = np.concatenate((ridge, np.empty_like(ridge)))
                    ridge[count] = away[r, c]
                    count += 1
    place = _SINGLE_SHARE * (count - 1)
    before = int(place)
    after = min(before + 1, count - 1)
    low = _edge_distance(np.partition(ridge[:count], before)[before])
    high = _edge_distance(np.partition(ridge[:count], after)[after])
    return 2.0 * (low + (place - before) * (high - low))


@kernel(read(uint64, 2, "C"), int64, int64, boolean, boolean)
def fill_holes(framed: _Words, h: int, w: int, flip_x: bool, flip_y: bool) -> _Words:
    """Fill the holes of a mask that are narrower than its cables and lie within one of them.

    Parameters
    ----------
    framed : (n, R) uint64
        As `stripes.frame` makes them.
    h, w : int
        Size of the box.
    flip_x, flip_y : bool
        Whether the pixels that are looked at first are counted from the last column and the last row.

    Returns
    -------
    (n, R) uint64
        (0, 0) where there is nothing to fill.
    """
    nothing = np.empty((0, 0), dtype=np.uint64)
    top, left = (h + 1) % _COARSE_PX if flip_y else 0, (w + 1) % _COARSE_PX if flip_x else 0
    coarse = _thinned(framed, h + 2, top, left)
    rows, columns = coarse.shape[1], (w + 3 - left) // _COARSE_PX
    ground = _find_ground(coarse, rows, columns)
    if len(ground.pixels) == 1 or ground.outlines > _MOST_OUTLINES:
        return nothing
    narrow, width = _find_narrow(coarse, rows, ground)
    if not narrow.any():
        return nothing
    deepest = _DEEPEST_WIDTHS * width + _SAMPLING_ERROR
    depth = _measure_depths(ground, narrow, deepest)
    likely = narrow & (depth <= deepest)
    if not likely.any():  # most holes are ground, and this is soon seen
        return nothing
    single = _single_width(_fill(coarse, ground, likely), rows, columns)
    if not (likely & (depth <= _DEEPEST_WIDTHS * single + _SAMPLING_ERROR)).any():
        return nothing
    ground = _find_ground(framed, h + 2, w + 2)
    if ground.outlines > _MOST_OUTLINES:
        return nothing
    narrow, width = _find_narrow(framed, h + 2, ground)
    deepest = _DEEPEST_WIDTHS * min(width, _COARSE_PX * single)
    within = narrow & (_measure_depths(ground, narrow, deepest) <= deepest)
    return _fill(framed, ground, within) if within.any() else nothing
