"""The tables of a run: in the paper's form, with its published figures in rows of their own, and what it has not."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

from dloftbs.evaluation import published
from dloftbs.evaluation.report_counts import exceptions_table, tracking_table
from dloftbs.evaluation.report_table import Cell, Table, existing, mean, median
from dloftbs.evaluation.runner_parts import FrameRow, Part
from dloftbs.evaluation.runner_score import CLEAN_DICE

_EMPTY = "frames without a curve"
_COUNTS = ("frames", _EMPTY)
_WHOLE = "L3 px, whole curve"
_MATCHED = "L3 is of the matched objects, however far off; missing ones have none."
_SEEN = "Means are over the frames that have a curve; those without are counted beside them."


def tables(parts: Sequence[Part]) -> list[Table]:
    """Return all tables that the parts have figures for."""
    suites = list(dict.fromkeys(part.key.suite for part in parts))
    made = [_summary(parts)]
    for suite in suites:
        of_suite = [part for part in parts if part.key.suite == suite]
        made.append(_FORMS.get(suite, _plain)(of_suite, suite))
    made += [table for table in (tracking_table(parts), exceptions_table(parts)) if table.rows]
    return made


def clean_share(rows: Sequence[FrameRow]) -> float:
    """Return the share of frames in which every object was found once, and nothing else."""
    return sum(row.clean for row in rows) / len(rows) if rows else 0.0


def _summary(parts: Sequence[Part]) -> Table:
    columns = (
        "suite",
        "method",
        "frames",
        "clean frames, %",
        "right objects, %",
        "L3 px",
        _WHOLE,
        "missing, %",
        "redundant, %",
        _EMPTY,
        "exceptions",
        "ms median",
        "ms p99",
    )
    made: list[tuple[Cell, ...]] = []
    for (suite, method), rows in _grouped(parts, lambda part: (part.key.suite, part.key.method)):
        true = max(sum(row.n_true for row in rows), 1)
        made.append(
            (
                suite,
                method,
                len(rows),
                100.0 * clean_share(rows),
                _right_percent(rows),
                mean(row.l3_px for row in rows),
                mean(row.l3_whole_px for row in rows),
                100.0 * sum(row.missing for row in rows) / true,
                100.0 * sum(row.redundant for row in rows) / true,
                _without(rows),
                sum(row.failure is not None for row in rows),
                median(row.ms for row in rows),
                median((row.ms for row in rows), 0.99),
            )
        )
    note = (
        "An object is right when the curve that it is given has an L3 of at most 5 px in HD and as much of smaller "
        f"images, or a DICE of at least {CLEAN_DICE} where only masks are known; a frame is clean when all its objects "
        "are right and there is nothing else. L3 is the mean over frames of all matched objects, however far off, "
        "whichever end comes first, and from the whole curve or its visible extent, whichever is nearer; the column "
        "beside it is from the whole curve always, the paper's criterion to the letter. Missing and "
        "redundant are shares of the true objects. Where a method raises an exception, all objects are missing."
    )
    return Table("summary", "All suites", columns, tuple(made), note)


def _table_1(parts: Sequence[Part], suite: str) -> Table:
    return _cover(parts, suite, "2D video, form of the paper's Table I", published.TABLE_I)


def _table_3(parts: Sequence[Part], suite: str) -> Table:
    return _cover(parts, suite, "RGBD, form of the paper's Table III", published.TABLE_III)


def _cover(parts: Sequence[Part], suite: str, title: str, others: Sequence[published.Cover]) -> Table:
    made: list[tuple[Cell, ...]] = [
        (
            sequence,
            method,
            mean(row.l1_px for row in rows),
            mean(row.l2_px for row in rows),
            median(row.ms for row in rows),
            mean(row.l3_px for row in rows),
            mean(row.l3_whole_px for row in rows),
            mean(row.l3_mm for row in rows),
            100.0 * clean_share(rows),
            len(rows),
            _without(rows),
        )
        for (sequence, method), rows in _grouped(parts, lambda part: (part.key.sequence, part.key.method))
    ]
    made += [(f"paper's {o.scenario}", _marked(o.method), o.l1, o.l2, o.ms, *(None,) * 6) for o in others]
    note = (
        "L1: mean distance of the objects' visible pixels to the nearest curve, a quarter of the width where the "
        f"curve is perfect; L2: of the curves' points to the nearest visible pixel. {_SEEN}"
    )
    columns = (
        "scenario",
        "method",
        "L1 px",
        "L2 px",
        "ms median",
        "L3 px",
        _WHOLE,
        "L3 mm",
        "clean frames, %",
        *_COUNTS,
    )
    return Table(suite, f"{suite}: {title}", columns, tuple(made), note).compact()


def _table_2(parts: Sequence[Part], suite: str) -> Table:
    made: list[tuple[Cell, ...]] = [
        (
            method,
            mean(row.l3_px for row in rows),
            mean(row.l3_whole_px for row in rows),
            sum(row.missing for row in rows),
            sum(row.redundant for row in rows),
            median(row.ms for row in rows),
            len(rows),
            sum(row.n_true for row in rows),
            _right_percent(rows),
            100.0 * clean_share(rows),
        )
        for (method,), rows in _grouped(parts, lambda part: (part.key.method,))
    ]
    made += [
        (_marked(other.method), None, other.l3, other.missing, other.redundant, other.ms, 62, None, None, None)
        for other in published.TABLE_II
    ]
    columns = (
        "method",
        "L3 px",
        _WHOLE,
        "missing",
        "redundant",
        "ms median",
        "images",
        "objects",
        "right objects, %",
        "clean images, %",
    )
    title = f"{suite}: images of several cables, form of the paper's Table II"
    return Table(suite, title, columns, tuple(made), _MATCHED)


def _table_4(parts: Sequence[Part], suite: str) -> Table:
    made: list[tuple[Cell, ...]] = []
    for (sequence, method), rows in _grouped(parts, lambda part: (part.key.sequence, part.key.method)):
        px, mm = existing(row.l3_whole_px for row in rows), existing(row.l3_mm for row in rows)
        flat = sum(row.l3_mm is None for row in rows)
        counts = (len(rows), _without(rows), flat)
        made.append((sequence, method, *_spread(px), *_spread(mm), median(row.ms for row in rows), *counts))
    made += [
        (f"paper's {o.scenario}", _marked(o.method), None, None, None, o.mean, o.largest, o.smallest, *(None,) * 4)
        for o in published.TABLE_IV
    ]
    spread = tuple(f"L3 {unit} {what}" for unit in ("px", "mm") for what in ("mean", "max", "min"))
    columns = ("scenario", "method", *spread, "ms median", *_COUNTS, "frames without a curve in space")
    title = f"{suite}: artificial RGBD, form of the paper's Table IV"
    note = (
        "L3 in px is that of the curve in the image, in mm that of the curve in space, beside which the published "
        f"figures stand. {_SEEN}"
    )
    return Table(suite, title, columns, tuple(made), note)


def _noise(parts: Sequence[Part], suite: str) -> Table:
    made: list[tuple[Cell, ...]] = [
        (
            ladder,
            level,
            method,
            100.0 * clean_share(rows),
            mean(row.l3_px for row in rows),
            mean(row.l3_whole_px for row in rows),
            mean(row.l1_px for row in rows),
            sum(row.missing for row in rows),
            sum(row.redundant for row in rows),
            median(row.ms for row in rows),
            len(rows),
            _without(rows),
        )
        for (ladder, level, method), rows in _grouped(parts, lambda p: (p.ladder or "", p.level, p.key.method))
    ]
    columns = (
        "ladder",
        "level",
        "method",
        "clean frames, %",
        "L3 px",
        _WHOLE,
        "L1 px",
        "missing",
        "redundant",
        "ms median",
        *_COUNTS,
    )
    return Table(suite, f"{suite}: error as the input gets worse", columns, tuple(made), _SEEN)


def _plain(parts: Sequence[Part], suite: str) -> Table:
    made: list[tuple[Cell, ...]] = [
        (
            sequence,
            method,
            100.0 * clean_share(rows),
            mean(row.l1_px for row in rows),
            mean(row.l2_px for row in rows),
            mean(row.l3_px for row in rows),
            mean(row.l3_whole_px for row in rows),
            mean(row.dice for row in rows),
            sum(row.missing for row in rows),
            sum(row.redundant for row in rows),
            median(row.ms for row in rows),
            len(rows),
            _without(rows),
        )
        for (sequence, method), rows in _grouped(parts, lambda part: (part.key.sequence, part.key.method))
    ]
    columns = (
        "sequence",
        "method",
        "clean frames, %",
        "L1 px",
        "L2 px",
        "L3 px",
        _WHOLE,
        "DICE",
        "missing",
        "redundant",
        "ms median",
        *_COUNTS,
    )
    return Table(suite, suite, columns, tuple(made), _SEEN).compact()


_FORMS: dict[str, Callable[[Sequence[Part], str], Table]] = {
    "rgb": _table_1,
    "several-cables": _table_2,
    "rgbd": _table_3,
    "rgbd-artificial": _table_4,
    "noise": _noise,
}


def _grouped(
    parts: Sequence[Part], group: Callable[[Part], tuple[Cell, ...]]
) -> Iterator[tuple[tuple[Cell, ...], list[FrameRow]]]:
    """Yield the frames of each group, in the order in which the groups come up first."""
    groups: dict[tuple[Cell, ...], list[FrameRow]] = {}
    for part in parts:
        groups.setdefault(group(part), []).extend(part.rows)
    yield from groups.items()


def _without(rows: Sequence[FrameRow]) -> int:
    return sum(row.n_found == 0 and row.n_true > 0 for row in rows)


def _right_percent(rows: Sequence[FrameRow]) -> float:
    return 100.0 * sum(row.right for row in rows) / max(sum(row.n_true for row in rows), 1)


def _spread(values: Sequence[float]) -> tuple[float | None, float | None, float | None]:
    return mean(values), max(values, default=None), min(values, default=None)


def _marked(method: str) -> str:
    return f"{method} ({published.MARK})"
