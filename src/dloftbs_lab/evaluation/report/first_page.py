"""The first page of the results: a table and some sentences, made of the figures in short alone."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from dloftbs_lab.evaluation.report.summary import DAGGER, Summary, marked
from dloftbs_lab.evaluation.report.table import Cell, Estimate, Table, shown

OURS, PUBLISHED, BASELINE = "default", "paper", "cpd"
_MAX_LOSSES = 3
_IN_README = {
    "rgb": "one cable held by two grippers",
    "rgbd": "a cable in hands, with depth",
    "several-cables": "2 to 8 cables, masks as a network leaves them",
    "tracking": "cables that cross, hide and come back",
    "simulated": "a cable that MuJoCo moves",
    "noise": "growing noise",
    "mbest": "photographs of mBEST's authors",
}
"""Suites that README shows, what is easy and what is hard."""


def first_page(summary: Summary) -> str:
    """Return the block of the first page, Markdown; links are relative to the folder of the documents."""
    lines = "\n".join(f"- {sentence}" for sentence in _sentences(summary))
    return f"{_table(summary)}\n{lines}\n"


def readme_line(summary: Summary) -> str:
    """Return what README says of the results: a table of some suites, wins and losses, and a sentence."""
    suites = summary["suites"]
    frames, scenes = (sum(suite[what] for suite in suites.values()) for what in ("frames", "scenes"))
    mark = f" ({summary['mark']})" if summary["mark"] else ""
    photographs, one_cable = (summary.get(what, {}).get("suites", {}) for what in ("photographs", "one_cable"))
    known = suites | photographs
    columns = {
        "default": (OURS, known),
        "default, `--objects 1`": (OURS, one_cable),
        "published method": (PUBLISHED, known),
        "CPD": (BASELINE, known),
    }
    rows = [
        (what, *(shown(_estimate(_right(of, name, method))) for method, of in columns.values()))
        for name, what in _IN_README.items()
        if name in known
    ]
    table = Table("readme", "", ("right frames, %", *columns), tuple(rows)).markdown().partition("\n\n")[2]
    return (
        f"{table}\n[Results](docs/results.md){mark}: {frames:,} frames of {scenes:,} generated scenes, with 95 % "
        'intervals; "-" was not run. The published method knows\nwhere there is only one cable. CPD, a baseline of '
        "CDCPD2's family, gets the first frame's curve.\n"
    )


def _table(summary: Summary) -> str:
    suites = {**summary["suites"], **summary.get("photographs", {}).get("suites", {})}
    methods = list(dict.fromkeys(name for suite in suites.values() for name in suite["methods"]))
    columns = ("suite", "what", "scenes", "frames", *(f"{name}: right, %" for name in methods))
    columns += tuple(f"{name}: L3" for name in methods)
    rows = []
    for name, suite in suites.items():
        generated = name in summary["suites"]
        of = [suite["methods"].get(method, {}) for method in methods]
        link = f"[{marked(name)}](results/{name}.md)" if generated else f"[{name}{DAGGER}](results/photographs.md)"
        right = (shown(_estimate(figures.get("clean_percent"))) for figures in of)
        rows.append(
            (link, suite["title"], str(suite["scenes"]), str(suite["frames"]), *right, *(_error(one) for one in of))
        )
    return Table("first", "", columns, tuple(rows)).markdown().partition("\n\n")[2]


def _error(figures: dict[str, Any]) -> str:
    """Return the mean L3 in px, and in mm where it is known; DICE where no curves are."""
    if "l3_px" not in figures:
        return f"DICE {shown(_value(figures['dice']))}" if "dice" in figures else shown(None)
    px = f"{shown(_value(figures['l3_px']))} px"
    return f"{px}, {shown(_value(figures['l3_mm']))} mm" if "l3_mm" in figures else px


def _sentences(summary: Summary) -> Iterator[str]:
    suites = summary["suites"]
    frames, scenes = (sum(suite[what] for suite in suites.values()) for what in ("frames", "scenes"))
    mark = f" **{summary['mark']}.**" if summary["mark"] else ""
    yield (
        f"**What:** {frames:,} frames of {scenes:,} generated scenes whose curves are known.{mark} A frame is right "
        "when every cable in it has one curve, within 5 px in HD (15 px in *simulated*), and there is nothing else. L3 "
        "is the distance from the true curve, in the image, and in space from the cable's axis."
    )
    yield (
        f"**How sure:** brackets are 95 % intervals over scenes. {DAGGER} marks data on whose kind the weights of the "
        "default were fitted; the published method has none."
    )
    both = [name for name, suite in suites.items() if {OURS, PUBLISHED} <= suite["methods"].keys()]
    ahead = [name for name in both if _clean(suites, name, OURS) >= _clean(suites, name, PUBLISHED)]
    if both:
        behind = [name for name in both if name not in ahead]
        yield (
            "**Against the published method** (`paper`, which knows when there is only one cable; the default does "
            f"not): the default has at least as many right frames in {len(ahead)} of {len(both)} suites"
            + (f", fewer in {', '.join(behind)}." if behind else ".")
        )
    for name, what in (("rgb", "One cable between grippers"), ("several-cables", "Several cables, a network's masks")):
        if name in both:
            yield f"**{what}:** {_percent(summary, name, OURS)} of the frames are right, with the published method " + (
                f"{_percent(summary, name, PUBLISHED)}."
            )
    if "rgbd-artificial" in both and "l3_surface_mm_median" in suites["rgbd-artificial"]["methods"][PUBLISHED]:
        ours, theirs = (suites["rgbd-artificial"]["methods"][name] for name in (OURS, PUBLISHED))
        yield (
            f"**In space** (medians): the default's curves are {shown(_value(ours['l3_mm_median']))} mm from the axis. "
            f"The published method follows the surface: {shown(_value(theirs['l3_mm_median']))} mm from the axis, "
            f"{shown(_value(theirs['l3_surface_mm_median']))} mm from the line on the surface; its paper prints means "
            "of 1.59 to 4.22."
        )
    worst = sorted(suites, key=lambda name: _clean(suites, name, OURS))[:_MAX_LOSSES]
    if worst and all(OURS in suites[name]["methods"] for name in worst):
        yield (
            "**Where the default loses most:** "
            + ", ".join(f"{name} ({_percent(summary, name, OURS)} right)" for name in worst)
            + "."
        )
    times = [suites[name]["methods"] for name in both]
    if times:
        ours_ms, theirs_ms = ([of[name]["ms_median"] for of in times] for name in (OURS, PUBLISHED))
        yield (
            f"**Time:** {min(ours_ms):.1f} to {max(ours_ms):.1f} ms a frame, median over a suite, one core; "
            f"the published method {min(theirs_ms):.1f} to {max(theirs_ms):.1f} ms. [Performance](performance.md) has "
            "more."
        )
    yield (
        "**Against others:** [tables I to IV of the paper](results/paper.md), cell by cell, with ours beneath"
        f"{', [Table II of photographs](results/photographs.md)' if 'photographs' in summary else ''}; "
        "[over all suites](results/overall.md): identities, joints, losses."
    )


def _right(suites: Summary, name: str, method: str) -> float | Sequence[float] | None:
    """Return the share of right frames of a method in a suite, None where it was not run."""
    share: float | Sequence[float] | None = suites.get(name, {}).get("methods", {}).get(method, {}).get("clean_percent")
    return share


def _clean(suites: Summary, name: str, method: str) -> float:
    return float(_value(_right(suites, name, method) or 0.0))


def _percent(summary: Summary, name: str, method: str) -> str:
    """Return a share of right frames with its interval."""
    return f"{shown(_estimate(_right(summary['suites'], name, method)))} %"


def _value(figure: float | Sequence[float]) -> float:
    return figure if isinstance(figure, int | float) else figure[0]


def _estimate(figure: float | Sequence[float] | None) -> Cell:
    return figure if figure is None or isinstance(figure, int | float) else Estimate(*figure)
