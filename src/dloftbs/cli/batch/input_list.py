"""Inputs of a batch: what globs, folders and files stand for, and the names of their results."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path

from dloftbs.errors import InputError, SinkError, SourceError
from dloftbs.sinks.sink import identity_of
from dloftbs.sources.image_files import glob_matches, is_glob, natural_key
from dloftbs.sources.recordings import METADATA, is_recording_file

STATUS = ".status.json"
MAX_NAME_BYTES = 240
"""Of a file name, some less than the 255 of common file systems: a lock and a folder of work have longer ones."""


@dataclass(frozen=True)
class BatchInput:
    """One input of a batch, and where its results go.

    Parameters
    ----------
    name : str
        Path below the common folder of all inputs, with slashes.
    path : Path
        Absolute.
    result, status : Path
        Files in the folder of the results, by the name of the input.
    """

    name: str
    path: Path
    result: Path
    status: Path


@dataclass(frozen=True)
class _Argument:
    """An argument of the command: a path or a glob.

    Parameters
    ----------
    text : str
        As it was given.
    root : str
        Absolute folder that names begin from: that of the path, or of the glob as far as it has no wildcards.
    pattern : tuple of str
        The rest of the glob, part by part; empty for a path.
    """

    text: str
    root: str
    pattern: tuple[str, ...]


def list_inputs(where: Sequence[str], out: Path, suffix: str, settings_files: Iterable[Path] = ()) -> list[BatchInput]:
    """Return the inputs in natural order, each with a name of its own.

    A file or a folder is one input, and each match of a glob is; where a glob matches files of a rosbag2, their folder
    is, once. The names of results are the paths of the inputs below the common folder of all arguments, as far as these
    are without wildcards: a new match changes no other's name.

    Parameters
    ----------
    where : sequence of str
        Files, folders and globs.
    out : Path
        Folder of the results.
    suffix : str
        Of the results, ``".jsonl"`` say.
    settings_files : iterable of Path
        Further files that are read.

    Raises
    ------
    InputError
        If inputs lie in each other, or results of two would have one name, or a name that is too long.
    SinkError
        If a result would replace a file that is read, or be an input of the next run.
    SourceError
        If there is no such file or folder, or a glob matches nothing.
    """
    arguments = [_read(text) for text in where]
    paths = sorted(
        {path for argument in arguments for path in _paths(argument)}, key=lambda path: natural_key(Path(path))
    )
    _check_apart(paths)
    try:
        root = os.path.commonpath([*(argument.root for argument in arguments), *map(os.path.dirname, paths)])
    except ValueError as error:  # two drives of Windows
        raise InputError(f"the inputs have no folder in common: {error}") from error
    out = Path(os.path.realpath(out))
    inputs = [_input(Path(path), root, out, suffix) for path in paths]
    _check_names(inputs)
    _check_places(inputs, arguments, out, settings_files)
    return inputs


def _read(text: str) -> _Argument:
    if text == "-" or "://" in text:
        raise InputError(f"a batch takes files, folders and globs, not {text!r}; use dloftbs track")
    text = os.path.expanduser(text)
    if is_glob(text):
        first = min(text.find(wildcard) for wildcard in "*?[" if wildcard in text)
        folder = os.path.dirname(text[:first])
        return _Argument(text, os.path.abspath(folder), Path(text[len(folder) :].lstrip(os.sep)).parts)
    if not os.path.exists(text):
        raise SourceError(f"there is no file or folder {text!r}")
    return _Argument(text, os.path.dirname(os.path.abspath(text)), ())


def _paths(argument: _Argument) -> Iterator[str]:
    found = glob_matches(argument.text) if argument.pattern else [argument.text]
    count = 0
    for path in map(os.path.abspath, found):
        if os.path.isfile(path) or os.path.isdir(path):
            count += 1
            yield _recording_of(path) if argument.pattern else path
    if not count:
        what = "nothing matches the pattern" if argument.pattern else "neither a file nor a folder:"
        raise SourceError(f"{what} {argument.text!r}")


def _recording_of(path: str) -> str:
    """Return the folder of a rosbag2 for one of its files, and any other path as it is."""
    folder = os.path.dirname(path)
    is_part = is_recording_file(Path(path)) and os.path.isfile(os.path.join(folder, METADATA))
    return folder if is_part else path


def _check_apart(paths: Sequence[str]) -> None:
    known = set(paths)
    for path in paths:
        outer = next((str(folder) for folder in Path(path).parents if str(folder) in known), None)
        if outer is not None:
            raise InputError(
                f"{path} and the folder {outer} that it lies in would both be inputs: "
                "name files by their suffix, as in '**/*.mp4', or folders alone, as in 'recordings/*/'"
            )


def _input(path: Path, root: str, out: Path, suffix: str) -> BatchInput:
    name = os.path.relpath(path, root)
    if name == os.curdir:
        raise InputError(f"the folder {path} has no name of its own to give to its result")
    target = out / name
    return BatchInput(
        Path(name).as_posix(), path, target.with_name(target.name + suffix), target.with_name(target.name + STATUS)
    )


def _check_names(inputs: Sequence[BatchInput]) -> None:
    places: dict[str, str] = {}
    for each in inputs:
        for file in (each.result, each.status):
            if len(os.fsencode(file.name)) > MAX_NAME_BYTES:
                raise InputError(
                    f"{each.path}: the name {file.name!r} of its result is too long; give it a shorter name"
                )
            other = places.setdefault(str(file).casefold(), each.name)  # some file systems take a for A
            if other != each.name:
                raise InputError(f"the results of {other} and {each.name} would have one name: rename one of the two")
    for each in inputs:
        for folder in each.result.parents:
            owner = places.get(str(folder).casefold())
            if owner is not None:
                raise InputError(
                    f"the result of {owner} would have the name of the folder for that of {each.name}: "
                    "rename one of the two"
                )


def _check_places(
    inputs: Sequence[BatchInput], arguments: Sequence[_Argument], out: Path, settings_files: Iterable[Path]
) -> None:
    real = {os.path.realpath(each.path): each.name for each in inputs}
    read = {identity_of(path): str(path) for path in (*map(str, settings_files), *real)}
    files = [file for each in inputs for file in (each.result, each.status)]
    for file in files:
        replaced = read.get(identity_of(file))
        if replaced is not None:
            raise SinkError(f"the result {file} would replace the input {replaced}; choose another folder with --out")
    for folder in (out, *out.parents):
        if str(folder) in real:
            raise SinkError(f"--out {out} is the input {folder}, or lies in it; choose another folder")
    folders = {folder for file in files for folder in file.parents}
    for argument in arguments:
        if argument.pattern:
            caught = _caught(argument, folders if argument.text.endswith(os.sep) else folders.union(files))
            if caught is not None:
                raise SinkError(
                    f"--out {out}: what is written to {caught} would match {argument.text!r}, and be an input of the "
                    "next run; choose another folder"
                )


def _caught(argument: _Argument, paths: Iterable[Path]) -> Path | None:
    root = Path(os.path.realpath(argument.root))
    for path in sorted(paths):
        if path.is_relative_to(root) and _matches(argument.pattern, path.relative_to(root).parts):
            return path
    return None


def _matches(pattern: Sequence[str], parts: Sequence[str]) -> bool:
    """Return whether a glob would match a path, in parts: ``**`` is any number of folders, ``*`` nothing hidden."""
    if not pattern:
        return not parts
    first, rest = pattern[0], pattern[1:]
    if first == "**":
        return any(_matches(rest or ("*",), parts[count:]) for count in range(len(parts)))
    hidden = bool(parts) and parts[0].startswith(".") and not first.startswith(".")
    return bool(parts) and not hidden and fnmatchcase(parts[0], first) and _matches(rest, parts[1:])
