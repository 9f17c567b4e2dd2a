"""Selection of the intersections of curves that are crossings of objects.

Two curves that share a stretch weave around each other there at random: their intersections along it show only
whether they leave it on other sides than they entered it, that is, whether their number is odd.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import boolean, float64, int64

from dloftbs.kernels.compiler import Bools, Floats, Ints, helper, kernel, read
from dloftbs.kernels.shared.selection import count_up_to
from dloftbs.kernels.shared.union_find import find_root

_NEAR_WIDTHS = 1.5
"""Distance of two intersections of the same two passes, mean widths, up to which they are one crossing.

Source: by hand; two cables that meet at 40 degrees overlap over as much.
"""

_REACH_WIDTHS = 0.5
"""Distance from another object, widths of it, within which a curve stays with that object.

Source: geometry; half a width from the axis is the border.
"""

_TURN_WIDTHS = 2.0 * math.pi * _REACH_WIDTHS
"""Length of a curve, widths, within which two of its chords are no crossing.

Source: geometry; the round of a circle with the least radius that a cable can have, half its width.
"""

_LEFT, _ENDED = -1, -2
"""Codes of a walk that left the other curve, and of one that came to the end of its own.

Source: by definition.
"""


class _Lines(NamedTuple):
    """The flattened curves, as `select_crossings` takes them."""

    points: Floats
    arc: Floats
    first: Ints
    closed: Bools
    widths: Floats


class _Hits(NamedTuple):
    """Their intersections: curves, chords, how far along these, and arc lengths, of both passes, (m, 2) each."""

    curves: Ints
    chords: Ints
    shares: Floats
    at: Floats


@helper
def _way(lines: _Lines, curve: int, difference: float) -> float:
    """Return the way along a curve between two arc lengths, the shorter one where it is a loop."""
    way = abs(difference)
    if lines.closed[curve]:
        way = min(way, lines.arc[lines.first[curve + 1] - 1] - way)
    return float(way)


@helper
def _next(lines: _Lines, curve: int, chord: int, step: int) -> int:
    """Return the chord before or after one of a curve; -1 behind its end."""
    chord += step
    if lines.first[curve] <= chord < lines.first[curve + 1] - 1:
        return chord
    if lines.closed[curve]:
        return int(lines.first[curve] if step > 0 else lines.first[curve + 1] - 2)
    return -1


@helper
def _distance(points: Floats, p: int, chord: int) -> float:
    """Return the distance of point `p` to a chord."""
    ax, ay = points[chord, 0], points[chord, 1]
    dx, dy = points[chord + 1, 0] - ax, points[chord + 1, 1] - ay
    px, py = points[p, 0] - ax, points[p, 1] - ay
    square = dx * dx + dy * dy
    share = min(max((px * dx + py * dy) / square, 0.0), 1.0) if square > 0.0 else 0.0
    return float(np.hypot(px - share * dx, py - share * dy))


@helper
def _nearest_chord(lines: _Lines, curve: int, p: int, chord: int) -> int:
    """Climb from a chord of a curve to the one nearby that is nearest to point `p`."""
    best = _distance(lines.points, p, chord)
    for step in (1, -1):
        following = _next(lines, curve, chord, step)
        while following >= 0:
            distance = _distance(lines.points, p, following)
            if not distance < best:
                break
            chord, best = following, distance
            following = _next(lines, curve, chord, step)
    return chord


@helper
def _meeting(lines: _Lines, hits: _Hits, low: int, high: int, start: int, chord: int, other: int, side: int) -> int:
    """Return another intersection on this chord with a chord near the other one, or -1."""
    foreign = hits.curves[start, 1 - side]
    near = 0.5 * lines.widths[foreign] + abs(lines.arc[other + 1] - lines.arc[other])
    for k in range(low, high):
        if k == start or hits.chords[k, side] != chord:
            continue
        if _way(lines, foreign, hits.at[k, 1 - side] - lines.arc[other]) <= near:
            return k
    return -1


@helper
def _walk(lines: _Lines, hits: _Hits, low: int, high: int, start: int, side: int, step: int) -> int:
    """Walk from an intersection along one of its curves for as long as it stays near the other.

    Returns that of the intersections `low` to `high - 1` which the walk comes to, or `_ENDED` where it comes to the end
    of its curve or to where the curve turns back on itself, or else `_LEFT`.
    """
    own, foreign = hits.curves[start, side], hits.curves[start, 1 - side]
    chord, other = hits.chords[start, side], hits.chords[start, 1 - side]
    reach_px = _REACH_WIDTHS * lines.widths[foreign]
    for n in range(lines.first[own + 1] - lines.first[own]):
        if n > 0:
            found = _meeting(lines, hits, low, high, start, chord, other, side)
            if found >= 0:
                return found
        vertex = chord + 1 if step > 0 else chord
        other = _nearest_chord(lines, foreign, vertex, other)
        if _distance(lines.points, vertex, other) > reach_px:
            return _LEFT
        if own == foreign and _way(lines, own, lines.arc[vertex] - lines.arc[other]) < _TURN_WIDTHS * lines.widths[own]:
            return _ENDED
        chord = _next(lines, own, chord, step)
        if chord < 0:
            return _ENDED
    return _LEFT


@helper
def _find_hits(lines: _Lines, chords: Ints, shares: Floats) -> _Hits:
    """Return the intersections without those of neighbouring parts of a curve."""
    n = len(chords)
    hits = _Hits(np.empty((n, 2), dtype=np.int64), np.empty((n, 2), dtype=np.int64), np.empty((n, 2)), np.empty((n, 2)))
    count = 0
    for i in range(n):
        for side in range(2):
            chord = chords[i, side]
            hits.chords[count, side], hits.shares[count, side] = chord, shares[i, side]
            hits.curves[count, side] = count_up_to(lines.first, chord) - 1
            hits.at[count, side] = lines.arc[chord] + shares[i, side] * (lines.arc[chord + 1] - lines.arc[chord])
        a, b = hits.curves[count]
        if a != b or _way(lines, a, hits.at[count, 0] - hits.at[count, 1]) >= _TURN_WIDTHS * lines.widths[a]:
            count += 1
    return _Hits(hits.curves[:count], hits.chords[:count], hits.shares[:count], hits.at[:count])


@helper
def _are_close(lines: _Lines, hits: _Hits, i: int, j: int) -> bool:
    """Return whether two intersections of the same curves lie close together along both passes."""
    a, b = hits.curves[i]
    limit = _NEAR_WIDTHS * (lines.widths[a] + lines.widths[b]) / 2.0
    if _way(lines, a, hits.at[i, 0] - hits.at[j, 0]) >= limit:
        return False
    return _way(lines, b, hits.at[i, 1] - hits.at[j, 1]) < limit


@helper
def _group(lines: _Lines, hits: _Hits) -> tuple[Ints, Bools]:
    """Return a representative of each intersection's group, and which intersections lie where a pass ends."""
    n = len(hits.chords)
    parent = np.arange(n)
    ended = np.zeros(n, dtype=np.bool_)
    low = 0
    while low < n:
        high = low + 1
        while high < n and hits.curves[high, 0] == hits.curves[low, 0] and hits.curves[high, 1] == hits.curves[low, 1]:
            high += 1
        for i in range(low, high):
            for j in range(i + 1, high):
                if _are_close(lines, hits, i, j):
                    parent[find_root(parent, j)] = find_root(parent, i)
            for side in range(2):
                for step in (1, -1):
                    found = _walk(lines, hits, low, high, i, side, step)
                    if found >= 0:
                        parent[find_root(parent, found)] = find_root(parent, i)
                    ended[i] |= found == _ENDED
        low = high
    for i in range(n):
        parent[i] = find_root(parent, i)
    return parent, ended


@helper
def _middle(lines: _Lines, hits: _Hits, members: Ints) -> int:
    """Return the member of a group from which the ways to all others are the shortest."""
    best, middle = np.inf, -1
    for i in members:
        total = 0.0
        for j in members:
            total += _way(lines, hits.curves[i, 0], hits.at[i, 0] - hits.at[j, 0])
        if total < best:
            best, middle = total, i
    return middle


@helper
def _between(values: Floats, hits: _Hits, hit: int, side: int) -> float:
    """Return what values at the vertices are at an intersection."""
    chord = hits.chords[hit, side]
    return float(values[chord] + hits.shares[hit, side] * (values[chord + 1] - values[chord]))


@kernel(
    read(float64, 2),
    read(float64, 1),
    read(float64, 1),
    read(int64, 1),
    read(boolean, 1),
    read(float64, 1),
    read(int64, 2),
    read(float64, 2),
)
def select_crossings(
    points: Floats, u: Floats, arc: Floats, first: Ints, closed: Bools, widths: Floats, chords: Ints, shares: Floats
) -> tuple[Ints, Floats, Floats, Floats]:
    """Return which intersections stand for crossings: the middle one of each odd group that no pass ends in.

    Intersections of the same two passes belong together where they lie close, or where one of the passes stays near the
    other from the one to the other.

    Parameters
    ----------
    points : (m, 2) float64
        The vertices of the flattened curves, curve after curve.
    u, arc : (m,) float64
        The parameter, and the distance from the start of each curve, px.
    first : (c + 1,) int64
        Start of each curve in these, and the end.
    closed : (c,) bool
        True for curves that are loops; their last vertex is their first.
    widths : (c,) float64
        Of the objects, px.
    chords : (n, 2) int64
        The two chords that intersect, by the index of their first vertex, those of the same two curves together.
    shares : (n, 2) float64
        Place along each of them, 0 to 1.

    Returns
    -------
    curves : (k, 2) int64
        The curves of both passes.
    places : (k, 2) float64
        ``(x, y)`` px.
    parameters, at : (k, 2) float64
        The parameter and the arc length of each pass.
    """
    lines = _Lines(points, arc, first, closed, widths)
    hits = _find_hits(lines, chords, shares)
    parent, ended = _group(lines, hits)
    n = len(parent)
    curves = np.empty((n, 2), dtype=np.int64)
    places, parameters, at = np.empty((n, 2)), np.empty((n, 2)), np.empty((n, 2))
    count = 0
    for root in range(n):
        if parent[root] != root:
            continue
        members = np.flatnonzero(parent == root)
        if len(members) % 2 == 0 or ended[members].any():
            continue
        hit = _middle(lines, hits, members)
        for side in range(2):
            curves[count, side], at[count, side] = hits.curves[hit, side], hits.at[hit, side]
            parameters[count, side] = _between(u, hits, hit, side)
        for axis in range(2):
            places[count, axis] = _between(points[:, axis], hits, hit, 0)
        count += 1
    return curves[:count], places[:count], parameters[:count], at[:count]
