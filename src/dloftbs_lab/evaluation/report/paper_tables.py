"""The paper's tables I to IV in their own form: what is printed, and beneath it what was measured here."""

from __future__ import annotations

import re
import statistics
from collections.abc import Callable, Iterable, Sequence

from dloftbs_lab.evaluation import paper_figures
from dloftbs_lab.evaluation.paper_figures import L1_PX, L2_PX, MARK, MS, PHOTOGRAPHS, Published
from dloftbs_lab.evaluation.report.spread import COVERAGE, Sample, frames_of
from dloftbs_lab.evaluation.report.table import Cell, Estimate, Table, existing, mean, shown
from dloftbs_lab.evaluation.runner.finished_parts import FrameRow, Part
from dloftbs_lab.evaluation.suites import SUITES

SUITES_OF_PAPER = ("rgb", "several-cables", "rgbd", "rgbd-artificial")
"""Generated stand-ins of the data of tables I to IV."""
TABLES_OF_PAPER = ("table-1", "table-2", "table-3", "table-4")
"""Names of the tables."""

_Frames = Sample[FrameRow]
_Figure = Callable[[FrameRow], float | None]
_HERE = "here"
_EMPTY = "frames without a curve"
_THEIRS = (
    f'Rows with "{MARK}" are printed in the paper: its authors measured all methods, on their data and an i7-9750H. '
    "Rows of the same number are of the same kind of scene, not the same scene. "
    f"Intervals: {COVERAGE:.0%}, by bootstrap over scenes."
)
_ONE = (
    "`paper` joins all segments, the authors' form for one cable. `cpd`, where it stands, is a baseline of the family "
    "of CDCPD2, told the first frame's curve and the length of the cable."
)
_NOTE_1 = (
    "Mean ± deviation over frames. L1: mask pixels to curves, L2: curves to mask pixels, both over what shows. Out of "
    f"view in 3, occlusions in 2 to 6, a self-crossing in 6. {_ONE} {_THEIRS}"
)
_NOTE_2 = (
    "L3 is from the whole true curves, mean over images; missing and redundant are counts in as many images as the "
    f"paper has, {PHOTOGRAPHS}, and so in proportion where there are more or fewer. `paper` is the authors' form for "
    f"several cables. {_THEIRS}"
)
_NOTE_3 = (
    "Means over frames. The paper prints no unit of L1 and L2: here are px in the image, and mm in space, there "
    "between the curve and the mask's pixels at their measured depth, those at edges whose depth flies included. "
    "`default` follows the axis, so that its L1 and L2 in space are a radius of the cable, 2 to 10 mm. "
    f"{_ONE} {_THEIRS}"
)
_NOTE_4 = (
    "Over frames. The paper prints no unit of L3: here are px in the image, and mm in space from the true axis. A "
    "curve through depth as it is measured follows the surface that faces the camera, 4 to 5 mm before the axis. If "
    "a method's curves are nearer to that line than to the axis, their L3 from it stands beneath, in mm. "
    f"{_ONE} {_THEIRS}"
)


def paper_tables(parts: Sequence[Part]) -> list[Table]:
    """Return those of tables I to IV that the parts have figures for."""
    of = {suite: [part for part in parts if part.key.suite == suite] for suite in SUITES_OF_PAPER}
    several = [part for part in parts if part.key.suite == "several-cables" or part.key.suite not in SUITES]
    made = []
    if of["rgb"]:
        title = "Table I: 2D videos of one cable"
        made.append(_by_scenario("table-1", title, of["rgb"], paper_figures.TABLE_I, _rows_1, _NOTE_1))
    if several:
        made.append(_table_2(several))
    if of["rgbd"]:
        title = "Table III: 3D videos of a cable in hands"
        made.append(_by_scenario("table-3", title, of["rgbd"], paper_figures.TABLE_III, _rows_3, _NOTE_3))
    if of["rgbd-artificial"]:
        title = "Table IV: artificial 3D videos, L3"
        made.append(_by_scenario("table-4", title, of["rgbd-artificial"], paper_figures.TABLE_IV, _rows_4, _NOTE_4))
    return made


def scenario_of(sequence: str) -> str | None:
    """Return the number that the name of a sequence begins with, as the paper counts its scenarios."""
    number = re.match(r"\d+", sequence)
    return number[0] if number else None


def _by_scenario(
    name: str,
    title: str,
    parts: Sequence[Part],
    published: Sequence[Published],
    figures: Callable[[Sequence[_Frames]], Iterable[tuple[str, Sequence[Cell]]]],
    note: str,
) -> Table:
    scenarios = [str(number) for number in range(len(published[0].cells))]
    rows: list[tuple[Cell, ...]] = [(row.method, MARK, row.figure, *row.cells) for row in published]
    for method in dict.fromkeys(part.key.method for part in parts):
        mine = [part for part in parts if part.key.method == method]
        frames = [frames_of(part for part in mine if scenario_of(part.key.sequence) == one) for one in scenarios]
        rows += [(method, _HERE, figure, *cells) for figure, cells in figures(frames)]
        empty = [sum(row.n_found == 0 and row.n_true > 0 for row in of_one.items) for of_one in frames]
        if any(empty):
            rows.append((method, _HERE, _EMPTY, *map(str, empty)))
    return Table(name, title, ("method", "from", "figure", *scenarios), tuple(rows), note)


def _rows_1(frames: Sequence[_Frames]) -> Iterable[tuple[str, Sequence[Cell]]]:
    for name, figure in ((L1_PX, _l1_px), (L2_PX, _l2_px), (MS, _ms)):
        yield name, [_mean_and_deviation(of_one, figure) for of_one in frames]
        if figure is not _ms:
            yield from _intervals(name, frames, figure)


def _rows_3(frames: Sequence[_Frames]) -> Iterable[tuple[str, Sequence[Cell]]]:
    figures: dict[str, _Figure] = {
        "L1 mm": lambda row: row.l1_mm,
        "L2 mm": lambda row: row.l2_mm,
        L1_PX: _l1_px,
        L2_PX: _l2_px,
        MS: _ms,
    }
    for name, figure in figures.items():
        yield name, [shown(mean(map(figure, of_one.items))) for of_one in frames]
        if figure is not _ms:
            yield from _intervals(name, frames, figure)


def _rows_4(frames: Sequence[_Frames]) -> Iterable[tuple[str, Sequence[Cell]]]:
    figures: dict[str, _Figure] = {"L3 mm": lambda row: row.l3_mm, "L3 px": lambda row: row.l3_whole_px}
    every = [row for of_one in frames for row in of_one.items]
    axis, surface = mean(row.l3_mm for row in every), mean(row.l3_surface_mm for row in every)
    if axis is not None and surface is not None and surface < axis:
        figures = {"L3 mm": figures["L3 mm"], "L3 mm, surface": lambda row: row.l3_surface_mm, **figures}
    for name, figure in figures.items():
        known = [existing(map(figure, of_one.items)) for of_one in frames]
        yield f"{name} mean", [shown(statistics.fmean(values) if values else None) for values in known]
        yield from _intervals(f"{name} mean", frames, figure)
        for what, of in (("max", max), ("min", min)):
            yield f"{name} {what}", [shown(of(values) if values else None) for values in known]


def _intervals(name: str, frames: Sequence[_Frames], figure: _Figure) -> Iterable[tuple[str, Sequence[Cell]]]:
    """Yield a row of the intervals of means, where any scenario has several scenes."""
    means = [of_one.mean(figure) for of_one in frames]
    if any(isinstance(value, Estimate) for value in means):
        yield f"{name}, interval", [_interval(value) for value in means]


def _interval(value: Cell) -> str:
    return str(value).partition(" ")[2] if isinstance(value, Estimate) else shown(None)


def _table_2(parts: Sequence[Part]) -> Table:
    columns = ("method", "from", *paper_figures.TABLE_II_FIGURES, "images", "cables")
    rows: list[tuple[Cell, ...]] = [
        (row.method, MARK, *row.cells, str(PHOTOGRAPHS), None) for row in paper_figures.TABLE_II
    ]
    groups: dict[tuple[str, str], list[Part]] = {}
    for part in parts:
        groups.setdefault((part.key.suite, part.key.method), []).append(part)
    for (suite, method), of_group in groups.items():
        frames = frames_of(of_group)
        figures = (
            shown(frames.mean(lambda row: row.l3_whole_px)),
            shown(frames.mean(lambda row: row.missing, PHOTOGRAPHS)),
            shown(frames.mean(lambda row: row.redundant, PHOTOGRAPHS)),
            shown(mean(map(_ms, frames.items))),
        )
        origin = "here, generated" if suite in SUITES else f"here, {suite}"
        cables = frames.total(lambda row: row.n_true)
        rows.append((method, origin, *figures, str(len(frames)), str(cables)))
    return Table("table-2", "Table II: images of several cables", columns, tuple(rows), _NOTE_2)


def _mean_and_deviation(frames: _Frames, figure: _Figure) -> str:
    values = existing(map(figure, frames.items))
    return f"{statistics.fmean(values):.2f}±{statistics.pstdev(values):.2f}" if values else shown(None)


def _l1_px(row: FrameRow) -> float | None:
    return row.l1_px


def _l2_px(row: FrameRow) -> float | None:
    return row.l2_px


def _ms(row: FrameRow) -> float:
    return row.ms
