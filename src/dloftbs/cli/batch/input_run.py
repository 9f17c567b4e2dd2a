"""One input of a batch: followed from its first frame to its last, its result put in place as a whole."""

from __future__ import annotations

import logging
import os
import shutil
import threading
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from dloftbs.cli.batch.input_list import BatchInput
from dloftbs.cli.batch.settings import BatchSettings
from dloftbs.cli.batch.status_file import (
    Fingerprint,
    State,
    Status,
    fingerprint_of,
    read_status,
    reason_to_run,
    status_of,
    write_status,
)
from dloftbs.cli.outputs import open_outputs
from dloftbs.cli.shell import Failure
from dloftbs.cli.stream_report import RunReport
from dloftbs.cli.stream_run import StreamRun
from dloftbs.config import Config
from dloftbs.errors import DloftbsError, SinkError
from dloftbs.support.claims import Claim, hidden_beside
from dloftbs.support.safe_files import sink_errors
from dloftbs.support.worker_process import use_one_core

MAX_WARNINGS = 100
"""Warnings of an input that its status holds; `Status.skipped` counts all frames."""

Shower = Callable[[RunReport], None]


def run_input(
    item: BatchInput,
    settings: BatchSettings,
    shown: Shower = lambda report: None,
    stop: Callable[[], bool] = lambda: False,
) -> Status:
    """Follow the cables through one input, and write its result and its status.

    Both are in place as a whole or not at all: the result is written in a hidden folder beside its place and moved,
    and then the status is, which says that it is complete. What an earlier run left there is removed first. It holds no
    times, so that it is the same, byte for byte, whoever makes it.

    Parameters
    ----------
    item : BatchInput
    settings : BatchSettings
    shown, stop
        As `FollowedStream.follow` has them.

    Returns
    -------
    Status
        The known one, if somebody else was faster; a state that is busy, if somebody is at it.

    Raises
    ------
    SinkError
        If the result or the status cannot be written. What is wrong with an input is in its status.
    KeyboardInterrupt
        If it was stopped; nothing is left then.
    """
    use_one_core()
    claim = _claim(item, settings)
    if isinstance(claim, Status):
        return claim
    with claim, _work_folder(item) as folder:
        known = read_status(item)
        if known is not None and reason_to_run(item, settings, known) is None:
            return known
        return _run_claimed(item, settings, folder, shown, stop)


def record_death(item: BatchInput, settings: BatchSettings, why: str) -> Status:
    """Write the status of an input whose process died, and remove what that left behind.

    Raises
    ------
    SinkError
        If it cannot be written.
    """
    claim = _claim(item, settings)
    if isinstance(claim, Status):
        return claim
    with claim, _work_folder(item):
        status = status_of(item, settings, State.FAILED, fingerprint_of(item, settings), RunReport(), error=why)
        write_status(item, status)
    return status


def _claim(item: BatchInput, settings: BatchSettings) -> Claim | Status:
    """Return the right to write the results of an input, or a status if somebody else has it."""
    with sink_errors(item.result):
        item.result.parent.mkdir(parents=True, exist_ok=True)
        try:
            return Claim(item.result)
        except SinkError as error:
            return status_of(item, settings, State.BUSY, Fingerprint(0, 0, ""), RunReport(), error=str(error))


def _run_claimed(
    item: BatchInput, settings: BatchSettings, folder: Path, shown: Shower, stop: Callable[[], bool]
) -> Status:
    with sink_errors(item.result):
        item.status.unlink(missing_ok=True)
        item.result.unlink(missing_ok=True)
    fingerprint = fingerprint_of(item, settings)  # before the first frame: what changes meanwhile is read again
    made = folder / item.result.name
    report, error = RunReport(), None
    with _warnings() as warnings:
        try:
            run = StreamRun(str(item.path), settings.options, in_turn=True)
            report = run.report
            _follow(run, made, settings.options.config, shown, stop)
        except SinkError:
            raise
        except (DloftbsError, Failure) as wrong:
            error = str(wrong)
        except Exception as wrong:  # noqa: BLE001 - whatever is wrong with an input stops no other one
            error = "".join(traceback.format_exception(wrong)).strip()
    state = State.FAILED if not report.frames else State.PARTIAL if error or report.skipped else State.DONE
    if report.frames:
        with sink_errors(item.result):
            os.replace(made, item.result)
    status = status_of(item, settings, state, fingerprint, report, error=error, warnings=warnings)
    write_status(item, status)
    return status


def _follow(run: StreamRun, result: Path, config: Config, shown: Shower, stop: Callable[[], bool]) -> None:
    with run, open_outputs([str(result)], config=config) as sink:
        run.follow(lambda frame, found: sink.write(frame, replace(found, stage_ms={})), shown=shown, stop=stop)
    run.check_frames()


@contextmanager
def _work_folder(item: BatchInput) -> Iterator[Path]:
    """Make an empty hidden folder beside a result, always of the same name, and remove it."""
    folder = hidden_beside(item.result, ".part")
    with sink_errors(folder):
        shutil.rmtree(folder, ignore_errors=True)  # of a run that was killed
        folder.mkdir()
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


@contextmanager
def _warnings() -> Iterator[list[str]]:
    """Collect the warnings of this thread, in place of showing them."""
    logger, handler = logging.getLogger("dloftbs"), _Collector()
    logger.addHandler(handler)
    try:
        yield handler.messages
    finally:
        logger.removeHandler(handler)


class _Collector(logging.Handler):
    def __init__(self) -> None:
        super().__init__(logging.WARNING)
        self.messages: list[str] = []
        self._thread = threading.get_ident()

    def emit(self, record: logging.LogRecord) -> None:
        if record.thread == self._thread and len(self.messages) < MAX_WARNINGS:
            self.messages.append(record.getMessage())
