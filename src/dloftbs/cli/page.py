"""The options of commands that serve a page, and what they print about it."""

from __future__ import annotations

import functools
import os
import shlex
import socket
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import click

from dloftbs.cli.config_options import Command
from dloftbs.cli.input_options import InputOptions

if TYPE_CHECKING:
    from dloftbs.config import Config
    from dloftbs.sources import Source
    from dloftbs.ui.server import Address, Session

HOST = "127.0.0.1"
_READING = (
    *("kind", "depth", "masks", "occluders", "instances", "camera", "registration", "depth_unit"),
    *("topic", "depth_topic", "info_topic", "mask_topic"),
)
"""Options that say how a source is read: the next command needs them as well."""
LOOK_EVERY_S = 0.2
"""Seconds from one look whether a page's work has ended, or Ctrl-C was pressed, to the next."""


@dataclass(frozen=True)
class PageOptions:
    """Address of a page, and whether a browser is opened."""

    host: str
    port: int | None
    browser: bool


def page_options(command: Command) -> Command:
    """Add the options that say where the page is served; the command gets them as `page`, a `PageOptions`."""

    @click.option(
        "--host",
        default=HOST,
        show_default=True,
        metavar="ADDRESS",
        help="Address to serve the page at. By default only this machine can open it; 0.0.0.0: all networks can.",
    )
    @click.option(
        "--port", type=click.IntRange(0, 65535), metavar="N", help="Port. Default: 8765, or another free one."
    )
    @click.option(
        "--browser/--no-browser",
        default=None,
        help="Open the page in a browser. Default: yes, in a terminal on a desktop.",
    )
    @functools.wraps(command)
    def with_page(*args: Any, host: str, port: int | None, browser: bool | None, **kwargs: Any) -> None:
        wanted = _has_desktop() if browser is None else browser
        command(*args, page=PageOptions(host, port, wanted), **kwargs)

    return with_page


@contextmanager
def served(session: Session, page: PageOptions) -> Iterator[Address]:
    """Serve a session while the block lasts, and say where.

    Raises
    ------
    SourceError
        As `dloftbs.ui.server.serve`.
    """
    from dloftbs.ui.server import serve

    with serve(session, page.host, page.port) as address:
        _announce(address, page)
        yield address


def _announce(address: Address, page: PageOptions) -> None:
    from dloftbs.ui.security import is_local

    click.echo(f"page       {address.url}", err=True)
    if is_local(page.host):
        name = f"{os.environ.get('USER', 'USER')}@{socket.gethostname()}"
        tunnel = f"ssh -L {address.port}:{address.authority} {name}"
        click.echo(f"from elsewhere, first  {tunnel}", err=True)
    else:
        click.echo("others on the network can open it, too, with this address alone; it is not encrypted", err=True)
    click.echo("Ctrl-C ends it", err=True)
    if page.browser:
        import webbrowser

        webbrowser.open(address.url)


def require_page() -> None:
    """Raise unless the extra `ui` is installed.

    Raises
    ------
    InputError
        With the line that installs it.
    """
    from dloftbs import ui

    ui.require()


def check_colour(source: Source, config: Config, inputs: InputOptions, where: Sequence[str]) -> None:
    """Raise where the first frame of a recording is a colour image and nothing says what in it is cable.

    The frame of a source that can be read only once is not looked at, since it would be lost.

    Raises
    ------
    Failure
        With the options that say it.
    """
    from dloftbs.cli.frames import UsableFrames

    if not (source.live or source.single_pass):
        next(iter(UsableFrames(source, config, inputs, where)), None)


def source_arguments(where: tuple[str, ...], context: click.Context) -> str:
    """Return the arguments of a command that name its source, as a shell takes them."""
    parts = [shlex.quote(text) for text in where]
    for name in _READING:
        value = context.params.get(name)
        if value is not None and (name, value) != ("kind", "auto"):
            parts.append(f"--{name.replace('_', '-')} {shlex.quote(str(value))}")
    return " ".join(parts)


def check_yaml_path(context: click.Context, parameter: click.Parameter, path: str | None) -> str | None:
    """Let only names of YAML files pass.

    Raises
    ------
    click.BadParameter
        On any other.
    """
    if path is not None and not path.lower().endswith((".yaml", ".yml")):
        raise click.BadParameter(f"must end in .yaml, got {path!r}", context, parameter)
    return path


def _has_desktop() -> bool:
    """Return whether somebody sits in front of this machine's screen."""
    if not sys.stderr.isatty() or "SSH_CONNECTION" in os.environ:
        return False
    return sys.platform in ("darwin", "win32") or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
