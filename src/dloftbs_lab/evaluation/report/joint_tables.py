"""Calibration of the joints' confidence: nine in ten joints that claim 0.9 should be right."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

from dloftbs.data.centerline import JointKind
from dloftbs_lab.evaluation.report.spread import Sample
from dloftbs_lab.evaluation.report.table import Cell, Estimate, Table, percent
from dloftbs_lab.evaluation.runner.finished_parts import JointRow, Part

EDGES = (0.0, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.99, 1.0)
"""Of the bins of confidence; each holds its lower edge, the last one both."""
KINDS = ("all", *(kind.value for kind in JointKind))

_NOTE = (
    "A joint is right when a true curve passes, in the found direction, the places a width before and behind it, and "
    "is about as long in between (to 2 widths and 30 %). Suites with true curves only. The expected calibration error "
    "is the mean distance of the stated confidence from the share that is right, over bins, weighted by their joints."
)


@dataclass(frozen=True)
class Bin:
    """The joints whose confidence lies in one interval.

    Parameters
    ----------
    low, high : float
    number : int
    stated, right : Estimate or float or None
        Mean confidence, and share that is right, in 0..1; None without joints.
    """

    low: float
    high: float
    number: int
    stated: Estimate | float | None
    right: Estimate | float | None


def joint_tables(parts: Sequence[Part]) -> list[Table]:
    """Return the stated confidence against the share that is right, in bins and in all; none without joints."""
    groups = joints_by_method(parts)
    return [_bins_table(groups), _errors_table(groups)] if groups else []


def joints_by_method(parts: Sequence[Part]) -> dict[str, dict[str, list[JointRow]]]:
    """Return the joints of each method that has any, by `KINDS`."""
    groups: dict[str, dict[str, list[JointRow]]] = {}
    for part in parts:
        if part.joints:
            of_method = groups.setdefault(part.key.method, {kind: [] for kind in KINDS})
            for joint in part.joints:
                of_method["all"].append(joint)
                of_method[joint.kind.value].append(joint)
    return groups


def binned(joints: Sequence[JointRow]) -> list[Bin]:
    """Return the bins between `EDGES`."""
    return [_bin(low, high, [j for j in joints if _bin_of(j) == i]) for i, (low, high) in enumerate(pairwise(EDGES))]


def calibration_error(bins: Sequence[Bin]) -> float | None:
    """Return the expected calibration error, in 0..1; None without joints."""
    off = [b.number * abs(b.stated - b.right) for b in bins if b.stated is not None and b.right is not None]
    return sum(off) / sum(b.number for b in bins) if off else None


def _bin_of(joint: JointRow) -> int:
    return sum(joint.confidence >= edge for edge in EDGES[1:-1])


def _bin(low: float, high: float, joints: Sequence[JointRow]) -> Bin:
    sample = Sample(tuple(joints), tuple(joint.scene for joint in joints))
    stated, right = sample.mean(lambda joint: joint.confidence), sample.mean(lambda joint: float(joint.right))
    return Bin(low, high, len(joints), stated, right)


def _bins_table(groups: Mapping[str, Mapping[str, Sequence[JointRow]]]) -> Table:
    columns: tuple[str, ...] = ("method", "stated confidence")
    for kind in KINDS:
        columns += (f"{kind}: stated, %", f"{kind}: right, %", f"{kind}: number")
    rows = []
    for method, by_kind in groups.items():
        for of_kinds in zip(*(binned(by_kind[kind]) for kind in KINDS), strict=True):
            row: list[Cell] = [method, f"{of_kinds[0].low:g} to {of_kinds[0].high:g}"]
            for one in of_kinds:
                row += [percent(one.stated), percent(one.right), one.number]
            rows.append(tuple(row))
    return Table("joints", "Joints: stated confidence, share right, number", columns, tuple(rows), _NOTE)


def _errors_table(groups: Mapping[str, Mapping[str, Sequence[JointRow]]]) -> Table:
    columns = ("method", "joints", "number", "stated, %", "right, %", "expected calibration error, %")
    rows = []
    for method, by_kind in groups.items():
        for kind, joints in by_kind.items():
            whole = _bin(0.0, 1.0, joints)
            figures = (whole.stated, whole.right, calibration_error(binned(joints)))
            rows.append((method, kind, whole.number, *map(percent, figures)))
    return Table("joint-calibration", "Joints: calibration", columns, tuple(rows))
