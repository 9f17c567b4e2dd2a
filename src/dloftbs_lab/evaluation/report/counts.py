"""Tables of counts over whole runs: identities, and exceptions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

from dloftbs_lab.evaluation.identity_scores import TrackingScores
from dloftbs_lab.evaluation.report.spread import Sample, sequences_of
from dloftbs_lab.evaluation.report.table import Cell, Table
from dloftbs_lab.evaluation.runner.finished_parts import FrameRow, Part

T = TypeVar("T")


def rows_of(parts: Sequence[Part]) -> list[FrameRow]:
    """Return the frames of all parts."""
    return [row for part in parts for row in part.rows]


def tracking_table(parts: Sequence[Part]) -> Table:
    """Return how identities and directions were held, for each suite and method that has any."""
    groups: dict[tuple[str, str], list[Part]] = {}
    for part in parts:
        if part.tracking is not None:
            groups.setdefault((part.key.suite, part.key.method), []).append(part)
    made = [(*group, *_tracked(sequences_of(of_group))) for group, of_group in groups.items()]
    columns = (
        "suite",
        "method",
        "scenes",
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


def _tracked(sequences: Sample[Part]) -> tuple[Cell, ...]:
    def scores(part: Part) -> TrackingScores:
        return part.tracking or TrackingScores()

    def errors(part: Part) -> int:
        return scores(part).misses + scores(part).false_positives + scores(part).switches

    return (
        sequences.count,
        sequences.total(lambda part: scores(part).objects),
        sequences.total(lambda part: scores(part).switches),
        sequences.total(lambda part: scores(part).flips),
        sequences.total(lambda part: scores(part).fragmentations),
        sequences.total(lambda part: scores(part).misses),
        sequences.total(lambda part: scores(part).false_positives),
        idf1(sequences, scores),
        sequences.ratio(errors, lambda part: scores(part).objects, -1.0, offset=1.0),
    )


def idf1(sequences: Sample[T], scores: Callable[[T], TrackingScores]) -> Cell:
    """Return the IDF1 of all sequences together."""
    return sequences.ratio(
        lambda one: 2 * scores(one).id_matches, lambda one: scores(one).objects + scores(one).outputs
    )


def exceptions_table(parts: Sequence[Part]) -> Table:
    """Return what methods raised, and in how many frames."""
    made: dict[tuple[str, str, str], int] = {}
    for row in rows_of(parts):
        if row.failure is not None:
            what = (row.suite, row.method, row.failure)
            made[what] = made.get(what, 0) + 1
    rows = tuple((*what, count) for what, count in sorted(made.items(), key=lambda item: -item[1]))
    return Table("exceptions", "What methods raised", ("suite", "method", "exception", "frames"), rows)
