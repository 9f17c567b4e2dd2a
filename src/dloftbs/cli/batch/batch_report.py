"""Report on a batch: a line while it runs, a table at its end."""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Iterable, Sequence
from time import perf_counter

import click

from dloftbs.cli.batch.status_file import Event, State, Status

MAX_ROWS = 100
"""Inputs up to which the table has a row for each; of more, only those are shown with which something is wrong."""
_HEADINGS = ("input", "state", "frames", "skipped", "tracks", "frames/s", "reason")
_TEXTS = (0, 1, 6)
"""Columns that are no numbers."""


class BatchReport:
    """The inputs of a batch that are done.

    Parameters
    ----------
    length : int
        Number of inputs in all.
    known : sequence of Status
        Those that an earlier run did.
    """

    def __init__(self, length: int, known: Sequence[Status]) -> None:
        self.length: int | None = length
        self._statuses = {status.input: status for status in known}
        self._known = len(known)
        self._frames = 0
        self._unfinished = 0
        self._start = perf_counter()

    @property
    def done(self) -> int:
        """Number of inputs of which it is known what became of them."""
        return len(self._statuses)

    @property
    def is_good(self) -> bool:
        """True if all are done as a whole."""
        return self.done == self.length and all(status.state is State.DONE for status in self._statuses.values())

    def add(self, event: Event) -> None:
        """Take down what has happened."""
        self._unfinished = event.unfinished
        if event.status is not None:
            self._statuses[event.status.input] = event.status
            self._frames += event.status.frames

    def line(self) -> str:
        """Return how the batch stands."""
        seconds = perf_counter() - self._start
        frames = self._frames + self._unfinished
        wrong = [f"{count} {state.value}" for state, count in self._states() if state is not State.DONE]
        return "  ".join(
            [f"{self.done}/{self.length} inputs", *wrong, f"{frames} frames", f"{frames / seconds:.1f} frames/s"]
        )

    def summary(self) -> str:
        """Return what the batch came to, in a line."""
        states = ", ".join(f"{count} {state.value}" for state, count in self._states()) or "none done"
        left = (self.length or 0) - self.done
        rest = f", {left} left" if left else ""
        before = f", {self._known} of them by an earlier run" if self._known else ""
        seconds = perf_counter() - self._start
        return f"{self.length} inputs: {states}{rest}{before}; {self._frames} frames in {seconds:.1f} s"

    def print_table(self) -> None:
        """Print a row for each input that is to be shown, to standard output, and why what failed did."""
        statuses = [self._statuses[name] for name in sorted(self._statuses)]
        if len(statuses) > MAX_ROWS:
            statuses = [status for status in statuses if status.state is not State.DONE]
        rows = [_row(status) for status in statuses]
        if rows and sys.stdout.isatty():
            _print_rich(rows)
        elif rows:
            _print_plain(rows)

    def _states(self) -> Iterable[tuple[State, int]]:
        counts = Counter(status.state for status in self._statuses.values())
        return [(state, counts[state]) for state in State if counts[state]]


def reason(status: Status) -> str | None:
    """Return in a line why an input is not done as a whole; None where it is."""
    if status.state is State.DONE:
        return None
    lines = (status.error or "").splitlines()  # the last line of a traceback says what it is
    first = f"{status.skipped} frames could not be read" if status.skipped else None
    return "; ".join(part for part in (lines[-1] if lines else None, first) if part)


def _row(status: Status) -> tuple[str, ...]:
    rate = "" if status.timing is None else f"{status.timing.frames_per_s:.1f}"
    return (
        status.input,
        status.state.value,
        str(status.frames),
        str(status.skipped),
        str(status.tracks),
        rate,
        reason(status) or "",
    )


def _print_plain(rows: Sequence[Sequence[str]]) -> None:
    widths = [max(len(row[column]) for row in (_HEADINGS, *rows)) for column in range(len(_HEADINGS))]
    for row in (_HEADINGS, *rows):
        cells = [
            cell.ljust(width) if i in _TEXTS else cell.rjust(width)
            for i, (cell, width) in enumerate(zip(row, widths, strict=True))
        ]
        click.echo("  ".join(cells).rstrip())


def _print_rich(rows: Sequence[Sequence[str]]) -> None:
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table()
    for column, heading in enumerate(_HEADINGS[:-1]):
        table.add_column(heading, justify="left" if column in _TEXTS else "right", overflow="fold")
    colours = {"done": "green", "partial": "yellow", "busy": "yellow", "failed": "red"}
    console = Console(file=sys.stdout)
    for name, state, *numbers, _ in rows:
        table.add_row(Text(name), Text(state, colours[state]), *map(Text, numbers))
    console.print(table)
    for name, state, *_, why in rows:
        if why:
            console.print(Text.assemble((state, colours[state]), f" {name}: {why}"))
