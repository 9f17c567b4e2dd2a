"""Places of all runs along a track, with hidden stretches between them as long as the evidence tells."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import accumulate, pairwise

import numpy as np

from dloftbs.tracking.alignment import at_border
from dloftbs.tracking.extension import UNSURE, as_long
from dloftbs.tracking.kernels import routing as kernels
from dloftbs.tracking.partial_match import Piece
from dloftbs.tracking.sample_graph import Run, Scene
from dloftbs.tracking.track_model import Memory, lookup

_PLACES = 33
_MOST_BENT = 3.0  # times its span: of what is hidden and longer, the span tells nothing


def lay(scene: Scene, runs: Sequence[Run], memory: Memory, size: tuple[int, int] | None) -> list[Piece]:
    """Lay all runs on their track together, with the hidden stretches between them."""
    runs = [as_long(scene, runs[0], memory)] if len(runs) == 1 else runs
    between = [_hidden(scene, a, b, memory) for a, b in pairwise(runs)]
    lengths = [scene.length(run) for run in runs]
    total = sum(lengths) + sum(between)
    longer = total - memory.length
    tolerance = memory.tolerance_px + UNSURE * sum(between)
    low, high = 0.0, 1.0
    usual = len(runs) == 1 and memory.is_as_usual(total)
    if abs(longer) > tolerance and not usual:
        start = _start(scene, runs, lengths, between, memory)
        if longer < 0.0:
            low = _shift(scene, start, -longer, runs, memory, size) / memory.length
            high = low + total / memory.length
        elif len(runs) == 1:  # else what is hidden may as well be shorter than it seems
            before = min(max(-start, 0.0), longer)
            low, high = -before / memory.length, 1.0 + (longer - before) / memory.length
    edges = accumulate([0.0, *(px for pair in zip(lengths, between, strict=False) for px in pair), lengths[-1]])
    at = [low + edge / total * (high - low) for edge in edges]
    at[-1] = high
    spans = [[first, last] for first, last in zip(at[::2], at[1::2], strict=True)]
    for n, (run, after) in enumerate(pairwise(runs)):
        if after.first == run.last + 1:  # it goes over from one to the other: nothing is hidden
            spans[n][1] = spans[n + 1][0] = 0.5 * (spans[n][1] + spans[n + 1][0])
    stretches = [scene.stretch(run) for run in runs]
    return [Piece(seen, (first, last), seen.of) for seen, (first, last) in zip(stretches, spans, strict=True)]


def _hidden(scene: Scene, run: Run, after: Run, memory: Memory) -> float:
    """Return the length hidden between two runs, px: as the detector has it, or as bent as it last was."""
    span = math.dist(scene.points[run.end], scene.points[after.start])
    if after.first == run.last + 1:
        return span
    if scene.follows(run, after):
        (_, low), (high, _) = scene.span(run), scene.span(after)
        return (high - low) * scene.parts[run.part].total
    # By most of their nodes: those beside what is hidden lie closer together, to be seen.
    low, high = (r.origin + r.way * i for r, i in ((run, run.end), (after, after.start)))
    stretch = lookup(memory.shape, np.linspace(low, high, _PLACES) / (kernels.STEPS * scene.nodes_of(memory)))
    steps = float(np.hypot(*np.diff(stretch, axis=0).T).sum())
    spanned = math.dist(stretch[0], stretch[-1])
    return span * steps / spanned if steps < _MOST_BENT * spanned else max(steps, span)


def _start(
    scene: Scene, runs: Sequence[Run], lengths: Sequence[float], between: Sequence[float], memory: Memory
) -> float:
    """Return where runs begin along their track as it is expected, px: the mean over all their nodes."""
    step = memory.length / (scene.nodes_of(memory) * kernels.STEPS)
    done = away = nodes = 0.0
    for run, length, gap in zip(runs, lengths, [*between, 0.0], strict=True):
        size = run.last - run.first + 1
        away += size * ((run.origin + run.way * run.start) * step - done)
        nodes += size
        done += length + gap
    return away / nodes


def _shift(
    scene: Scene, start: float, missing: float, runs: Sequence[Run], memory: Memory, size: tuple[int, int] | None
) -> float:
    """Return the missing length before the runs, px: all of it or nothing, unless it clearly differs.

    `start` is where the runs lie by the motion so far.
    """
    start = min(max(start, 0.0), missing)
    after = missing - start
    if size is not None:
        ends = scene.points[[runs[0].start, runs[-1].end]]
        leaves = [at_border(end, size, memory.width) for end in ends]
        if leaves[0] != leaves[1] and (after if leaves[0] else start) < 2.0 * memory.slack_px:
            return missing if leaves[0] else 0.0
    if min(start, after) > memory.slack_px:
        return start
    return 0.0 if start <= after else missing
