"""Processes of this machine that work on inputs, each on one at a time; one that dies costs its input alone."""

from __future__ import annotations

import multiprocessing
import signal
from collections import deque
from collections.abc import Callable, Generator, Sequence
from contextlib import suppress
from multiprocessing import connection
from multiprocessing.connection import Connection
from time import monotonic
from types import FrameType

from dloftbs.cli.batch.input_list import BatchInput
from dloftbs.cli.batch.input_run import record_death, run_input
from dloftbs.cli.batch.settings import BatchSettings
from dloftbs.cli.batch.status_file import Event, Status
from dloftbs.cli.stream_report import RunReport
from dloftbs.errors import DloftbsError, SinkError
from dloftbs.pipeline.kernel_loading import load_kernels
from dloftbs.support.worker_process import begin_worker, starting_workers

TICK_S = 0.2
"""Time after which who waits is asked whether to go on."""
PATIENCE_S = 10.0
"""Time that a process has to put away what it is at, when all is to end."""
READY = "ready"

_SPAWN = multiprocessing.get_context("spawn")  # threads of numba and OpenCV do not survive a fork


def in_processes(items: Sequence[BatchInput], settings: BatchSettings, jobs: int) -> Generator[Event, None, None]:
    """Work on inputs in processes, and yield what happens; closing this ends them.

    Kernels that are not compiled yet are compiled here, before the processes load them.

    Raises
    ------
    SinkError
        If a result cannot be written; then all ends.
    DloftbsError
        If processes cannot begin.
    """
    load_kernels()
    waiting = deque(items)
    workers: list[_Worker] = []
    try:
        workers += (_Worker(settings) for _ in range(min(jobs, len(items))))
        while waiting or any(worker.item is not None for worker in workers):
            for worker in _with_news(workers):
                try:
                    status = worker.receive()
                except EOFError:  # it has died
                    workers.remove(worker)
                    status = worker.bury(settings)
                    if waiting:
                        workers.append(_Worker(settings))
                if worker.is_free and waiting:
                    worker.give(waiting.popleft())
                yield Event(status, _unfinished(workers))
            yield Event(None, _unfinished(workers))
    finally:
        _end(workers)


def _unfinished(workers: Sequence[_Worker]) -> int:
    return sum(worker.frames for worker in workers)


def _with_news(workers: Sequence[_Worker]) -> list[_Worker]:
    """Return the processes that have said something, or have died, after waiting a moment for the first."""
    ready = connection.wait([worker.channel for worker in workers], TICK_S)
    return [worker for worker in workers if worker.channel in ready]


class _Worker:
    """A process, as the first one knows it."""

    def __init__(self, settings: BatchSettings) -> None:
        self.channel, theirs = _SPAWN.Pipe()
        self._process = _SPAWN.Process(target=_work, args=(theirs, settings), name="dloftbs-batch", daemon=True)
        with starting_workers():
            self._process.start()
        theirs.close()  # the end of the process is then the end of the channel
        self.item: BatchInput | None = None
        self.frames = 0
        self.is_ready = self._dead = False

    @property
    def is_free(self) -> bool:
        """True if it can be given an input."""
        return self.is_ready and not self._dead and self.item is None

    def give(self, item: BatchInput) -> None:
        """Let it work on an input."""
        self.item = item
        try:
            self.channel.send(item)
        except OSError:  # it has died, which the next receiving finds
            return

    def receive(self) -> Status | None:
        """Take down what it says, and return the status of its input once it is done.

        Raises
        ------
        EOFError
            If it has died.
        SinkError
            If it cannot write a result.
        """
        try:
            message = self.channel.recv()
        except OSError as error:
            raise EOFError from error
        match message:
            case Status():
                self.item, self.frames = None, 0
                return message
            case SinkError():
                raise message
            case int():
                self.frames = message
            case _:
                self.is_ready = True
        return None

    def bury(self, settings: BatchSettings) -> Status | None:
        """Return what became of its input now that it is dead; None where it had none.

        Raises
        ------
        DloftbsError
            If it never began.
        """
        self._dead = True
        self._process.join()
        self.channel.close()
        code = self._process.exitcode or 0
        by = f"by signal {-code} ({signal.strsignal(-code)})" if code < 0 else f"with exit code {code}"
        if not self.is_ready:
            raise DloftbsError(f"a process of the batch ended {by} before it could begin: too little memory, perhaps")
        if self.item is None:
            return None
        return record_death(self.item, settings, f"its process ended {by}: too little memory, or a crash")

    def terminate(self) -> None:
        """Ask it to end: at work it heeds the signal, while it waits the end of the channel."""
        self._process.terminate()
        self.channel.close()

    def join(self, seconds: float) -> None:
        """Wait for its end, and bring it about after a while."""
        self._process.join(seconds)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()
        self._process.close()


def _end(workers: Sequence[_Worker]) -> None:
    for worker in workers:
        worker.terminate()
    deadline = monotonic() + PATIENCE_S
    for worker in workers:
        worker.join(max(0.0, deadline - monotonic()))


def _work(channel: Connection, settings: BatchSettings) -> None:
    """Do what a process does: one input after the other, until it is asked to end or the first process is gone."""
    begin_worker()
    leaving = False

    def leave(_signal: int, _frame: FrameType | None) -> None:
        # An exception raised here would go through compiled code, which makes another one of it.
        nonlocal leaving
        leaving = True

    signal.signal(signal.SIGTERM, leave)
    with suppress(EOFError, BrokenPipeError, ConnectionResetError, KeyboardInterrupt):
        channel.send(READY)
        while True:
            channel.send(_outcome(channel.recv(), settings, channel, lambda: leaving))


def _outcome(
    item: BatchInput, settings: BatchSettings, channel: Connection, stop: Callable[[], bool]
) -> Status | SinkError:
    due = monotonic() + TICK_S

    def show(report: RunReport) -> None:
        nonlocal due
        if monotonic() >= due:
            due = monotonic() + TICK_S
            with suppress(OSError):  # the first process is gone, which is no fault of the input
                channel.send(report.frames)

    try:
        return run_input(item, settings, show, stop)
    except SinkError as error:
        return SinkError(str(error))
