"""Untangling by drawing ends back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from dloftbs.topology.planar_map import PlanarMap
from dloftbs.topology.reidemeister import reduce


@dataclass(frozen=True)
class EndMove:
    """End of a cable to draw back through the crossing next to it.

    Parameters
    ----------
    object : int
        Index of the detection, as in `Diagram.objects`.
    end : int
        0 for the end at ``u = 0``, 1 for that at ``u = 1``.
    crossing : int
        Label of the crossing, its index in `FrameResult.crossings`.
    over : bool or None
        True if the end lies over the other strand there, and can be lifted back; False if it must be drawn back from
        underneath; None where that is not known.
    """

    object: int
    end: int
    crossing: int
    over: bool | None


def next_end_move(rest: PlanarMap, closed: Sequence[bool], objects: Sequence[int]) -> EndMove | None:
    """Return the end to draw back so that the fewest crossings remain; of equal ones, one that lies on top.

    Parameters
    ----------
    rest : PlanarMap
        Simplified map.
    closed : sequence of bool
        Whether each strand is closed.
    objects : sequence of int
        Names of the strands.
    """
    found = []
    for strand, name in enumerate(objects):
        walk = [] if closed[strand] else rest.walk(strand)
        for end, (crossing, level) in enumerate([walk[0], walk[-1]] if walk else []):
            after = rest.copy()
            after.erase(crossing)
            reduce(after, slides=0)
            over = None if crossing in rest.unknown else level == 1
            found.append((len(after.signs), not over, EndMove(name, end, crossing, over)))
    return min(found, key=lambda one: one[:2])[2] if found else None
