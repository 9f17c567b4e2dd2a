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


def simplify(diagram: PlanarMap) -> tuple[PlanarMap, list[Move]]:
    """Return the map with the fewest crossings that moves were found to, and these; ends of strands stay in place."""
    best = diagram.copy()
    done = reduce(best)
    for seed in range(_DESCENTS):
        if _is_minimal(best):
            break
        other, chance, moves = diagram.copy(), random.Random(seed), list[Move]()
        while len(moves) < _STEPS and (faces := _movable(other)):
            moves.append(_move(other, chance.choice(faces)))
        moves += reduce(other)
        if len(other.signs) < len(best.signs):
            best, done = other, moves
    return best, done


def _is_minimal(diagram: PlanarMap) -> bool:
    """Say whether it is known to have the fewest crossings: it alternates, and no face meets a crossing twice.

    Source: L. Kauffman, K. Murasugi, M. Thistlethwaite, 1987.
    """
    met = [[dart >> 2 for dart in face if dart >= 0] for face in diagram.faces()]
    alternates = all((dart ^ mate) & 1 for dart, mate in diagram.mate.items() if dart >= 0 <= mate)
    return alternates and all(len(set(face)) == len(face) for face in met)


def reduce(diagram: PlanarMap, slides: int = _SLIDES) -> list[Move]:
    """Remove crossings by the shortest series of moves that removes one, until there is none, and return these."""
    moves = list[Move]()
    while series := _series(diagram, slides):
        moves += [_move(diagram, face) for face in series]
    return moves


def _series(diagram: PlanarMap, slides: int) -> list[Orbit]:
    """Return the faces of the shortest series of moves that removes crossings; third moves make `slides` maps."""
    queue: deque[tuple[PlanarMap, list[Orbit]]] = deque([(diagram, [])])
    seen = {frozenset(diagram.mate.items())}
    while queue:
        before, series = queue.popleft()
        faces = _movable(before)
        if faces and len(faces[0]) < 3:
            return [*series, faces[0]]
        for face in faces:
            after = before.copy()
            _move(after, face)
            key = frozenset(after.mate.items())
            if key not in seen and len(seen) < slides:
                seen.add(key)
                queue.append((after, [*series, face]))
    return []


def _movable(diagram: PlanarMap) -> list[Orbit]:
    """Return the faces that a move removes or turns over, the smallest first: of one, two or three crossings.

    Of a larger one than a loop, one strand lies over the others: an edge runs above at both of its ends, or below.
    """
    faces = [
        face
        for face in diagram.faces()
        if len(face) <= 3
        and min(face) >= 0
        and len({dart >> 2 for dart in face}) == len(face)
        and (
            len(face) == 1
            or (
                any(not (dart ^ diagram.mate[dart]) & 1 for dart in face)
                and diagram.unknown.isdisjoint([dart >> 2 for dart in face])
            )
        )
    ]
    return sorted(faces, key=len)


def _move(diagram: PlanarMap, face: Orbit) -> Move:
    """Remove the crossings of a face, or exchange on each strand of a triangle the two that it passes there."""
    crossings = tuple([dart >> 2 for dart in face])
    for dart in face:
        if len(face) < 3:
            diagram.erase(dart >> 2)
            continue
        into = diagram.mate[dart]
        before, after = diagram.mate[dart ^ 2], diagram.mate[into ^ 2]
        if before != into ^ 2:
            diagram.link(before, into)
            diagram.link(into ^ 2, dart ^ 2)
            diagram.link(dart, after)
    return Move("I" * len(face), crossings)
