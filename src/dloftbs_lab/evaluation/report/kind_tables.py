"""The suite of difficulties at a glance: a row for each kind, a group of columns for each method, peers beside them."""

from __future__ import annotations

from collections.abc import Sequence

from dloftbs_lab.evaluation import paper_figures
from dloftbs_lab.evaluation.report.spread import frames_of
from dloftbs_lab.evaluation.report.table import Cell, Table
from dloftbs_lab.evaluation.runner.finished_parts import Part

_NOTE = (
    "Clean: exactly the right number of curves, each with an L3 of at most 5 px in HD from its true one. L3: the "
    "median over frames of the mean of a frame. Noisy: 0.3 % salt and pepper, an edge jitter of 1 px correlated over "
    "2 px. Occluded: three discs of radius 18 to 34 px on the cables. They leave the ends to be seen, and hide at most "
    f"a half turn at a stretch. Cables have 12 px in HD. Columns with a star are of {paper_figures.KINDS_ORIGIN}."
)


def kinds_table(parts: Sequence[Part], suite: str) -> Table:
    """Return the share of clean frames and the median L3 by sequence and method, with the peers' figures.

    Parameters
    ----------
    parts : sequence of Part
        Of the suite of kinds.
    suite : str
        Its name.
    """
    methods = list(dict.fromkeys(part.key.method for part in parts))
    kinds = list(dict.fromkeys(part.key.sequence for part in parts))
    groups = [*methods, *(f"{name}*" for name in paper_figures.KINDS_METHODS)]
    columns = ("kind", *(f"{name}: {figure}" for name in groups for figure in ("clean, %", "L3 px")))
    rows = tuple((kind, *_measured(parts, kind, methods), *_theirs(kind)) for kind in kinds)
    title = f"{suite}: clean frames and median L3, by kind of difficulty"
    return Table(f"{suite}-clean", title, columns, rows, _NOTE).compact()


def _measured(parts: Sequence[Part], kind: str, methods: Sequence[str]) -> list[Cell]:
    cells: list[Cell] = []
    for method in methods:
        frames = frames_of(part for part in parts if (part.key.sequence, part.key.method) == (kind, method))
        cells += [frames.mean(lambda row: float(row.clean), 100.0), frames.quantile(lambda row: row.l3_px)]
    return cells


def _theirs(kind: str) -> list[Cell]:
    cells: list[Cell] = []
    for method in paper_figures.KINDS_METHODS:
        known = paper_figures.KINDS.get((kind, method))
        cells += [None, None] if known is None else [100.0 * known.clean, known.l3]
    return cells
