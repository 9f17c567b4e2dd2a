"""Inputs of a batch: what patterns match, where each one's result goes, and which are whose."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import click

from dloftbs.errors import SourceError
from dloftbs.sinks.sink import identity_of
from dloftbs.sources.image_files import is_glob, matching, natural_key
from dloftbs.sources.recordings import METADATA, is_recording_file

STATUS = ".status.json"
AUTO = "auto"
_SLURM = (
    ("SLURM_ARRAY_TASK_ID", "SLURM_ARRAY_TASK_COUNT", "SLURM_ARRAY_TASK_MIN"),
    ("SLURM_PROCID", "SLURM_NTASKS", None),
)
"""Variables of a job array, then of the tasks of a step: number, how many, and the first number where it is not 0."""


@dataclass(frozen=True)
class BatchInput:
    """An input, and its result by the path below the output folder, without a suffix."""

    path: str
    result: str


def list_inputs(patterns: Sequence[str]) -> list[BatchInput]:
    """Return the inputs that patterns match and paths name, in natural order.

    A file of a rosbag2 stands for its folder. The result of an input lies below the output folder as the input lies
    below the part of its pattern that has no wildcards.

    Raises
    ------
    SourceError
        If a pattern matches nothing, or a path is not there.
    click.UsageError
        If two inputs would have one result.
    """
    found: dict[object, BatchInput] = {}
    for pattern in patterns:
        base, paths = _expand(pattern)
        for path in sorted(paths, key=natural_key):
            found.setdefault(identity_of(path), BatchInput(str(path), os.path.relpath(path, base)))
    inputs = sorted(found.values(), key=lambda one: natural_key(Path(one.path)))
    by_result: dict[str, BatchInput] = {}
    for one in inputs:
        other = by_result.setdefault(one.result.casefold(), one)
        if other is not one:
            raise click.UsageError(
                f"{other.path} and {one.path} would have the same result, {one.result}; "
                "give a pattern in quotes, such as 'recordings/**/*.mcap', which keeps their folders apart"
            )
    return inputs


def _expand(pattern: str) -> tuple[Path, set[Path]]:
    """Return the folder that results are named from, and the inputs."""
    text = os.path.expanduser(pattern)
    if not is_glob(text):
        path = Path(text)
        if not path.exists():
            raise SourceError(f"there is no file or folder {pattern!r}")
        return path.parent, {path}
    matches = {_whole(Path(match)) for match in matching(text) if not os.path.basename(match).startswith(".")}
    if not matches:
        raise SourceError(f"nothing matches the pattern {pattern!r}")
    fixed = re.split(r"[*?\[]", text, maxsplit=1)[0]
    base = Path(os.path.dirname(fixed) or ".")
    # A pattern for the files of one recording matches the folder that it begins in.
    return (base.parent if base in matches else base), matches


def _whole(path: Path) -> Path:
    """Return the folder of a rosbag2 that a file belongs to, or else the path."""
    is_part = is_recording_file(path) and (path.parent / METADATA).is_file()
    return path.parent if is_part else path


def read_shard(text: str | None, environment: Mapping[str, str]) -> tuple[int, int]:
    """Return which part of how many is meant, from 1 on: ``2/8``, ``auto`` by the variables of SLURM, or all.

    Raises
    ------
    click.UsageError
        If it says something else, or there are no such variables.
    """
    if text is None:
        return 1, 1
    numbers = _slurm(environment) if text == AUTO else _fraction(text)
    if numbers is None or not 1 <= numbers[0] <= numbers[1]:
        got = f"{text!r} in an environment without a task of SLURM" if text == AUTO and numbers is None else repr(text)
        raise click.UsageError(f"--shard must be I/N with I from 1 to N, such as 2/8, or auto under SLURM, got {got}")
    return numbers


def _fraction(text: str) -> tuple[int, int] | None:
    found = re.fullmatch(r"([0-9]{1,9})/([0-9]{1,9})", text)
    return None if found is None else (int(found[1]), int(found[2]))


def _slurm(environment: Mapping[str, str]) -> tuple[int, int] | None:
    for number, count, first in _SLURM:
        if number in environment and count in environment:
            try:
                begin = int(environment.get(first, "0")) if first is not None else 0
                return int(environment[number]) - begin + 1, int(environment[count])
            except ValueError:
                return None
    return None


def of_shard(inputs: Sequence[BatchInput], shard: tuple[int, int]) -> list[BatchInput]:
    """Return every Nth input from the Ith on."""
    number, count = shard
    return list(inputs[number - 1 :: count])
