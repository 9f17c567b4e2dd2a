"""Gauss codes and planar-diagram codes of closed strands."""

from __future__ import annotations

from collections.abc import Sequence

from dloftbs.errors import InputError
from dloftbs.support.values import check_integer
from dloftbs.topology.diagram_fields import check_sequence

Passes = tuple[tuple[int, ...], ...]


def passes_of_gauss_code(
    code: Sequence[Sequence[int]], signs: Sequence[int]
) -> tuple[Passes, tuple[int, ...], tuple[int | None, ...]]:
    """Return the passes, turns and tops of a `Diagram`.

    Raises
    ------
    InputError
        If the code is none.
    """
    tops: list[int | None] = [None] * len(check_sequence("signs", signs))
    seen: list[int] = []
    strands = [check_sequence("code", strand) for strand in check_sequence("code", code)]
    for number in (number for strand in strands for number in strand):
        crossing = abs(check_integer("a number of code", number, -len(tops), len(tops)))
        if not crossing:
            raise InputError("crossings of a Gauss code are numbered from 1 on, got 0")
        if number in seen:
            raise InputError(f"crossing {crossing} of a Gauss code must be there once above and once below")
        tops[crossing - 1] = int(number < 0) if -number not in seen else tops[crossing - 1]
        seen.append(number)
    passes = tuple([tuple([abs(number) - 1 for number in strand]) for strand in strands])
    given = [check_integer("a sign", sign, -1, 1) for sign in signs]
    turns = tuple([-sign if top else sign for sign, top in zip(given, tops, strict=True)])
    return passes, turns, tuple(tops)


def gauss_code_of(passes: Passes, tops: Sequence[int | None]) -> Passes:
    """Return for each strand the crossings that it passes, from 1 on, negative where it runs below."""
    seen: set[int] = set()
    code: list[list[int]] = []
    for strand in passes:
        code.append([])
        for number in strand:
            above = (number in seen) == bool(tops[number])
            seen.add(number)
            code[-1].append(number + 1 if above else -number - 1)
    return tuple([tuple(strand) for strand in code])


def pd_code_of(passes: Passes, code: Passes, signs: Sequence[int]) -> tuple[tuple[int, int, int, int], ...]:
    """Return for each crossing its four edges, counter-clockwise from that by which the lower strand comes in."""
    edges: list[list[int]] = [[0] * 4 for _ in signs]
    first = 1
    for strand, ways in zip(passes, code, strict=True):
        for place, (number, way) in enumerate(zip(strand, ways, strict=True)):
            into = 0 if way < 0 else (3 if signs[number] > 0 else 1)
            edges[number][into] = first + place
            edges[number][into ^ 2] = first + (place + 1) % len(strand)
        first += len(strand)
    return tuple([(a, b, c, d) for a, b, c, d in edges])
