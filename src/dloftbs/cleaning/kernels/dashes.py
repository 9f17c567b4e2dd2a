"""Small pieces of a mask that lie in line with others: the dashes of a thin cable, distinguished from salt.

It is decided a contrario (Desolneux, Moisan and Morel, 2000): how many such lines would chance make of as many pieces,
strewn and turned at random? What chance makes in one mask of a thousand at most is a line.
"""

from __future__ import annotations

import math

import numpy as np
from numba import int64

from dloftbs.kernels.compiler import Bools, Floats, Ints, helper, inlined, kernel, write
from dloftbs.kernels.shared.bitmask_layout import WORD_BITS
from dloftbs.kernels.shared.copying import longer_rows
from dloftbs.kernels.shared.union_find import find_root

_CHANCE = 0.001
"""Number of lines that chance may make in a mask of pieces strewn at random."""

_CELL_PX = 16
"""Side of the cells by which neighbours are found, px; it bounds time."""

_LARGEST_TURN = math.pi / 4
"""Largest angle between the axis of a dash and the way to the next one, rad; at more they are not in line."""

_EXACT = 1e-9
"""Rounding errors of coordinates and costs, so that equal ones are equal in a mask that is flipped, too."""

_STRAIGHT_PX = 3.0
"""Width up to which a long piece is looked at as one, px: two pixels, and one by which it is bent."""

_MAX_DASHES = 1000
"""Number of pieces that are looked at, the largest first; more are noise, and it bounds time."""

_FIRST = 256
_X, _Y, _AXIS_X, _AXIS_Y, _LENGTH, _TURN, _SIZE = range(7)  # centre px, axis, length px, its axis's error rad, pixels
_COLUMNS = 7


@inlined
def _place(p: int, rows: int) -> tuple[int, int]:
    """Return the column and the row of a pixel, by its number."""
    word = p >> 6
    return word // rows * WORD_BITS + (p & 63), word % rows


@inlined
def _measure(pixels: Ints, start: int, end: int, rows: int, node: Floats) -> bool:
    """Describe some pixels as a dash, by their moments; return whether they have a longer axis."""
    n = end - start
    x0, y0 = _place(pixels[start], rows)
    sx = sy = sxx = syy = sxy = 0
    for i in range(start, end):
        column, row = _place(pixels[i], rows)
        x, y = column - x0, row - y0
        sx += x
        sy += y
        sxx += x * x
        syy += y * y
        sxy += x * y
    a, b, c = n * sxx - sx * sx, n * syy - sy * sy, n * sxy - sx * sy
    slant, skew = float(a - b), 2.0 * float(c)  # their squares exceed 64 bits in a row of 440 pixels
    spread = math.sqrt(slant * slant + skew * skew)
    if spread == 0.0:
        return False
    cosine = (a - b) / spread  # of twice the angle
    node[_X], node[_Y] = x0 + sx / n, y0 + sy / n
    node[_AXIS_X] = math.sqrt(max(0.0, 0.5 * (1.0 + cosine)))
    node[_AXIS_Y] = math.sqrt(max(0.0, 0.5 * (1.0 - cosine))) * (1.0 if c >= 0 else -1.0)
    # The variance of n pixels in a row is (n^2 - 1) / 12.
    node[_LENGTH] = math.sqrt(6.0 * (a + b + spread) / (n * n) + 1.0)
    width = math.sqrt(max(0.0, 6.0 * (a + b - spread) / (n * n)) + 1.0)
    node[_TURN] = width / node[_LENGTH]
    node[_SIZE] = n
    return True


@inlined
def _halve(pixels: Ints, start: int, end: int, rows: int, node: Floats) -> tuple[int, int]:
    """Sort some pixels by the halves of their axis; return where the first ends, and where the second begins.

    Those just in the middle lie between them.
    """
    n = end - start
    x0, y0 = _place(pixels[start], rows)
    sx = sy = 0
    for i in range(start, end):
        column, row = _place(pixels[i], rows)
        sx += column - x0
        sy += row - y0
    low, high, i = start, end, start
    while i < high:
        column, row = _place(pixels[i], rows)
        along = (n * (column - x0) - sx) * node[_AXIS_X] + (n * (row - y0) - sy) * node[_AXIS_Y]
        if along < 0.0:
            pixels[i], pixels[low] = pixels[low], pixels[i]
            low += 1
            i += 1
        elif along > 0.0:
            high -= 1
            pixels[i], pixels[high] = pixels[high], pixels[i]
        else:
            i += 1
    return low, high


@helper
def _smallest(ends: Ints, least: int) -> int:
    """Return the size from which on no more than `_MAX_DASHES` pieces are as large, or are large anyway."""
    number = np.zeros(least + 1, dtype=np.int64)  # of pieces by size
    start = 0
    for end in ends:
        number[min(end - start, least)] += 1
        start = end
    size, total = least, number[least]
    while size > 2 and total + number[size - 1] <= _MAX_DASHES:  # a single pixel has no direction
        size -= 1
        total += number[size]
    return size


@helper
def _describe(pixels: Ints, ends: Ints, rows: int, least: int) -> tuple[Floats, Ints]:
    """Describe the largest pieces as dashes, long bent ones in parts of up to twice `least` pixels.

    Returns
    -------
    nodes : (m, 7) float64
    pieces : (m,) int64
        The piece of each, in ascending order.
    """
    nodes = np.empty((_FIRST, _COLUMNS))
    pieces = np.empty((_FIRST, 1), dtype=np.int64)
    stack = np.empty((2 * WORD_BITS, 2), dtype=np.int64)  # deep enough for halves of halves of any piece
    count = 0
    start = 0
    smallest = _smallest(ends, least)
    for piece in range(len(ends)):
        stack[0, 0], stack[0, 1] = start, ends[piece]
        waiting = ends[piece] - start >= smallest
        start = ends[piece]
        while waiting > 0:
            waiting -= 1
            first, last = stack[waiting, 0], stack[waiting, 1]
            if count == len(nodes):
                nodes, pieces = longer_rows(nodes), longer_rows(pieces)
            if not _measure(pixels, first, last, rows, nodes[count]):
                continue
            straight = nodes[count, _TURN] * nodes[count, _LENGTH] <= _STRAIGHT_PX
            if straight or last - first <= 2 * least or waiting + 2 > len(stack):
                pieces[count, 0] = piece
                count += 1
                continue
            low, high = _halve(pixels, first, last, rows, nodes[count])
            stack[waiting, 0], stack[waiting, 1] = first, low
            stack[waiting + 1, 0], stack[waiting + 1, 1] = high, last
            waiting += 2
    return nodes[:count], pieces[:count, 0]


@inlined
def _reach(node: Floats, least: int) -> float:
    """Return the distance of centres, px, up to which a dash has partners that are not longer than itself."""
    return 2.0 * min(node[_LENGTH], float(least)) + node[_LENGTH]


@inlined
def _pair(one: Floats, other: Floats, least: int) -> tuple[float, int, int]:
    """Compare two dashes that may follow each other.

    Returns
    -------
    area : float
        Size of the region, px^2, in which a dash would be in line at least as well: as near, turned as little. It is
        multiplied by the share of directions. Negative where they are not in line.
    side, other_side : int
        The end of each that faces the other, 0 or 1.
    """
    x, y = other[_X] - one[_X], other[_Y] - one[_Y]
    distance = math.sqrt(x * x + y * y)
    along = one[_AXIS_X] * x + one[_AXIS_Y] * y
    other_along = other[_AXIS_X] * x + other[_AXIS_Y] * y
    together = one[_LENGTH] + other[_LENGTH]
    gap = distance - 0.5 * together
    straight = min(abs(along), abs(other_along))
    if gap < -1.0 or gap > min(one[_LENGTH], float(least)) + min(other[_LENGTH], float(least)) + _EXACT:
        return -1.0, 0, 0
    if straight < math.cos(_LARGEST_TURN) * distance - _EXACT:
        return -1.0, 0, 0
    turn = max(math.acos(min(1.0, straight / distance)), one[_TURN], other[_TURN])
    gap = max(gap, 1.0)
    # A sector behind the end, whose tip is the centre, with a pixel to both sides.
    area = gap * (2.0 + turn * (gap + together)) * min(1.0, 2.0 * turn / math.pi)
    return area, 1 if along > 0.0 else 0, 0 if other_along > 0.0 else 1


@helper
def _sort_into_cells(nodes: Floats) -> tuple[Ints, Ints, int, int]:
    """Return the dashes cell by cell, where each cell begins, and the number of cells across and down."""
    across = down = 0
    for i in range(len(nodes)):
        across = max(across, int(nodes[i, _X]) // _CELL_PX + 1)
        down = max(down, int(nodes[i, _Y]) // _CELL_PX + 1)
    starts = np.zeros(across * down + 1, dtype=np.int64)
    for i in range(len(nodes)):
        starts[int(nodes[i, _Y]) // _CELL_PX * across + int(nodes[i, _X]) // _CELL_PX + 1] += 1
    for cell in range(across * down):
        starts[cell + 1] += starts[cell]
    order = np.empty(len(nodes), dtype=np.int64)
    filled = starts.copy()
    for i in range(len(nodes)):
        cell = int(nodes[i, _Y]) // _CELL_PX * across + int(nodes[i, _X]) // _CELL_PX
        order[filled[cell]] = i
        filled[cell] += 1
    return order, starts, across, down


@helper
def _find_pairs(nodes: Floats, pieces: Ints, least: int) -> tuple[Floats, Ints]:
    """Find dashes of different pieces that may follow each other.

    Returns
    -------
    areas : (k, 1) float64
        That of `_pair`, over the area of a dash by chance among those around either.
    pairs : (k, 4) int64
        Two dashes, and the ends by which they face each other.
    """
    order, starts, across, down = _sort_into_cells(nodes)
    areas = np.empty((_FIRST, 1))
    pairs = np.empty((_FIRST, 4), dtype=np.int64)
    density = np.zeros(len(nodes))
    count = 0
    for i in range(len(nodes)):
        x, y, reach = nodes[i, _X], nodes[i, _Y], _reach(nodes[i], least) + _EXACT
        near = 0
        for row in range(max(int(y - reach) // _CELL_PX, 0), min(int(y + reach) // _CELL_PX + 1, down)):
            first = row * across + max(int(x - reach) // _CELL_PX, 0)
            last = row * across + min(int(x + reach) // _CELL_PX, across - 1)
            for k in range(starts[first], starts[last + 1]):
                j = order[k]
                dx, dy = nodes[j, _X] - x, nodes[j, _Y] - y
                if pieces[j] == pieces[i] or dx * dx + dy * dy > reach * reach:
                    continue
                near += 1
                length, other = nodes[i, _LENGTH], nodes[j, _LENGTH]
                if other > length or (other == length and j > i):  # found from there
                    continue
                area, side, other_side = _pair(nodes[i], nodes[j], least)
                if area < 0.0:
                    continue
                if count == len(pairs):
                    areas, pairs = longer_rows(areas), longer_rows(pairs)
                areas[count, 0] = area
                pairs[count, 0], pairs[count, 1], pairs[count, 2], pairs[count, 3] = i, j, side, other_side
                count += 1
        density[i] = near / (math.pi * reach * reach)
    for k in range(count):
        areas[k, 0] *= max(density[pairs[k, 0]], density[pairs[k, 1]])
    return areas[:count], pairs[:count]


@inlined
def _tail(evidence: float, links: int) -> float:
    """Return the probability that so many chances have at most the product ``exp(-evidence)`` (Fisher, 1925)."""
    term, total = math.exp(-evidence), 0.0
    for k in range(links):
        total += term
        term *= evidence / (k + 1)
    return total if links > 0 else 1.0


@kernel(write(int64, 1, "C"), write(int64, 1, "C"), int64, int64)
def find_dashes(pixels: Ints, ends: Ints, rows: int, least: int) -> Bools:
    """Find the pieces that lie in line with others, so many and so well that chance does not explain it.

    Each end of a dash goes together with the one that follows it best, if that agrees. The expected number of dashes
    that follow as well by chance, of as many in the neighbourhood, is multiplied along the line, and by their number;
    Fisher's method says what such a product is worth.

    Parameters
    ----------
    pixels : (n,) int64
        Numbers of pixels, piece after piece; their order within a piece changes.
    ends : (m,) int64
        Where each piece ends.
    rows : int
        Of the bitmask.
    least : int
        Number of pixels that such a line has at least, px; longer bent pieces are looked at in parts.

    Returns
    -------
    (m,) bool
    """
    found = np.zeros(len(ends), dtype=np.bool_)
    nodes, pieces = _describe(pixels, ends, rows, least)
    count = len(nodes)
    if count < 2:
        return found
    chances, pairs = _find_pairs(nodes, pieces, least)
    best = np.full((count, 2), np.inf)
    for k in range(len(pairs)):
        i, j, side, other_side = pairs[k]
        best[i, side] = min(best[i, side], chances[k, 0])
        best[j, other_side] = min(best[j, other_side], chances[k, 0])
    parent = np.arange(count)
    links = np.zeros(count, dtype=np.int64)  # of a line, at its root
    evidence = np.zeros(count)  # in nats
    for k in range(len(pairs)):
        i, j, side, other_side = pairs[k]
        chance = chances[k, 0]
        if chance >= 1.0 or chance > (1.0 + _EXACT) * min(best[i, side], best[j, other_side]):
            continue
        a, b = find_root(parent, i), find_root(parent, j)
        if a != b:
            parent[max(a, b)] = min(a, b)
            evidence[min(a, b)] = evidence[a] + evidence[b] - math.log(chance)
            nodes[min(a, b), _SIZE] = nodes[a, _SIZE] + nodes[b, _SIZE]
            links[min(a, b)] = links[a] + links[b] + 1
    for i in range(count):
        root = find_root(parent, i)
        expected = count * _tail(evidence[root], links[root])
        found[pieces[i]] |= nodes[root, _SIZE] >= least and expected <= _CHANCE * (1.0 + _EXACT)
    return found
