"""Knot diagrams of cables: codes, invariants, and what is left to untangle."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations, product
from typing import Any, TypeVar

import numpy.typing as npt

from dloftbs.data.curve import BSplineCurve
from dloftbs.data.frame_result import FrameResult
from dloftbs.data.tracks import Track
from dloftbs.errors import InputError
from dloftbs.support.values import check_flag, check_integer, check_number, set_fields
from dloftbs.topology.codes import GaussCode, PDCode, from_gauss_code, from_pd_code, gauss_code_of, pd_code_of
from dloftbs.topology.crossing_passes import passes_of_curves
from dloftbs.topology.diagram_fields import check_sequence, checked_fields
from dloftbs.topology.end_moves import EndMove, next_end_move
from dloftbs.topology.knot_table import Polynomial
from dloftbs.topology.knot_type import alexander_polynomial, is_knotted, is_linked, name_of
from dloftbs.topology.planar_map import PlanarMap
from dloftbs.topology.reidemeister import Move, reduce, simplify
from dloftbs.topology.result_passes import passes_of_result

_T = TypeVar("_T")

MIN_CONFIDENCE = 0.8
"""Probability below which the order at a crossing counts as unknown.

Source: by hand, on 240 drawings of open ropes, a third of these tight: of orders stated with less, 6 of 10 are right.
"""

MIN_STRAND_CONFIDENCE = 0.5
"""Probability below which a strand rather runs otherwise.

Source: by definition.
"""

MAX_UNKNOWN = 8
"""Number of unknown orders up to which all readings are tried.

Source: bounds time; 256 readings.
"""


@dataclass(frozen=True)
class Diagram:
    """Closed and open strands in the plane, and their crossings: a knot, a link, or cables with ends.

    The properties of open strands are those of closed ones: both ends are joined over everything, which is the same as
    leading them out of the picture over everything, and then under everything. Where an order is unknown, both readings
    are tried. A property is None where these disagree, or where more than `MAX_UNKNOWN` orders would matter.

    Parameters
    ----------
    passes : tuple of tuple of int
        For each strand, the crossings that it passes, in order; each of the numbers 0, 1, ... is there twice.
    closed : tuple of bool
        Whether each strand is closed.
    turns : tuple of int
        For each crossing, 1 if the direction of its first pass is turned counter-clockwise, by less than 180 degrees,
        to that of the second one, as seen; else -1. The first pass is the one that `passes` has first.
    tops : tuple of int or None
        For each crossing, which pass lies on top, 0 or 1; None where that is not known.
    confidences : tuple of float, optional
        Probabilities of these, each 1 where they are left out.
    labels : tuple of int, optional
        Names of the crossings in what they come from, such as their indices in `FrameResult.crossings`.
    objects : tuple of int, optional
        Names of the strands, such as the indices of the detections.
    strand_confidences : tuple of float, optional
        Probabilities that the strands run like that, each 1 where they are left out. With one below
        `MIN_STRAND_CONFIDENCE`, what the strands are together is None, and what it is itself.

    Raises
    ------
    InputError
        If a value is of another type or out of range, or no curves in the plane cross like that.
    """

    passes: tuple[tuple[int, ...], ...]
    closed: tuple[bool, ...]
    turns: tuple[int, ...]
    tops: tuple[int | None, ...]
    confidences: tuple[float, ...] = ()
    labels: tuple[int, ...] = ()
    objects: tuple[int, ...] = ()
    strand_confidences: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        set_fields(self, **checked_fields(**vars(self)))
        if not self._map().is_planar():
            raise InputError(
                "no curves in the plane have these crossings: one is missing, lies at another's place, or is none, "
                f"among {self.labels}"
            )

    @classmethod
    def from_result(
        cls, result: FrameResult, objects: Sequence[int | Track] | None = None, min_confidence: float = MIN_CONFIDENCE
    ) -> Diagram:
        """Read the diagram of a frame's objects.

        Parameters
        ----------
        result : FrameResult
        objects : sequence of int or Track, optional
            Indices of the detections to read, or tracks, which are read in their direction; else all detections.
        min_confidence : float
            Probability below which the order at a crossing counts as unknown; an order that comes without one is sure.

        Raises
        ------
        InputError
            If an object is not seen in this frame, or its curves do not cross as `FrameResult.crossings` says.
        """
        return cls(**passes_of_result(result, objects, check_number("min_confidence", min_confidence, 0.0, 1.0)))

    @classmethod
    def from_curves(
        cls, curves: Sequence[BSplineCurve | npt.ArrayLike], closed: bool | Sequence[bool] | None = None
    ) -> Diagram:
        """Project curves in space along their z axis; a larger z lies on top.

        In a camera's frame, whose z axis points away, the diagram is that seen from behind: orders are exchanged, and
        what does not depend on the side is the same, such as knots, signs and linking numbers.

        Parameters
        ----------
        curves : sequence of BSplineCurve or array_like (n, 3)
        closed : bool or sequence of bool, optional
            Whether the curves are closed; else splines know it, and points are open.

        Raises
        ------
        InputError
            If a curve has another shape, or the view is not a general one, in which curves meet at points alone.
        """
        return cls(**passes_of_curves(curves, closed))

    @classmethod
    def from_gauss_code(cls, code: Sequence[Sequence[int]], signs: Sequence[int]) -> Diagram:
        """Build closed strands from a signed Gauss code, as `gauss_code` and `signs` give it.

        Raises
        ------
        InputError
            If the code is none.
        """
        return cls._of_map(from_gauss_code(code, signs), len(code))

    @classmethod
    def from_pd_code(cls, code: Sequence[Sequence[int]]) -> Diagram:
        """Build closed strands from a planar-diagram code: for each crossing its four edges, counter-clockwise.

        The first is that by which the strand below comes in. A strand that lies over all others has no direction in
        such a code, and gets one.

        Raises
        ------
        InputError
            If the code is none.
        """
        diagram = from_pd_code([check_sequence("code", one) for one in check_sequence("code", code)])
        return cls._of_map(diagram, len({strand for pair in diagram.strands.values() for strand in pair}))

    @classmethod
    def _of_map(cls, diagram: PlanarMap, count: int, **names: Any) -> Diagram:
        """Return the diagram of the strands of a map, and what else is known of them."""
        walks = [diagram.walk(strand) for strand in range(count)]
        labels = sorted(diagram.signs)
        first = {c: level for walk in reversed(walks) for c, level in reversed(walk)}
        return cls(
            tuple([tuple([labels.index(c) for c, _ in walk]) for walk in walks]),
            tuple([-2 * strand - 1 not in diagram.mate for strand in range(count)]),
            tuple([diagram.signs[c] * (2 * first[c] - 1) for c in labels]),
            tuple([None if c in diagram.unknown else 1 - first[c] for c in labels]),
            labels=tuple(labels),
            **names,
        )

    def _changed(self, diagram: PlanarMap) -> Diagram:
        """Return the diagram of a map that was made from that of this one."""
        known = dict(zip(self.labels, self.confidences, strict=True))
        return self._of_map(
            diagram,
            len(self.passes),
            confidences=tuple([known.get(label, 1.0) for label in sorted(diagram.signs)]),
            objects=self.objects,
            strand_confidences=self.strand_confidences,
        )

    def _walks(self) -> list[list[tuple[int, int]]]:
        """Return for each strand the labels of the crossings, and 1 where it runs above; a guess where unknown."""
        seen: set[int] = set()
        walks: list[list[tuple[int, int]]] = []
        for strand in self.passes:
            walks.append([])
            for number in strand:
                walks[-1].append((self.labels[number], int((number in seen) == bool(self.tops[number]))))
                seen.add(number)
        return walks

    def _map(self) -> PlanarMap:
        """Return the planar map, in which the first pass lies on top where that is not known."""
        unknown = frozenset(label for label, top in zip(self.labels, self.tops, strict=True) if top is None)
        signs = {c: -turn if top else turn for c, turn, top in zip(self.labels, self.turns, self.tops, strict=True)}
        return PlanarMap.from_walks(self._walks(), self.closed, signs, unknown)

    @property
    def is_open(self) -> bool:
        """True if a strand has ends."""
        return not all(self.closed)

    def part(self, strands: Sequence[int]) -> Diagram:
        """Return the diagram of some of the strands alone, by their numbers, in order.

        Raises
        ------
        InputError
            If there is no such strand.
        """
        chosen = sorted(
            {check_integer("a strand", one, 0, len(self.passes) - 1) for one in check_sequence("strands", strands)}
        )
        kept = [number for number, owners in enumerate(self._owners) if {*owners} <= {*chosen}]
        return Diagram(
            tuple([tuple([kept.index(number) for number in self.passes[one] if number in kept]) for one in chosen]),
            tuple([self.closed[one] for one in chosen]),
            tuple([self.turns[number] for number in kept]),
            tuple([self.tops[number] for number in kept]),
            tuple([self.confidences[number] for number in kept]),
            tuple([self.labels[number] for number in kept]),
            tuple([self.objects[one] for one in chosen]),
            tuple([self.strand_confidences[one] for one in chosen]),
        )

    def close(self, over: bool) -> Diagram:
        """Join both ends of each open strand over everything, or under everything, by as few crossings as there can be.

        Raises
        ------
        InputError
            If `over` is neither True nor False.
        """
        diagram = self._map()
        diagram.close(check_flag("over", over))
        return self._changed(diagram)

    def simplify(self) -> Simplified:
        """Remove crossings by Reidemeister's moves, as far as they are found; the ends of open strands stay in place.

        Returns
        -------
        Simplified
            The diagram of what remains, and the moves in order.
        """
        return self._simplified

    @property
    def writhe(self) -> int | None:
        """Sum of the signs of the crossings as they are drawn; None where an order or a strand is unknown."""
        return sum(self._map().signs.values()) if self._runs_as_drawn and None not in self.tops else None

    @property
    def signs(self) -> tuple[int, ...] | None:
        """For each crossing of `gauss_code`, in the order of its number, 1 if it is right-handed and -1 if not."""
        return None if self._drawn is None else tuple(self._drawn._map().signs.values())

    @property
    def gauss_code(self) -> GaussCode | None:
        """For each strand the crossings that it passes, numbered from 1 on, negative below: see `signs`.

        Of open strands it is that of `close`, over everything.
        """
        return None if self._drawn is None else gauss_code_of(self._drawn._walks(), self._drawn.labels)

    @property
    def pd_code(self) -> PDCode | None:
        """For each crossing its four edges, counter-clockwise from that by which the lower strand comes in.

        Edges are numbered from 1 on, along each strand. Of open strands it is that of `close`, over everything.
        """
        drawn = self._drawn
        return None if drawn is None else pd_code_of(drawn._map(), drawn._walks(), drawn.labels)

    @cached_property
    def _drawn(self) -> Diagram | None:
        """The closed diagram that the codes are of.

        None where an order or a strand is unknown, or both ways of closing disagree.
        """
        if None in self.tops or not self._runs_as_drawn:
            return None
        if not self.is_open:
            return self
        agree = self.alexander_polynomial is not None and None not in self.linking_numbers.values()
        return self.close(True) if agree and self.is_knotted is not None else None

    @property
    def _runs_as_drawn(self) -> bool:
        """True if no strand rather runs otherwise."""
        return min(self.strand_confidences, default=1.0) >= MIN_STRAND_CONFIDENCE

    @cached_property
    def _simplified(self) -> Simplified:
        diagram, moves = simplify(self._map())
        return Simplified(self._changed(diagram), tuple(moves))

    @property
    def _reduced(self) -> Diagram:
        return self._simplified.diagram

    def _readings(self) -> Iterator[PlanarMap]:
        """Yield closed diagrams of all readings; none where too many orders are unknown, or a strand itself."""
        tops = self._reduced.tops
        if tops.count(None) > MAX_UNKNOWN or not self._runs_as_drawn:
            return
        for orders in product(*((0, 1) if top is None else (top,) for top in tops)):
            diagram = replace(self._reduced, tops=orders)._map()
            for over in (True, False)[: 1 + self.is_open]:
                reading = diagram.copy()
                reading.close(over)
                reduce(reading, slides=0)
                yield reading

    def _agreed(self, measure: Callable[[PlanarMap], _T]) -> _T | None:
        """Return what all readings give, or None; those after the first disagreement are not made."""
        readings = map(measure, self._readings())
        first = next(readings, None)
        return first if all(one == first for one in readings) else None

    @cached_property
    def alexander_polynomial(self) -> Polynomial | None:
        """Coefficients of the Alexander polynomial in one variable, the lowest power first, the first one positive.

        ``(1,)`` of no knot, empty of strands that can be pulled apart; the same of a knot and its mirror image.
        """
        return self._agreed(self._polynomial)

    def _polynomial(self, reading: PlanarMap) -> Polynomial:
        crossed = {strand for pair in reading.strands.values() for strand in pair}
        return () if len(crossed) < len(self.passes) > 1 else alexander_polynomial(reading)

    @property
    def determinant(self) -> int | None:
        """Absolute value of the Alexander polynomial at -1: 1 of no knot, 0 of strands that can be pulled apart."""
        polynomial = self.alexander_polynomial
        return None if polynomial is None else abs(sum(one * (-1) ** power for power, one in enumerate(polynomial)))

    @cached_property
    def linking_numbers(self) -> dict[tuple[int, int], int | None]:
        """For each two strands, half the sum of the signs of their crossings; None where that is not known."""
        crossed = set(self._owners)
        unsure = {i for i, sure in enumerate(self.strand_confidences) if sure < MIN_STRAND_CONFIDENCE}
        return {
            pair: self.part(pair)._agreed(_linking_number) if unsure & {*pair} or pair in crossed else 0
            for pair in combinations(range(len(self.passes)), 2)
        }

    @cached_property
    def _owners(self) -> list[tuple[int, int]]:
        """For each crossing, the strands of its first pass and its second one."""
        owners: list[list[int]] = [[] for _ in self.turns]
        for strand, numbers in enumerate(self.passes):
            for number in numbers:
                owners[number].append(strand)
        return [(first, second) for first, second in owners]

    @cached_property
    def is_knotted(self) -> bool | None:
        """True if a strand is knotted by itself; None where that depends on what is not known."""
        if len(self.passes) == 1:
            return self._agreed(is_knotted)
        return _any([strand.is_knotted for strand in self._strands])

    @cached_property
    def _strands(self) -> list[Diagram]:
        """Each strand alone."""
        return [self.part([strand]) for strand in range(len(self.passes))]

    @cached_property
    def is_tangled(self) -> bool | None:
        """True if a strand is knotted or hooked to another one; None where that depends on what is not known.

        A strand that lies over all others, or under all others, is hooked to none of them.
        """
        if len(self.passes) < 2:
            return self.is_knotted
        rest = self._reduced
        left = list(range(len(self.passes)))
        while free := [strand for strand, levels in rest._levels(left).items() if len(levels) < 2]:
            left.remove(free[0])
        if len(left) < len(self.passes):
            return _any([rest.part(left).is_tangled, self.is_knotted])
        return _any([self._agreed(is_linked), self.is_knotted])

    def _levels(self, strands: Sequence[int]) -> dict[int, set[Any]]:
        """Return for each strand where it crosses others of these: below, above, or if unknown, by itself."""
        levels: dict[int, set[Any]] = {strand: set() for strand in strands}
        for number, (top, owners) in enumerate(zip(self.tops, self._owners, strict=True)):
            if owners[0] != owners[1] and levels.keys() >= set(owners):
                for place, owner in enumerate(owners):
                    levels[owner].add(("unknown", number) if top is None else top == place)
        return levels

    @property
    def name(self) -> str | None:
        """Name of the knot in Rolfsen's table, of one strand of up to seven crossings: ``0_1`` of no knot.

        A knot and its mirror image have one name; the sign of the writhe after `simplify` tells these apart. None
        where that is not known, and of several strands and larger knots.
        """
        return self._agreed(name_of) if len(self.passes) == 1 else None

    @property
    def probability(self) -> float:
        """Probability that all strands and orders are right; one order that is unknown is so in half of the cases."""
        orders = [0.5 if top is None else max(sure, 0.5) for top, sure in zip(self.tops, self.confidences, strict=True)]
        return math.prod(orders) * math.prod(self.strand_confidences)

    @cached_property
    def next_move(self) -> EndMove | None:
        """The end to draw back through the crossing next to it, so that the fewest crossings remain.

        After `simplify`, of the cables as they lie; None where no crossings remain, or no ends, or a strand is unknown.
        """
        return next_end_move(self._reduced._map(), self.closed, self.objects) if self._runs_as_drawn else None

    def to_dict(self) -> dict[str, Any]:
        """Return the answers as plain values, ready for JSON."""
        simplified, following, crossed = self.simplify(), self.next_move, set(self._owners)
        code, edges = self.gauss_code, self.pd_code
        return {
            "objects": list(self.objects),
            "crossings": list(self.labels),
            "gauss_code": None if code is None else [list(strand) for strand in code],
            "pd_code": None if edges is None else [list(crossing) for crossing in edges],
            "writhe": self.writhe,
            "linking_numbers": [
                [self.objects[a], self.objects[b], number]
                for (a, b), number in self.linking_numbers.items()
                if (a, b) in crossed
            ],
            "alexander_polynomial": None if self.alexander_polynomial is None else list(self.alexander_polynomial),
            "determinant": self.determinant,
            "is_knotted": self.is_knotted,
            "is_tangled": self.is_tangled,
            "names": [strand.name for strand in self._strands],
            "probability": self.probability,
            "remaining_crossings": list(simplified.diagram.labels),
            "moves": [{"kind": move.kind, "crossings": list(move.crossings)} for move in simplified.moves],
            "next_move": None if following is None else vars(following).copy(),
        }


@dataclass(frozen=True)
class Simplified:
    """Result of `Diagram.simplify`.

    Parameters
    ----------
    diagram : Diagram
        The crossings that remain, with the labels that they had.
    moves : tuple of Move
        The moves that lead there, in order.
    """

    diagram: Diagram
    moves: tuple[Move, ...]


def _any(found: Sequence[bool | None]) -> bool | None:
    """Return whether one is true, if that is known."""
    if True in found:
        return True
    return None if None in found else False


def _linking_number(reading: PlanarMap) -> int:
    return sum(reading.signs[c] for c, pair in reading.strands.items() if pair[0] != pair[1]) // 2
