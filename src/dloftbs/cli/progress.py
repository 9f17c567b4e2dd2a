"""Progress on standard error: a bar on a terminal, a line now and then elsewhere."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from time import monotonic
from typing import Protocol

import click

_BAR_EVERY_S = 0.1
_LINE_EVERY_S = 5.0


class Shown(Protocol):
    """A report on a run: how much is done, of how much where that is known, and how it stands in a line."""

    @property
    def length(self) -> int | None:
        """Return how much there is to do."""

    @property
    def done(self) -> int:
        """Return how much is done."""

    def line(self) -> str:
        """Return how it stands."""


class Progress:
    """Shows how a run stands, but not more often than is useful.

    Parameters
    ----------
    show : callable
        Takes the report.
    every_s : float
        Seconds that pass at least before the first time, and from one time to the next.
    """

    def __init__(self, show: Callable[[Shown], None], every_s: float) -> None:
        self._show = show
        self._every_s = every_s
        self._next = monotonic() + every_s

    def tick(self, report: Shown) -> None:
        """Show the report if it is time to."""
        now = monotonic()
        if now >= self._next:
            self._next = now + self._every_s
            self._show(report)


@contextmanager
def open_progress(*, shares_terminal: bool) -> Iterator[Progress]:
    """Open the progress of a run.

    Parameters
    ----------
    shares_terminal : bool
        Whether results are printed to the terminal at the same time: a bar would be torn apart by them.
    """
    if sys.stderr.isatty() and not shares_terminal:
        with _bar() as update:
            yield Progress(lambda report: update(report.done, report.length, report.line()), _BAR_EVERY_S)
    else:
        yield Progress(lambda report: click.echo(report.line(), err=True), _LINE_EVERY_S)


@contextmanager
def _bar() -> Iterator[Callable[[int, int | None, str], None]]:
    """Open a bar: a function that takes how much is done, of how much, if that is known, and the line beside it."""
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn
    from rich.progress import Progress as RichProgress

    columns = (BarColumn(bar_width=20), TextColumn("{task.description}", markup=False))
    # Standard output belongs to the results; messages on standard error are lifted above the bar.
    with RichProgress(*columns, console=Console(stderr=True), transient=True, redirect_stdout=False) as bar:
        task = bar.add_task("", total=None)
        yield lambda done, count, line: bar.update(task, completed=done, total=count, description=line)
