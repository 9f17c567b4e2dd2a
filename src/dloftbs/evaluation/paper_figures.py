"""The figures of others, beside which measured ones stand for orientation only.

Those that the paper published (Kicki, Szymko, Walas, ICRA 2023, tables I to IV), as it prints them, come from other
data and another machine (one core of an i7-9750H, HD images); those of peers' code by kind of difficulty were measured
on other sequences of the same kinds.
"""

from __future__ import annotations

from typing import NamedTuple

MARK = "published, on other data"


class Cover(NamedTuple):
    """A row of table I or III: criteria 1 and 2, and milliseconds a frame; ranges where only these are known."""

    method: str
    scenario: str
    l1: str
    l2: str
    ms: str


class Several(NamedTuple):
    """A row of table II: criterion 3 in px, missing and redundant objects in 62 images, milliseconds an image."""

    method: str
    l3: str
    missing: str
    redundant: str
    ms: str


class Shape(NamedTuple):
    """A row of table IV: mean, largest and smallest criterion 3 over a sequence."""

    method: str
    scenario: str
    mean: str
    largest: str
    smallest: str


_TABLE_1 = (
    ("4.82", "0.88", "38.2"),
    ("6.15", "0.39", "34.8"),
    ("2.45", "1.67", "30.0"),
    ("2.88", "7.08", "33.2"),
    ("4.97", "0.56", "39.5"),
    ("2.92", "0.72", "26.0"),
    ("4.45", "0.99", "35.1"),
)
_TABLE_4 = {
    "DLOFTBs": (
        ("1.59", "2.6", "1.23"),
        ("4.22", "38.1", "1.57"),
        ("1.99", "47.7", "1.1"),
        ("2.42", "5.75", "1.48"),
        ("2.47", "6.91", "1.34"),
    ),
    "CDCPD2": (
        ("7.94", "128", "1.96"),
        ("10.62", "75", "2.96"),
        ("26.8", "198", "2.02"),
        ("23.9", "82", "2.82"),
        ("30.4", "100", "2.48"),
    ),
}

TABLE_I: tuple[Cover, ...] = (
    *(Cover("DLOFTBs", str(number), *row) for number, row in enumerate(_TABLE_1, start=1)),
    Cover("FastDLO", "all", "", "", "60 to 98"),
    Cover("Ariadne+", "all", "", "", "920 to 975"),
)
"""2D video, seven scenarios, px."""

TABLE_II: tuple[Several, ...] = (
    Several("DLOFTBs", "27.17", "3", "33", "39.2"),
    Several("FastDLO", "51.55", "3", "75", "64.3"),
    Several("Ariadne+", "45.06", "9", "16", "421.3"),
)
"""62 images of several cables, px."""

TABLE_III: tuple[Cover, ...] = (
    Cover("DLOFTBs", "all", "3.8 to 5.3", "0.7 to 5.8", "18 to 38"),
    Cover("CDCPD2", "all", "5.5 to 19", "2.5 to 16.6", "81 to 125"),
)
"""Real RGBD, ten scenarios, as ranges over these."""

TABLE_IV: tuple[Shape, ...] = tuple(
    Shape(method, str(number), *row) for method, rows in _TABLE_4.items() for number, row in enumerate(rows)
)
"""Artificial RGBD, five scenarios: 0 and 1 high curvature, 1 and 2 self-intersection, 3 and 4 rapid moves."""


class Kind(NamedTuple):
    """A method on one kind of difficulty: share of clean frames in 0..1, and median criterion 3 in px where known."""

    clean: float
    l3: float | None = None


KINDS_ORIGIN = "measured on other sequences of the same kinds"
KINDS_METHODS = ("authors' code", "mBEST", "goal")
_KINDS_CLEAN: dict[str, tuple[float | None, float | None, float]] = {
    "high curvature": (0.55, 0.97, 0.99),
    "one loop": (0.00, 0.78, 0.97),
    "a loop that unties": (0.63, 0.98, 0.99),
    "rapid moves 1": (0.97, 0.99, 1.00),
    "rapid moves 2": (0.89, 0.98, 1.00),
    "high curvature, noisy": (0.13, 0.0, 0.95),
    "one loop, noisy": (0.04, 0.0, 0.95),
    "a loop that unties, noisy": (0.36, 0.0, 0.95),
    "rapid moves 1, noisy": (0.64, 0.0, 0.95),
    "rapid moves 2, noisy": (0.31, 0.0, 0.95),
    "high curvature, occluded": (0.53, 0.0, 0.92),
    "one loop, occluded": (0.08, 0.0, 0.85),
    "three cables": (None, 0.57, 0.97),
    "three cables, occluded": (None, 0.00, 0.88),
    "five cables": (None, 0.20, 0.85),
    "five cables, noisy": (None, 0.00, 0.80),
}
_KINDS_L3 = {"high curvature": (0.50, 0.78, 0.25)}

KINDS: dict[tuple[str, str], Kind] = {
    (kind, method): Kind(clean, l3)
    for kind, of_kind in _KINDS_CLEAN.items()
    for method, clean, l3 in zip(KINDS_METHODS, of_kind, _KINDS_L3.get(kind, (None, None, None)), strict=True)
    if clean is not None
}
"""By kind, as the sequences of the suite are named, and method."""


class SpaceBar(NamedTuple):
    """Bars for curves in space on a scenario with noisy depth, mm: the mean L3, and the L3 of most frames."""

    mean_mm: float
    frame_mm: float


SPACE_SHARE = 0.95
"""Of the frames that must be within `SpaceBar.frame_mm`."""
SPACE_LENGTH = 0.01
"""Largest error of the mean length, as a share of the true length."""
_SPACE_BARS = {
    "0": SpaceBar(2.0, 4.0),
    "1": SpaceBar(3.0, 6.0),
    "2": SpaceBar(3.0, 6.0),
    "3": SpaceBar(2.0, 4.0),
    "4": SpaceBar(2.0, 4.0),
}


def space_bar(scenario: str) -> SpaceBar | None:
    """Return the bar of a scenario, whose name begins with its number; None where it has none."""
    return _SPACE_BARS.get(scenario.partition(" ")[0])
