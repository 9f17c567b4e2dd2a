"""``dloftbs warmup``: the compiled kernels, made ready before they are needed."""

from __future__ import annotations

import logging
import sys
from collections.abc import Callable
from time import perf_counter

import click

from dloftbs.cli.shell import kernel_counts
from dloftbs.kernel_loading import load_kernels


@click.command(short_help="Compile the kernels, once for this machine.")
def warmup() -> None:
    """Compile the kernels if this machine has not done so yet, and load them.

    They stay on disk. Without this command, the first one that needs them compiles them.
    """
    since = perf_counter()
    compiled = _load_with_bar() if sys.stderr.isatty() else _load()
    seconds = perf_counter() - since
    what = "compiled, and saved for the next time," if compiled else "loaded, compiled before,"
    click.echo(f"kernels {what} in {seconds:.1f} s")


def _load() -> bool:
    """Load the kernels, and return whether some had to be compiled."""
    flag = _Flag()
    logger = logging.getLogger("dloftbs.kernels")
    logger.addHandler(flag)
    try:
        load_kernels()
    finally:
        logger.removeHandler(flag)
    return flag.raised


def _load_with_bar() -> bool:
    """Do the same, and show how many are ready in a bar rather than in lines."""
    from dloftbs.cli.progress import open_count

    with open_count("compiling kernels") as show, kernel_counts(_Bar(show)):
        return _load()


class _Flag(logging.Handler):
    """Notices that something was logged: the kernels announce that they are being compiled."""

    raised = False

    def emit(self, record: logging.LogRecord) -> None:
        self.raised = True


class _Bar(logging.Handler):
    """Shows how many kernels are ready, and of how many."""

    def __init__(self, show: Callable[[int, int], None]) -> None:
        super().__init__()
        self._show = show

    def emit(self, record: logging.LogRecord) -> None:
        match record.args:
            case (int(ready), int(count)):
                self._show(ready, count)
