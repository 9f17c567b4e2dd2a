"""Plots of a run: error over frames and against noise, times, trust in joints. Matplotlib is imported late."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from dloftbs.errors import SinkError
from dloftbs.support.arrays import FloatArray
from dloftbs_lab.evaluation.report.all_tables import clean_share
from dloftbs_lab.evaluation.report.joint_tables import KINDS, binned, joints_by_method
from dloftbs_lab.evaluation.report.picture_names import stem_of
from dloftbs_lab.evaluation.report.table import existing, mean, percent
from dloftbs_lab.evaluation.runner.finished_parts import FrameRow, Part

# Okabe and Ito's colours, distinguished by colour-blind readers too; a method has the same one in every plot.
_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
_BAD = "#B00020"
_LINES = ("-", "--", ":")  # so that two methods that agree are both seen
_MAX_PANELS, _MIN_FRAMES = 16, 12
_MIN_L3 = 0.05  # px or mm
_IN_METRES = ("rgbd-noisy",)
_RC: Any = {
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.alpha": 0.3,
    "axes.titlesize": 9,
    "axes.titlelocation": "left",
    "legend.frameon": False,
}


def write_plots(parts: Sequence[Part], folder: Path) -> list[Path]:
    """Draw all plots that the parts have figures for, as PNG.

    Raises
    ------
    ImportError
        If matplotlib is not installed.
    SinkError
        If a file cannot be written.
    """
    colours = {part.key.method: "" for part in parts}
    colours = {method: _COLOURS[i % len(_COLOURS)] for i, method in enumerate(colours)}
    paths = []
    for suite in dict.fromkeys(part.key.suite for part in parts):
        of_suite = [part for part in parts if part.key.suite == suite]
        ladders = list(dict.fromkeys(part.ladder for part in of_suite if part.ladder is not None))
        for base in dict.fromkeys(ladder.partition(",")[0] for ladder in ladders):
            of_base = [one for one in ladders if one.partition(",")[0] == base]
            of_depth = [one for one in of_base if one.partition(", ")[2].startswith("depth")]
            in_image = [one for one in of_base if one not in of_depth]
            if in_image:
                paths.append(_noise(of_suite, in_image, _IN_IMAGE, colours, _file(folder, "noise", base)))
            if of_depth:
                paths.append(_noise(of_suite, of_depth, _IN_SPACE, colours, _file(folder, "depth", base)))
        if not ladders:
            error = "l3_mm" if suite in _IN_METRES else "l3_px"
            paths.append(_frames(of_suite, error, colours, _file(folder, "frames", suite)))
    if parts:
        paths.append(_times(parts, colours, _file(folder, "times", "")))
    if any(part.joints for part in parts):
        paths.append(_joints(parts, colours, _file(folder, "joints", "")))
    return paths


def _frames(parts: Sequence[Part], error: str, colours: dict[str, str], path: Path) -> Path:
    """Draw an error, ``"l3_px"`` or ``"l3_mm"``, over the frames, a panel for all sequences of a name.

    On the axis stand marks where something is missing.
    """
    panels = [[part for part in parts if part.key.sequence == n] for n in dict.fromkeys(p.key.sequence for p in parts)]
    # A few frames are not worth a panel of their own.
    together = len(panels) > _MAX_PANELS or max(len(part.rows) for part in parts) < _MIN_FRAMES
    panels = [list(parts)] if together else panels
    known = existing(getattr(row, error) for part in parts for row in part.rows)
    highest = max([*known, 10.0])
    with _figure(path, len(panels)) as axes:
        for axis, of_panel in zip(axes, panels, strict=True):
            for number, (method, colour) in enumerate(colours.items()):
                rows = [row for part in of_panel if part.key.method == method for row in part.rows]
                _draw_frames(
                    axis, rows, error, {"label": method, "color": colour, "linestyle": _LINES[number % len(_LINES)]}
                )
            key = of_panel[0].key
            axis.set_title(key.suite if together else f"{key.suite}: {key.sequence}")
            axis.set(yscale="log", ylim=(_MIN_L3, 1.3 * highest), ylabel=f"L3, {error[-2:]}")
            axis.yaxis.set_major_formatter("{x:g}")
            axis.xaxis.get_major_locator().set_params(integer=True)
        axes[-1].set_xlabel("frame; marks on the axis: something is missing (|) or redundant (x)")
        axes[0].legend(loc="upper right", ncols=len(colours))
    return path


def _draw_frames(axis: Any, rows: Sequence[FrameRow], error: str, style: dict[str, Any]) -> None:
    x = np.arange(len(rows))
    values = _values([getattr(row, error) for row in rows]).clip(min=_MIN_L3)
    axis.plot(x, values, linewidth=1.0, marker=".", ms=3, **style)
    for name, marker in (("missing", "|"), ("redundant", "x")):
        bad = np.array([getattr(row, name) > 0 for row in rows], dtype=bool)
        at = axis.get_xaxis_transform()
        (marks,) = axis.plot(x[bad], np.zeros(bad.sum()), marker, color=_BAD, ms=6, clip_on=False, transform=at)
        marks.set_in_layout(False)  # what is not clipped, and empty, would make the axes collapse


def _noise(
    parts: Sequence[Part], ladders: Sequence[str], figures: Sequence[_Figure], colours: dict[str, str], path: Path
) -> Path:
    """Draw two figures over the level, a row of two panels for each ladder."""
    with _figure(path, len(ladders), columns=2) as axes:
        for i, ladder in enumerate(ladders):
            for number, (method, colour) in enumerate(colours.items()):
                style = {"marker": "o", "ms": 4, "color": colour, "linestyle": _LINES[number % len(_LINES)]}
                rungs = _rungs(parts, ladder, method)
                levels = sorted(rungs)
                for j, figure in enumerate(figures):
                    values = _values([figure.of(rungs[level]) for level in levels])
                    axes[2 * i + j].plot(levels, values, label=method, **style)
            axes[2 * i].set_title(ladder)
            for j, figure in enumerate(figures):
                axes[2 * i + j].set(ylabel=figure.label)
                axes[2 * i + j].set_ylim(*figure.limits)
        axes[0].legend(loc="best")
    return path


@dataclass(frozen=True)
class _Figure:
    """Quantity that is drawn over the levels of a ladder."""

    label: str
    of: Callable[[Sequence[FrameRow]], float | None]
    limits: tuple[float, float | None]


_IN_IMAGE = (
    _Figure("L3, px", lambda rows: mean(row.l3_px for row in rows), (0.0, None)),
    _Figure("clean frames, %", lambda rows: 100.0 * clean_share(rows), (-3.0, 103.0)),
)
_IN_SPACE = (
    _Figure("L3, mm", lambda rows: mean(row.l3_mm for row in rows), (0.0, None)),
    _Figure("length off, %", lambda rows: percent(mean(row.length_error for row in rows)), (0.0, None)),
)


def _rungs(parts: Sequence[Part], ladder: str, method: str) -> dict[float, list[FrameRow]]:
    rungs: dict[float, list[FrameRow]] = {}
    for part in parts:
        if part.ladder == ladder and part.key.method == method and part.level is not None:
            rungs.setdefault(part.level, []).extend(part.rows)
    return rungs


def _times(parts: Sequence[Part], colours: dict[str, str], path: Path) -> Path:
    times = {m: np.array([row.ms for part in parts if part.key.method == m for row in part.rows]) for m in colours}
    every = np.concatenate(list(times.values())).clip(min=1e-3)
    bins = np.geomspace(every.min() * 0.99, every.max() * 1.01, 41)
    with _figure(path, 1) as (axis,):
        for method, colour in colours.items():
            label = f"{method}, median {np.median(times[method]):.2f} ms"
            axis.hist(times[method].clip(min=1e-3), bins, color=colour, alpha=0.6, label=label)
        axis.set_xscale("log")
        axis.set_xlabel("ms a frame, the method's call alone")
        axis.set_ylabel("frames")
        axis.legend(loc="upper right")
    return path


def _joints(parts: Sequence[Part], colours: dict[str, str], path: Path) -> Path:
    """Draw the share of joints that are right over their stated confidence, a panel for each kind.

    The area of a mark grows with the number of joints in its bin; on the diagonal, confidence says what it means.
    """
    groups = joints_by_method(parts)
    with _figure(path, 1, columns=len(KINDS), row_height=2.6) as axes:
        for axis, kind in zip(axes, KINDS, strict=True):
            axis.plot((0.0, 1.0), (0.0, 1.0), color="0.6", linewidth=1.0, linestyle="--")
            for number, (method, by_kind) in enumerate(groups.items()):
                bins = [one for one in binned(by_kind[kind]) if one.number]
                x, y = ([getattr(one, name) for one in bins] for name in ("stated", "right"))
                counts = np.array([one.number for one in bins], dtype=np.float64)
                share = counts / max(1.0, counts.sum())
                style = {"color": colours[method], "label": f"{method}, {counts.sum():.0f} joints"}
                axis.plot(x, y, linewidth=1.0, linestyle=_LINES[number % len(_LINES)], **style)
                axis.scatter(x, y, 12.0 + 240.0 * share, color=colours[method], alpha=0.6, linewidths=0.0)
            axis.set(title=kind, xlabel="stated confidence", xlim=(-0.03, 1.03), ylim=(-0.03, 1.03))
            axis.legend(loc="lower right")
        axes[0].set_ylabel("share right")
    return path


@contextmanager
def _figure(path: Path, panels: int, columns: int = 1, row_height: float = 1.6) -> Iterator[list[Any]]:
    """Open a figure with rows of panels, each of this height in inches, and write it at the end."""
    import matplotlib as mpl
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    with mpl.rc_context(_RC):
        figure = Figure(figsize=(9.0, 1.2 + row_height * panels), dpi=100, layout="constrained")
        FigureCanvasAgg(figure)
        yield list(figure.subplots(panels, columns, squeeze=False).ravel())
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            figure.savefig(path)
        except OSError as error:
            raise SinkError(f"cannot write {str(path)!r}: {error}") from error


def _file(folder: Path, what: str, suite: str) -> Path:
    return folder / f"{stem_of(what, suite)}.png"


def _values(values: Sequence[float | None]) -> FloatArray:
    return np.array([np.nan if value is None else value for value in values], dtype=np.float64)
