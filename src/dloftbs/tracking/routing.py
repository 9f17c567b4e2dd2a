"""Tracks known for a while, routed through a frame: every stretch of one is seen on some detection, or hidden.

A detector may take a wrong turn at a crossing, or end one object where another one goes on. Each track is therefore
laid through all that the frame shows, and may go over from one detection to another where they pass each other.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import accumulate, pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from dloftbs._arrays import FloatArray
from dloftbs.kernels import routing as kernels
from dloftbs.tracking.matching import Known
from dloftbs.tracking.memory import Memory, lookup
from dloftbs.tracking.pieces import Piece
from dloftbs.tracking.placing import at_border, is_scaled
from dloftbs.tracking.seeing import SAMPLES, Seen, sample

_MOST_NODES = 128
_REACH_WIDTHS, _REACH_SHARE = 2.0, 0.025  # of a width and of the length: how far from where it is expected
_BY_SPEED = 0.5  # of the way that a track goes in a frame
_WIDENING, _WIDEST = 4.0, 3.0  # a second, and at most, where it was not seen
_HIDDEN, _STILL_HIDDEN = 1.0, 0.4  # prices of a node: of being hidden, and of still being so
_TAKEN = 1.5  # price of a sample that another track has taken
_OVERLAP = 2  # nodes that two tracks may share, where they cross
_LEAST_NODES = 3
_FREE = 0.5  # of a part is taken at most, or it is not left over
_PLACES = 33
_EVERYWHERE = 2 * kernels.STEPS  # samples that a run is led on anywhere, to the end of what is seen
_UNSURE = 0.15  # of the length of what is hidden between two runs
_MOST_BENT = 3.0  # times its span: of what is hidden and longer, the span tells nothing
_MOSTLY = 0.8  # of a track that is seen, or it may have leapt
_ELSEWHERE = 0.4  # of all tracks is less seen, and it is another scene
_LEAST_SHARE = 0.25  # of a track is seen, or it is not routed


class _Run(NamedTuple):
    """Nodes `first` to `last` of a track on the samples `start` to `end` of a part, descending where it is reversed.

    By most of its nodes, its sample i lies at `origin` + `way` i along the track, in samples.
    """

    part: int
    start: int
    end: int
    first: int
    last: int
    origin: float = 0.0

    @property
    def way(self) -> int:
        return 1 if self.end >= self.start else -1


class Routed(NamedTuple):
    """What routing found.

    Parameters
    ----------
    pieces : dict of int to list of Piece
        By the track's number.
    left : list of Seen
        The parts of detections that no track takes most of.
    parts : list of Seen
        All parts that the detections fall into at their long gaps.
    elsewhere : bool
        Whether hardly anything of the tracks is where they are expected, although as much is seen as of them.
    """

    pieces: dict[int, list[Piece]]
    left: list[Seen]
    parts: list[Seen]
    elsewhere: bool


def route(
    memories: Sequence[Memory],
    known: Known,
    rows: Sequence[int],
    seen: Sequence[Seen],
    dt: float,
    gate: float,
    size: tuple[int, int] | None,
) -> Routed:
    """Route tracks through a frame.

    Parameters
    ----------
    memories : sequence of Memory
    known : Known
        Where they are expected.
    rows : sequence of int
        Those to be routed.
    seen : sequence of Seen
        The detections to route them through.
    dt : float
        Seconds since the last frame.
    gate : float
        See `TrackingConfig.gate`.
    size : (int, int) or None
        ``(H, W)`` of the image.
    """
    parts = [part for one in seen for part in one.parts()]
    scene = _Scene(parts, max(_spacing(memories[t]) for t in rows))
    ways = {t: scene.way_of(memories[t], known.points[t], dt) for t in rows}
    for t, way in list(ways.items()):
        if way.share < _MOSTLY and any(_may_be_all(memories[t], known.points[t], one, gate) for one in seen):
            del ways[t]  # a leap: it is somewhere else as a whole
    length, shown = (sum(one.length for one in those) for those in ([memories[t] for t in rows], seen))
    there = sum(ways[t].share * memories[t].length for t in ways) / length
    elsewhere = len(ways) == len(rows) and there < _ELSEWHERE and shown > (1.0 - _ELSEWHERE) * length
    taken: dict[int, list[_Run]] = {}
    for t in sorted(ways, key=lambda t: (ways[t].price, t)):
        way = ways[t]
        if scene.overlap(way.runs) > _OVERLAP:
            way = scene.way_of(memories[t], known.points[t], dt)
        if way.share >= _LEAST_SHARE:
            taken[t] = way.runs
            scene.take(way.runs)
    for one in [part for p, part in enumerate(parts) if part.clear and scene.share_taken(p) < _FREE]:
        for t in [t for t in taken if ways[t].share < 1.0 or len(taken[t]) > 1]:
            if _may_be_all(memories[t], known.points[t], one, gate):
                scene.give_back(taken.pop(t))  # it is there as a whole, and not where its pieces seemed to be
                break
    pieces = {}
    for t, runs in taken.items():
        whole = scene.completed(runs, memories[t])
        pieces[t] = scene.pieces(scene.grown(whole, memories[t]), memories[t], known.points[t], size)
    left = [part for p, part in enumerate(parts) if scene.share_taken(p) < _FREE]
    return Routed(pieces, left, parts, elsewhere)


def _may_be_all(memory: Memory, expected: FloatArray, one: Seen, gate: float) -> bool:
    """Tell whether a detection without gaps, as long as a track, is near enough to be all of it."""
    as_long = abs(one.length - memory.length) <= memory.slack_px or memory.is_as_usual(one.length)
    if not one.clear or one.curve.closed or not as_long:
        return False
    away = min(np.hypot(*(points - expected).T).mean() for points in (one.points, one.points[::-1]))
    return bool(away < gate * memory.length)


def _spacing(memory: Memory) -> float:
    """Return the distance from node to node that suits a track, px."""
    width = 0.0 if math.isnan(memory.width) else memory.width
    return max(width, memory.length / _MOST_NODES if width else memory.length / SAMPLES)


class _Way(NamedTuple):
    """How a track goes through a frame: its runs, the mean price of its nodes, and which share of them is seen."""

    runs: list[_Run]
    price: float
    share: float


class _Scene:
    """The parts of a frame's detections as evenly spaced samples, and which of them tracks have taken."""

    def __init__(self, parts: Sequence[Seen], spacing: float) -> None:
        self._parts = parts
        self._spacing = spacing
        counts = [max(round(kernels.STEPS * part.length / spacing), 1) + 1 for part in parts]
        last = np.cumsum(counts)
        self._bounds = np.stack((last - counts, last - 1), axis=1)
        self._of = np.repeat(np.arange(len(parts)), counts)
        self._points = np.vstack([sample(p.curve, *p.of, n)[0] for p, n in zip(parts, counts, strict=True)])
        self._extra = np.zeros(len(self._points))
        self._taken = np.zeros(len(self._points), np.bool_)

    def way_of(self, memory: Memory, expected: FloatArray, dt: float) -> _Way:
        """Route a track through what is not taken yet."""
        count = self._nodes(memory) + 1
        width = 0.0 if math.isnan(memory.width) else memory.width
        speed = np.hypot(*memory.velocity.T)
        reach = max(_REACH_WIDTHS * width, _REACH_SHARE * memory.length) + _BY_SPEED * dt * speed
        reach = reach * np.minimum(1.0 + _WIDENING * memory.unseen_s, _WIDEST)
        known, nodes, at = np.empty((SAMPLES, 4)), np.empty((count, 4)), np.empty(count, np.int64)
        known[:, :2], known[:, 2] = expected, reach
        known[:, 3] = np.where(memory.unseen_s > 0.0, _STILL_HIDDEN, _HIDDEN)
        kernels.interpolate(known, nodes)
        price = kernels.route(
            nodes[:, :2],
            nodes[:, 2],
            nodes[:, 3],
            self._points,
            self._of,
            self._bounds,
            self._extra,
            memory.length / (count - 1),
            self._slack(memory),
            at,
        )
        runs = self._runs(at)
        return _Way(runs, price, sum(r.last - r.first + 1 for r in runs) / count)

    def _slack(self, memory: Memory) -> float:
        return memory.slack_px + self._spacing

    def _runs(self, at: npt.NDArray[np.int64]) -> list[_Run]:
        """Return what goes on along one part, of at least some nodes where there is more."""
        found = np.empty((len(at), 6), np.int64)
        count = kernels.find_runs(at, self._of, _LEAST_NODES, found)
        return [
            _Run(part, start, end, first, last, 0.5 * twice)
            for part, start, end, first, last, twice in found[:count].tolist()
        ]

    def overlap(self, runs: Sequence[_Run]) -> float:
        """Return how much of some runs is taken, in nodes."""
        return sum(int(self._taken[_between(run)].sum()) for run in runs) / kernels.STEPS

    def take(self, runs: Sequence[_Run]) -> None:
        """Take what runs cover."""
        for run in runs:
            self._taken[_between(run)] = True
            self._extra[_between(run)] = _TAKEN

    def give_back(self, runs: Sequence[_Run]) -> None:
        """Free what runs cover."""
        for run in runs:
            self._taken[_between(run)] = False

    def share_taken(self, part: int) -> float:
        """Return which share of a part is taken."""
        first, last = self._bounds[part]
        return float(self._taken[first : last + 1].mean())

    def completed(self, runs: list[_Run], memory: Memory) -> list[_Run]:
        """Return all of one detection as runs, where it is as long as the track and all runs follow it."""
        number, way = self._parts[runs[0].part].number, runs[0].way
        mine = [p for p, part in enumerate(self._parts) if part.number == number][::way]
        total = self._parts[mine[0]].total
        gaps = total - sum(self._parts[p].length for p in mine)
        as_long = abs(total - memory.length) <= memory.tolerance_px + _UNSURE * gaps or memory.is_as_usual(total)
        if not as_long or not all(self._follows(*pair) for pair in pairwise(runs)):
            return runs
        covered = sum(abs(run.end - run.start) + 1 for run in runs)
        if sum(int(self._taken[first : last + 1].sum()) for first, last in self._bounds[mine]) > covered:
            return runs  # another track has a part of it
        result = []
        for p in mine:
            known = [run for run in runs if run.part == p]
            start, end = self._bounds[p][::way].tolist()
            low, high = sorted(abs(float(u) - (way < 0)) for u in self._parts[p].of)
            first, last = (known[0].first, known[-1].last) if known else self._nodes_at(memory, low, high)
            origin = known[0].origin if known else float(kernels.STEPS * first - way * start)
            result.append(_Run(p, start, end, first, last, origin))
        self.take(result)
        return result

    def _nodes_at(self, memory: Memory, low: float, high: float) -> tuple[int, int]:
        count = self._nodes(memory)
        return round(low * count), round(high * count)

    def grown(self, runs: Sequence[_Run], memory: Memory) -> list[_Run]:
        """Return runs led on to where their parts end: a little everywhere, and all the way at the ends of the track.

        Nothing that another track has taken; and where one run goes over into another, to where they are closest.
        """
        result: list[_Run] = []
        for n, run in enumerate(runs):
            start, end = run.start, run.end
            if n and run.first == runs[n - 1].last + 1:
                result[-1], start = self._met(result[-1], run)
            else:
                start = self._led_on(run, -run.way, start, _EVERYWHERE if run.first else len(self._points))
            if n == len(runs) - 1 or runs[n + 1].first > run.last + 1:
                at_end = run.last == self._nodes(memory)
                end = self._led_on(run, run.way, end, len(self._points) if at_end else _EVERYWHERE)
            result.append(run._replace(start=start, end=end))
            self._taken[_between(result[-1])] = True
        return result

    def _led_on(self, run: _Run, way: int, edge: int, most: int) -> int:
        """Return where a run ends that is led on: at its part's end, if that is near and nothing is taken before it."""
        first, last = self._bounds[run.part]
        end = int(last if way > 0 else first)
        near = abs(end - edge) <= most
        return end if near and not self._taken[np.arange(edge + way, end + way, way)].any() else edge

    def _met(self, run: _Run, after: _Run) -> tuple[_Run, int]:
        """Return a run, and where the next one starts, so that they meet where they are closest."""
        near = kernels.STEPS * 2
        ends = self._around(run.part, run.end, near)
        starts = self._around(after.part, after.start, near)
        away = np.hypot(*(self._points[ends][:, None] - self._points[starts][None]).transpose(2, 0, 1))
        i, j = np.unravel_index(int(away.argmin()), away.shape)
        end, start = int(ends[i]), int(starts[j])
        if (end - run.start) * run.way <= 0 or (after.end - start) * after.way <= 0:
            return run, after.start
        return run._replace(end=end), start

    def _around(self, part: int, i: int, near: int) -> npt.NDArray[np.int64]:
        first, last = self._bounds[part]
        return np.arange(max(i - near, first), min(i + near, last) + 1)

    def pieces(
        self, runs: Sequence[_Run], memory: Memory, expected: FloatArray, size: tuple[int, int] | None
    ) -> list[Piece]:
        """Lay runs on their track, all together with what is hidden between them."""
        runs = [self._as_long(runs[0], memory)] if len(runs) == 1 else runs
        between = [self._hidden(a, b, memory) for a, b in pairwise(runs)]
        lengths = [self._length(run) for run in runs]
        total = sum(lengths) + sum(between)
        longer = total - memory.length
        tolerance = memory.tolerance_px + _UNSURE * sum(between)
        low, high = 0.0, 1.0
        usual = len(runs) == 1 and memory.is_as_usual(total)
        if abs(longer) > tolerance and not usual:
            start = self._start(runs, lengths, between, memory)
            if len(runs) == 1 and is_scaled(memory, expected, self._stretch(runs[0])[0]):
                pass
            elif longer < 0.0:
                low = self._shift(start, -longer, runs, memory, size) / memory.length
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
        result = []
        for run, (first, last) in zip(runs, spans, strict=True):
            shown, of = self._stretch(run)
            result.append(Piece(shown, (first, last), of))
        return result

    def _as_long(self, run: _Run, memory: Memory) -> _Run:
        """Return a run that ends where the detection goes on as long as its track: nothing else tells where that ends.

        It grows no further than to what another track has taken.
        """
        first, last = self._bounds[run.part][:: run.way].tolist()
        free = [run.first == 0 and run.start != first, run.last == self._nodes(memory) and run.end != last]
        if not any(free):
            return run
        lacking = round((memory.length - self._length(run)) / self._step(run.part) / sum(free))
        start = self._moved(run.part, run.start, -run.way, lacking) if free[0] else run.start
        end = self._moved(run.part, run.end, run.way, lacking) if free[1] else run.end
        if (end - start) * run.way <= 0:
            return run
        result = run._replace(start=start, end=end)
        self._taken[_between(result)] = True
        return result

    def _moved(self, part: int, edge: int, way: int, count: int) -> int:
        """Return the edge of a run moved by some samples, backwards where they are negative, up to what is taken."""
        if count <= 0:
            return edge + way * count
        stop = self._bounds[part][1 if way > 0 else 0]
        onward = np.arange(edge + way, stop + way, way)[:count]
        taken = np.flatnonzero(self._taken[onward])
        return edge + way * int(taken[0] if len(taken) else len(onward))

    def _hidden(self, run: _Run, after: _Run, memory: Memory) -> float:
        """Return how long what is hidden between two runs is, px: as the detector has it, or as bent as it last was."""
        span = math.dist(self._points[run.end], self._points[after.start])
        if after.first == run.last + 1:
            return span
        if self._follows(run, after):
            (_, low), (high, _) = self._stretch(run)[1], self._stretch(after)[1]
            return (high - low) * self._parts[run.part].total
        # By most of their nodes: those beside what is hidden lie closer together, to be seen.
        low, high = (r.origin + r.way * i for r, i in ((run, run.end), (after, after.start)))
        stretch = lookup(memory.shape, np.linspace(low, high, _PLACES) / (kernels.STEPS * self._nodes(memory)))
        steps = float(np.hypot(*np.diff(stretch, axis=0).T).sum())
        spanned = math.dist(stretch[0], stretch[-1])
        return span * steps / spanned if steps < _MOST_BENT * spanned else max(steps, span)

    def _follows(self, run: _Run, after: _Run) -> bool:
        """Tell whether the detector, too, has one run after the other."""
        same = self._parts[run.part].number == self._parts[after.part].number and run.way == after.way
        return same and (after.start - run.end) * run.way > 0

    def _start(self, runs: Sequence[_Run], lengths: Sequence[float], between: Sequence[float], memory: Memory) -> float:
        """Return where runs begin along their track as it is expected, px: the mean over all their nodes."""
        step = memory.length / (self._nodes(memory) * kernels.STEPS)
        done = away = nodes = 0.0
        for run, length, gap in zip(runs, lengths, [*between, 0.0], strict=True):
            size = run.last - run.first + 1
            away += size * ((run.origin + run.way * run.start) * step - done)
            nodes += size
            done += length + gap
        return away / nodes

    def _nodes(self, memory: Memory) -> int:
        """Return the number of a track's last node."""
        return max(round(memory.length / self._spacing), _LEAST_NODES)

    def _step(self, part: int) -> float:
        """Return the distance from sample to sample, px."""
        first, last = self._bounds[part]
        return float(self._parts[part].length / (last - first))

    def _length(self, run: _Run) -> float:
        return abs(run.end - run.start) * self._step(run.part)

    def _stretch(self, run: _Run) -> tuple[Seen, tuple[float, float]]:
        """Return the detection of a run, in the track's direction, and which stretch of it the run is."""
        part, (first, last) = self._parts[run.part], self._bounds[run.part]
        low, high = part.of
        ends = [low + (i - first) / (last - first) * (high - low) for i in (run.start, run.end)]
        if run.way > 0:
            return part.between(*ends), (ends[0], ends[1])
        seen = part.reversed().between(1.0 - ends[0], 1.0 - ends[1])
        return seen, seen.of

    def _shift(
        self, start: float, missing: float, runs: Sequence[_Run], memory: Memory, size: tuple[int, int] | None
    ) -> float:
        """Return how much of what is missing lies before the runs, px: all of it or nothing, unless it clearly differs.

        `start` is where the runs lie by the motion so far.
        """
        start = min(max(start, 0.0), missing)
        after = missing - start
        if size is not None:
            ends = self._points[[runs[0].start, runs[-1].end]]
            leaves = [at_border(end, size, memory.width) for end in ends]
            if leaves[0] != leaves[1] and (after if leaves[0] else start) < 2.0 * memory.slack_px:
                return missing if leaves[0] else 0.0
        if min(start, after) > memory.slack_px:
            return start
        return 0.0 if start <= after else missing


def _between(run: _Run) -> slice:
    return slice(min(run.start, run.end), max(run.start, run.end) + 1)
