"""Tables of counts over whole runs: identities, and exceptions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

from dloftbs_lab.evaluation.identity_scores import TrackingScores
from dloftbs_lab.evaluation.report.spread import Sample, grouped, sequences_of
from dloftbs_lab.evaluation.report.table import Cell, Table
from dloftbs_lab.evaluation.runner.finished_parts import FrameRow, Part

T = TypeVar("T")


def rows_of(parts: Sequence[Part]) -> list[FrameRow]:
    """Return the frames of all parts."""
    return [row for part in parts for row in part.rows]


def tracking_table(parts: Sequence[Part]) -> Table:
    """Return how identities and directions were held, for each suite and method that has any."""
    tracked = [part for part in parts if part.tracking is not None]
    note = (
        "A track is that of an object while its L3 is within 50 px in HD, and as much of smaller images. Hidden "
        "tracks do not count."
    )
    return Table("tracking", "Tracking", *grouped(tracked, _GROUP, _FIGURES, sequences_of), note)


def _scores(part: Part) -> TrackingScores:
    return part.tracking or TrackingScores()


def _errors(part: Part) -> int:
    return _scores(part).misses + _scores(part).false_positives + _scores(part).switches


def idf1(sequences: Sample[T], scores: Callable[[T], TrackingScores]) -> Cell:
    """Return the IDF1 of all sequences together."""
    return sequences.ratio(
        lambda one: 2 * scores(one).id_matches, lambda one: scores(one).objects + scores(one).outputs
    )


_GROUP: dict[str, Callable[[Part], Cell]] = {
    "suite": lambda part: part.key.suite,
    "method": lambda part: part.key.method,
}
_FIGURES: dict[str, Callable[[Sample[Part]], Cell]] = {
    "scenes": lambda sequences: sequences.count,
    "objects, all frames": lambda sequences: sequences.total(lambda part: _scores(part).objects),
    "identity switches": lambda sequences: sequences.total(lambda part: _scores(part).switches),
    "direction flips": lambda sequences: sequences.total(lambda part: _scores(part).flips),
    "fragmentations": lambda sequences: sequences.total(lambda part: _scores(part).fragmentations),
    "misses": lambda sequences: sequences.total(lambda part: _scores(part).misses),
    "false positives": lambda sequences: sequences.total(lambda part: _scores(part).false_positives),
    "IDF1": lambda sequences: idf1(sequences, _scores),
    "MOTA": lambda sequences: sequences.ratio(_errors, lambda part: _scores(part).objects, -1.0, offset=1.0),
}


def exceptions_table(parts: Sequence[Part]) -> Table:
    """Return what methods raised, and in how many frames."""
    made: dict[tuple[str, str, str], int] = {}
    for row in rows_of(parts):
        if row.failure is not None:
            what = (row.suite, row.method, row.failure)
            made[what] = made.get(what, 0) + 1
    rows = tuple((*what, count) for what, count in sorted(made.items(), key=lambda item: -item[1]))
    return Table("exceptions", "What methods raised", ("suite", "method", "exception", "frames"), rows)
