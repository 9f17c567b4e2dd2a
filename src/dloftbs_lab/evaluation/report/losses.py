"""Losses of a method in words, so that good means do not hide them."""

from __future__ import annotations

from collections.abc import Sequence

from dloftbs_lab.evaluation.report.table import mean
from dloftbs_lab.evaluation.runner.finished_parts import FrameRow, Part

_MAX = 3  # of a suite
_BAD_BELOW = 0.9


def losses(parts: Sequence[Part]) -> list[str]:
    """Return, for each method, the sequences of each suite with the fewest clean frames, a line each."""
    lines = []
    for method in dict.fromkeys(part.key.method for part in parts):
        sequences: dict[tuple[str, str], list[FrameRow]] = {}
        for part in parts:
            if part.key.method == method and part.rows:
                sequences.setdefault((part.key.suite, part.key.sequence), []).extend(part.rows)
        mine = sorted(sequences.items(), key=lambda item: _clean_share(item[1]))
        bad = [(name, rows) for name, rows in mine if _clean_share(rows) < _BAD_BELOW]
        if not bad:
            lines.append(f"{method}: at least {_BAD_BELOW:.0%} of the frames of every sequence are clean.")
            continue
        lines.append(
            f"{method}: in {len(bad)} of {len(mine)} sequences fewer than "
            f"{_BAD_BELOW:.0%} of the frames are clean; the worst:"
        )
        for suite in dict.fromkeys(suite for (suite, _), _ in bad):
            lines += [f"{method}, {', '.join(name)}: {_line(rows)}" for name, rows in bad if name[0] == suite][:_MAX]
    return lines


def _line(rows: Sequence[FrameRow]) -> str:
    what = [f"{_clean_share(rows):.0%} of {len(rows)} frames clean"]
    error = mean(row.l3_px for row in rows)
    if error is not None:
        what.append(f"mean L3 {error:.1f} px")
    for name, count in _counts(rows).items():
        if count:
            what.append(f"{count} {name}")
    return ", ".join(what)


def _counts(rows: Sequence[FrameRow]) -> dict[str, int]:
    return {
        "objects missing": sum(row.missing for row in rows),
        "redundant": sum(row.redundant for row in rows),
        "frames with an exception": sum(row.failure is not None for row in rows),
    }


def _clean_share(rows: Sequence[FrameRow]) -> float:
    return sum(row.clean for row in rows) / len(rows)
