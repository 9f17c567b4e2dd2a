"""``dloftbs evaluate``: methods against sequences whose truth is known."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

import click

from dloftbs.cli.options import parse_size

if TYPE_CHECKING:
    from dloftbs.evaluation.suites import Suite

_METHODS = ("default", "paper")


@click.command(short_help="Score methods on sequences whose truth is known.")
@click.argument("names", metavar="[SUITE]...", nargs=-1)
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
    type=click.Path(path_type=Path, file_okay=False),
    default="evaluation",
    show_default=True,
    metavar="FOLDER",
)
@click.option("--quick", is_flag=True, help="A tenth of the frames, of 640x360.")
@click.option("--scale", type=click.FloatRange(0.0, min_open=True), metavar="X", help="Share of the frames; 1.")
@click.option("--size", metavar="WxH", callback=parse_size, help="Of what is generated; 1280x720.")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Another one, other sequences.")
@click.option("--jobs", "-j", type=click.IntRange(min=1), metavar="N", help="Processes; as many as there are cores.")
def evaluate(
    names: tuple[str, ...],
    methods: tuple[str, ...],
    out: Path,
    quick: bool,
    scale: float | None,
    size: tuple[int, int] | None,
    seed: int,
    jobs: int | None,
) -> None:
    """Score methods on sequences whose truth is known, and print the tables.

    SUITE is rgbd-artificial, rgbd-noisy, rgb, rgbd, several-cables, kinds, tracking, plain-sight, noise, or a
    folder of labelled data; without any, all the generated ones. MODULE:CALLABLE is a function from a frame to
    curves: arrays of points (n, 2) px or (n, 3) m in order, splines, or a mapping from identities to such; or a
    class, of which an instance is made for each sequence and called so. Python must find the module: see PYTHONPATH.

    The folder gets the tables (report.md, tables/*.csv, report.json), every frame's scores (frames.csv), whether
    every joint is right (joints.csv), plots, and pictures of the worst frames. What is finished is kept there,
    too: the same command goes on where it was interrupted.

    \b
    dloftbs evaluate --quick
    dloftbs evaluate rgb several-cables --method default,mymodule:find --out results
    """
    from dloftbs.cli.evaluation_progress import open_parts_progress
    from dloftbs.cli.methods import method_of
    from dloftbs.evaluation.report import write_report
    from dloftbs.evaluation.runner import evaluate as run

    suites = _suites(names, quick, scale, size, seed)
    wanted = [method_of(name) for given in methods for name in given.split(",")]
    total = sum(suite.frames for suite in suites) * len(wanted)
    with open_parts_progress(total) as progress:
        parts = run(suites, wanted, out / "parts", jobs=jobs or os.cpu_count() or 1, finished=progress)
        report = write_report(suites, parts, out, _heading(suites, quick))
    if report.no_plots is not None:
        click.echo(report.no_plots, err=True)
    click.echo(report.text())
    click.echo(f"written to {out}", err=True)


def _suites(
    names: tuple[str, ...], quick: bool, scale: float | None, size: tuple[int, int] | None, seed: int
) -> list[Suite]:
    from dloftbs.evaluation.suites import HD, QUICK_SCALE, QUICK_SIZE, SUITES, open_suite

    default_scale, default_size = (QUICK_SCALE, QUICK_SIZE) if quick else (1.0, HD)
    return [
        open_suite(name, scale=scale or default_scale, seed=seed, size=size or default_size) for name in names or SUITES
    ]


def _heading(suites: list[Suite], quick: bool) -> str:
    settings = dict.fromkeys(suite.settings for suite in suites)
    what = f"{sum(suite.frames for suite in suites)} frames; {'; '.join(settings)}"
    return f"{what} (quick: fewer and smaller frames than the full suites)" if quick else what
