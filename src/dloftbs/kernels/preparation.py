"""Compilation of whole rooms ahead of their first use, in as many processes as there are cores."""

from __future__ import annotations

import json
import logging
import os
import subprocess
import sys
import threading
from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from dloftbs.kernels import compiler

MAX_WORKERS = 7
"""Processes beside this one: with more, all would wait for the module that takes longest, a tenth of the time."""
_MIN_KERNELS = 4
"""Missing kernels below which a process costs more, by loading numba, than it saves."""
_WORKER = (
    "import json, sys; sys.path[:] = json.loads(sys.stdin.readline()); "
    "from dloftbs.kernels.preparation import serve; serve()"
)
_loaded: set[str] = set()
"""Rooms whose kernels are loaded, as far as they were imported."""
_entered: set[str] = set()
"""Rooms of which the cache has had all kernels, or this process has compiled those that it needed."""


def prepare(rooms: Sequence[str] | None = None) -> int:
    """Load the kernels of rooms, and compile those that are not in the cache yet.

    Parameters
    ----------
    rooms : sequence of str, optional
        Folders of the package, such as ``"linking"``; all whose kernels are imported by default.

    Returns
    -------
    int
        Number of kernels that were not in the cache.
    """
    if rooms is not None and _loaded.issuperset(rooms):
        return 0
    missing = compiler.count_missing(rooms)
    with _workers(missing) as (waiting, threads):
        while waiting:
            compiler.make_ready(modules=[waiting.popleft()])
        for thread in threads:
            thread.join()
    compiler.make_ready(rooms)
    _loaded.update(rooms or ())
    return sum(missing.values())


@contextmanager
def compiling_ahead(rooms: Sequence[str]) -> Iterator[None]:
    """Compile the kernels of rooms in other processes, the last room first, while this one goes through the rooms.

    What is still being compiled at the end of the block is given up: nothing there has needed it.
    """
    if _entered.issuperset(rooms):
        yield
        return
    with _workers(compiler.count_missing(rooms)):
        yield
    _entered.update(rooms)


@contextmanager
def _workers(missing: dict[str, int]) -> Iterator[tuple[deque[str], list[threading.Thread]]]:
    """Start processes that take modules from the end of a queue, each with the thread that hands them out."""
    waiting = deque(missing)
    count = min(_core_count() - 1, MAX_WORKERS, len(missing)) if sum(missing.values()) >= _MIN_KERNELS else 0
    processes: list[subprocess.Popen[str]] = []
    threads: list[threading.Thread] = []
    try:
        # They save time alone: whoever needs a kernel compiles it. A thread that cannot start is a RuntimeError.
        with suppress(OSError, RuntimeError):
            for _ in range(count if _can_start_python() else 0):
                processes.append(_start())
                thread = threading.Thread(target=_hand_out, args=(processes[-1], waiting, missing), daemon=True)
                thread.start()
                threads.append(thread)
        yield waiting, threads
    finally:
        waiting.clear()
        for process in processes:
            process.kill()
        for thread in threads:
            thread.join()
        for process in processes:
            process.communicate()


def _start() -> subprocess.Popen[str]:
    """Start Python by itself: a process of `multiprocessing` would import the user's program once more."""
    return subprocess.Popen(
        [sys.executable, "-c", _WORKER], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1
    )


def _hand_out(process: subprocess.Popen[str], waiting: deque[str], missing: dict[str, int]) -> None:
    """Give a process one module after the other; if it dies, whoever needs its kernels compiles them."""
    assert process.stdin is not None
    assert process.stdout is not None
    try:
        process.stdin.write(f"{json.dumps(sys.path)}\n")
        while waiting:
            module = waiting.pop()
            process.stdin.write(f"{module}\n")
            if not process.stdout.readline():
                break
            compiler.progress.add(missing[module])
    except (IndexError, OSError):  # another one took the last module, or the process is gone
        return


def serve() -> None:
    """Compile the modules that come on standard input, a line each, and answer with a line when one is done."""
    import importlib
    import signal

    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the first process ends this one
    logging.getLogger("dloftbs.kernels").setLevel(logging.ERROR)  # and says how far they are
    for line in sys.stdin:
        module = line.strip()
        importlib.import_module(module)
        compiler.make_ready(modules=[module])
        sys.stdout.write(f"{module}\n")
        sys.stdout.flush()


def _core_count() -> int:
    """Return the number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _can_start_python() -> bool:
    """Return whether the running program is Python itself: a frozen or embedding one would start itself once more."""
    return not getattr(sys, "frozen", False) and Path(sys.executable or "").name.lower().startswith(("python", "pypy"))
