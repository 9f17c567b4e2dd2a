"""Alexander polynomials, and the names of knots of up to seven crossings."""

from __future__ import annotations

from dloftbs.topology.planar_map import PlanarMap

Polynomial = tuple[int, ...]

KNOTS: dict[Polynomial, str] = {
    (1,): "0_1",
    (1, -1, 1): "3_1",
    (1, -3, 1): "4_1",
    (1, -1, 1, -1, 1): "5_1",
    (2, -3, 2): "5_2",
    (2, -5, 2): "6_1",
    (1, -3, 3, -3, 1): "6_2",
    (1, -3, 5, -3, 1): "6_3",
    (1, -2, 3, -2, 1): "3_1#3_1",
    (1, -1, 1, -1, 1, -1, 1): "7_1",
    (3, -5, 3): "7_2",
    (2, -3, 3, -3, 2): "7_3",
    (4, -7, 4): "7_4",
    (2, -4, 5, -4, 2): "7_5",
    (1, -5, 7, -5, 1): "7_6",
    (1, -5, 9, -5, 1): "7_7",
    (1, -4, 5, -4, 1): "3_1#4_1",
}
"""Names in Rolfsen's table by the coefficients; of all knots with up to seven crossings no two have the same ones.

Source: D. Rolfsen, Knots and Links, 1976; a knot and its mirror image have one name.
"""

TABLED_CROSSINGS = 7
"""Number of crossings up to which a diagram's polynomial gives its name.

Source: by definition of `KNOTS`.
"""


def alexander_polynomial(diagram: PlanarMap) -> Polynomial:
    """Return the coefficients of the Alexander polynomial in one variable of closed strands, the lowest power first.

    The first one is positive; of strands that can be pulled apart there are none. It is a minor of Fox's matrix, which
    has a column for each arc from one underpass to the next and a row for each crossing. Its value at one power of two
    that no coefficient comes near has all coefficients as digits.

    Source: R. H. Crowell and R. H. Fox, Introduction to Knot Theory, 1963.
    """
    crossings = list(diagram.enters)
    arcs = {4 * c + (diagram.enters[c][0] ^ 2): number for number, c in enumerate(crossings)}
    below = {c: strands[0] for c, strands in diagram.strands.items()}
    if any(strand not in below.values() for strands in diagram.strands.values() for strand in strands):
        return ()  # one that lies over all others
    bits = 2 * len(crossings) + 2
    t = 1 << bits
    rows = []
    for c in crossings:
        row = [0] * len(crossings)
        into, above = 4 * c + diagram.enters[c][0], 4 * c + diagram.enters[c][1]
        before, after = (1, -t) if diagram.sign(c) > 0 else (-t, 1)
        row[_arc_into(diagram, arcs, into)] += before
        row[arcs[into ^ 2]] += after
        row[_arc_into(diagram, arcs, above)] += t - 1
        rows.append(row[:-1])
    return _digits(determinant(rows[:-1]), bits)


def _arc_into(diagram: PlanarMap, arcs: dict[int, int], dart: int) -> int:
    """Return the number of the arc that enters a crossing by a dart."""
    while (dart := diagram.mate[dart]) not in arcs:
        dart ^= 2
    return arcs[dart]


def determinant(rows: list[list[int]]) -> int:
    """Return the determinant of a matrix of integers, exactly: by E. H. Bareiss' elimination, 1968."""
    rows, sign, divisor = [row[:] for row in rows], 1, 1
    for k in range(len(rows) - 1):
        pivot = next((i for i in range(k, len(rows)) if rows[i][k]), None)
        if pivot is None:
            return 0
        if pivot != k:
            rows[k], rows[pivot], sign = rows[pivot], rows[k], -sign
        for row in rows[k + 1 :]:
            head = row[k]
            for j in range(k + 1, len(rows)):
                row[j] = (row[j] * rows[k][k] - head * rows[k][j]) // divisor
        divisor = rows[k][k]
    return sign * rows[-1][-1] if rows else 1


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
