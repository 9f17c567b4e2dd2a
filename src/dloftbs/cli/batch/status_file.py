"""Status of an input of a batch, in a file beside its result."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from typing import NamedTuple

from dloftbs.cli.batch.input_list import BatchInput
from dloftbs.cli.batch.settings import BatchSettings
from dloftbs.cli.durations import LatencyHistogram
from dloftbs.cli.stream_report import RunReport
from dloftbs.errors import InputError
from dloftbs.sources.image_files import IMAGE_EXTENSIONS, files_of
from dloftbs.sources.naming_rules import partners_of
from dloftbs.support.documents import parse_json, read_text
from dloftbs.support.json_text import encode
from dloftbs.support.safe_files import write_whole
from dloftbs.support.text import readable


class State(str, Enum):
    """End that an input came to."""

    DONE = "done"
    """All its frames were read."""
    PARTIAL = "partial"
    """There is a result, and frames are missing in it: some could not be read, or the rest could not."""
    FAILED = "failed"
    """There is no result."""
    BUSY = "busy"
    """Somebody else works on it at the moment; no file ever says so."""


@dataclass(frozen=True)
class Fingerprint:
    """Names, sizes and times of change of the files of an input, which show whether it has changed."""

    files: int
    bytes: int
    digest: str


@dataclass(frozen=True)
class Spread:
    """Milliseconds a frame."""

    p50: float
    p99: float
    max: float


@dataclass(frozen=True)
class Timing:
    """Times, which differ from run to run as nothing else in the file does."""

    seconds: float
    frames_per_s: float
    ms: dict[str, Spread]


@dataclass(frozen=True)
class Status:
    """Outcome of an input, and what its result was made by.

    Parameters
    ----------
    input : str
        Its name.
    state : State
    error : str or None
        Message of the error that ended the reading before its time.
    result : str or None
        Name of the file beside this one.
    frames, skipped : int
        Frames in the result, and frames that could not be read.
    warnings : tuple of str
        The first warnings while it was read; there is one for each frame that was skipped.
    detections, tracks : int
        Objects found, summed up over the frames, and confirmed tracks.
    nothing_found, no_curve_in_space : dict of str to int
        Number of frames without an object, and of objects without a curve in space, by their reason.
    unsteady : str or None
        Signs that the mask breaks up, or that the number of objects is known, and the options that help.
    fingerprint : Fingerprint
    settings, version : str
        Digest of the settings, and version of the code, that made the result.
    timing : Timing or None
    """

    input: str
    state: State
    error: str | None
    result: str | None
    frames: int
    skipped: int
    warnings: tuple[str, ...]
    detections: int
    tracks: int
    nothing_found: dict[str, int]
    no_curve_in_space: dict[str, int]
    unsteady: str | None
    fingerprint: Fingerprint
    settings: str
    version: str
    timing: Timing | None = field(default=None)


class Event(NamedTuple):
    """News of a batch: an input that is done, if one is, and the frames read by now of those that are not."""

    status: Status | None = None
    unfinished: int = 0


def status_of(
    item: BatchInput,
    settings: BatchSettings,
    state: State,
    fingerprint: Fingerprint,
    report: RunReport,
    *,
    error: str | None = None,
    warnings: Iterable[str] = (),
) -> Status:
    """Return the status of an input after a run."""
    return Status(
        input=readable(item.name),
        state=state,
        error=None if error is None else readable(error),
        result=readable(item.result.name) if report.frames else None,
        frames=report.frames,
        skipped=report.skipped,
        warnings=tuple(map(readable, warnings)),
        detections=report.objects,
        tracks=report.steadiness.tracks,
        nothing_found=report.reasons.counts(),
        no_curve_in_space=report.reasons_3d.counts(),
        unsteady="; ".join(report.warnings()) or None,
        fingerprint=fingerprint,
        settings=settings.digest,
        version=settings.version,
        timing=_timing(report) if report.frames else None,
    )


def write_status(item: BatchInput, status: Status) -> None:
    """Write or replace the file as a whole.

    Raises
    ------
    SinkError
        If it cannot be written.
    """
    write_whole(item.status, encode(status, indent=2) + b"\n")


def read_status(item: BatchInput) -> Status | None:
    """Return what the file says; None where there is none, or it says something else."""
    try:
        status: Status = parse_json(read_text(item.status), Status)
    except InputError:
        return None
    return status


def reason_to_run(item: BatchInput, settings: BatchSettings, status: Status | None) -> str | None:
    """Return why there is something to do for an input, in few words; None where its status holds."""
    if status is None:
        return "new"
    if status.state is not State.FAILED and not os.path.isfile(item.result):
        return "without their result"
    if status.settings != settings.digest:
        return "with other settings"
    if status.version != settings.version:
        return "by another version"
    if status.fingerprint != fingerprint_of(item, settings):
        return "changed since"
    return "failed before" if settings.retry_failed and status.state is not State.DONE else None


def fingerprint_of(item: BatchInput, settings: BatchSettings) -> Fingerprint:
    """Return what shows whether an input, or what goes with its frames by a naming rule, has changed."""
    digest, count, size = hashlib.sha256(), 0, 0
    partners = (file for rule in settings.options.inputs.rules for file in _partners(item.path, rule))
    for path in sorted({*_files(item.path), *partners}):
        try:
            found = os.stat(path)
        except OSError:  # missing, as a partner may be; reading says so
            continue
        name = os.path.relpath(path, item.path.parent)
        digest.update(b"%s\0%d\0%d\0" % (os.fsencode(name), found.st_size, found.st_mtime_ns))
        count, size = count + 1, size + found.st_size
    return Fingerprint(count, size, digest.hexdigest())


def _files(path: Path) -> Iterator[Path]:
    if not os.path.isdir(path):
        yield path
    for folder, _, names in os.walk(path):
        yield from (Path(folder, name) for name in names if not name.startswith("."))


def _partners(path: Path, rule: str) -> Iterator[Path]:
    groups = partners_of(files_of(str(path), IMAGE_EXTENSIONS), rule)
    return (partner for group in groups for partner in group)


def _timing(report: RunReport) -> Timing:
    parts = {**report.stages, "pipeline": report.total}
    return Timing(report.seconds, report.rate, {name: _spread(histogram) for name, histogram in parts.items()})


def _spread(histogram: LatencyHistogram) -> Spread:
    return Spread(histogram.percentile(50), histogram.percentile(99), histogram.max_ms)
