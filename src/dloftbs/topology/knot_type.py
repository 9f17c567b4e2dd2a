"""Knot types of closed strands whose orders are known: polynomials, and what these say with the moves."""

from __future__ import annotations

from collections import Counter

from dloftbs.topology.knot_table import KNOTS, TABLED_CROSSINGS, Polynomial
from dloftbs.topology.planar_map import PlanarMap
from dloftbs.topology.reidemeister import simplify

_TRIVIAL_CROSSINGS = 10
"""Number of crossings up to which a diagram with the polynomial 1 is no knot.

Source: the least knots with that polynomial, of J. H. Conway and of S. Kinoshita and H. Terasaka, have 11 crossings.
"""


def is_knotted(reading: PlanarMap) -> bool | None:
    """Say whether one closed strand is knotted; None where no move and no polynomial tells."""
    if alexander_polynomial(reading) != (1,):
        return True
    return False if _has_at_most(reading, _TRIVIAL_CROSSINGS) else None


def is_linked(reading: PlanarMap) -> bool | None:
    """Say whether closed strands are hooked to each other; None where no move and no polynomial tells."""
    if not _is_crossed(reading):
        return False
    if _has_linking_number(reading):
        return True
    # Strands of two parts can be pulled apart, so that the polynomial of both together says nothing.
    if any(_is_crossed(part) and alexander_polynomial(part) for part in _parts(reading)):
        return True
    return None if _is_crossed(simplify(reading)[0]) else False


def _is_crossed(reading: PlanarMap) -> bool:
    return any(below != above for below, above in reading.strands.values())


def _has_linking_number(reading: PlanarMap) -> bool:
    """Say whether the linking number of any two strands is other than zero."""
    sums: Counter[frozenset[int]] = Counter()
    for c, strands in reading.strands.items():
        if strands[0] != strands[1]:
            sums[frozenset(strands)] += reading.signs[c]
    return any(sums.values())


def _parts(reading: PlanarMap) -> list[PlanarMap]:
    """Return the map of each connected part."""
    parts = []
    for darts in reading.parts():
        part = reading.copy()
        for c in reading.signs.keys() - {dart >> 2 for dart in darts}:
            part.erase(c)
        parts.append(part)
    return parts


def name_of(reading: PlanarMap) -> str | None:
    """Return the name of the knot that one closed strand is; None if it has more crossings than the table."""
    name = KNOTS.get(alexander_polynomial(reading))
    return name if name is not None and _has_at_most(reading, TABLED_CROSSINGS) else None


def _has_at_most(reading: PlanarMap, crossings: int) -> bool:
    """Say whether simplification comes down to a number of crossings."""
    return len(reading.signs) <= crossings or len(simplify(reading)[0].signs) <= crossings


def alexander_polynomial(diagram: PlanarMap) -> Polynomial:
    """Return the coefficients of the Alexander polynomial in one variable of closed strands, the lowest power first.

    The first one is positive; of strands that can be pulled apart there are none. It is a minor of Fox's matrix, which
    has a column for each arc from one underpass to the next and a row for each crossing. Its value at one power of two
    that no coefficient comes near has all coefficients as digits.

    Source: R. H. Crowell and R. H. Fox, Introduction to Knot Theory, 1963.
    """
    bits = 2 * len(diagram.signs) + 2
    t = 1 << bits
    rows = {c: [0] * len(diagram.signs) for c in diagram.signs}
    arc = 0
    for strand in sorted({strand for pair in diagram.strands.values() for strand in pair}):
        walk = diagram.walk(strand)
        below = [place for place, (_, level) in enumerate(walk) if not level]
        if not below:
            return ()  # it lies over all others
        first, last = arc, arc + len(below) - 1
        for c, level in walk[below[-1] + 1 :] + walk[: below[-1] + 1]:
            if level:
                rows[c][arc] += t - 1
                continue
            before, after = (1, -t) if diagram.signs[c] > 0 else (-t, 1)
            rows[c][arc] += before
            arc = arc + 1 if arc < last else first
            rows[c][arc] += after
        arc = last + 1
    return _digits(determinant([row[:-1] for row in rows.values()][:-1]), bits)


def determinant(rows: list[list[int]]) -> int:
    """Return the determinant of a matrix of integers, exactly: by E. H. Bareiss' elimination, 1968.

    Each pivot is one that fills the fewest zeros, after H. M. Markowitz, 1957, as Fox's matrix has three entries a row.
    A row with no entry in the pivot's column waits: it stays that of an earlier step, whose pivot then divides it.
    """
    left = [({j: value for j, value in enumerate(row) if value}, 1) for row in rows]
    columns, sign, divisor = list(range(len(rows))), 1, 1
    while left:
        counts = Counter(j for row, _ in left for j in row)
        entries = [
            ((len(row) - 1) * (counts[j] - 1), abs(value), i, j)
            for i, (row, _) in enumerate(left)
            for j, value in row.items()
        ]
        if not entries:
            return 0
        _, _, i, j = min(entries)
        sign *= (-1) ** (i + columns.index(j))
        columns.remove(j)
        top, since = left.pop(i)
        top = {column: value * divisor // since for column, value in top.items()}
        divisor = top.pop(j)
        for number, (row, since) in enumerate(left):
            if head := row.pop(j, 0):
                values = {k: (row.get(k, 0) * divisor - head * top.get(k, 0)) // since for k in row | top}
                left[number] = ({k: value for k, value in values.items() if value}, divisor)
    return sign * divisor


def _digits(value: int, bits: int) -> Polynomial:
    """Return the digits of a number in the base of a power of two, around zero, without zeros at both ends."""
    digits, half = [], 1 << (bits - 1)
    while value:
        digit = ((value + half) & ((1 << bits) - 1)) - half
        digits.append(digit)
        value = (value - digit) >> bits
    while digits and not digits[0]:
        digits.pop(0)
    return tuple([-digit for digit in digits] if digits and digits[0] < 0 else digits)
