"""Curves in space from imperfect depth: by scenario, and by a camera's errors."""

from __future__ import annotations

import math
from collections.abc import Sequence

from dloftbs_lab.evaluation.report.spread import Sample, frames_of
from dloftbs_lab.evaluation.report.table import Cell, Table, existing, percent
from dloftbs_lab.evaluation.runner.finished_parts import FrameRow, Part

_MEAN, _P95 = "L3 mm mean", "L3 mm 95 %"
_LENGTH = "length off, % mean"
_NONE = "frames without a curve in space"
_COLUMNS = ("scenario", "method", _MEAN, _P95, "L3 mm max", _LENGTH, "length off, % median", "scenes", "frames", _NONE)
_SHARE = 0.95
_NOTE = (
    "L3 of the curve in space from the true axis, and how much its length is off the true one. 95 %: below it lie so "
    "many of all frames, those without a curve in space counting as infinitely far off. Depth has noise with a "
    "sigma of 1 mm at 0.5 m and 4 mm at 1.5 m, 5 % of the cable has no depth, and half of the pixels at edges fly; "
    "stereo adds grain of 2 px and steps of 2 mm at 1 m."
)

FAR_MM = 5.0
"""L3 from which a frame counts as far off, mm."""
_ERRORS_NOTE = (
    "Cables of 3 to 20 mm, 0.4 to 1.5 m away and 2 to 15 cm above a table: level, lifted, tilted, bent towards the "
    "camera, and crossing. Each row is of the same scenes. L3 of the curve in space from the true axis, inferred parts "
    f"included. Far off is more than {FAR_MM:g} mm."
)


def space_table(parts: Sequence[Part], suite: str) -> Table:
    """Return the errors in space by sequence and method.

    Parameters
    ----------
    parts : sequence of Part
        Of the suite.
    suite : str
        Its name.
    """
    groups: dict[tuple[str, str], list[Part]] = {}
    for part in parts:
        groups.setdefault((part.key.sequence, part.key.method), []).append(part)
    rows = tuple(_row(*names, frames_of(of_group)) for names, of_group in groups.items())
    return Table(suite, f"{suite}: RGBD with the noise of depth cameras, curves in space", _COLUMNS, rows, _NOTE)


def depth_camera_table(parts: Sequence[Part], suite: str) -> Table:
    """Return the errors in space by a depth camera's errors and method.

    Parameters
    ----------
    parts : sequence of Part
        Of the suite; a sequence is named by its kind of scene and, after a comma, the camera's errors.
    suite : str
        Its name.
    """
    groups: dict[tuple[str, str], list[Part]] = {}
    for part in parts:
        groups.setdefault((part.key.sequence.partition(", ")[2], part.key.method), []).append(part)
    columns = (
        *("errors of depth", "method", "L3 mm median", _P95, "L3 mm max", "far off", "far off, %", _LENGTH),
        *("scenes", "frames", _NONE),
    )
    rows = []
    for names, of_group in groups.items():
        frames = frames_of(of_group)
        known = existing(row.l3_mm for row in frames.items)
        rows.append(
            (
                *names,
                frames.quantile(lambda row: row.l3_mm),
                frames.quantile(lambda row: row.l3_mm, _SHARE),
                max(known, default=None),
                sum(error > FAR_MM for error in known),
                frames.mean(lambda row: None if row.l3_mm is None else float(row.l3_mm > FAR_MM), 100.0),
                frames.mean(lambda row: row.length_error, 100.0),
                frames.count,
                len(frames),
                len(frames) - len(known),
            )
        )
    return Table(suite, f"{suite}: curves in space, by the errors of depth", columns, tuple(rows), _ERRORS_NOTE)


def _row(scenario: str, method: str, frames: Sample[FrameRow]) -> tuple[Cell, ...]:
    return (
        scenario,
        method,
        frames.mean(lambda row: row.l3_mm),
        _finite(frames.quantile(_or_endless, _SHARE)),
        max(existing(row.l3_mm for row in frames.items), default=None),
        frames.mean(lambda row: row.length_error, 100.0),
        frames.quantile(_length_percent),
        frames.count,
        len(frames),
        frames.total(lambda row: row.l3_mm is None),
    )


def _length_percent(row: FrameRow) -> float | None:
    return percent(row.length_error)


def _or_endless(row: FrameRow) -> float:
    return math.inf if row.l3_mm is None else row.l3_mm


def _finite(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) else None
