"""Progress of an evaluation on standard error: a bar on a terminal, a line now and then elsewhere."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from time import monotonic

import click

from dloftbs_lab.evaluation.runner.finished_parts import Part

_LINE_EVERY_S = 5.0


class FrameCount:
    """Counts the frames that are scored.

    Parameters
    ----------
    total : int
        Frames of all sequences, times methods.
    """

    def __init__(self, total: int) -> None:
        self._total = total
        self.done = 0

    def line(self, part: Part) -> str:
        """Count a part, and return how the run stands."""
        self.done += len(part.rows)
        return f"{self.done}/{self._total} frames  {part.key.suite}, {part.key.sequence}: {part.key.method}"


@contextmanager
def open_parts_progress(total: int) -> Iterator[Callable[[Part], None]]:
    """Open the progress of a run of `total` frames; the function that it yields takes each part as it gets ready."""
    count = FrameCount(total)
    if sys.stderr.isatty():
        with _bar(count, total) as show:
            yield show
    else:
        yield _lines(count)


def _lines(count: FrameCount) -> Callable[[Part], None]:
    due = monotonic()

    def show(part: Part) -> None:
        nonlocal due
        line, now = count.line(part), monotonic()
        if now >= due:
            due = now + _LINE_EVERY_S
            click.echo(line, err=True)

    return show


@contextmanager
def _bar(count: FrameCount, total: int) -> Iterator[Callable[[Part], None]]:
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (BarColumn(bar_width=20), TimeRemainingColumn(), TextColumn("{task.description}", markup=False))
    # Standard output belongs to the tables; messages on standard error are lifted above the bar.
    with Progress(*columns, console=Console(stderr=True), transient=True, redirect_stdout=False) as bar:
        task = bar.add_task("", total=total)
        yield lambda part: bar.update(task, description=count.line(part), completed=count.done)
