"""Nothing that a command writes takes the place of what it reads, or of what else it writes."""

from __future__ import annotations

import os
import stat
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click

from dloftbs import sinks
from dloftbs.cli.output_options import STANDARD_OUTPUT
from dloftbs.cli.outputs import config_beside
from dloftbs.config import Config
from dloftbs.sinks.sink import Identity, identity_of
from dloftbs.sources.image_files import IMAGE_EXTENSIONS, files_of
from dloftbs.sources.naming_rules import is_rule, partners_of
from dloftbs.sources.recordings import BAG_SUFFIXES, COMPRESSED
from dloftbs.sources.standard_input import STANDARD_INPUT
from dloftbs.support.safe_files import sink_errors

READING = (
    "depth",
    "masks",
    "occluders",
    "instances",
    "camera",
    "registration",
    "config_file",
    "background",
    "robot",
    "joints",
    "camera_pose",
)
"""Parameters of commands that name further inputs beside the frames."""
_ONE = (*IMAGE_EXTENSIONS, ".npy")
_FRAMES = (*IMAGE_EXTENSIONS, *BAG_SUFFIXES, COMPRESSED)
"""Suffixes of files in a folder that frames may come from."""


class InputFiles:
    """All files that a command reads, known by device and inode, whatever links lead to them; none is opened.

    Parameters
    ----------
    where : sequence of str
        Source of the frames.
    parameters : mapping of str to object
        Of the command, by name.
    """

    def __init__(self, where: Sequence[str], parameters: Mapping[str, Any]) -> None:
        beside = [str(parameters[name]) for name in READING if parameters.get(name) is not None]
        files = [text for text in where if text != STANDARD_INPUT]
        frames = [file for text in files for file in files_of(text, _FRAMES)]
        rules = [text for text in beside if is_rule(text)]
        partners = [file for rule in rules for group in partners_of(frames, rule) for file in group]
        others = [file for text in beside for file in files_of(text, _ONE)]
        self._names = {identity_of(file): str(file) for file in (*others, *partners, *frames)}
        self._frames = {os.path.normpath(file) for file in frames} - {str(partner) for partner in partners}
        self._named = self._frames or set(files)  # whoever opens a file that is missing says so
        self._is_piped = list(where) == [STANDARD_INPUT]

    @property
    def is_one_image(self) -> bool:
        """True if the frames are a single image file, there or missing, or standard input, which may be one."""
        return self._is_piped or (
            len(self._named) == 1 and all(Path(name).suffix.lower() in IMAGE_EXTENSIONS for name in self._named)
        )

    def name_of(self, identity: Identity) -> str | None:
        """Return the name of the input that is this file, or None."""
        return self._names.get(identity)

    def within(self, folder: str) -> list[str]:
        """Return which files in a folder are inputs, by their paths there.

        Raises
        ------
        SinkError
            If the folder cannot be read.
        """
        with sink_errors(Path(folder)):
            paths = [os.path.join(folder, name) for name in os.listdir(folder)] if os.path.isdir(folder) else []
        return [path for path in paths if self.name_of(identity_of(path)) is not None]


@dataclass(frozen=True)
class Outputs:
    """Outputs of a command, none of which is an input.

    Parameters
    ----------
    data : tuple of str
        Files of curves; ``"-"`` is standard output.
    pictures : dict of str to (str, str)
        By option: a folder, a picture or a video, and what names of pictures in a folder end in before their suffix.
    config_file : Path or None
        File that the configuration is written to.
    """

    data: tuple[str, ...]
    pictures: dict[str, tuple[str, str]]
    config_file: Path | None


def plan_outputs(
    data: Sequence[str], pictures: Mapping[str, str | None], inputs: InputFiles, config: Config, *, is_one: bool = False
) -> Outputs:
    """Return what will be written, if none of it replaces an input, and no two are the same place.

    Parameters
    ----------
    data : sequence of str
        As --out has them.
    pictures : mapping of str to str or None
        Outputs of drawn frames, by option.
    inputs : InputFiles
    config : Config
        That will lie beside the first output.
    is_one : bool
        Whether there is a single frame, whatever the inputs are.

    Raises
    ------
    click.UsageError
        If an output is an input or another output, or a picture is to take several frames.
    SinkError
        If the configuration would replace a file that is none, or a folder cannot be read.
    """
    named = {option: path for option, path in pictures.items() if path is not None}
    outputs = [*(("--out", path) for path in data), *named.items()]
    _check_places(outputs, inputs)
    for path in data:
        if path != STANDARD_OUTPUT and inputs.within(path):
            raise click.UsageError(f"--out {path} holds inputs, which the results would replace; choose another name")
    endings = {option: _checked_ending(option, path, inputs) for option, path in named.items()}
    for option, path in named.items():
        if not (is_one or inputs.is_one_image) and sinks.kind_of(path) is sinks.OverlayPictureSink:
            raise click.UsageError(
                f"{option} {path} is one picture, but the input is not one image; name a folder, as in {path}/"
            )
    # What lies beside a folder of inputs is nobody's to write to.
    beside = [os.path.join(path, endings[option][1:]) if endings[option] else path for option, path in named.items()]
    config_file = config_beside((*data, *beside), config)
    if config_file is not None:
        _check_places([*outputs, ("the configuration used,", str(config_file))], inputs)
    return Outputs(tuple(data), {option: (path, endings[option]) for option, path in named.items()}, config_file)


def _check_places(outputs: Iterable[tuple[str, str]], inputs: InputFiles) -> None:
    known: dict[Identity, str] = {}
    for option, path in outputs:
        place = _standard_output() if path == STANDARD_OUTPUT else identity_of(path)
        what = f"{option} {path}"
        if (replaced := inputs.name_of(place)) is not None:
            raise click.UsageError(f"{what} would replace the input {replaced}; choose another name")
        if place in known:
            raise click.UsageError(f"{known[place]} and {what} are the same place; choose two")
        known[place] = what


def _checked_ending(option: str, folder: str, inputs: InputFiles) -> str:
    """Return what distinguishes pictures from the inputs in their folder, nothing where there is none."""
    there = inputs.within(folder)
    if not there:
        return ""
    ending = f".{option.removeprefix('--')}"
    for path in there:
        if path.lower().endswith(f"{ending}.png"):
            raise click.UsageError(
                f"{option} {folder} could replace the input {path}, which is named as its pictures are; "
                "remove it if an earlier run drew it, or choose another folder"
            )
    return ending


def _standard_output() -> Identity:
    """Return what distinguishes the file that standard output goes to; its name where it is no file."""
    try:
        found = os.fstat(sys.stdout.fileno())
    except (AttributeError, OSError, ValueError):  # None where it was closed, or not of the system
        return STANDARD_OUTPUT
    return (found.st_dev, found.st_ino) if stat.S_ISREG(found.st_mode) else STANDARD_OUTPUT
