"""Tables of counts over whole runs: identities, and exceptions."""

from __future__ import annotations

from collections.abc import Sequence

from dloftbs.evaluation.identity_scores import TrackingScores
from dloftbs.evaluation.report.table import Cell, Table
from dloftbs.evaluation.runner.finished_parts import FrameRow, Part


def rows_of(parts: Sequence[Part]) -> list[FrameRow]:
    """Return the frames of all parts."""
    return [row for part in parts for row in part.rows]


def tracking_table(parts: Sequence[Part]) -> Table:
    """Return how identities and directions were held, for each suite and method that has any."""
    totals: dict[tuple[str, str], TrackingScores] = {}
    for part in parts:
        if part.tracking is not None:
            group = part.key.suite, part.key.method
            totals[group] = totals.get(group, TrackingScores()) + part.tracking
    made: list[tuple[Cell, ...]] = [
        (*group, t.objects, t.switches, t.flips, t.fragmentations, t.misses, t.false_positives, t.idf1, t.mota)
        for group, t in totals.items()
    ]
    columns = (
        "suite",
        "method",
        "objects, all frames",
        "identity switches",
        "direction flips",
        "fragmentations",
        "misses",
        "false positives",
        "IDF1",
        "MOTA",
    )
    note = (
        "A track is that of an object while its L3 is within 50 px in HD, and as much of smaller images. Hidden "
        "tracks do not count."
    )
    return Table("tracking", "Tracking", columns, tuple(made), note)


def exceptions_table(parts: Sequence[Part]) -> Table:
    """Return what methods raised, and in how many frames."""
    made: dict[tuple[str, str, str], int] = {}
    for row in rows_of(parts):
        if row.failure is not None:
            what = (row.suite, row.method, row.failure)
            made[what] = made.get(what, 0) + 1
    rows = tuple((*what, count) for what, count in sorted(made.items(), key=lambda item: -item[1]))
    return Table("exceptions", "What methods raised", ("suite", "method", "exception", "frames"), rows)
