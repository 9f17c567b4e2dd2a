"""Reidemeister's moves, and the simplification of a diagram by them."""

from __future__ import annotations

import random
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass

from dloftbs.topology.planar_map import Orbit, PlanarMap

_SLIDES = 100
"""Number of diagrams that are tried before no series of third moves is said to help.

Source: bounds time.
"""


_DESCENTS = 10
"""Number of simplifications that begin with moves at random.

Source: bounds time.
"""

_STEPS = 50
"""Number of moves at random that these begin with.

Source: bounds time.
"""


@dataclass(frozen=True)
class Move:
    """Step of a simplification.

    Parameters
    ----------
    kind : str
        ``"I"``, ``"II"`` or ``"III"`` of Reidemeister.
    crossings : tuple of int
        Labels of the crossings that it removes, or slides over each other in a third move.
    """

    kind: str
    crossings: tuple[int, ...]


class MovableFaces:
    """A map with the faces that a move removes or turns over, which each move keeps up to date around itself."""

    __slots__ = ("_of_dart", "_order", "diagram")

    def __init__(self, diagram: PlanarMap) -> None:
        self.diagram = diagram
        self._order = {dart: place for place, dart in enumerate(diagram.mate)}
        self._of_dart: dict[int, Orbit] = {}
        self._find(diagram.mate)

    def copy(self) -> MovableFaces:
        """Return a map of its own, with its faces."""
        other = MovableFaces.__new__(MovableFaces)
        other.diagram, other._order, other._of_dart = self.diagram.copy(), self._order, self._of_dart.copy()
        return other

    def sorted(self) -> list[Orbit]:
        """Return the faces, the smallest first, and else in the order of the darts."""
        faces = [face for dart, face in self._of_dart.items() if face[0] == dart]
        return sorted(faces, key=lambda face: (len(face), self._order[face[0]]))

    def move(self, face: Orbit) -> Move:
        """Remove the crossings of a face, or exchange on each strand of a triangle the two that it passes there."""
        diagram, mate, changed = self.diagram, self.diagram.mate, set[int]()
        for dart in face:
            if len(face) < 3:
                slots = range(dart & ~3, (dart & ~3) + 4)
                changed.update(slots, [mate[slot] for slot in slots])
                diagram.erase(dart >> 2)
                continue
            into = mate[dart]
            before, after = mate[dart ^ 2], mate[into ^ 2]
            if before != into ^ 2:
                diagram.link(before, into)
                diagram.link(into ^ 2, dart ^ 2)
                diagram.link(dart, after)
                changed.update((before, into, into ^ 2, dart ^ 2, dart, after))
        for dart in changed:
            for other in self._of_dart.get(dart, ()):
                del self._of_dart[other]
        self._find([dart for dart in changed if dart in mate])
        return Move("I" * len(face), tuple([dart >> 2 for dart in face]))

    def _find(self, darts: Iterable[int]) -> None:
        """Find the faces through some darts, of one, two or three crossings.

        Of a larger one than a loop, one strand lies over the others: an edge runs above at both of its ends, or below.
        """
        mate, of_dart, order = self.diagram.mate, self._of_dart, self._order
        for first in darts:
            face, dart = [first], mate[first]
            for _ in range(3):
                if dart < 0 or (dart := dart - 1 if dart & 3 else dart + 3) == first:
                    break
                face.append(dart)
                dart = mate[dart]
            else:
                continue
            if dart < 0 or first in of_dart:
                continue
            crossings = {dart >> 2 for dart in face}
            if len(crossings) == len(face) and (
                len(face) == 1
                or (any(not (dart ^ mate[dart]) & 1 for dart in face) and self.diagram.unknown.isdisjoint(crossings))
            ):
                start = face.index(min(face, key=order.__getitem__))
                face = face[start:] + face[:start]
                of_dart.update(dict.fromkeys(face, face))


def simplify(diagram: PlanarMap) -> tuple[PlanarMap, list[Move]]:
    """Return the map with the fewest crossings that moves were found to, and these; ends of strands stay in place."""
    given = MovableFaces(diagram)
    best = given.copy()
    done = _reduce(best, _SLIDES)
    for seed in range(_DESCENTS):
        if _is_minimal(best.diagram):
            break
        other, chance, moves = given.copy(), random.Random(seed), list[Move]()
        while len(moves) < _STEPS and (faces := other.sorted()):
            moves.append(other.move(chance.choice(faces)))
        moves += _reduce(other, _SLIDES)
        if len(other.diagram.signs) < len(best.diagram.signs):
            best, done = other, moves
    return best.diagram, done


def _is_minimal(diagram: PlanarMap) -> bool:
    """Say whether it is known to have the fewest crossings: it alternates, and no face meets a crossing twice.

    Source: L. Kauffman, K. Murasugi, M. Thistlethwaite, 1987.
    """
    met = [[dart >> 2 for dart in face if dart >= 0] for face in diagram.faces()]
    alternates = all((dart ^ mate) & 1 for dart, mate in diagram.mate.items() if dart >= 0 <= mate)
    return alternates and all(len(set(face)) == len(face) for face in met)


def reduce(diagram: PlanarMap, slides: int = _SLIDES) -> list[Move]:
    """Remove crossings by the shortest series of moves that removes one, until there is none, and return these."""
    return _reduce(MovableFaces(diagram), slides)


def _reduce(movable: MovableFaces, slides: int) -> list[Move]:
    moves = list[Move]()
    while series := _series(movable, slides):
        moves += [movable.move(face) for face in series]
    return moves


def _series(movable: MovableFaces, slides: int) -> list[Orbit]:
    """Return the faces of the shortest series of moves that removes crossings; third moves make `slides` maps."""
    faces = movable.sorted()
    if faces and len(faces[0]) < 3:
        return faces[:1]
    queue: deque[tuple[MovableFaces, list[Orbit], list[Orbit]]] = deque([(movable, faces, [])])
    # Third moves neither add nor remove darts: the mates of all maps are in the same order.
    seen = {tuple(movable.diagram.mate.values())}
    while queue:
        before, triangles, series = queue.popleft()
        for face in triangles:
            after = before.copy()
            after.move(face)
            key = tuple(after.diagram.mate.values())
            if key in seen:
                continue
            if len(seen) >= slides:
                return []
            seen.add(key)
            faces = after.sorted()
            if faces and len(faces[0]) < 3:
                return [*series, face, faces[0]]
            queue.append((after, faces, [*series, face]))
    return []
