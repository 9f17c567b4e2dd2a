"""Curves in space from imperfect depth: by scenario, and by a camera's errors."""

from __future__ import annotations

import math
from collections.abc import Sequence

from dloftbs.evaluation.report.table import Cell, Table, existing, mean, median, percent
from dloftbs.evaluation.runner.finished_parts import FrameRow, Part

_MEAN, _P95 = "L3 mm mean", "L3 mm 95 %"
_LENGTH = "length off, % mean"
_NONE = "frames without a curve in space"
_COLUMNS = ("scenario", "method", _MEAN, _P95, "L3 mm max", _LENGTH, "length off, % median", "frames", _NONE)
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
    groups: dict[tuple[str, str], list[FrameRow]] = {}
    for part in parts:
        groups.setdefault((part.key.sequence, part.key.method), []).extend(part.rows)
    rows = tuple(_row(*names, of_group) for names, of_group in groups.items())
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
    groups: dict[tuple[str, str], list[FrameRow]] = {}
    for part in parts:
        errors = part.key.sequence.partition(", ")[2]
        groups.setdefault((errors, part.key.method), []).extend(part.rows)
    columns = ("errors of depth", "method", "L3 mm median", _P95, "L3 mm max", "far off", _LENGTH, "frames", _NONE)
    rows = []
    for (errors, method), of_group in groups.items():
        known = [row.l3_mm for row in of_group if row.l3_mm is not None]
        rows.append(
            (
                errors,
                method,
                median(known),
                median(known, _SHARE),
                max(known, default=None),
                sum(error > FAR_MM for error in known),
                percent(mean(row.length_error for row in of_group)),
                len(of_group),
                len(of_group) - len(known),
            )
        )
    return Table(suite, f"{suite}: curves in space, by the errors of depth", columns, tuple(rows), _ERRORS_NOTE)


def _row(scenario: str, method: str, rows: Sequence[FrameRow]) -> tuple[Cell, ...]:
    errors = [math.inf if row.l3_mm is None else row.l3_mm for row in rows]
    return (
        scenario,
        method,
        mean(row.l3_mm for row in rows),
        _finite(median(errors, _SHARE)),
        max(existing(row.l3_mm for row in rows), default=None),
        percent(mean(row.length_error for row in rows)),
        percent(median(row.length_error for row in rows)),
        len(rows),
        sum(row.l3_mm is None for row in rows),
    )


def _finite(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) else None
