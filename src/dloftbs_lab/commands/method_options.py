"""Options that set up the methods to be scored; methods that are functions of the user's own take none of them."""

from __future__ import annotations

import functools
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from dloftbs.cli.config_options import Command, parse_changes, parse_hsv, read_config, stated_in
from dloftbs.cli.limits import file_path

if TYPE_CHECKING:
    from dloftbs.config import Config, HsvRange


@dataclass(frozen=True)
class MethodSettings:
    """Changes by the options in the configuration of every method that has one.

    Parameters
    ----------
    config_file : Path or None
        YAML file; what it states replaces what the method has.
    changes : dict of str to object
        By dotted path; they replace what the file states.
    hsv : tuple of HsvRange
        Colours of cables, in place of those that the method has.
    """

    config_file: Path | None = None
    changes: dict[str, Any] = field(default_factory=dict)
    hsv: tuple[HsvRange, ...] = ()

    @property
    def options(self) -> list[str]:
        """The options that were given."""
        given = {"--config": self.config_file is not None, "--set": self.changes, "--hsv": self.hsv}
        return [option for option, value in given.items() if value]

    def applied_to(self, base: Path | None, *, paper: bool = False) -> Config:
        """Return the configuration of a method.

        Parameters
        ----------
        base : Path or None
            YAML file of the method itself.
        paper : bool
            Whether what nobody states is the published method's rather than the default's.

        Raises
        ------
        ConfigError
            If a file cannot be read, or a key or a value is wrong, or is not one of the method.
        click.UsageError
            As `stated_in`.
        """
        stated = {} if self.config_file is None else stated_in(self.config_file, paper=paper)
        return read_config(paper, [] if base is None else [base], {**stated, **self.changes}, self.hsv)


def method_options(command: Command) -> Command:
    """Add the options; the command gets them as `settings`, a `MethodSettings`."""

    @click.option(
        "--config",
        "config_file",
        type=file_path(),
        metavar="FILE",
        help="Settings for default, paper and the YAML files among the methods, over their own.",
    )
    @click.option(
        "--set",
        "changes",
        multiple=True,
        metavar="SECTION.KEY=VALUE",
        callback=parse_changes,
        help="Change one setting of these methods, e.g. tracking.gate=0.2; the value is YAML. Repeatable.",
    )
    @click.option(
        "--hsv",
        multiple=True,
        metavar="COLOUR|H0:H1[,S0:S1[,V0:V1]]",
        callback=parse_hsv,
        help="Colour of a cable for these methods, as `dloftbs detect` has it: they then work on pictures, where there "
        "are any, in place of masks. Repeatable.",
    )
    @functools.wraps(command)
    def with_settings(
        *args: Any, config_file: Path | None, changes: dict[str, Any], hsv: tuple[HsvRange, ...], **kwargs: Any
    ) -> None:
        command(*args, settings=MethodSettings(config_file, changes, hsv), **kwargs)

    return with_settings
