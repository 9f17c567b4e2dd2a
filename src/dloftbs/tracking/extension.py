"""Extension of the runs of a track to the ends of what is seen, as far as no other track has taken it."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from dloftbs.tracking.kernels import routing as kernels
from dloftbs.tracking.sample_graph import Run, Scene
from dloftbs.tracking.track_model import Memory

UNSURE = 0.15
"""Share of the length hidden between two runs."""

_EVERYWHERE = 2 * kernels.STEPS  # samples that a run is led on anywhere, to the end of what is seen


def completed(scene: Scene, runs: list[Run], memory: Memory) -> list[Run]:
    """Return all of one detection as runs, where it is as long as the track and all runs follow it."""
    number, way = scene.parts[runs[0].part].number, runs[0].way
    mine = scene.parts_of[number][::way]
    total = scene.parts[mine[0]].total
    gaps = total - sum(scene.parts[p].length for p in mine)
    as_long = abs(total - memory.length) <= memory.tolerance_px + UNSURE * gaps or memory.is_as_usual(total)
    if not as_long or not all(scene.follows(*pair) for pair in pairwise(runs)):
        return runs
    covered = sum(abs(run.end - run.start) + 1 for run in runs)
    if sum(scene.count_taken(p) for p in mine) > covered:
        return runs  # another track has a part of it
    result = []
    for p in mine:
        known = [run for run in runs if run.part == p]
        start, end = scene.bounds[p][::way]
        low, high = sorted(abs(float(u) - (way < 0)) for u in scene.parts[p].of)
        first, last = (known[0].first, known[-1].last) if known else _nodes_at(scene, memory, low, high)
        origin = known[0].origin if known else float(kernels.STEPS * first - way * start)
        result.append(Run(p, start, end, first, last, origin))
    scene.take(result)
    return result


def _nodes_at(scene: Scene, memory: Memory, low: float, high: float) -> tuple[int, int]:
    count = scene.nodes_of(memory)
    return round(low * count), round(high * count)


def grown(scene: Scene, runs: Sequence[Run], memory: Memory) -> list[Run]:
    """Return runs extended to the ends of their parts: a little everywhere, and all the way at the ends of the track.

    Nothing that another track has taken; and where one run goes over into another, to where they are closest.
    """
    result: list[Run] = []
    for n, run in enumerate(runs):
        start, end = run.start, run.end
        if n and run.first == runs[n - 1].last + 1:
            result[-1], start = _met(scene, result[-1], run)
        else:
            start = _led_on(scene, run, -run.way, start, _EVERYWHERE if run.first else len(scene.points))
        if n == len(runs) - 1 or runs[n + 1].first > run.last + 1:
            at_end = run.last == scene.nodes_of(memory)
            end = _led_on(scene, run, run.way, end, len(scene.points) if at_end else _EVERYWHERE)
        result.append(run._replace(start=start, end=end))
        scene.taken[result[-1].samples] = True
    return result


def _led_on(scene: Scene, run: Run, way: int, edge: int, most: int) -> int:
    """Return the end of an extended run: at its part's end, if that is near and nothing is taken before it."""
    first, last = scene.bounds[run.part]
    end = last if way > 0 else first
    beyond = slice(edge + 1, end + 1) if way > 0 else slice(end, edge)
    return end if abs(end - edge) <= most and not np.count_nonzero(scene.taken[beyond]) else edge


def _met(scene: Scene, run: Run, after: Run) -> tuple[Run, int]:
    """Return a run, and where the next one starts, so that they meet where they are closest."""
    near = kernels.STEPS * 2
    ends = _around(scene, run.part, run.end, near)
    starts = _around(scene, after.part, after.start, near)
    away = np.hypot(*(scene.points[ends][:, None] - scene.points[starts][None]).transpose(2, 0, 1))
    i, j = np.unravel_index(int(away.argmin()), away.shape)
    end, start = int(ends[i]), int(starts[j])
    if (end - run.start) * run.way <= 0 or (after.end - start) * after.way <= 0:
        return run, after.start
    return run._replace(end=end), start


def _around(scene: Scene, part: int, i: int, near: int) -> npt.NDArray[np.int64]:
    first, last = scene.bounds[part]
    return np.arange(max(i - near, first), min(i + near, last) + 1)


def as_long(scene: Scene, run: Run, memory: Memory) -> Run:
    """Return a run that ends where the detection goes on as long as its track: nothing else tells where that ends.

    It grows no further than to what another track has taken.
    """
    first, last = scene.bounds[run.part][:: run.way]
    free = [run.first == 0 and run.start != first, run.last == scene.nodes_of(memory) and run.end != last]
    if not any(free):
        return run
    lacking = round((memory.length - scene.length(run)) / scene.step(run.part) / sum(free))
    start = _moved(scene, run.part, run.start, -run.way, lacking) if free[0] else run.start
    end = _moved(scene, run.part, run.end, run.way, lacking) if free[1] else run.end
    if (end - start) * run.way <= 0:
        return run
    result = run._replace(start=start, end=end)
    scene.taken[result.samples] = True
    return result


def _moved(scene: Scene, part: int, edge: int, way: int, count: int) -> int:
    """Return the edge of a run moved by some samples, backwards where they are negative, up to the next taken one."""
    if count <= 0:
        return edge + way * count
    stop = scene.bounds[part][1 if way > 0 else 0]
    onward = np.arange(edge + way, stop + way, way)[:count]
    taken = np.flatnonzero(scene.taken[onward])
    return edge + way * int(taken[0] if len(taken) else len(onward))
