"""Names of the knots of up to seven crossings."""

from __future__ import annotations

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
