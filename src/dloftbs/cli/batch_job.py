"""One input of a batch: its result and its status, each of which appears as a whole, and says whether it is done."""

from __future__ import annotations

import hashlib
import logging
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import click

from dloftbs import sinks
from dloftbs._documents import parse_json
from dloftbs._json import encode
from dloftbs._text import readable
from dloftbs._version import __version__
from dloftbs.cli.batch_inputs import STATUS, BatchInput
from dloftbs.cli.frames import UsableFrames
from dloftbs.cli.options import InputOptions
from dloftbs.config import Config
from dloftbs.errors import DloftbsError, InputError, SinkError, SourceError
from dloftbs.pipeline import Pipeline
from dloftbs.sinks._safe_files import sink_errors, write_whole

DONE, FAILED = "done", "failed"
_MOST_WARNINGS = 20
"""Of an input, in its status."""


@dataclass(frozen=True)
class Job:
    """One input and all that is needed to work on it, in any process.

    Parameters
    ----------
    given : BatchInput
    out : str
        Folder of the results.
    suffix : str
        Form of the result: ``.jsonl``, ``.npz`` or ``.csv``.
    config : Config
    inputs : InputOptions
    """

    given: BatchInput
    out: str
    suffix: str
    config: Config
    inputs: InputOptions

    @property
    def result(self) -> Path:
        """File of the result."""
        return Path(self.out, f"{self.given.result}{self.suffix}")

    @property
    def status(self) -> Path:
        """File of the status."""
        return Path(self.out, f"{self.given.result}{STATUS}")

    @property
    def key(self) -> str:
        """Digest of all that the result depends on: input, configuration, options, version."""
        parts = (__version__, self.config.to_yaml(), repr(self.inputs), self.suffix, *_state_of(Path(self.given.path)))
        return hashlib.sha256("\n".join(map(str, parts)).encode("utf-8", "backslashreplace")).hexdigest()


@dataclass(frozen=True)
class Outcome:
    """Outcome of one input, as its status file has it.

    Parameters
    ----------
    input, key : str
    state : str
        ``done`` or ``failed``.
    error : str, optional
        Reason for the failure.
    frames, skipped, tracks : int
        Frames in the result, frames that could not be read, and confirmed tracks.
    warnings : tuple of str
        The first ones.
    """

    input: str
    key: str
    state: str
    error: str | None = None
    frames: int = 0
    skipped: int = 0
    tracks: int = 0
    warnings: tuple[str, ...] = ()


def finished(job: Job) -> Outcome | None:
    """Return the outcome of an earlier run, if all is as it was then and the result is there; else None."""
    try:
        values = parse_json(job.status.read_bytes(), dict[str, Any])
        outcome = Outcome(**{**values, "warnings": tuple(values["warnings"])})
    except (OSError, InputError, KeyError, TypeError):
        return None
    is_same = outcome.state == DONE and outcome.key == job.key and job.result.is_file()
    return outcome if is_same else None


def run_job(job: Job) -> Outcome:
    """Work on an input, and write its result and its status; a failure of any kind is an outcome.

    The result is written under another name, ``.part.NAME``, and renamed. Its lines hold no times of computation: they
    are the same, byte for byte, whenever and wherever they are made.
    """
    key = job.key
    with _warnings() as warnings:
        try:
            counts = _track(job)
        except SinkError as error:  # somebody else may be writing there: the status is theirs
            return Outcome(job.given.path, key, FAILED, readable(str(error)))
        except (DloftbsError, click.ClickException) as error:
            said = error.message if isinstance(error, click.ClickException) else str(error)
            outcome = Outcome(job.given.path, key, FAILED, readable(said))
        except Exception as error:  # noqa: BLE001 - one input, whatever is wrong with it, stops no other
            outcome = Outcome(job.given.path, key, FAILED, readable(f"unexpected {type(error).__name__}: {error}"))
        else:
            outcome = Outcome(job.given.path, key, DONE, None, *counts)
    return write_status(job, replace(outcome, warnings=tuple(warnings)))


def died(job: Job, exit_code: int | None) -> Outcome:
    """Return the outcome of an input that the process working on it died of, and write its status."""
    how = "" if exit_code is None else f" by signal {-exit_code}" if exit_code < 0 else f" with code {exit_code}"
    return write_status(job, Outcome(job.given.path, job.key, FAILED, f"the process that worked on it ended{how}"))


def write_status(job: Job, outcome: Outcome) -> Outcome:
    """Write the status of an input, and return it; where that fails, a failure that says so."""
    values = {**asdict(outcome), "input": readable(outcome.input)}
    try:
        write_whole(job.status, encode(values, indent=1) + b"\n")
    except SinkError as error:
        return replace(outcome, state=FAILED, error=readable(str(error)))
    return outcome


def _track(job: Job) -> tuple[int, int, int]:
    """Track an input, and return the numbers of frames, of those skipped, and of confirmed tracks."""
    part = job.result.with_name(f".part.{job.result.name}")
    frames = 0
    confirmed: set[int] = set()
    pipeline = Pipeline(job.config)
    with job.inputs.open(job.given.path) as source:
        if source.live:
            raise InputError("a batch takes recordings; a camera or a stream has no end")
        usable = UsableFrames(source, job.config, job.inputs)
        with sinks.open(part) as sink:
            for frame in usable:
                result = pipeline.process(frame)
                sink.write(frame, replace(result, stage_ms={}))
                frames += 1
                confirmed |= {track.id for track in result.tracks if track.state.value == "confirmed"}
    if not frames:
        part.unlink(missing_ok=True)
        raise SourceError(f"{source.name}: no frame could be read")
    with sink_errors(job.result):
        os.replace(part, job.result)
    return frames, usable.skipped, len(confirmed)


@contextmanager
def _warnings() -> Iterator[list[str]]:
    """Gather what is logged in the block."""
    gathered = _Gatherer()
    logger = logging.getLogger("dloftbs")
    handlers, propagates = logger.handlers, logger.propagate
    logger.handlers, logger.propagate = [gathered], False
    try:
        yield gathered.texts
    finally:
        logger.handlers, logger.propagate = handlers, propagates


class _Gatherer(logging.Handler):
    def __init__(self) -> None:
        super().__init__(logging.WARNING)
        self.texts: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        if len(self.texts) < _MOST_WARNINGS and not record.name.startswith("dloftbs.kernels"):
            self.texts.append(readable(record.getMessage()))


def _state_of(path: Path) -> Iterator[str]:
    """Yield size and time of each file of an input: who replaces it asks for another result."""
    files = sorted(path.rglob("*")) if path.is_dir() else [path]
    for file in files:
        try:
            found = file.stat()
        except OSError:
            continue
        if file.is_file():
            yield f"{file.relative_to(path.parent)} {found.st_size} {found.st_mtime_ns}"
