"""The figures of a run in short, as plain values: all that the first page and README quote stands here."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from dloftbs_lab.evaluation.report.spread import Sample, frames_of
from dloftbs_lab.evaluation.report.table import Cell, Estimate, median
from dloftbs_lab.evaluation.runner.finished_parts import FrameRow, Part
from dloftbs_lab.evaluation.suites import Suite

FITTED = (
    "rgbd-camera",
    "several-cables",
    "kinds",
    "tracking",
    "known-occluders",
    "seen-occluders",
    "plain-sight",
    "real-motion",
    "edge-cases",
    "simulated",
    "noise",
)
"""Suites whose generators drew scenes for `benchmarks.fit_linking` or `fit_tracking`, from other seeds."""
DAGGER = "†"
FITTED_NOTE = (
    f"{DAGGER} The weights of the default's linking or tracking were fitted on scenes of this generator or an earlier "
    "form of it, of other seeds, and on other sources. The pages of the weights of "
    "[linking](../maintainers/linking-weights.md) and of [tracking](../maintainers/tracking-weights.md) have the loss "
    "with each source left out of the fit. The published method has no fitted weights."
)

Summary = Mapping[str, Any]

_FIGURES: dict[str, Callable[[Sample[FrameRow]], Cell]] = {
    "clean_percent": lambda frames: frames.mean(lambda row: float(row.clean), 100.0),
    "right_percent": lambda frames: frames.ratio(lambda row: row.right, lambda row: row.n_true, 100.0),
    "l1_px": lambda frames: frames.mean(lambda row: row.l1_px),
    "l2_px": lambda frames: frames.mean(lambda row: row.l2_px),
    "l3_px": lambda frames: frames.mean(lambda row: row.l3_px),
    "l3_whole_px": lambda frames: frames.mean(lambda row: row.l3_whole_px),
    "l3_mm": lambda frames: frames.mean(lambda row: row.l3_mm),
    "l3_mm_median": lambda frames: frames.quantile(lambda row: row.l3_mm),
    "l3_surface_mm_median": lambda frames: frames.quantile(lambda row: row.l3_surface_mm),
    "dice": lambda frames: frames.mean(lambda row: row.dice),
    "missing": lambda frames: frames.total(lambda row: row.missing),
    "redundant": lambda frames: frames.total(lambda row: row.redundant),
    "ms_median": lambda frames: median(row.ms for row in frames.items),
}


def marked(suite: str) -> str:
    """Return a suite's name, with a dagger where the default was fitted on scenes of its generator."""
    return f"{suite}{DAGGER}" if suite in FITTED else suite


def summarise(suites: Sequence[Suite], parts: Sequence[Part], heading: str, mark: str = "") -> dict[str, Any]:
    """Return the figures of a run by suite and method, as plain values; intervals are ``[value, low, high]``.

    Parameters
    ----------
    suites : sequence of Suite
    parts : sequence of Part
        Of these suites.
    heading, mark : str
        A line on what was run, and what none of the figures must be taken without.
    """
    made: dict[str, Any] = {}
    for suite in suites:
        of_suite = [part for part in parts if part.key.suite == suite.name]
        methods = dict.fromkeys(part.key.method for part in of_suite)
        samples = {name: frames_of(part for part in of_suite if part.key.method == name) for name in methods}
        if not samples:
            continue
        first = next(iter(samples.values()))
        made[suite.name] = {
            "title": suite.title,
            "scenes": first.count,
            "frames": len(first),
            "objects": first.total(lambda row: row.n_true),
            "methods": {name: _figures(frames) for name, frames in samples.items()},
        }
    return {"heading": heading, "mark": mark, "suites": made}


def _figures(frames: Sample[FrameRow]) -> dict[str, Any]:
    found = {name: figure(frames) for name, figure in _FIGURES.items()}
    return {name: _plain(value) for name, value in found.items() if value is not None}


def _plain(value: Cell) -> Any:
    """Return a figure with the digits that are worth keeping; with its interval as a list."""
    if isinstance(value, Estimate):
        return [_short(end) for end in (float(value), value.low, value.high)]
    return _short(value) if isinstance(value, float) else value


def _short(value: float) -> float:
    return float(f"{value:.4g}")
