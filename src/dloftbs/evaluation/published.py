"""The figures that the paper published (Kicki, Szymko, Walas, ICRA 2023, tables I to IV), as it prints them.

They come from other data and another machine (one core of an i7-9750H, HD images), and stand beside measured ones for
orientation only.
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
