"""Curves in space from imperfect depth: by scenario, and by a camera's errors."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

from dloftbs_lab.evaluation.report.spread import Sample, frames_of, grouped
from dloftbs_lab.evaluation.report.table import Cell, Table, existing, percent
from dloftbs_lab.evaluation.runner.finished_parts import FrameRow, Part

_SHARE = 0.95
_Group = Mapping[str, Callable[[Part], Cell]]
_Figures = Mapping[str, Callable[[Sample[FrameRow]], Cell]]
_NOTE = (
    "L3 of the curve in space from the true axis, and the error of its length. 95 %: this share of all frames lies "
    "below it; a frame without a curve in space is infinitely far off. Depth has noise with a sigma of 1 mm at 0.5 m "
    "and 4 mm at 1.5 m. 5 % of the cable has no depth, and half of the pixels at edges fly. Stereo adds grain of 2 px "
    "and steps of 2 mm at 1 m."
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
    made = grouped(parts, {"scenario": lambda part: part.key.sequence, **_METHOD}, _FIGURES, frames_of)
    return Table(suite, f"{suite}: RGBD with the noise of depth cameras, curves in space", *made, _NOTE)


def depth_camera_table(parts: Sequence[Part], suite: str) -> Table:
    """Return the errors in space by a depth camera's errors and method.

    Parameters
    ----------
    parts : sequence of Part
        Of the suite; a sequence is named by its kind of scene and, after a comma, the camera's errors.
    suite : str
        Its name.
    """
    errors: _Group = {"errors of depth": lambda part: part.key.sequence.partition(", ")[2], **_METHOD}
    made = grouped(parts, errors, _ERRORS_FIGURES, frames_of)
    return Table(suite, f"{suite}: curves in space, by the errors of depth", *made, _ERRORS_NOTE)


def _known(frames: Sample[FrameRow]) -> list[float]:
    return existing(row.l3_mm for row in frames.items)


def _is_far(row: FrameRow) -> float | None:
    return None if row.l3_mm is None else float(row.l3_mm > FAR_MM)


def _length_percent(row: FrameRow) -> float | None:
    return percent(row.length_error)


def _or_endless(row: FrameRow) -> float:
    return math.inf if row.l3_mm is None else row.l3_mm


def _finite(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) else None


_METHOD: _Group = {"method": lambda part: part.key.method}
_FRAMES: _Figures = {
    "scenes": lambda frames: frames.count,
    "frames": len,
    "frames without a curve in space": lambda frames: frames.total(lambda row: row.l3_mm is None),
}
_MAX: _Figures = {"L3 mm max": lambda frames: max(_known(frames), default=None)}
_LENGTH: _Figures = {"length off, % mean": lambda frames: frames.mean(lambda row: row.length_error, 100.0)}
_FIGURES: _Figures = {
    "L3 mm mean": lambda frames: frames.mean(lambda row: row.l3_mm),
    "L3 mm 95 %": lambda frames: _finite(frames.quantile(_or_endless, _SHARE)),
    **_MAX,
    **_LENGTH,
    "length off, % median": lambda frames: frames.quantile(_length_percent),
    **_FRAMES,
}
_ERRORS_FIGURES: _Figures = {
    "L3 mm median": lambda frames: frames.quantile(lambda row: row.l3_mm),
    "L3 mm 95 %": lambda frames: frames.quantile(lambda row: row.l3_mm, _SHARE),
    **_MAX,
    "far off": lambda frames: sum(error > FAR_MM for error in _known(frames)),
    "far off, %": lambda frames: frames.mean(_is_far, 100.0),
    **_LENGTH,
    **_FRAMES,
}
