"""The tables of a run: over all suites, the paper's in their own form, and of each suite by itself."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence

from dloftbs_lab.evaluation.report.counts import exceptions_table, tracking_table
from dloftbs_lab.evaluation.report.joint_tables import joint_tables
from dloftbs_lab.evaluation.report.kind_tables import kinds_table
from dloftbs_lab.evaluation.report.paper_tables import paper_tables
from dloftbs_lab.evaluation.report.space_tables import depth_camera_table, space_table
from dloftbs_lab.evaluation.report.spread import Sample, frames_of, grouped
from dloftbs_lab.evaluation.report.table import Cell, Table, existing, median
from dloftbs_lab.evaluation.report.tracking_tables import following_table
from dloftbs_lab.evaluation.runner.finished_parts import FrameRow, Part
from dloftbs_lab.evaluation.runner.frame_scores import CLEAN_DICE, SURE

_EMPTY = "frames without a curve"
_WHOLE = "L3 px, whole curve"
_LENGTH = "length in space off, %"
_COUNTS = ("scenes", "frames", _EMPTY)
_MATCHED = "L3 is of the matched objects, however far off; missing ones have none."
_SEEN = "Means are over the frames that have a curve; those without are counted beside them."

_Frames = Sample[FrameRow]
_Group = Mapping[str, Callable[[Part], Cell]]


def tables(parts: Sequence[Part], untracked: Collection[str] = ()) -> list[Table]:
    """Return all tables that the parts have figures for, without those of tracks in the suites named in `untracked`."""
    suites = dict.fromkeys(part.key.suite for part in parts)
    of_suites = [table for suite in suites for table in suite_tables(parts, suite, untracked)]
    first, *rest = overall_tables(parts, untracked)
    return [first, *paper_tables(parts), *of_suites, *rest]


def overall_tables(parts: Sequence[Part], untracked: Collection[str] = ()) -> list[Table]:
    """Return the tables over all suites; the first is the summary."""
    tracked = [part for part in parts if part.key.suite not in untracked]
    made = [table for table in (tracking_table(tracked), exceptions_table(parts)) if table.rows]
    return [_summary(parts), *made, *joint_tables(parts)]


def suite_tables(parts: Sequence[Part], suite: str, untracked: Collection[str] = ()) -> list[Table]:
    """Return the tables of one suite."""
    of_suite = [part for part in parts if part.key.suite == suite]
    made = [kinds_table(of_suite, suite)] if suite == "kinds" else []
    if suite not in untracked and any(part.following is not None for part in of_suite):
        made.append(following_table(of_suite, suite).compact())
    return [*made, _FORMS.get(suite, _plain)(of_suite, suite)]


def clean_share(rows: Sequence[FrameRow]) -> float:
    """Return the share of frames in which every object was found once, and nothing else."""
    return sum(row.clean for row in rows) / len(rows) if rows else 0.0


def _share_of_objects(count: Callable[[FrameRow], int]) -> Callable[[_Frames], Cell]:
    return lambda frames: frames.ratio(count, lambda row: row.n_true, 100.0)


def _has_right_number(row: FrameRow) -> float:
    """Return 1.0 for a frame with as many curves as objects; those of which nothing shows may have one or none."""
    return float(row.n_found == row.n_true if row.dice is not None else row.missing == row.redundant == 0)


_FIGURES: dict[str, Callable[[_Frames], Cell]] = {
    "scenes": lambda frames: frames.count,
    "frames": len,
    "images": len,
    "objects": lambda frames: frames.total(lambda row: row.n_true),
    "clean frames, %": lambda frames: frames.mean(lambda row: float(row.clean), 100.0),
    "clean images, %": lambda frames: frames.mean(lambda row: float(row.clean), 100.0),
    "right number, %": lambda frames: frames.mean(_has_right_number, 100.0),
    "right objects, %": _share_of_objects(lambda row: row.right),
    "L1 px": lambda frames: frames.mean(lambda row: row.l1_px),
    "L2 px": lambda frames: frames.mean(lambda row: row.l2_px),
    "L3 px": lambda frames: frames.mean(lambda row: row.l3_px),
    _WHOLE: lambda frames: frames.mean(lambda row: row.l3_whole_px),
    "L3 px mean": lambda frames: frames.mean(lambda row: row.l3_whole_px),
    "L3 px max": lambda frames: max(existing(row.l3_whole_px for row in frames.items), default=None),
    "L3 px min": lambda frames: min(existing(row.l3_whole_px for row in frames.items), default=None),
    "L3 mm": lambda frames: frames.mean(lambda row: row.l3_mm),
    "L3 mm mean": lambda frames: frames.mean(lambda row: row.l3_mm),
    "L3 mm max": lambda frames: max(existing(row.l3_mm for row in frames.items), default=None),
    "L3 mm min": lambda frames: min(existing(row.l3_mm for row in frames.items), default=None),
    _LENGTH: lambda frames: frames.mean(lambda row: row.length_error, 100.0),
    "sure and wrong, %": lambda frames: frames.ratio(lambda row: row.sure_wrong, lambda row: row.sure, 100.0),
    "whole harness right, %": lambda frames: frames.mean(lambda row: float(row.whole), 100.0),
    "branches right, %": _share_of_objects(lambda row: row.branches_right),
    "F1 of branch points, %": lambda frames: frames.ratio(
        lambda row: 2 * row.nodes_right, lambda row: row.nodes_true + row.nodes_found, 100.0
    ),
    "DICE": lambda frames: frames.mean(lambda row: row.dice),
    "missing": lambda frames: frames.total(lambda row: row.missing),
    "missing, %": _share_of_objects(lambda row: row.missing),
    "redundant": lambda frames: frames.total(lambda row: row.redundant),
    "redundant, %": _share_of_objects(lambda row: row.redundant),
    _EMPTY: lambda frames: frames.total(lambda row: row.n_found == 0 and row.n_true > 0),
    "frames without a curve in space": lambda frames: frames.total(lambda row: row.l3_mm is None),
    "exceptions": lambda frames: frames.total(lambda row: row.failure is not None),
    "ms median": lambda frames: median(row.ms for row in frames.items),
    "ms p99": lambda frames: median((row.ms for row in frames.items), 0.99),
}
"""From a column's title to what stands in it, for a group of frames."""

_SUITE: _Group = {"suite": lambda part: part.key.suite}
_SCENARIO: _Group = {"scenario": lambda part: part.key.sequence}
_SEQUENCE: _Group = {"sequence": lambda part: part.key.sequence}
_RUNG: _Group = {"ladder": lambda part: part.ladder or "", "level": lambda part: part.level}
_FAMILY: _Group = {"family": lambda part: part.key.sequence.rpartition(", ")[0]}
_METHOD: _Group = {"method": lambda part: part.key.method}


def _rows(
    parts: Sequence[Part], group: _Group, figures: Sequence[str]
) -> tuple[tuple[str, ...], tuple[tuple[Cell, ...], ...]]:
    return grouped(parts, group, {figure: _FIGURES[figure] for figure in figures}, frames_of)


def _summary(parts: Sequence[Part]) -> Table:
    rates = ("clean frames, %", "right objects, %", "L3 px", _WHOLE, "missing, %", "redundant, %")
    figures = ("scenes", "frames", *rates, _EMPTY, "exceptions", "ms median", "ms p99")
    note = (
        "An object is right if its curve has an L3 of at most 5 px in HD, and as much of smaller images. --tolerance "
        f"or the data may set another limit. With masks alone it is a DICE of at least {CLEAN_DICE}. A frame is clean "
        "if all its objects are right and there is nothing else. L3 is the mean over frames of all matched objects, "
        "however far off, whichever end comes first. It is from the whole curve or its visible extent, whichever is "
        "nearer. The column beside it is from the whole curve always, the paper's criterion to the letter. Missing "
        "and redundant are shares of the true objects. If a method raises an exception, all objects are missing."
    )
    made = _rows(parts, {**_SUITE, **_METHOD}, figures)
    return Table("summary", "All suites", *made, note)


def _scenarios(parts: Sequence[Part], suite: str) -> Table:
    figures = ("clean frames, %", "L1 px", "L2 px", "L3 px", _WHOLE, "L3 mm", "ms median", *_COUNTS)
    note = (
        "L1: mean distance of the objects' visible pixels to the nearest curve, a quarter of the width where the "
        f"curve is perfect; L2: of the curves' points to the nearest visible pixel. {_SEEN}"
    )
    return Table(suite, f"{suite}: by scenario", *_rows(parts, {**_SCENARIO, **_METHOD}, figures), note).compact()


def _by_number(parts: Sequence[Part], suite: str) -> Table:
    figures = ("L3 px", _WHOLE, "missing", "redundant", "ms median", "images", "objects")
    made = _rows(parts, {**_SEQUENCE, **_METHOD}, (*figures, "right objects, %", "clean images, %"))
    return Table(suite, f"{suite}: by the number of cables", *made, _MATCHED)


def _deep_scenarios(parts: Sequence[Part], suite: str) -> Table:
    spread = [f"L3 {unit} {what}" for unit in ("px", "mm") for what in ("mean", "max", "min")]
    figures = (*spread, _LENGTH, "ms median", *_COUNTS, "frames without a curve in space")
    note = (
        "L3 in px is that of the curve in the image, from the whole true curve; in mm that of the curve in space, "
        f"from the true axis. {_SEEN}"
    )
    return Table(suite, f"{suite}: by scenario", *_rows(parts, {**_SCENARIO, **_METHOD}, figures), note)


def _in_space(parts: Sequence[Part], suite: str) -> Table:
    figures = ("L3 px", "L3 mm", _LENGTH, "ms median", *_COUNTS, "frames without a curve in space")
    note = "L3 in mm is that of the curve in space, from the true axis; the method stereo alone has the second view."
    return Table(suite, f"{suite}: by rig", *_rows(parts, {**_FAMILY, **_METHOD}, figures), note).compact()


def _noise(parts: Sequence[Part], suite: str) -> Table:
    errors = ("L3 px", _WHOLE, "L1 px", "L3 mm", _LENGTH)
    figures = ("clean frames, %", *errors, "missing", "redundant", "ms median", *_COUNTS)
    title = f"{suite}: error as the input gets worse"
    return Table(suite, title, *_rows(parts, {**_RUNG, **_METHOD}, figures), _SEEN).compact()


def _families(parts: Sequence[Part], suite: str) -> Table:
    figures = ("clean frames, %", "L1 px", "L2 px", "L3 px", _WHOLE, "missing", "redundant", "ms median", *_COUNTS)
    title = f"{suite}: what was seen in each frame"
    return Table(f"{suite}-frames", title, *_rows(parts, {**_FAMILY, **_METHOD}, figures), _SEEN).compact()


def _footage(parts: Sequence[Part], suite: str) -> Table:
    figures = ("clean frames, %", "right objects, %", "sure and wrong, %", "L3 px", "missing", "redundant", "ms median")
    note = (
        "Right objects: specks and salt that are found as short curves spoil a clean frame, but not the object beside "
        f"them. Sure and wrong: of the curves with a confidence of at least {SURE:g}, those that are not right. {_SEEN}"
    )
    made = _rows(parts, {**_FAMILY, **_METHOD}, (*figures, *_COUNTS))
    return Table(f"{suite}-frames", f"{suite}: what was seen in each frame", *made, note).compact()


def _harnesses(parts: Sequence[Part], suite: str) -> Table:
    figures = ("whole harness right, %", "branches right, %", "F1 of branch points, %", "L3 px", "ms median", *_COUNTS)
    note = (
        "A branch point is right within 10 px in HD. A branch is right if its L3 is at most 5 px, and the branch "
        f"points at its ends are right. A harness is right if all of it is, and there is nothing else. {_SEEN}"
    )
    return Table(suite, f"{suite}: by sequence", *_rows(parts, {**_SEQUENCE, **_METHOD}, figures), note).compact()


def _plain(parts: Sequence[Part], suite: str) -> Table:
    covers = ("clean frames, %", "right number, %", "L1 px", "L2 px", "L3 px", _WHOLE, "DICE")
    figures = (*covers, "missing", "redundant", "ms median", *_COUNTS)
    return Table(suite, suite, *_rows(parts, {**_SEQUENCE, **_METHOD}, figures), _SEEN).compact()


_FORMS: dict[str, Callable[[Sequence[Part], str], Table]] = {
    "rgb": _scenarios,
    "tracking": _families,
    "known-occluders": _families,
    "seen-occluders": _families,
    "plain-sight": _families,
    "real-motion": _families,
    "real-footage": _footage,
    "simulated": _families,
    "harness": _harnesses,
    "several-cables": _by_number,
    "rgbd": _scenarios,
    "rgbd-artificial": _deep_scenarios,
    "rgbd-noisy": space_table,
    "rgbd-camera": depth_camera_table,
    "two-cameras": _in_space,
    "noise": _noise,
}
