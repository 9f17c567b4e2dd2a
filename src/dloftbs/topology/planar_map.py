"""Planar map of a diagram: its crossings as a graph in the plane.

Darts are half-edges: that of crossing ``c`` in slot ``s`` is ``4 * c + s``. The four slots of a crossing follow each
other counter-clockwise, as seen, and the even ones belong to the strand below. Open ends are negative
darts, ``-2k - 1`` where strand ``k`` starts and ``-2k - 2`` where it stops. Two darts that an edge joins are mates.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from typing import TypeAlias

from dloftbs.errors import InputError
from dloftbs.support.values import MAX_WHOLE, check_integer, shown

Orbit: TypeAlias = list[int]
"""Darts around a face, each with that face on its left."""


class PlanarMap:
    """Crossings and the edges between them.

    Attributes
    ----------
    mate : dict of int to int
        The other dart of each dart's edge.
    enters : dict of int to (int, int)
        The slots by which the strand below and the strand above enter each crossing.
    strands : dict of int to (int, int)
        The numbers of these strands.
    unknown : frozenset of int
        Crossings whose order is a guess: no move relies on it.
    fresh : int
        Label of the next new crossing.
    """

    __slots__ = ("enters", "fresh", "mate", "strands", "unknown")

    def __init__(
        self,
        mate: dict[int, int],
        enters: dict[int, tuple[int, int]],
        strands: dict[int, tuple[int, int]],
        unknown: frozenset[int],
        fresh: int,
    ) -> None:
        self.mate, self.enters, self.strands, self.unknown, self.fresh = mate, enters, strands, unknown, fresh

    @classmethod
    def from_passes(
        cls,
        passes: Sequence[Sequence[int]],
        closed: Sequence[bool],
        turns: Sequence[int],
        tops: Sequence[int | None],
        labels: Sequence[int],
    ) -> PlanarMap:
        """Build the map of a `Diagram`; of a crossing whose order is unknown, the first pass is laid on top."""
        seen: set[int] = set()
        diagram = cls({}, {}, {}, frozenset(), 1 + max(labels, default=-1))
        for strand, numbers in enumerate(passes):
            ways = []
            for number in numbers:
                label, above = labels[number], (number in seen) == bool(tops[number])
                seen.add(number)
                sign = turns[number] * (-1 if tops[number] else 1)
                enters = diagram.enters.setdefault(label, (0, 3 if sign > 0 else 1))
                below, over = diagram.strands.get(label, (strand, strand))
                diagram.strands[label] = (below, strand) if above else (strand, over)
                ways.append(4 * label + enters[above])
            starts = ways[-1:] if closed[strand] else [-2 * strand - 1]
            for out, into in zip([*starts, *ways], ways if closed[strand] else [*ways, -2 * strand - 2], strict=False):
                diagram.link(out ^ 2 if out >= 0 else out, into)
        diagram.unknown = frozenset(label for label, top in zip(labels, tops, strict=True) if top is None)
        return diagram

    @classmethod
    def from_pd_code(cls, code: Sequence[Sequence[int]]) -> PlanarMap:
        """Build closed strands from a planar-diagram code.

        Raises
        ------
        InputError
            If an edge is not there twice, or a strand below runs against its direction.
        """
        places: dict[int, list[int]] = {}
        for crossing, edges in enumerate(code):
            if len(edges) != 4:
                raise InputError(f"a crossing of a planar-diagram code has 4 edges, got {shown(edges)}")
            for slot, edge in enumerate(edges):
                places.setdefault(check_integer("an edge", edge, 0, MAX_WHOLE), []).append(4 * crossing + slot)
        if wrong := [edge for edge, darts in places.items() if len(darts) != 2]:
            raise InputError(f"each edge of a planar-diagram code must be there twice, {wrong[0]} is not")
        diagram = cls({}, {}, {}, frozenset(), len(code))
        for a, b in places.values():
            diagram.link(a, b)
        # Strands that run below somewhere have a direction; the others get one.
        into: dict[int, int] = {}
        along = [4 * c + (1 if edges[3] == edges[1] + 1 else 3) for c, edges in enumerate(code)]
        numbered = [dart for dart in along if code[dart >> 2][dart & 3] + 1 == code[dart >> 2][dart & 3 ^ 2]]
        starts = [*range(0, 4 * len(code), 4), *numbered, *range(1, 4 * len(code), 4)]
        for start in starts:
            if start in into or start ^ 2 in into:
                continue
            strand, dart = len(set(into.values())), start
            while dart not in into:
                if dart & 3 == 2:
                    raise InputError(f"the strand below crossing {dart >> 2} of the code runs against its direction")
                into[dart] = strand
                dart = diagram.mate[dart ^ 2]
        for c in range(len(code)):
            above = 1 if 4 * c + 1 in into else 3
            diagram.enters[c], diagram.strands[c] = (0, above), (into[4 * c], into[4 * c + above])
        return diagram

    def walk(self, strand: int) -> list[tuple[int, int]]:
        """Return the crossings that a strand passes, in order, each with 1 where it runs above and 0 below."""
        ways = [(c, level) for c, pair in sorted(self.strands.items()) for level in (0, 1) if pair[level] == strand]
        if not ways:
            return []
        first = 4 * ways[0][0] + self.enters[ways[0][0]][ways[0][1]]
        start = self.mate.get(-2 * strand - 1, first)
        found, dart = [(start >> 2, start & 1)], self.mate[start ^ 2]
        while dart >= 0 and dart != start:
            found.append((dart >> 2, dart & 1))
            dart = self.mate[dart ^ 2]
        return found

    def copy(self) -> PlanarMap:
        """Return a map of its own."""
        return PlanarMap(self.mate.copy(), self.enters.copy(), self.strands.copy(), self.unknown, self.fresh)

    def adopt(self, other: PlanarMap) -> None:
        """Become what another map is."""
        self.mate, self.enters, self.strands, self.fresh = other.mate, other.enters, other.strands, other.fresh

    def link(self, a: int, b: int) -> None:
        """Join two darts by an edge."""
        self.mate[a], self.mate[b] = b, a

    def sign(self, crossing: int) -> int:
        """Return +1 for a right-handed crossing, -1 for a left-handed one."""
        below, above = self.enters[crossing]
        return 1 if (above - below) % 4 == 3 else -1

    def erase(self, crossing: int) -> None:
        """Remove a crossing; each of its strands goes straight on."""
        for slot in (4 * crossing, 4 * crossing + 1):
            a, b = self.mate[slot], self.mate[slot + 2]
            if a != slot + 2:
                self.link(a, b)
        for slot in range(4 * crossing, 4 * crossing + 4):
            del self.mate[slot]
        del self.enters[crossing], self.strands[crossing]

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

    def is_planar(self) -> bool:
        """Say whether it can be drawn in the plane: by Euler's formula, two for each connected part."""
        root = {dart: dart for dart in self.mate}

        def find(dart: int) -> int:
            while root[dart] != dart:
                root[dart] = dart = root[root[dart]]
            return dart

        for dart, other in self.mate.items():
            root[find(dart)] = find(other)
            if dart >= 0:
                root[find(dart)] = find(dart & ~3)
        parts = sum(root[dart] == dart for dart in root)
        nodes = len(self.enters) + sum(dart < 0 for dart in self.mate)
        return nodes - len(self.mate) // 2 + len(self.faces()) == 2 * parts

    def join(self, start: int, stop: int, over: bool) -> tuple[int, ...]:
        """Join two ends of a strand, over everything or under everything, by as few crossings as there can be.

        Returns
        -------
        tuple of int
            Labels of the new crossings, in order.
        """
        tip, last = self.mate.pop(start), self.mate[stop]
        if tip == stop:  # a closed curve without crossings
            del self.mate[stop]
            return ()
        self.link(start, tip)
        route = self.route(start, stop)
        strand, added = self._strand(tip), []
        del self.mate[start]
        for dart in route:
            crossing, other = self.fresh, self.mate[dart]
            self.fresh += 1
            added.append(crossing)
            along, base = self._leaves(dart), 4 * crossing
            crossed = self._strand(dart)
            # The dart points north from the crossing behind it, and the new strand goes from west to east.
            south, east, north, west = (0, 1, 2, 3) if over else (1, 2, 3, 0)
            self.link(base + south, dart)
            self.link(base + north, other)
            self.link(base + west, tip)
            tip, enter = base + east, south if along else north
            self.enters[crossing] = (enter, west) if over else (west, enter)
            self.strands[crossing] = (crossed, strand) if over else (strand, crossed)
        del self.mate[stop]
        self.link(tip, last)
        return tuple(added)

    def route(self, start: int, stop: int) -> list[int]:
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

    def _strand(self, dart: int) -> int:
        return self.strands[dart >> 2][dart & 1] if dart >= 0 else (-dart - 1) // 2

    def _leaves(self, dart: int) -> bool:
        """Say whether a strand runs out along a dart, rather than in."""
        return self.enters[dart >> 2][dart & 1] != dart & 3 if dart >= 0 else dart % 2 == 1
