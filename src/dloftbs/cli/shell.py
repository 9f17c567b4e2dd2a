"""Exit codes of the commands, and their messages on standard error."""

from __future__ import annotations

import logging
import os
import shlex
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import IO, Any, NoReturn

import click

from dloftbs.cli.help_sections import ORDER
from dloftbs.cli.streams import standard_streams
from dloftbs.errors import DloftbsError, explain_import

BAD_INPUT = 1
INTERRUPTED = 130
"""128 + SIGINT, as shells report a process that Ctrl-C ended."""
CLOSED_PIPE = 141
"""128 + SIGPIPE, as shells report a process whose reader has gone; by a code, so that all files are closed first."""


class Failure(click.ClickException):
    """Bad input: a message on standard error, and no traceback."""

    exit_code = BAD_INPUT

    def show(self, file: IO[Any] | None = None) -> None:
        """Print the message as all errors of the command look."""
        report_error(self.message)


class Shell(click.Group):
    """A group of commands that turns the package's errors, Ctrl-C and a lost standard output into exit codes."""

    def main(self, *args: Any, **kwargs: Any) -> Any:
        """Parse the arguments and run the command, with standard streams that take any text."""
        with standard_streams(_output_lost):
            return super().main(*args, **kwargs)

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the commands in the order of use."""
        return sorted(self.commands, key=lambda name: (ORDER.index(name) if name in ORDER else len(ORDER), name))

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Find the command that the first argument names.

        Raises
        ------
        click.UsageError
            If there is none; where a file was named in its place, with the commands that read one.
        """
        try:
            return super().resolve_command(ctx, args)
        except click.UsageError as error:
            if not os.path.exists(args[0]):
                raise
            source = shlex.quote(args[0])
            raise click.UsageError(
                f"{args[0]!r} is no command. `dloftbs detect {source}` finds the objects of pictures and masks, "
                f"`dloftbs track {source}` follows those of a stream.",
                ctx,
            ) from error

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command.

        Raises
        ------
        Failure
            In place of any `DloftbsError`, or where OpenCV cannot be imported.
        click.exceptions.Exit
            In place of KeyboardInterrupt.
        """
        try:
            return super().invoke(ctx)
        except DloftbsError as error:
            raise Failure(str(error)) from error
        except ImportError as error:
            if (explained := explain_import(error)) is error:
                raise
            raise Failure(str(explained)) from error
        except KeyboardInterrupt as interrupt:
            click.echo("interrupted", err=True)
            raise click.exceptions.Exit(INTERRUPTED) from interrupt


def _output_lost(error: OSError) -> NoReturn:
    """End the command: quietly where the reader of a pipe has gone, which is its right."""
    if isinstance(error, BrokenPipeError):
        raise click.exceptions.Exit(CLOSED_PIPE) from error
    raise Failure(f"cannot write to standard output: {error.strerror}") from error


@contextmanager
def interrupted() -> Iterator[Callable[[], bool]]:
    """Make Ctrl-C a thing to ask for, which never falls into the writing of a file; a second one ends all at once."""
    asked = False

    def remember(_signal: int, _frame: FrameType | None) -> None:
        nonlocal asked
        asked = True
        signal.signal(signal.SIGINT, before)

    before = signal.signal(signal.SIGINT, remember)
    try:
        yield lambda: asked
    finally:
        signal.signal(signal.SIGINT, before)


def report_error(message: object) -> None:
    """Print an error in a line on standard error."""
    click.echo(f"error: {message}", err=True)


_PROGRESS = "dloftbs.kernels.progress"
"""Logger of the compilation, which is no fault; in a program its records are warnings, so that they are seen."""


class _MessageHandler(logging.Handler):
    """Prints log records as short lines on standard error as it is at the moment: a progress bar redirects it."""

    def emit(self, record: logging.LogRecord) -> None:
        # echo(err=True) would reach around rich's proxy, into the bar.
        level = "" if record.name == _PROGRESS else f"{record.levelname.lower()}: "
        click.echo(f"{level}{record.getMessage()}", file=sys.stderr)


@contextmanager
def messages_to_stderr() -> Iterator[None]:
    """Show the package's warnings on standard error for as long as the command runs."""
    logger, handler = logging.getLogger("dloftbs"), _MessageHandler(logging.WARNING)
    logger.addHandler(handler)
    try:
        yield
    finally:
        logger.removeHandler(handler)
