"""Reidemeister's moves, and the simplification of a diagram by them."""

from __future__ import annotations

import random
from collections import deque
from dataclasses import dataclass

from dloftbs.topology.planar_map import Orbit, PlanarMap

_SLIDES = 100
"""Number of diagrams that are tried before no series of third moves is said to help.

Source: bounds time.
"""


_DESCENTS = 10
"""Number of simplifications that begin with third moves at random.

Source: bounds time.
"""

_FAILURES = 30
"""Number of third moves in a row that remove no crossing, after which one of these stops them.

Source: bounds time.
"""


@dataclass(frozen=True)
class Move:
    """Step of a simplification.

    Parameters
    ----------
    kind : str
        ``"I"``, ``"II"`` or ``"III"`` of Reidemeister, or ``"pass"``: a stretch that lies over everything, or under
        everything, is laid where it crosses least. That is a series of second and third moves.
    crossings : tuple of int
        Labels of the crossings that it removes, or slides over each other in a third move.
    added : tuple of int
        Labels of the crossings that a pass makes.
    """

    kind: str
    crossings: tuple[int, ...]
    added: tuple[int, ...] = ()


def simplify(diagram: PlanarMap) -> list[Move]:
    """Remove as many crossings as the moves find, and return these; ends of open strands stay where they are."""
    best, done = descend(diagram)
    for seed in range(_DESCENTS):
        if is_minimal(best):
            break
        other, way = descend(diagram, random.Random(seed))
        if len(other.enters) < len(best.enters):
            best, done = other, way
    diagram.adopt(best)
    return done


def is_minimal(diagram: PlanarMap) -> bool:
    """Say whether it is known to have the fewest crossings, or cannot be searched.

    Source: a reduced alternating diagram has the fewest; L. Kauffman, K. Murasugi, M. Thistlethwaite, 1987.
    """
    return any(dart < 0 for dart in diagram.mate) or all((dart ^ other) & 1 for dart, other in diagram.mate.items())


def descend(diagram: PlanarMap, chance: random.Random | None = None) -> tuple[PlanarMap, list[Move]]:
    """Return a simpler map and the moves there: at first by third moves at random, if `chance` is given."""
    way, failures = diagram.copy(), 0
    moves = reduce(way)
    while chance is not None and failures < _FAILURES and (triangles := _triangles(way)):
        triangle = chance.choice(triangles)
        _slide(way, triangle)
        moves.append(Move("III", tuple([dart >> 2 for dart in triangle])))
        helped = reduce(way)
        moves += helped
        failures = 0 if helped else failures + 1
    while found := _lay_anew(way) or _slide_until_it_helps(way):
        moves += found + reduce(way)
    return way, moves


def shorten(diagram: PlanarMap) -> None:
    """Remove crossings by the first move, the second one and passes alone, fast."""
    reduce(diagram)
    while _lay_anew(diagram):
        reduce(diagram)


def reduce(diagram: PlanarMap) -> list[Move]:
    """Undo loops and double crossings until there are none: the first and the second move."""
    moves: list[Move] = []
    while move := _reducible(diagram):
        moves.append(move)
        for crossing in move.crossings:
            diagram.erase(crossing)
    return moves


def _reducible(diagram: PlanarMap) -> Move | None:
    for orbit in diagram.faces():
        if len(orbit) > 2 or orbit[0] < 0:
            continue
        crossings = tuple(dart >> 2 for dart in orbit)
        if len(orbit) == 1:
            return Move("I", crossings)
        a, b = orbit
        if (
            b >= 0
            and crossings[0] != crossings[1]
            and not (a ^ diagram.mate[a]) & 1
            and diagram.unknown.isdisjoint(crossings)
        ):
            return Move("II", crossings)
    return None


def _slide_until_it_helps(diagram: PlanarMap) -> list[Move]:
    """Find the shortest series of third moves after which others remove crossings, do it and return it."""
    queue: deque[tuple[PlanarMap, list[Move]]] = deque([(diagram, [])])
    seen = {frozenset(diagram.mate.items())}
    while queue and len(seen) < _SLIDES:
        before, moves = queue.popleft()
        for triangle in _triangles(before):
            after = before.copy()
            _slide(after, triangle)
            key = frozenset(after.mate.items())
            if key in seen:
                continue
            seen.add(key)
            series = [*moves, Move("III", tuple(dart >> 2 for dart in triangle))]
            if _reducible(after) is not None:
                diagram.adopt(after)
                return series
            if helped := _lay_anew(after):
                diagram.adopt(after)
                return series + helped
            queue.append((after, series))
    return []


def _triangles(diagram: PlanarMap) -> list[Orbit]:
    """Return the faces on which one strand lies over the other two, which a third move can slide."""
    return [
        orbit
        for orbit in diagram.faces()
        if len(orbit) == 3
        and min(orbit) >= 0
        and len({dart >> 2 for dart in orbit}) == 3
        and any(dart & diagram.mate[dart] & 1 for dart in orbit)
        and diagram.unknown.isdisjoint([dart >> 2 for dart in orbit])
    ]


def _slide(diagram: PlanarMap, triangle: Orbit) -> None:
    """Exchange on each strand of a triangle the two crossings that it passes there."""
    for out in triangle:
        into = diagram.mate[out]
        before, after = diagram.mate[out ^ 2], diagram.mate[into ^ 2]
        if before != into ^ 2:
            diagram.link(before, into)
            diagram.link(into ^ 2, out ^ 2)
            diagram.link(out, after)


def _lay_anew(diagram: PlanarMap) -> list[Move]:
    """Lay one stretch over or under everything where it crosses less, do it and return it.

    Only of closed strands: the ends of open ones may lie between the old place and the new one.
    """
    if diagram.unknown & diagram.enters.keys() or any(dart < 0 for dart in diagram.mate):
        return []
    for level in (1, 0):
        for strand in sorted({strand for pair in diagram.strands.values() for strand in pair}):
            own = [c for c, pair in diagram.strands.items() if strand in pair]
            if all(diagram.strands[c][1 - level] != strand for c in own):
                for crossing in own:
                    diagram.erase(crossing)
                return [Move("pass", tuple(own))]
        for first in [4 * c + (diagram.enters[c][1 - level] ^ 2) for c in diagram.enters]:
            passed, dart = [], diagram.mate[first]
            while dart & 1 == level:
                passed.append(dart >> 2)
                dart = diagram.mate[dart ^ 2]
            if passed and (move := _laid_anew(diagram, first, dart, passed, over=level == 1)):
                return [move]
    return []


def _laid_anew(diagram: PlanarMap, first: int, last: int, passed: list[int], over: bool) -> Move | None:
    """Lay the stretch from one dart to another one anew, unless it crosses no less then."""
    after, (a, b, c, d) = diagram.copy(), (-3, -2, -1, -4)
    after.link(first, a)
    after.link(diagram.mate[first], b)
    after.link(diagram.mate[last], c)
    after.link(last, d)
    for crossing in passed:
        after.erase(crossing)
    del after.mate[b], after.mate[c]
    if len(after.route(a, d)) >= len(passed):
        return None
    added = after.join(a, d, over)
    diagram.adopt(after)
    return Move("pass", tuple(passed), added)
