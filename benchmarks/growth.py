"""How the time of a frame grows: with the mask, with the number of segments, and with the image around the same mask.

Run it with ``python -m benchmarks.growth [--quick] [--docs PAGE] [--plot PNG]``. Masks of cables from 320 x 240 to 4K,
from 2 to 40 px wide, from one cable to fifty, up to some 200 segments, and up to 200 objects; each moves to and fro by
2 px, and is tracked.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import Any

import cv2
import numpy as np

from benchmarks.docs import arguments, published
from benchmarks.scenes import Mask, cables, hooks
from benchmarks.timing import Floats
from dloftbs import Config, Frame, Pipeline
from dloftbs.pipeline.stages import run_stages

SIZES: tuple[tuple[int, int], ...] = (
    (240, 320),
    (360, 640),
    (480, 640),
    (540, 960),
    (720, 1280),
    (1080, 1920),
    (1440, 2560),
    (2160, 3840),
)
WIDTHS_PX: tuple[float, ...] = (2.0, 3.0, 4.0, 6.0, 9.0, 12.0, 17.0, 24.0, 32.0, 40.0)
LENGTHS_PX: tuple[float, ...] = (100.0, 200.0, 400.0, 700.0, 1100.0, 1600.0, 2200.0)
LONG: tuple[int, ...] = (1, 2, 3, 4, 6, 8, 10)
HOOKS: tuple[int, ...] = (10, 20, 50, 100, 200)
SHORT: tuple[int, ...] = (1, 2, 4, 7, 12, 20, 33, 50)

WHOLE = "all"
GROUPS = {
    "cleaning, skeleton": ("cleaning", "skeleton"),
    "segments, linking": ("segments", "linking"),
    "fitting, crossings": ("fitting", "crossings"),
    "tracking": ("tracking",),
}
_COLOURS = ("#222222", "#0072B2", "#D55E00", "#009E73", "#CC79A7")
_HD_PX, _SHIFT_PX = 720.0, 2


@dataclass
class Point:
    """One mask, and how long it took.

    Parameters
    ----------
    x : float
        What it is plotted against.
    frames : list of Frame
        The mask, and the same a little further down.
    """

    x: float
    frames: list[Frame]
    pipeline: Pipeline = field(default_factory=Pipeline)
    times: dict[str, list[float]] = field(default_factory=dict)

    def process(self, turn: int) -> None:
        """Take it through the pipeline once more."""
        since = perf_counter()
        result = self.pipeline.process(self.frames[turn % 2])
        self.times.setdefault(WHOLE, []).append(1e3 * (perf_counter() - since))
        for name, stages in GROUPS.items():
            total = sum(result.stage_ms.get(stage, 0.0) for stage in stages)
            self.times.setdefault(name, []).append(total)


@dataclass
class Series:
    """Masks of which one thing grows.

    Parameters
    ----------
    title, axis : str
    masks : callable
        Yields masks for a seed, each with what it is plotted against.
    """

    title: str
    axis: str
    masks: Callable[[int], Iterator[tuple[float, Mask]]]
    points: list[Point] = field(default_factory=list)


def main() -> None:
    """Print the exponents, and draw the plot."""
    parser = arguments(__doc__, "few masks and rounds, to see that it runs")
    parser.add_argument("--plot", type=Path, metavar="PNG", help="draw it")
    given = parser.parse_args()
    seeds, rounds = (1, 1) if given.quick else (3, 11)
    cv2.setNumThreads(1)
    series = all_series(quick=given.quick)
    with published("growth", given.docs):
        for one in series:
            one.points = [make_point(x, mask) for seed in range(seeds) for x, mask in one.masks(seed)]
            measure(one.points, rounds)
            print_exponents(one)
    if given.plot is not None:
        given.plot.parent.mkdir(parents=True, exist_ok=True)
        draw(series, given.plot)


def all_series(*, quick: bool) -> list[Series]:
    """Return what grows."""
    few = slice(None, None, 3 if quick else 1)
    sizes, widths = SIZES[few], WIDTHS_PX[few]
    pixels = "pixels of the mask"
    return [
        Series("320 x 240 to 4K, all in proportion", pixels, partial(by_size, sizes)),
        Series("2 to 40 px wide, 1280 x 720", pixels, partial(by_width, widths)),
        Series("1 cable of 100 to 2200 px", pixels, partial(by_length, LENGTHS_PX[few])),
        Series("1 to 10 cables of 1500 px", "segments", partial(by_segments, LONG[few])),
        Series("1 to 50 cables of 300 px", "cables", partial(by_cables, SHORT[few])),
        Series("10 to 200 hooks that lie apart", "hooks", partial(by_hooks, HOOKS[few])),
        Series("the same mask in larger images", "pixels of the image", partial(by_area, sizes)),
    ]


def by_size(sizes: tuple[tuple[int, int], ...], seed: int) -> Iterator[tuple[float, Mask]]:
    """Yield two cables, everything in proportion to the height of the image."""
    for size in sizes:
        k = size[0] / _HD_PX
        mask = cables(2, seed, 1200.0 * k, size, 12.0 * k)
        yield float(np.count_nonzero(mask)), mask


def by_width(widths: tuple[float, ...], seed: int) -> Iterator[tuple[float, Mask]]:
    """Yield two cables of all widths."""
    for width_px in widths:
        mask = cables(2, seed, 1200.0, width_px=width_px)
        yield float(np.count_nonzero(mask)), mask


def by_length(lengths: tuple[float, ...], seed: int) -> Iterator[tuple[float, Mask]]:
    """Yield ever longer cables."""
    for length_px in lengths:
        mask = cables(1, seed, length_px)
        yield float(np.count_nonzero(mask)), mask


def by_segments(counts: tuple[int, ...], seed: int) -> Iterator[tuple[float, Mask]]:
    """Yield ever more long cables, which cross ever more often."""
    for count in counts:
        mask = cables(count, seed)
        graph = run_stages(Frame(mask=mask), Config(), None).graph
        assert graph is not None  # so many segments are none too many
        yield graph.branch_count, mask


def by_cables(counts: tuple[int, ...], seed: int) -> Iterator[tuple[float, Mask]]:
    """Yield ever more short cables."""
    for count in counts:
        yield count, cables(count, seed, 300.0)


def by_hooks(counts: tuple[int, ...], seed: int) -> Iterator[tuple[float, Mask]]:
    """Yield ever more objects that have nothing to do with each other; the same for all seeds."""
    if seed == 0:
        for count in counts:
            yield count, hooks(count)


def by_area(sizes: tuple[tuple[int, int], ...], seed: int) -> Iterator[tuple[float, Mask]]:
    """Yield the cables of the smallest image in the middle of larger ones."""
    small = cables(2, seed, 400.0, SIZES[0], 6.0)
    for height, width in sizes:
        mask = np.zeros((height, width), np.uint8)
        top, left = (height - small.shape[0]) // 2, (width - small.shape[1]) // 2
        mask[top : top + small.shape[0], left : left + small.shape[1]] = small
        yield mask.size, mask


def make_point(x: float, mask: Mask) -> Point:
    """Return a mask, and the same a little further down, with what it is plotted against."""
    return Point(x, [Frame(mask=mask), Frame(mask=np.roll(mask, _SHIFT_PX, axis=0))])


def measure(points: list[Point], rounds: int) -> None:
    """Take all points in turn, again and again; the first two turns do not count."""
    for turn in range(-2, rounds):
        for point in points:
            if turn == 0:
                point.times.clear()
            point.process(turn)


def medians(series: Series, name: str) -> tuple[Floats, Floats]:
    """Return x and the median times of a series, by x."""
    points = sorted(series.points, key=lambda point: point.x)
    return np.array([point.x for point in points]), np.array([np.median(point.times[name]) for point in points])


def exponent(x: Floats, milliseconds: Floats) -> float:
    """Return the e of the power law ``x ** e`` that fits best, in logarithms."""
    return float(np.polyfit(np.log(x), np.log(milliseconds), 1)[0])


def print_exponents(series: Series) -> None:
    """Print the exponents over the whole range and over its upper half, and the times at its ends."""
    x, _ = medians(series, WHOLE)
    print(f"{series.title}: against {series.axis}, {x[0]:,.0f} to {x[-1]:,.0f}")
    print(f"  {'':<22}{'exponent':>10}{'upper half':>12}{'ms, least':>11}{'ms, most':>10}")
    upper = x >= np.sqrt(x[0] * x[-1])
    for name in (WHOLE, *GROUPS):
        _, ms = medians(series, name)
        half = exponent(x[upper], ms[upper]) if len(np.unique(x[upper])) > 1 else np.nan
        print(f"  {name:<22}{exponent(x, ms):>10.2f}{half:>12.2f}{ms[0]:>11.2f}{ms[-1]:>10.2f}")
    print(flush=True)


def draw(series: list[Series], path: Path) -> None:
    """Draw all series in logarithms, a panel each."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt
    from matplotlib.ticker import FuncFormatter, NullFormatter

    style: Any = {"font.size": 9, "axes.spines.top": False, "axes.spines.right": False, "axes.titlelocation": "left"}
    with mpl.rc_context({**style, "axes.grid": True, "grid.alpha": 0.3, "axes.titlesize": 9, "legend.frameon": False}):
        figure, grid = plt.subplots(2, 4, figsize=(14.6, 6.4), layout="constrained")
        for panel in grid.ravel()[len(series) :]:
            panel.remove()
        for panel, one in zip(grid.ravel(), series, strict=False):
            for name, colour in zip((WHOLE, *GROUPS), _COLOURS, strict=True):
                x, ms = medians(one, name)
                slope, at = np.polyfit(np.log(x), np.log(ms), 1)
                panel.loglog(x, ms, "o", color=colour, markersize=3.5, alpha=0.7)
                line = np.exp(at + slope * np.log(x[[0, -1]]))
                panel.loglog(x[[0, -1]], line, color=colour, linewidth=1.8 if name == WHOLE else 1.0)
                label = f"{name}: {slope:.2f}"
                panel.plot([], [], "o-", color=colour, markersize=3.5, label=label)
            low, high = panel.get_ylim()
            panel.set(title=one.title, xlabel=one.axis, ylabel="ms", ylim=(low, high * (high / low) ** 0.5))
            for axis in (panel.xaxis, panel.yaxis):
                axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,.10g}"))
                axis.set_minor_formatter(NullFormatter())
            panel.legend(fontsize=7, title="exponents", title_fontsize=7, loc="upper left")
        figure.savefig(path, dpi=110)
        plt.close(figure)


if __name__ == "__main__":
    main()
