"""``dloftbs evaluate``: methods against sequences whose truth is known."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

import click

from dloftbs.cli.limits import MAX_JOBS, MAX_SCALE, MAX_SEED, MAX_TOLERANCE_PX, FilledPath, file_path, parse_size
from dloftbs_lab.commands.method_options import MethodSettings, method_options

if TYPE_CHECKING:
    from dloftbs_lab.evaluation.suites import Suite

_METHODS = ("default", "paper")
PARTS = "parts"
"""Folder of the finished parts; it is made before all else."""
_QUICK = "quick run"
_UNSEEN_SEED = 1000
"""Seed of sequences that no weights were fitted on; `make results` has it, too.

Source: by definition; no fit of `benchmarks` draws from it.
"""
_NO_TRACKING = "no tracking tables: so few frames say nothing of tracking, run without --quick"


@click.command(short_help="Score methods on sequences whose truth is known.")
@click.argument("names", metavar="[SUITE]...", nargs=-1, type=FilledPath())
@click.option(
    "--method",
    "methods",
    multiple=True,
    default=_METHODS,
    show_default=True,
    metavar="METHOD",
    help="Methods to score: default, paper, stereo, cpd (a baseline), FILE.yaml (a configuration), MODULE:CALLABLE. "
    "Repeatable, or separated by commas.",
)
@method_options
@click.option(
    "--out",
    "-o",
    type=file_path(file_okay=False),
    default="evaluation",
    show_default=True,
    metavar="FOLDER",
    help="Folder of the results.",
)
@click.option(
    "--paper", "is_paper", is_flag=True, help="Print tables I to IV of the paper, with the rows of these methods below."
)
@click.option("--quick", is_flag=True, help="Score a tenth of the scenes, at 640x360, without tables of tracking.")
@click.option(
    "--scale",
    type=click.FloatRange(0.0, MAX_SCALE, min_open=True),
    metavar="X",
    help="Share of the scenes. Default: 1.",
)
@click.option("--size", metavar="WxH", callback=parse_size, help="Size of generated images. Default: 1280x720.")
@click.option(
    "--seed",
    type=click.IntRange(0, MAX_SEED),
    default=_UNSEEN_SEED,
    show_default=True,
    metavar="N",
    help="Seed of the sequences. Weights were fitted on scenes of some other seeds, 0 to 2 among them.",
)
@click.option(
    "--tolerance",
    type=click.FloatRange(0.0, MAX_TOLERANCE_PX, min_open=True),
    metavar="PX",
    help="Largest L3 of a right object. Default: the limit of the data, or 5 at 1280x720, scaled with the size.",
)
@click.option(
    "--jobs", "-j", type=click.IntRange(1, MAX_JOBS), metavar="N", help="Number of processes. Default: one per core."
)
def evaluate(
    names: tuple[str, ...],
    methods: tuple[str, ...],
    settings: MethodSettings,
    out: Path,
    is_paper: bool,
    quick: bool,
    scale: float | None,
    size: tuple[int, int] | None,
    seed: int,
    tolerance: float | None,
    jobs: int | None,
) -> None:
    """Score methods on sequences whose truth is known, and print the tables.

    Each figure is over 20 scenes or more with different seeds, and has a 95 % interval from a bootstrap over scenes.
    Single scenarios of rgbd and rgbd-artificial have 8 scenes. --quick and --scale take fewer.

    SUITE is a generated suite: rgbd-artificial, rgbd-noisy, rgbd-camera, rgb, rgbd, several-cables, kinds, tracking,
    known-occluders, seen-occluders, noise, plain-sight, edge-cases, real-footage, two-cameras or harness. The suite
    simulated needs MuJoCo. The suite real-motion needs its recordings, or real-motion:FOLDER. A folder of labelled
    data is a suite, too (see below). By default all generated suites are scored.

    With --paper the suites are rgb, several-cables, rgbd and rgbd-artificial, unless some of them are named. Folders
    of photographs of several cables join Table II.

    METHOD is default or paper; on sequences of one cable, paper uses the authors' form for one cable. A YAML
    configuration, as `dloftbs config` prints it, is a method, too. So is MODULE:CALLABLE, a function
    from a frame to curves: arrays of points (n, 2) px or (n, 3) m in order, splines, or a mapping from ids to
    these. A class is instantiated for each sequence; its optional method start(frame, truth) gets the first frame.
    Modules are found in the current folder, and on Python's path.

    The method cpd is coherent point drift with stretch limits, the family of CDCPD2, for rgb, rgbd and
    rgbd-artificial. It knows the first curve and the cable's length. The method stereo is `StereoPipeline`, for
    two-cameras; other methods see only the first view. --config and --set change the package's own methods. With
    --hsv, MODULE:CALLABLE gets the mask by colour, too, as the package's own methods find it.

    The folder of --out gets the tables (report.md, pages/*.md, tables/*.csv, report.json), a summary
    (summary.json), the scores of each frame (frames.csv) and of each joint (joints.csv), plots, and pictures of the
    worst frames. Finished sequences are kept there, so the same command resumes after an interruption.

    \b
    dloftbs evaluate --quick
    dloftbs evaluate --paper ariadne:photographs
    dloftbs evaluate rgb several-cables --method default,mymodule:find --out results
    dloftbs evaluate mydata --method default,paper,mine.yaml --hsv 100:130

    A folder of labelled data has frames, and their truth beside them under the same name. It is one sequence, in
    natural order of the names; a folder of such folders is a suite. If the curves are known, as points along
    each cable from end to end:

    \b
    mydata/
      00.png         image or mask: .png .jpg .jpeg .bmp .tif .tiff .webp .pbm .pgm .ppm
      00.json        its truth: {"curves": [[[x, y], [x, y], ...], ...]}, a list of points per cable
      00.mask.png    mask of the image; without it, give --hsv
      00.depth.png   depth: 16 bits in mm, or 00.depth.npy in metres; optional
      00.occluders.png   mask of objects that may hide cables; optional
      01.jpg
      01.csv         in place of JSON: a line object,x,y (or object,x,y,z), then a row per point
      camera.json    {"fx": ..., "fy": ..., "cx": ..., "cy": ...}, for curves in metres; optional

    Any non-zero of a mask is cable, unless many grey values make it a probability, whose cable begins at one half.
    x and y are pixels, right and down from the centre of the top left pixel. With points [x, y, z], z being the
    depth in metres, and a camera, curves in space are scored, too. A cubic spline goes through two points or more;
    repeat the first point at the end for a loop. Images without truth are skipped, with a warning. Each image counts
    by itself; ids are scored in sequences with times, as `dloftbs_lab.write_sequence` writes them.
    If only the mask of each cable is known, the score is DICE:

    \b
    mydata/
      00.jpg
      00.labels.png  number of the object in each pixel, 0 is ground: one channel, or indexed colour
      00.mask.png    mask of the image; without it, methods get all labelled pixels

    Published data sets are read as LAYOUT:FOLDER. LAYOUT is written, labels, mbest, ariadne, spline tables or
    polylines; without it, the layout is recognised. For any other folder, the error shows all layouts.
    """
    from dloftbs.support.safe_files import claim_folder
    from dloftbs_lab.commands.evaluation_progress import open_parts_progress
    from dloftbs_lab.commands.methods import current_folder_importable, methods_of
    from dloftbs_lab.evaluation.report.write import write_report
    from dloftbs_lab.evaluation.runner.run import evaluate as run
    from dloftbs_lab.evaluation.runner.run import tasks_of

    names = _names_of_paper(names) if is_paper else names
    suites = _suites(names, quick, scale, size, seed, tolerance)
    _check_out(names, out)
    wanted_names = [name for given in methods for name in given.split(",")]
    with current_folder_importable():
        wanted = methods_of(wanted_names, settings)
        _check_colours(suites, wanted_names, settings)
        total = sum(task.key.frames for task in tasks_of(suites, wanted))
        with claim_folder(out), open_parts_progress(total) as progress:
            parts = run(suites, wanted, out / PARTS, jobs=jobs or os.cpu_count() or 1, finished=progress)
            untracked = [suite.name for suite in suites if quick and suite.thinned]
            heading = _heading(suites, quick, untracked)
            report = write_report(suites, parts, out, heading, untracked, _mark(suites, quick, scale))
    if report.no_plots is not None:
        click.echo(report.no_plots, err=True)
    click.echo(report.text(only_paper=is_paper))
    click.echo(f"written to {out}", err=True)


def _names_of_paper(names: tuple[str, ...]) -> tuple[str, ...]:
    """Return the suites of the paper's tables: those that are named, or all; and the folders."""
    from dloftbs_lab.evaluation.report.paper_tables import SUITES_OF_PAPER
    from dloftbs_lab.evaluation.suites import SUITES

    return names if any(name in SUITES for name in names) else (*SUITES_OF_PAPER, *names)


def _check_colours(suites: list[Suite], methods: list[str], settings: MethodSettings) -> None:
    """Find out from the first frame of labelled data whether methods can work on it.

    Raises
    ------
    InputError
        If it is a picture without a mask, and a method does not know the colour of cables.
    """
    from dloftbs.errors import InputError
    from dloftbs_lab.commands.methods import config_of
    from dloftbs_lab.evaluation.suites import SUITES

    configs = {name: config for name in methods if (config := config_of(name, settings)) is not None}
    colourless = [name for name, config in configs.items() if not config.segmentation.is_given]
    for suite in suites:
        if not suite.frames or (suite.name in SUITES and not settings.hsv):
            continue
        frame = next(sequence for sequence in suite.sequences if len(sequence)).frame(0)
        if frame.mask is None and colourless:
            raise InputError(
                f"{suite.name}: {frame.name} is a picture without a mask, and nothing says to {', '.join(colourless)} "
                "what in it is cable: give its colour, e.g. --hsv 170:10,80:255,60:255 for red, masks in files such as "
                f"{Path(frame.name).stem}.mask.png, or other methods with --method"
            )
        if frame.image is None and settings.hsv:
            click.echo(f"{suite.name}: --hsv makes no difference, since its frames are masks", err=True)


def _check_out(names: tuple[str, ...], out: Path) -> None:
    """Let only a folder pass in which nothing is replaced but what an evaluation wrote.

    Raises
    ------
    SinkError
        If labelled data lies in a folder that is written to, or around it, or other files have the results' names.
    """
    from dloftbs.errors import SinkError
    from dloftbs_lab.evaluation.report.pages import WORST
    from dloftbs_lab.evaluation.report.write import FRAMES, JOINTS, JSON, MARKDOWN, PAGES, PLOTS, SUMMARY, TABLES
    from dloftbs_lab.evaluation.suites import SUITES, place_of

    for name in names:
        data = Path(os.path.realpath(place_of(name)))
        for folder in (out, *(out / part for part in (PARTS, TABLES, PLOTS, WORST, PAGES))):
            if name not in SUITES and Path(os.path.realpath(folder)).is_relative_to(data):
                raise SinkError(f"--out {out} would write into the labelled data of {name}: choose another folder")
    results = (MARKDOWN, JSON, SUMMARY, FRAMES, JOINTS, TABLES, PLOTS, WORST, PAGES)
    there = [name for name in results if os.path.lexists(out / name)]
    if there and not os.path.isdir(out / PARTS):
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
    from dloftbs_lab.evaluation.suites import HD, QUICK_SCALE, QUICK_SIZE, SUITES, missing_for, open_suite

    default_scale, default_size = (QUICK_SCALE, QUICK_SIZE) if quick else (1.0, HD)
    lacking = {name: remedy for name in SUITES if not names and (remedy := missing_for(name)) is not None}
    for name, remedy in lacking.items():
        click.echo(f"left out {name}: {remedy}", err=True)
    return [
        open_suite(name, scale=scale or default_scale, seed=seed, size=size or default_size, tolerance_px=tolerance)
        for name in names or SUITES
        if name not in lacking
    ]


def _heading(suites: list[Suite], quick: bool, untracked: list[str]) -> str:
    settings = dict.fromkeys(suite.settings for suite in suites)
    what = f"{sum(suite.frames for suite in suites)} frames; {'; '.join(settings)}"
    why = f"; {_NO_TRACKING}" if untracked else ""
    return f"QUICK RUN, a tenth of the scenes in small images: to try, not to quote. {what}{why}" if quick else what


def _mark(suites: list[Suite], quick: bool, scale: float | None) -> str:
    """Return what must stand beside every figure: that there are fewer scenes than a figure needs."""
    if not any(suite.thinned for suite in suites):
        return ""
    return _QUICK if quick else f"scale {scale:g}"
