"""Planar map of a diagram: its crossings as a graph in the plane.

Darts are half-edges: that of crossing ``c`` in slot ``s`` is ``4 * c + s``. The four slots of a crossing follow each
other counter-clockwise, as seen, from that by which the strand below comes in; the odd ones belong to the strand above.
Open ends are negative darts, ``-2k - 1`` where strand ``k`` starts and ``-2k - 2`` where it stops. Two darts that an
edge joins are mates.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from typing import TypeAlias

Orbit: TypeAlias = list[int]
"""Darts around a face, each with that face on its left."""


class PlanarMap:
    """Crossings and the edges between them.

    Attributes
    ----------
    mate : dict of int to int
        The other dart of each dart's edge.
    signs : dict of int to int
        For each crossing, 1 if it is right-handed and -1 if not.
    strands : dict of int to (int, int)
        For each crossing, the numbers of the strands below and above.
    unknown : frozenset of int
        Crossings whose order is a guess: no move relies on it.
    """

    __slots__ = ("mate", "signs", "strands", "unknown")

    def __init__(
        self,
        mate: dict[int, int],
        signs: dict[int, int],
        strands: dict[int, tuple[int, int]],
        unknown: frozenset[int] = frozenset(),
    ) -> None:
        self.mate, self.signs, self.strands, self.unknown = mate, signs, strands, unknown

    @classmethod
    def from_walks(
        cls,
        walks: Sequence[Sequence[tuple[int, int]]],
        closed: Sequence[bool],
        signs: Mapping[int, int],
        unknown: frozenset[int] = frozenset(),
    ) -> PlanarMap:
        """Build the map of strands, each as `walk` returns it."""
        owner = {one: strand for strand, walk in enumerate(walks) for one in walk}
        diagram = cls({}, dict(signs), {c: (owner[c, 0], owner[c, 1]) for c in signs}, unknown)
        for strand, walk in enumerate(walks):
            ways = [diagram.entrance(crossing, level) for crossing, level in walk]
            outs = [way ^ 2 for way in ways]
            if closed[strand]:
                outs = outs[-1:] + outs[:-1]
            else:
                ways, outs = [*ways, -2 * strand - 2], [-2 * strand - 1, *outs]
            for out, into in zip(outs, ways, strict=True):
                diagram.link(out, into)
        return diagram

    def entrance(self, crossing: int, level: int) -> int:
        """Return the dart by which the strand below, 0, or above, 1, comes to a crossing."""
        return 4 * crossing + level * (2 + self.signs[crossing])

    def walk(self, strand: int) -> list[tuple[int, int]]:
        """Return the crossings that a strand passes, in order, each with 1 where it runs above and 0 below."""
        own = [self.entrance(c, pair.index(strand)) for c, pair in sorted(self.strands.items()) if strand in pair]
        first = dart = self.mate.get(-2 * strand - 1, own[0] if own else -1)
        found: list[tuple[int, int]] = []
        while dart >= 0 and (dart != first or not found):
            found.append((dart >> 2, dart & 1))
            dart = self.mate[dart ^ 2]
        return found

    def copy(self) -> PlanarMap:
        """Return a map of its own."""
        return PlanarMap(self.mate.copy(), self.signs.copy(), self.strands.copy(), self.unknown)

    def link(self, a: int, b: int) -> None:
        """Join two darts by an edge."""
        self.mate[a], self.mate[b] = b, a

    def erase(self, crossing: int) -> None:
        """Remove a crossing; each of its strands goes straight on."""
        for slot in (4 * crossing, 4 * crossing + 1):
            a, b = self.mate[slot], self.mate[slot + 2]
            if a != slot + 2:
                self.link(a, b)
        for slot in range(4 * crossing, 4 * crossing + 4):
            del self.mate[slot]
        del self.signs[crossing], self.strands[crossing]

    def faces(self) -> list[Orbit]:
        """Return the faces; one that encloses parts apart from it counts once for each of them."""
        mate, seen, orbits = self.mate, set(), []
        for first in mate:
            if first in seen:
                continue
            orbit, dart = [], first
            while dart not in seen:
                seen.add(dart)
                orbit.append(dart)
                other = mate[dart]
                dart = other if other < 0 else (other & ~3) | ((other - 1) & 3)
            orbits.append(orbit)
        return orbits

    def parts(self) -> list[set[int]]:
        """Return the darts of each connected part."""
        parts, left = [], set(self.mate)
        while left:
            part: set[int] = set()
            queue = [left.pop()]
            while queue:
                dart = queue.pop()
                part.add(dart)
                near = {self.mate[dart], *(dart ^ turn for turn in (1, 2, 3) if dart >= 0)} & left
                left -= near
                queue += near
            parts.append(part)
        return parts

    def is_planar(self) -> bool:
        """Say whether it can be drawn in the plane: by Euler's formula, two for each connected part."""
        nodes = len(self.signs) + sum(dart < 0 for dart in self.mate)
        return nodes - len(self.mate) // 2 + len(self.faces()) == 2 * len(self.parts())

    def close(self, over: bool) -> None:
        """Join both ends of each open strand, over everything or under everything, by as few crossings as can be."""
        for strand in sorted({(-dart - 1) // 2 for dart in self.mate if dart < 0}):
            self._join(strand, -2 * strand - 2, -2 * strand - 1, over)

    def _join(self, strand: int, start: int, stop: int, over: bool) -> None:
        route = self._route(start, stop)
        tip, last = self.mate.pop(start), self.mate[stop]
        for dart in route:
            along = dart % 2 == 1 if dart < 0 else dart != self.entrance(dart >> 2, dart & 1)
            crossed = (-dart - 1) // 2 if dart < 0 else self.strands[dart >> 2][dart & 1]
            # The dart points north from the crossing behind it, and the new strand goes from west to east.
            crossing, other = 1 + max(self.signs), self.mate[dart]
            south = (0 if along else 2) if over else 1
            base = 4 * crossing
            self.link(base + south, dart)
            self.link(base + (south ^ 2), other)
            self.link(base + (south + 3) % 4, tip)
            tip = base + (south + 1) % 4
            self.signs[crossing] = 1 if along == over else -1
            self.strands[crossing] = (crossed, strand) if over else (strand, crossed)
        del self.mate[stop]
        if last != start:  # else a closed curve without crossings
            self.link(tip, last)

    def _route(self, start: int, stop: int) -> list[int]:
        """Return the darts of the edges to cross from the face of one end to that of another, left to right.

        Ends of parts that nothing connects can be laid side by side: nothing has to be crossed.
        """
        orbits = self.faces()
        face = {dart: number for number, orbit in enumerate(orbits) for dart in orbit}
        came: dict[int, int] = {face[start]: start}
        queue = deque(came)
        while queue and face[stop] not in came:
            for dart in orbits[queue.popleft()]:
                beyond = face[self.mate[dart]]
                if beyond not in came:
                    came[beyond] = dart
                    queue.append(beyond)
        route, at = [], face[stop]
        while at in came and at != face[start]:
            route.append(came[at])
            at = face[came[at]]
        return route[::-1]
