"""The figures of others, beside which measured ones stand for orientation only.

Those that the paper published (Kicki, Szymko, Walas, ICRA 2023, tables I to IV), cell by cell as it prints them, come
from other data and another machine (one core of an i7-9750H, HD images); those of peers' code by kind of difficulty
were measured on other sequences of the same kinds.
"""

from __future__ import annotations

from typing import NamedTuple

MARK = "published, on other data"
"""Origin of every published row."""
PHOTOGRAPHS = 62
"""Number of images of table II."""


class Published(NamedTuple):
    """A row of a published table: a method, a figure with its unit where one is printed, and its cells as printed."""

    method: str
    figure: str
    cells: tuple[str, ...]


def _row(method: str, figure: str, cells: str) -> Published:
    return Published(method, figure, tuple(cells.split()))


L1_PX, L2_PX, MS = "L1 px", "L2 px", "ms"

TABLE_I = (
    _row("DLOFTBs", L1_PX, "4.82±0.05 6.15±0.13 2.45±0.09 2.88±0.17 4.97±0.30 2.92±0.08 4.45±0.04"),
    _row("DLOFTBs", L2_PX, "0.88±2.35 0.39±0.12 1.67±3.13 7.08±14.58 0.56±0.03 0.72±0.07 0.99±0.02"),
    _row("DLOFTBs", MS, "38.2±6.4 34.8±4.4 30.0±5.2 33.2±10.0 39.5±4.0 26.0±2.0 35.1±2.0"),
    _row("Ariadne+", L1_PX, "8.03±4.38 12.45±16.80 30.01±32.57 29.55±0.64 54.85±71.67 117.60±38.23 -"),
    _row("Ariadne+", L2_PX, "0.51±0.8 1.99±4.71 1.22±3.18 47.59±1.55 0.74±0.23 2.63±6.60 -"),
    _row("Ariadne+", MS, "973.9±35.3 956.0±61.3 974.2±30.5 935.5±37.0 962.5±31.0 923.3±30.9 -"),
    _row("FastDLO", L1_PX, "9.17±12.8 8.98±10.32 29.3±33.2 29.1±47.5 177.6±16.6 173.7±6.5 171±13"),
    _row("FastDLO", L2_PX, "0.36±0.01 0.37±0.01 0.36±0.01 0.36±0.02 0.37±0.01 0.36±0.01 0.36±0.02"),
    _row("FastDLO", MS, "86.3±6.3 97.6±10.2 62.2±6.5 64.9±9.5 96.4±9.1 60.8±9.0 88.3±3.6"),
)
"""2D videos, scenarios 0 to 6: mean ± deviation over frames."""

TABLE_II_FIGURES = ("L3 px", "missing", "redundant", MS)
TABLE_II = (
    _row("Ariadne+", "", "45.06 9 16 421.3"),
    _row("FastDLO", "", "51.55 3 75 64.3"),
    _row("DLOFTBs", "", "27.17 3 33 39.2"),
)
"""`PHOTOGRAPHS` of several cables: the cells are those of `TABLE_II_FIGURES`."""

TABLE_III = (
    _row("CDCPD2", "L1", "6.26 7.1 6.21 5.73 15.6 5.49 6.03 5.79 19.0 11.19"),
    _row("CDCPD2", "L2", "2.73 2.85 6.55 3.87 16.6 2.83 2.76 2.5 12.3 3.79"),
    _row("CDCPD2", MS, "81 110 125 120 87 85 91 92 92 103"),
    _row("DLOFTBs", "L1", "5.05 5.31 4.41 4.5 4.07 3.79 4.69 4.51 4.79 5.23"),
    _row("DLOFTBs", "L2", "1.08 1.04 5.75 2.71 2.08 0.88 1.21 1.03 1.58 0.68"),
    _row("DLOFTBs", MS, "26 36 38 33 29 30 19 18 23 26"),
)
"""Real 3D videos, scenarios 0 to 9; the units of L1 and L2 are not printed."""

TABLE_IV = (
    _row("CDCPD2", "L3 mean", "7.94 10.62 26.8 23.9 30.4"),
    _row("CDCPD2", "L3 max", "128 75 198 82 100"),
    _row("CDCPD2", "L3 min", "1.96 2.96 2.02 2.82 2.48"),
    _row("DLOFTBs", "L3 mean", "1.59 4.22 1.99 2.42 2.47"),
    _row("DLOFTBs", "L3 max", "2.6 38.1 47.7 5.75 6.91"),
    _row("DLOFTBs", "L3 min", "1.23 1.57 1.1 1.48 1.34"),
)
"""Artificial 3D videos, scenarios 0 to 4: 0 and 1 high curvature, 1 and 2 self-intersection, 3 and 4 rapid moves; the
unit of L3 is not printed."""


class Kind(NamedTuple):
    """A method on one kind of difficulty: share of clean frames in 0..1, and median criterion 3 in px where known."""

    clean: float
    l3: float | None = None


KINDS_ORIGIN = (
    "their public programs, run once on sequences of the same kinds that another generator drew, one cable or several "
    "of 12 px in HD. They are not of the scenes of this table, and not measured again with it"
)
KINDS_METHODS = ("authors' code", "mBEST")
_KINDS_CLEAN: dict[str, tuple[float | None, float | None]] = {
    "high curvature": (0.55, 0.97),
    "one loop": (0.00, 0.78),
    "a loop that unties": (0.63, 0.98),
    "rapid moves 1": (0.97, 0.99),
    "rapid moves 2": (0.89, 0.98),
    "high curvature, noisy": (0.13, 0.0),
    "one loop, noisy": (0.04, 0.0),
    "a loop that unties, noisy": (0.36, 0.0),
    "rapid moves 1, noisy": (0.64, 0.0),
    "rapid moves 2, noisy": (0.31, 0.0),
    "high curvature, occluded": (0.53, 0.0),
    "one loop, occluded": (0.08, 0.0),
    "three cables": (None, 0.57),
    "three cables, occluded": (None, 0.00),
    "five cables": (None, 0.20),
    "five cables, noisy": (None, 0.00),
}
_KINDS_L3 = {"high curvature": (0.50, 0.78)}

KINDS: dict[tuple[str, str], Kind] = {
    (kind, method): Kind(clean, l3)
    for kind, of_kind in _KINDS_CLEAN.items()
    for method, clean, l3 in zip(KINDS_METHODS, of_kind, _KINDS_L3.get(kind, (None, None)), strict=True)
    if clean is not None
}
"""By kind, as the sequences of the suite are named, and method."""
