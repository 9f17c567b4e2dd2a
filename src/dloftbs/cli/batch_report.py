"""Table of a batch: a row an input."""

from __future__ import annotations

from collections.abc import Sequence

from dloftbs.cli.batch_job import DONE, Outcome

_MOST_ROWS = 200
"""Rows of inputs that were done without a remark; the others are all shown."""


def table(outcomes: Sequence[Outcome], kept: int) -> str:
    """Return a row an input and a line of sums.

    Parameters
    ----------
    outcomes : sequence of Outcome
    kept : int
        Number of those that an earlier run had done.
    """
    lines = [f"{'state':<8}{'frames':>8}{'skipped':>9}{'tracks':>8}  input"]
    quiet = [one for one in outcomes if one.state == DONE and not one.warnings]
    hidden = {id(one) for one in quiet[_MOST_ROWS:]}
    for one in outcomes:
        if id(one) in hidden:
            continue
        lines.append(f"{one.state:<8}{one.frames:>8}{one.skipped:>9}{one.tracks:>8}  {one.input}")
        lines += [f"{'':8}{text}" for text in (*([one.error] if one.error else []), *one.warnings)]
    if hidden:
        lines.append(f"{'':8}and {len(hidden)} more that are done")
    failed = sum(one.state != DONE for one in outcomes)
    frames = sum(one.frames for one in outcomes)
    done = len(outcomes) - failed
    lines.append(f"{done} done, {kept} of them before; {failed} failed; {frames} frames")
    return "\n".join(lines)
