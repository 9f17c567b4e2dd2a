"""``dloftbs config``: what the settings are, and whether a file of them is right."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from dloftbs.cli.config_options import config_options
from dloftbs.cli.limits import file_path
from dloftbs.cli.shell import BAD_INPUT, report_error
from dloftbs.errors import ConfigError

if TYPE_CHECKING:
    from dloftbs.config import Config


@click.group(invoke_without_command=True)
@click.pass_context
def config(context: click.Context) -> None:
    """Print the settings with their meaning, or check a file of them.

    Without a command, it prints the default settings.
    """
    if context.invoked_subcommand is None:
        from dloftbs.config import Config

        click.echo(Config().explain(), nl=False)


@config.command("print")
@config_options
def print_(config: Config) -> None:
    """Print all settings and what they mean as YAML, as --config reads them.

    \b
    dloftbs config print --hsv 170:10,80:255,60:255 > red.yaml
    """
    click.echo(config.explain(), nl=False)


@config.command()
@click.argument("files", metavar="FILE...", nargs=-1, required=True, type=file_path())
@click.pass_context
def check(context: click.Context, files: tuple[Path, ...]) -> None:
    """Check files of settings: exit code 0, or 1 if one is wrong, with the place of the error."""
    from dloftbs.config import Config

    wrong = 0
    for file in files:
        try:
            Config.from_file(file)
        except ConfigError as error:
            report_error(error)
            wrong += 1
        else:
            click.echo(f"{file}: ok")
    if wrong:
        context.exit(BAD_INPUT)
