"""Processes that work for another one: they end with it, leave Ctrl-C to it, and use one core each."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing import connection

_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
"""Variables that libraries read when they are loaded."""


def begin_worker() -> None:
    """Make this process one that works for its parent."""
    # Ctrl-C reaches all processes of a terminal: the first one sees to the others.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    use_one_core()
    threading.Thread(target=_end_with_parent, daemon=True).start()


def use_one_core() -> None:
    """Leave the other cores to other processes: these are as many as the cores."""
    import cv2

    cv2.setNumThreads(1)


@contextmanager
def starting_workers() -> Iterator[None]:
    """Let the processes that are started in the block load libraries that use one thread, and heed no Ctrl-C meanwhile.

    They inherit both. `begin_worker` would come too late, after all is imported.
    """
    before = {name: os.environ.get(name) for name in _THREADS}
    heeded = signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.environ.update(dict.fromkeys(_THREADS, "1"))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, heeded)
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        connection.wait([parent.sentinel])
        signal.raise_signal(signal.SIGTERM)
