"""Gauss codes and planar-diagram codes of closed strands."""

from __future__ import annotations

from collections.abc import Sequence

from dloftbs.errors import InputError
from dloftbs.support.values import MAX_WHOLE, check_integer, shown
from dloftbs.topology.diagram_fields import check_sequence
from dloftbs.topology.planar_map import PlanarMap

GaussCode = tuple[tuple[int, ...], ...]
PDCode = tuple[tuple[int, int, int, int], ...]


def from_gauss_code(code: Sequence[Sequence[int]], signs: Sequence[int]) -> PlanarMap:
    """Return the map of closed strands with a signed Gauss code.

    Raises
    ------
    InputError
        If the code is none.
    """
    given = [check_integer("a sign", sign, -1, 1) for sign in check_sequence("signs", signs)]
    if 0 in given:
        raise InputError("signs must be 1 or -1, got 0")
    strands = [check_sequence("code", strand) for strand in check_sequence("code", code)]
    numbers = [check_integer("a number of code", number, -len(given), len(given)) for own in strands for number in own]
    if 0 in numbers:
        raise InputError("crossings of a Gauss code are numbered from 1 on, got 0")
    for number in range(1, len(given) + 1):
        if not numbers.count(number) == numbers.count(-number) == 1:
            raise InputError(f"crossing {number} of a Gauss code must be there once above and once below")
    walks = [[(abs(number) - 1, int(number > 0)) for number in strand] for strand in strands]
    return PlanarMap.from_walks(walks, [True] * len(walks), dict(enumerate(given)))


def from_pd_code(code: Sequence[Sequence[int]]) -> PlanarMap:
    """Return the map of closed strands with a planar-diagram code.

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
    mate = {dart: other for a, b in places.values() for dart, other in ((a, b), (b, a))}
    # Strands that run below somewhere have a direction; others run as their edges are numbered.
    rising = [dart for dart in mate if dart & 1 and code[dart >> 2][dart & 3] + 1 == code[dart >> 2][dart & 3 ^ 2]]
    into: dict[int, int] = {}
    for start in [*range(0, 4 * len(code), 4), *rising, *range(1, 4 * len(code), 4)]:
        strand, dart = len(set(into.values())), start
        while dart not in into and start ^ 2 not in into:
            if dart & 3 == 2:
                raise InputError(f"the strand below crossing {dart >> 2} of the code runs against its direction")
            into[dart] = strand
            dart = mate[dart ^ 2]
    signs = {c: 1 if 4 * c + 3 in into else -1 for c in range(len(code))}
    return PlanarMap(mate, signs, {c: (into[4 * c], into[4 * c + 2 + signs[c]]) for c in signs})


def gauss_code_of(walks: Sequence[Sequence[tuple[int, int]]], labels: Sequence[int]) -> GaussCode:
    """Return for each strand the crossings that it passes, from 1 on, negative where it runs below."""
    return tuple([tuple([(labels.index(c) + 1) * (1 if level else -1) for c, level in walk]) for walk in walks])


def pd_code_of(diagram: PlanarMap, walks: Sequence[Sequence[tuple[int, int]]], labels: Sequence[int]) -> PDCode:
    """Return for each crossing its four edges, counter-clockwise from that by which the lower strand comes in."""
    entered = [diagram.entrance(crossing, level) for walk in walks for crossing, level in walk]
    edges = {dart: number for number, way in enumerate(entered, 1) for dart in (way, diagram.mate[way])}
    return tuple([(edges[c], edges[c + 1], edges[c + 2], edges[c + 3]) for c in (4 * label for label in labels)])
