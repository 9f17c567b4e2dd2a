"""The pages of a run: one for each suite, one for the paper's tables, one over all suites."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from dloftbs_lab.evaluation.report.all_tables import overall_tables, suite_tables
from dloftbs_lab.evaluation.report.losses import losses
from dloftbs_lab.evaluation.report.paper_tables import paper_tables
from dloftbs_lab.evaluation.report.picture_names import stem_of
from dloftbs_lab.evaluation.report.spread import NOTE
from dloftbs_lab.evaluation.report.summary import FITTED, FITTED_NOTE, marked
from dloftbs_lab.evaluation.report.table import Table
from dloftbs_lab.evaluation.runner.finished_parts import Part
from dloftbs_lab.evaluation.suites import Suite

OVERALL, PAPER = "overall", "paper"
WORST = "worst"
"""Folder of the sheets of the worst frames."""
_WORST_NOTE = (
    "A sheet shows the ten worst frames of a method, the worst first; several may be of one scene. White casings are "
    "the true curves, and colours what was found. The mask is grey, or green over an image."
)


def make_pages(
    suites: Sequence[Suite],
    parts: Sequence[Part],
    pictures: Sequence[Path],
    run: Sequence[str],
    untracked: Collection[str] = (),
    mark: str = "",
) -> dict[str, str]:
    """Return the pages by name, Markdown; links to pictures are relative to the folder of a run's pages.

    Parameters
    ----------
    suites : sequence of Suite
    parts : sequence of Part
        Of these suites.
    pictures : sequence of Path
        Plots and sheets of the worst frames, in folders beside that of the pages.
    run : sequence of str
        What was run, and on what machine: paragraphs.
    untracked : collection of str
        Names of suites without tables of tracks.
    mark : str
        What none of the figures must be taken without.
    """
    names = [suite.name for suite in suites]
    owners: Mapping[Path, str | None] = {picture: _owner(picture, names) for picture in pictures}
    pages = {}
    for suite in suites:
        note = [FITTED_NOTE] if suite.name in FITTED else []
        mine = [picture for picture in pictures if owners[picture] == suite.name]
        counts = f"{suite.title}; {len(suite.sequences)} sequences, {suite.frames} frames. {suite.settings}."
        pages[suite.name] = _page(
            marked(suite.name), [counts, *note], suite_tables(parts, suite.name, untracked), mine, mark
        )
    of_paper = paper_tables(parts)
    if of_paper:
        pages[PAPER] = _page("The paper's tables", [run[0]], of_paper, [], mark)
    rest = [picture for picture in pictures if owners[picture] is None]
    lost = "### Where it loses\n\n" + "\n".join(f"- {line}" for line in losses(parts)) + "\n"
    pages[OVERALL] = _page("Over all suites", run, overall_tables(parts, untracked), rest, mark, lost)
    return pages


def _page(
    title: str, paragraphs: Sequence[str], tables: Sequence[Table], pictures: Sequence[Path], mark: str, more: str = ""
) -> str:
    notes = [*paragraphs, *([NOTE] if any(table.has_intervals for table in tables) else [])]
    images = "\n\n".join(_image(picture) for picture in pictures)
    if any(_is_worst(picture) for picture in pictures):
        images = f"{_WORST_NOTE}\n\n{images}"
    blocks = [f"# {title}\n", *(f"{note}\n" for note in notes), *(replace(one, mark=mark).markdown() for one in tables)]
    return "\n".join([*blocks, *([more] if more else []), *([f"### Pictures\n\n{images}\n"] if images else [])])


def _image(picture: Path) -> str:
    what = "The worst frames" if _is_worst(picture) else "Plot"
    return f"![{what}: {picture.stem}](../{picture.parent.name}/{picture.name})"


def _is_worst(picture: Path) -> bool:
    return picture.parent.name == WORST


def _owner(picture: Path, suites: Sequence[str]) -> str | None:
    """Return the suite that a picture is of: of the names that stand in its own the first, and there the longest."""
    stem = f"-{picture.stem}-"
    places = {name: f"-{stem_of(name)}-" for name in suites}
    named = [name for name in suites if places[name] in stem]
    return min(named, key=lambda name: (stem.index(places[name]), -len(name)), default=None)
