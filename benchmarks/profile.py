"""Where the time of a frame goes, function by function: kernels apart from the Python between them.

Run it with ``python -m benchmarks.profile [--quick] [--docs PAGE] [--plot PNG]``. It follows moving cables under
cProfile, which numba tells of its kernels, and prints the functions that take most by themselves. The plot has a box
for each function under the one that called it, as wide as the time spent there; where a function has several callers,
the time below it is divided among them in proportion. Profiling slows Python down, and kernels hardly: the share of
kernels here is a lower bound.
"""

from __future__ import annotations

import cProfile
import pstats
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from time import perf_counter
from typing import Any

import cv2

import dloftbs
from benchmarks.docs import arguments, published
from benchmarks.scenes import Mask, cables, swaying
from dloftbs import Frame, Pipeline

PACKAGE = Path(dloftbs.__file__).parent
KERNEL, PYTHON, LIBRARY = "kernel", "Python of the package", "numpy, OpenCV, scipy, Python itself"
_COLOURS = {KERNEL: "#0072B2", PYTHON: "#E69F00", LIBRARY: "#BBBBBB"}
_MAX_ROWS = 18
_MIN_SHARE, _MIN_LABEL = 0.002, 0.02
_DEEPEST = 12

Function = tuple[str, int, str]
"""File, line and name, as `pstats` has them."""


@dataclass
class Box:
    """A function at a place in the flame graph; `left` and `width` are shares of the whole."""

    function: Function
    left: float
    width: float
    depth: int


def main() -> None:
    """Print the tables, and draw the plots."""
    parser = arguments(__doc__, "few frames, to see that it runs")
    parser.add_argument("--plot", type=Path, metavar="PNG", help="draw it")
    given = parser.parse_args()
    frames = 8 if given.quick else 200
    cv2.setNumThreads(1)
    stats = {}
    with published("profile", given.docs):
        for count in (1, 5):
            title = f"{count} cable{'s' * (count > 1)}"
            stats[title], milliseconds = profiled(count, frames)
            print_table(f"{title}, 1280 x 720, {frames} frames, {milliseconds:.2f} ms each", stats[title])
    if given.plot is not None:
        given.plot.parent.mkdir(parents=True, exist_ok=True)
        draw(stats, given.plot)


def profiled(count: int, frames: int) -> tuple[pstats.Stats, float]:
    """Follow cables under the profiler; return what it says, and the milliseconds of a frame without it."""
    films = [list(islice(swaying(cables(count, seed)), frames // 4)) for seed in range(4)]
    process(films)  # compiles what is not compiled yet
    since = perf_counter()
    process(films)
    milliseconds = 1e3 * (perf_counter() - since) / sum(map(len, films))
    profile = cProfile.Profile()
    profile.runcall(process, films)
    return pstats.Stats(profile), milliseconds


def process(films: list[list[Mask]]) -> None:
    """Follow what is in each."""
    for masks in films:
        pipeline = Pipeline()
        for mask in masks:
            pipeline.process(Frame(mask=mask))


def kind_of(function: Function) -> str:
    """Say whether a function is a kernel, Python of the package, or somebody else's."""
    path = Path(function[0])
    if not path.is_relative_to(PACKAGE):
        return LIBRARY
    return KERNEL if "kernels" in path.relative_to(PACKAGE).parts else PYTHON


def name_of(function: Function) -> str:
    """Return a name to be read, with its module where it is of the package."""
    path, _, name = function
    if kind_of(function) == LIBRARY:
        plain = name.strip("{}").removeprefix("built-in ").removeprefix("method ").partition(" of ")[0]
        return plain.strip("'<>").rpartition(".")[2]
    return f"{'.'.join(Path(path).relative_to(PACKAGE).with_suffix('').parts)}.{name}"


def entries(stats: pstats.Stats) -> dict[Function, Any]:
    """Return calls, own time, time with all below, and callers of each function; typeshed does not have it."""
    return stats.stats  # type: ignore[attr-defined]


def print_table(title: str, stats: pstats.Stats) -> None:
    """Print the shares of the kinds, and the functions that take most."""
    found = entries(stats)
    total = sum(entry[2] for entry in found.values())
    kinds = dict.fromkeys(_COLOURS, 0.0)
    for function, entry in found.items():
        kinds[kind_of(function)] += entry[2]
    print(title)
    for kind, seconds in kinds.items():
        print(f"  {kind:<52}{100.0 * seconds / total:>7.1f} %")
    frames = next(
        entry[1] for function, entry in found.items() if function[2] == "process" and "pipeline" in function[0]
    )
    print(f"\n  {'function':<52}{'own':>9}{'with calls':>12}{'calls/frame':>13}")
    for function, entry in sorted(found.items(), key=lambda item: -item[1][2])[:_MAX_ROWS]:
        _, calls, own, below, _ = entry
        mark = "*" if kind_of(function) == KERNEL else " "
        shares = f"{100.0 * own / total:>7.1f} %{100.0 * below / total:>10.1f} %"
        print(f"  {mark} {name_of(function)[:49]:<50}{shares}{calls / frames:>13.1f}")
    print("  * compiled\n", flush=True)


def boxes(stats: pstats.Stats) -> Iterator[Box]:
    """Yield the boxes of the flame graph, the pipeline's `process` on top."""
    found = entries(stats)
    called: dict[Function, list[tuple[Function, float]]] = {}
    for function, entry in found.items():
        for caller, edge in entry[4].items():
            called.setdefault(caller, []).append((function, edge[3]))
    root = next(function for function in found if function[2] == "process" and "pipeline" in function[0])

    def below(function: Function, left: float, share: float, path: tuple[Function, ...]) -> Iterator[Box]:
        yield Box(function, left, share, len(path))
        whole = found[function][3]
        for child, seconds in sorted(called.get(function, []), key=lambda item: -item[1]):
            width = share * min(seconds / whole, 1.0)
            if width >= _MIN_SHARE and child not in path and child != function and len(path) < _DEEPEST:
                yield from below(child, left, width, (*path, function))
                left += width

    yield from below(root, 0.0, 1.0, ())


def draw(stats: dict[str, pstats.Stats], path: Path) -> None:
    """Draw the flame graphs, upside down: what calls is above what it calls."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt
    from matplotlib.patches import Patch

    figure, panels = plt.subplots(len(stats), 1, figsize=(13.0, 4.2 * len(stats)), layout="constrained")
    for panel, (title, one) in zip(panels, stats.items(), strict=True):
        deepest = 0
        for box in boxes(one):
            deepest = max(deepest, box.depth)
            colour = _COLOURS[kind_of(box.function)]
            panel.barh(
                -box.depth, box.width, left=box.left, height=0.94, color=colour, edgecolor="white", linewidth=0.5
            )
            if box.width >= _MIN_LABEL:
                name = name_of(box.function).rpartition(".")[2].lstrip("_")
                text = name[: max(int(box.width * 235) - 1, 1)]
                panel.text(box.left + 0.001, -box.depth, text, fontsize=6.5, va="center", ha="left", clip_on=True)
        panel.set(xlim=(0.0, 1.0), ylim=(-deepest - 0.6, 0.6), yticks=[], xlabel="share of the time", title=title)
        panel.spines[["top", "left", "right"]].set_visible(False)
    figure.legend(handles=[Patch(color=c, label=k) for k, c in _COLOURS.items()], loc="outside lower center", ncols=3)
    figure.savefig(path, dpi=100)
    plt.close(figure)


if __name__ == "__main__":
    main()
