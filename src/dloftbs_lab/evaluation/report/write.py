"""The files of a run: tables as Markdown, CSV and JSON, every frame's and joint's score, plots, the worst frames."""

from __future__ import annotations

import csv
import io
import os
import platform
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from importlib import metadata
from pathlib import Path
from typing import Any

from dloftbs._version import __version__
from dloftbs.support.json_text import encode
from dloftbs.support.safe_files import sink_errors, write_whole
from dloftbs_lab.evaluation.report.all_tables import tables
from dloftbs_lab.evaluation.report.counts import rows_of
from dloftbs_lab.evaluation.report.losses import losses
from dloftbs_lab.evaluation.report.pages import WORST, make_pages
from dloftbs_lab.evaluation.report.paper_tables import TABLES_OF_PAPER
from dloftbs_lab.evaluation.report.plots import write_plots
from dloftbs_lab.evaluation.report.spread import NOTE
from dloftbs_lab.evaluation.report.summary import summarise
from dloftbs_lab.evaluation.report.table import Table
from dloftbs_lab.evaluation.report.worst_frames import write_worst
from dloftbs_lab.evaluation.runner.finished_parts import FrameRow, Part
from dloftbs_lab.evaluation.suites import Suite

MARKDOWN, JSON, FRAMES, JOINTS = "report.md", "report.json", "frames.csv", "joints.csv"
SUMMARY = "summary.json"
TABLES, PLOTS, PAGES = "tables", "plots", "pages"
_LIBRARIES = ("numpy", "scipy", "numba", "opencv-python-headless")


@dataclass(frozen=True)
class Report:
    """Results of a run.

    Parameters
    ----------
    heading : str
        A line on what was run.
    tables : tuple of Table
    pictures : tuple of Path
        Plots and sheets of the worst frames.
    no_plots : str or None
        Reason why there are no plots.
    """

    heading: str
    tables: tuple[Table, ...]
    pictures: tuple[Path, ...]
    no_plots: str | None = None

    def text(self, *, only_paper: bool = False) -> str:
        """Return the tables as they are printed to a terminal: all, or those of the paper with their notes."""
        if only_paper:
            of_paper = [f"{table.text()}\n{table.note}" for table in self.tables if table.name in TABLES_OF_PAPER]
            return "\n\n".join([self.heading, *of_paper])
        note = [NOTE] if any(table.has_intervals for table in self.tables) else []
        return "\n\n".join([self.heading, *(table.text() for table in self.tables), *note])


def write_report(
    suites: Sequence[Suite],
    parts: Sequence[Part],
    folder: Path,
    heading: str,
    untracked: Collection[str] = (),
    mark: str = "",
) -> Report:
    """Write all files of a run into a folder.

    Without matplotlib there are no plots, and the report says so.

    Parameters
    ----------
    suites : sequence of Suite
    parts : sequence of Part
        Of these suites.
    folder : Path
    heading : str
        A line on what was run.
    untracked : collection of str
        Names of suites without tables of tracks.
    mark : str
        What none of the figures must be taken without: it stands in every table, in the page and in files.

    Raises
    ------
    SinkError
        If a file cannot be written.
    """
    made = tuple(replace(table, mark=mark) for table in tables(parts, untracked))
    for table in made:
        write_whole(folder / TABLES / f"{table.name}.csv", table.csv().encode())
    write_whole(folder / FRAMES, _frames_csv(rows_of(parts)).encode())
    write_whole(folder / JOINTS, _joints_csv(parts).encode())
    write_whole(folder / JSON, _json(suites, parts, made, heading))
    plots, no_plots = _plots(parts, folder / PLOTS)
    report = Report(heading, made, (*plots, *write_worst(suites, parts, folder / WORST)), no_plots)
    write_whole(folder / MARKDOWN, markdown(report, suites, parts, folder).encode())
    write_whole(folder / SUMMARY, encode(summarise(suites, parts, heading, mark), indent=1))
    run = (heading, "; ".join(f"{name}: {value}" for name, value in environment().items()))
    pages = make_pages(suites, parts, report.pictures, run, untracked, mark)
    for name, page in pages.items():
        write_whole(folder / PAGES / f"{name}.md", page.encode())
    with sink_errors(folder / PAGES):
        for older in (folder / PAGES).glob("*.md"):
            if older.stem not in pages:
                older.unlink()  # of a suite that is not in this run: its figures would be taken for this run's
    return report


def markdown(report: Report, suites: Sequence[Suite], parts: Sequence[Part], folder: Path) -> str:
    """Return the report as a page; links are relative to the folder."""
    about = [
        f"- **{suite.name}** ({len(suite.sequences)} sequences, {suite.frames} frames): {suite.title}"
        for suite in suites
    ]
    machine = [f"- {name}: {value}" for name, value in environment().items()]
    pictures = [f"![{path.stem}]({path.relative_to(folder).as_posix()})" for path in report.pictures]
    blocks = [
        f"{report.heading}\n",
        "\n".join(about) + "\n",
        "\n".join(machine) + "\n",
        *([f"{NOTE}\n"] if any(table.has_intervals for table in report.tables) else []),
        *(table.markdown() for table in report.tables),
        "### Where it loses\n",
        "\n".join(f"- {line}" for line in losses(parts)) + "\n",
        "### Pictures\n",
        "\n\n".join([*pictures, *([report.no_plots] if report.no_plots else [])]) + "\n",
    ]
    return "\n".join(blocks)


def environment() -> dict[str, str]:
    """Return the machine and the versions that a run's figures depend on."""
    found = {
        "dloftbs": __version__,
        "Python": platform.python_version(),
        "system": f"{platform.system()} {platform.machine()}",
        "processor": f"{_processor()}, {os.cpu_count()} cores, one a sequence",
    }
    return found | {name: _version(name) for name in _LIBRARIES}


def _plots(parts: Sequence[Part], folder: Path) -> tuple[list[Path], str | None]:
    try:
        return write_plots(parts, folder), None
    except ImportError as error:
        return [], f"no plots, which need matplotlib ({error}): pip install 'dloftbs[evaluation]'"


def _frames_csv(rows: Sequence[FrameRow]) -> str:
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(FrameRow.__dataclass_fields__)
    writer.writerows([getattr(row, name) for name in FrameRow.__dataclass_fields__] for row in rows)
    return out.getvalue()


def _joints_csv(parts: Sequence[Part]) -> str:
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(("suite", "sequence", "index", "method", "kind", "confidence", "right"))
    for part in parts:
        key = part.key
        writer.writerows(
            (key.suite, key.sequence, joint.index, key.method, joint.kind.value, joint.confidence, joint.right)
            for joint in part.joints
        )
    return out.getvalue()


def _json(suites: Sequence[Suite], parts: Sequence[Part], made: Sequence[Table], heading: str) -> bytes:
    data: dict[str, Any] = {
        "heading": heading,
        "environment": environment(),
        "suites": {suite.name: {"title": suite.title, "settings": suite.settings} for suite in suites},
        "tables": {table.name: table.records() for table in made},
        "sequences": [
            {
                "suite": part.key.suite,
                "sequence": part.key.sequence,
                "method": part.key.method,
                "ladder": part.ladder,
                "level": part.level,
                "tracking": part.tracking,
                "frames": part.rows,
            }
            for part in parts
        ],
    }
    return encode(data, indent=1)


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor() or "unknown"
    return next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), "unknown")


def _version(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return "unknown"
