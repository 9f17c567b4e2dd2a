"""``dloftbs evaluate``: methods against sequences whose truth is known."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

import click

from dloftbs.cli.limits import MAX_JOBS, MAX_SCALE, MAX_SEED, MAX_TOLERANCE_PX, FilledPath, file_path, parse_size

if TYPE_CHECKING:
    from dloftbs.evaluation.suites import Suite

_METHODS = ("default", "paper")
PARTS = "parts"
"""Folder of the finished parts; it is made before all else."""


@click.command(short_help="Score methods on sequences whose truth is known.")
@click.argument("names", metavar="[SUITE]...", nargs=-1, type=FilledPath())
@click.option(
    "--method",
    "methods",
    multiple=True,
    default=_METHODS,
    show_default=True,
    metavar="METHOD",
    help="default, paper, or MODULE:CALLABLE. Repeatable, or with commas.",
)
@click.option(
    "--out",
    "-o",
    type=file_path(file_okay=False),
    default="evaluation",
    show_default=True,
    metavar="FOLDER",
)
@click.option("--quick", is_flag=True, help="A tenth of the frames, of 640x360.")
@click.option(
    "--scale", type=click.FloatRange(0.0, MAX_SCALE, min_open=True), metavar="X", help="Share of the frames; 1."
)
@click.option("--size", metavar="WxH", callback=parse_size, help="Of what is generated; 1280x720.")
@click.option("--seed", type=click.IntRange(0, MAX_SEED), default=0, show_default=True, help="For other sequences.")
@click.option(
    "--tolerance",
    type=click.FloatRange(0.0, MAX_TOLERANCE_PX, min_open=True),
    metavar="PX",
    help="Largest L3 of a right object; what the data say, or 5 at 1280x720 and in proportion.",
)
@click.option("--jobs", "-j", type=click.IntRange(1, MAX_JOBS), metavar="N", help="Processes; one for each core.")
def evaluate(
    names: tuple[str, ...],
    methods: tuple[str, ...],
    out: Path,
    quick: bool,
    scale: float | None,
    size: tuple[int, int] | None,
    seed: int,
    tolerance: float | None,
    jobs: int | None,
) -> None:
    """Score methods on sequences whose truth is known, and print the tables.

    SUITE is rgbd-artificial, rgbd-noisy, rgbd-camera, rgb, rgbd, several-cables, kinds, tracking, plain-sight,
    edge-cases, simulated (by MuJoCo, where it is installed), noise, or a folder of labelled data, or LAYOUT:FOLDER,
    such as mbest:photographs; without any, all the generated ones.
    MODULE:CALLABLE is a function from a frame to curves: arrays of points (n, 2) px or (n, 3) m in order, splines,
    or a mapping from identities to such; or a class, of which an instance is made for each sequence and called so.
    Python must find the module: see PYTHONPATH.

    The folder gets the tables (report.md, tables/*.csv, report.json), every frame's scores (frames.csv), whether
    every joint is right (joints.csv), plots, and pictures of the worst frames. Finished sequences are
    kept there, too: the same command goes on where it was interrupted.

    \b
    dloftbs evaluate --quick
    dloftbs evaluate rgb several-cables --method default,mymodule:find --out results
    """
    from dloftbs.cli.evaluation_progress import open_parts_progress
    from dloftbs.cli.methods import method_of
    from dloftbs.cli.outputs import claim_folder
    from dloftbs.evaluation.report.write import write_report
    from dloftbs.evaluation.runner.run import evaluate as run

    suites = _suites(names, quick, scale, size, seed, tolerance)
    _check_out(names, out)
    wanted = [method_of(name) for given in methods for name in given.split(",")]
    total = sum(suite.frames for suite in suites) * len(wanted)
    with claim_folder(out), open_parts_progress(total) as progress:
        parts = run(suites, wanted, out / PARTS, jobs=jobs or os.cpu_count() or 1, finished=progress)
        report = write_report(suites, parts, out, _heading(suites, quick))
    if report.no_plots is not None:
        click.echo(report.no_plots, err=True)
    click.echo(report.text())
    click.echo(f"written to {out}", err=True)


def _check_out(names: tuple[str, ...], out: Path) -> None:
    """Let only a folder pass in which nothing is replaced but what an evaluation wrote.

    Raises
    ------
    SinkError
        If labelled data lies in a folder that is written to, or around it, or other files have the results' names.
    """
    from dloftbs.errors import SinkError
    from dloftbs.evaluation.report.write import FRAMES, JOINTS, JSON, MARKDOWN, PLOTS, TABLES, WORST
    from dloftbs.evaluation.suites import SUITES, place_of

    for name in names:
        data = Path(os.path.realpath(place_of(name)))
        for folder in (out, *(out / part for part in (PARTS, TABLES, PLOTS, WORST))):
            if name not in SUITES and Path(os.path.realpath(folder)).is_relative_to(data):
                raise SinkError(f"--out {out} would write into the labelled data of {name}: choose another folder")
    results = (MARKDOWN, JSON, FRAMES, JOINTS, TABLES, PLOTS, WORST)
    there = [name for name in results if os.path.lexists(out / name)]
    if there and not (out / PARTS).is_dir():
        raise SinkError(
            f"{out} is not the folder of an evaluation, and holds {', '.join(there)}, which would be replaced: "
            "choose another folder with --out"
        )


def _suites(
    names: tuple[str, ...],
    quick: bool,
    scale: float | None,
    size: tuple[int, int] | None,
    seed: int,
    tolerance: float | None,
) -> list[Suite]:
    from dloftbs.evaluation.suites import HD, QUICK_SCALE, QUICK_SIZE, SUITES, missing_for, open_suite

    default_scale, default_size = (QUICK_SCALE, QUICK_SIZE) if quick else (1.0, HD)
    lacking = {name: remedy for name in SUITES if not names and (remedy := missing_for(name)) is not None}
    for name, remedy in lacking.items():
        click.echo(f"left out {name}: {remedy}", err=True)
    return [
        open_suite(name, scale=scale or default_scale, seed=seed, size=size or default_size, tolerance_px=tolerance)
        for name in names or SUITES
        if name not in lacking
    ]


def _heading(suites: list[Suite], quick: bool) -> str:
    settings = dict.fromkeys(suite.settings for suite in suites)
    what = f"{sum(suite.frames for suite in suites)} frames; {'; '.join(settings)}"
    return f"{what} (quick: fewer and smaller frames than the full suites)" if quick else what
