"""Runs of methods on suites: in parallel over sequences, each scored only once."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from itertools import groupby
from pathlib import Path
from typing import NamedTuple

from dloftbs.errors import DloftbsError, InputError, SinkError
from dloftbs.support.worker_process import begin_worker
from dloftbs_lab.evaluation.runner.finished_parts import Key, Part, code_version, load, save
from dloftbs_lab.evaluation.runner.sequence_run import Method, score_sequence
from dloftbs_lab.evaluation.suites import Suite
from dloftbs_lab.known_sequence import KnownSequence

Watcher = Callable[[Part], None]


class Task(NamedTuple):
    """One method on one sequence."""

    key: Key
    sequence: KnownSequence
    method: Method


def evaluate(
    suites: Sequence[Suite],
    methods: Sequence[Method],
    folder: Path,
    *,
    jobs: int = 1,
    finished: Watcher = lambda part: None,
) -> list[Part]:
    """Score every method on every sequence.

    All but the times is the same, bit for bit, whatever the number of jobs. Finished parts lie in `folder` whatever
    ends the run, and is not computed again by a run with the same settings and the same code.

    Parameters
    ----------
    suites : sequence of Suite
    methods : sequence of Method
        With different names.
    folder : Path
        Folder of the finished parts.
    jobs : int
        Processes; with 1, all happens in this one.
    finished : callable
        Called with each part, as soon as it is there; first with those that need no computing.

    Returns
    -------
    list of Part
        In the order of the suites, their sequences, and the methods.

    Raises
    ------
    InputError
        If names are used twice, a method is for none of the suites, or cannot be made.
    SinkError
        If a part cannot be written, or is spoilt before it is read again.
    DloftbsError
        If a process dies.
    """
    tasks = tasks_of(suites, methods)
    parts: dict[Key, Part] = {}
    for part in _parts(tasks, folder, jobs):
        parts[part.key] = part
        finished(part)
    return [parts[task.key] for task in tasks]


def tasks_of(suites: Sequence[Suite], methods: Sequence[Method]) -> list[Task]:
    """Return what there is to do, in order.

    Raises
    ------
    InputError
        If names are used twice, or a method is for none of the suites.
    """
    for what, names in (("suites", [s.name for s in suites]), ("methods", [m.name for m in methods])):
        if len(set(names)) < len(names):
            raise InputError(f"{what} must have different names, got {', '.join(names)}")
    for method in methods:
        if method.suites and not any(suite.name in method.suites for suite in suites):
            raise InputError(
                f"method {method.name!r} is for the suites {', '.join(method.suites)}, got "
                f"{', '.join(suite.name for suite in suites)}"
            )
    code = code_version()
    return [
        Task(
            Key(suite.name, sequence.name, method.name, i, len(sequence), suite.settings, method.settings, code),
            sequence,
            method,
        )
        for suite in suites
        for i, sequence in enumerate(suite.sequences)
        for method in methods
        if not method.suites or suite.name in method.suites
    ]


def _parts(tasks: Sequence[Task], folder: Path, jobs: int) -> Iterator[Part]:
    missing = []
    for task in tasks:
        part = load(folder, task.key)
        if part is None:
            missing.append(task)
        else:
            yield part
    of_scene: dict[tuple[str, str | int], list[Task]] = {}
    for task in missing:
        of_scene.setdefault(_shared_scene(task), []).append(task)
    # The longest first, so that no process is left with one at the end.
    groups = sorted(of_scene.values(), key=lambda group: -sum(task.key.frames for task in group))
    if jobs == 1 or len(groups) < 2:
        for group in groups:
            yield from run_tasks(group, folder)
    else:
        with _processes(min(jobs, len(groups))) as pool:
            yield from _in_parallel(pool, groups, folder)


def _shared_scene(task: Task) -> tuple[str, str | int]:
    """Return what is equal for sequences that one process should score, since what they show is drawn once for all."""
    scene = task.sequence.scene_name
    return task.key.suite, task.key.number if scene is None else scene


def _in_parallel(pool: ProcessPoolExecutor, groups: Sequence[Sequence[Task]], folder: Path) -> Iterator[Part]:
    try:
        futures = {pool.submit(_keep_tasks, group, folder): group for group in groups}
        for future in as_completed(futures):
            future.result()
            yield from (_kept(task.key, folder) for task in futures[future])
    except BrokenProcessPool as error:
        raise DloftbsError(
            "a process died while it scored a sequence: a method that crashes, or too little memory; "
            "what is finished is kept, and with one job the culprit shows"
        ) from error


def _keep_tasks(tasks: Sequence[Task], folder: Path) -> None:
    # The parts are read from their files: of a longer answer, which a process writes in pieces, this one would wait for
    # the rest for ever if that process died in between.
    run_tasks(tasks, folder)


def _kept(key: Key, folder: Path) -> Part:
    part = load(folder, key)
    if part is None:
        raise SinkError(f"{str(folder / key.file_name)!r} has changed since it was written: start again to compute it")
    return part


def run_tasks(tasks: Sequence[Task], folder: Path) -> list[Part]:
    """Score methods on sequences, one sequence after the other, and write the parts of each.

    Raises
    ------
    InputError
        If a method cannot be made.
    SinkError
        If a part cannot be written.
    """
    parts: list[Part] = []
    for _, same in groupby(tasks, key=lambda task: task.key.number):
        of_one = list(same)
        made = score_sequence([task.key for task in of_one], of_one[0].sequence, [task.method for task in of_one])
        for part in made:
            save(folder, part)
        parts += made
    return parts


@contextmanager
def _processes(jobs: int) -> Iterator[ProcessPoolExecutor]:
    """Open processes that end with the block, at once if it is left by an exception."""
    # Spawned, not forked: threads of numba and OpenCV do not survive a fork.
    context = multiprocessing.get_context("spawn")
    before = set(multiprocessing.active_children())
    pool = ProcessPoolExecutor(jobs, mp_context=context, initializer=begin_worker)
    try:
        yield pool
    except BaseException:
        pool.shutdown(wait=False, cancel_futures=True)
        for process in set(multiprocessing.active_children()) - before:
            process.terminate()
        raise
    pool.shutdown()
