"""Processes that work on jobs, a job at a time each; one that dies costs its job alone."""

from __future__ import annotations

import multiprocessing
import os
import signal
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing import connection
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from threading import Thread
from typing import Any, Generic, TypeVar

J = TypeVar("J")
R = TypeVar("R")

_ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
"""Variables by which libraries are told how many threads to use."""


@dataclass(eq=False)
class _Worker(Generic[J]):
    process: BaseProcess
    pipe: Connection
    job: J


def run_in_processes(
    work: Callable[[J], R], died: Callable[[J, int | None], R], jobs: Iterable[J], processes: int
) -> Iterator[tuple[J, R]]:
    """Yield each job with its result, as they get ready; all processes end with the iteration, however it ends.

    Parameters
    ----------
    work : callable
        A function of a module, which processes import.
    died : callable
        Makes the result of a job whose process died of it; takes the exit code.
    jobs : iterable
    processes : int
        Number of processes, each with one thread.
    """
    context = multiprocessing.get_context("spawn")
    waiting = iter(jobs)
    busy: list[_Worker[J]] = []
    idle: list[tuple[BaseProcess, Connection]] = []

    def start(job: J) -> None:
        if idle:
            process, pipe = idle.pop()
        else:
            pipe, theirs = context.Pipe()
            process = context.Process(target=_serve, args=(work, theirs), daemon=True)
            with _one_thread():
                process.start()
            theirs.close()
        busy.append(_Worker(process, pipe, job))
        with suppress(OSError):  # it died while it had nothing to do, and is found dead below
            pipe.send(job)

    try:
        while True:
            while len(busy) < processes and (job := next(waiting, None)) is not None:
                start(job)
            if not busy:
                return
            connection.wait([worker.pipe for worker in busy])
            for worker in [one for one in busy if one.pipe.poll()]:
                busy.remove(worker)
                try:
                    result = worker.pipe.recv()
                except (EOFError, OSError):
                    worker.process.join()
                    result = died(worker.job, worker.process.exitcode)
                else:
                    idle.append((worker.process, worker.pipe))
                yield worker.job, result
    finally:
        for process in [*(worker.process for worker in busy), *(process for process, _ in idle)]:
            process.terminate()
            process.join()


def _serve(work: Callable[[Any], Any], pipe: Connection) -> None:
    """Work on jobs until there are no more, or whoever sends them is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches all processes of a terminal: the first one decides
    Thread(target=_end_with_parent, daemon=True).start()
    import cv2

    cv2.setNumThreads(1)
    while True:
        try:
            job = pipe.recv()
        except EOFError:
            return
        pipe.send(work(job))


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None  # this is a process that another one started
    parent.join()
    os._exit(1)


@contextmanager
def _one_thread() -> Iterator[None]:
    """Tell the libraries of processes that are started in the block to use one thread."""
    before = {name: os.environ.get(name) for name in _ONE_THREAD}
    os.environ.update(dict.fromkeys(_ONE_THREAD, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
