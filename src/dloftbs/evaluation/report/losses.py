"""Losses of a method in words, so that good means do not hide them."""

from __future__ import annotations

from collections.abc import Sequence

from dloftbs.evaluation.report.table import mean
from dloftbs.evaluation.runner.finished_parts import FrameRow, Part

_MOST = 3  # of a suite
_BAD_BELOW = 0.9


def losses(parts: Sequence[Part]) -> list[str]:
    """Return, for each method, the sequences of each suite with the fewest clean frames, a line each."""
    lines = []
    for method in dict.fromkeys(part.key.method for part in parts):
        mine = sorted((part for part in parts if part.key.method == method and part.rows), key=_clean_share)
        bad = [part for part in mine if _clean_share(part) < _BAD_BELOW]
        if not bad:
            lines.append(f"{method}: at least {_BAD_BELOW:.0%} of the frames of every sequence are clean.")
            continue
        lines.append(
            f"{method}: in {len(bad)} of {len(mine)} sequences fewer than "
            f"{_BAD_BELOW:.0%} of the frames are clean; the worst:"
        )
        for suite in dict.fromkeys(part.key.suite for part in bad):
            lines += [f"{method}, {_line(part)}" for part in bad if part.key.suite == suite][:_MOST]
    return lines


def _line(part: Part) -> str:
    rows = part.rows
    what = [f"{_clean_share(part):.0%} of {len(rows)} frames clean"]
    error = mean(row.l3_px for row in rows)
    if error is not None:
        what.append(f"mean L3 {error:.1f} px")
    for name, count in _counts(rows).items():
        if count:
            what.append(f"{count} {name}")
    return f"{part.key.suite}, {part.key.sequence}: {', '.join(what)}"


def _counts(rows: Sequence[FrameRow]) -> dict[str, int]:
    return {
        "objects missing": sum(row.missing for row in rows),
        "redundant": sum(row.redundant for row in rows),
        "frames with an exception": sum(row.failure is not None for row in rows),
    }


def _clean_share(part: Part) -> float:
    return sum(row.clean for row in part.rows) / len(part.rows)
