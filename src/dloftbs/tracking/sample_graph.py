"""The parts of one frame's detections as evenly spaced samples, and the ways of tracks through them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from dloftbs._arrays import FloatArray
from dloftbs.observation import SAMPLES, Seen, sample
from dloftbs.tracking.kernels import routing as kernels
from dloftbs.tracking.track_model import Memory

LEAST_NODES = 3
"""Of a track, and of a run."""

_MOST_NODES = 128
_REACH_WIDTHS, _REACH_SHARE = 2.0, 0.025  # of a width and of the length: how far from where it is expected
_BY_SPEED = 0.5  # of the way that a track goes in a frame
_WIDENING, _WIDEST = 4.0, 3.0  # a second, and at most, where it was not seen
_HIDDEN, _STILL_HIDDEN = 1.0, 0.4  # prices of a node: of being hidden, and of still being so
_TAKEN = 1.5  # price of a sample that another track has taken


class Run(NamedTuple):
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
        """1, or -1 where it is reversed."""
        return 1 if self.end >= self.start else -1

    @property
    def samples(self) -> slice:
        """Samples that the run covers, ascending."""
        return slice(min(self.start, self.end), max(self.start, self.end) + 1)


class Way(NamedTuple):
    """Way of a track through a frame: its runs, the mean price of its nodes, and the share of them that is seen."""

    runs: list[Run]
    price: float
    share: float


class Scene:
    """The samples of all parts, one part after the other, and which of them tracks have taken.

    Parameters
    ----------
    parts : sequence of Seen
    spacing : float
        From node to node of a track, px.

    Attributes
    ----------
    parts : sequence of Seen
    points : numpy.ndarray, shape (n, 2)
        The samples, px.
    bounds : list of [int, int]
        First and last sample of each part.
    taken : numpy.ndarray, shape (n,), bool
    parts_of : dict of int to list of int
        The parts of each detection, by its number.
    """

    def __init__(self, parts: Sequence[Seen], spacing: float) -> None:
        self.parts = parts
        self._spacing = spacing
        counts = [max(round(kernels.STEPS * part.length / spacing), 1) + 1 for part in parts]
        last = np.cumsum(counts)
        self._bounds = np.stack((last - counts, last - 1), axis=1)
        self.bounds: list[list[int]] = self._bounds.tolist()
        self._of = np.repeat(np.arange(len(parts)), counts)
        self.points = np.vstack([sample(p.curve, *p.of, n)[0] for p, n in zip(parts, counts, strict=True)])
        self._extra = np.zeros(len(self.points))
        self.taken = np.zeros(len(self.points), np.bool_)
        self.parts_of: dict[int, list[int]] = {}
        for p, part in enumerate(parts):
            self.parts_of.setdefault(part.number, []).append(p)
        self._tangents = np.full_like(self.points, math.inf)
        self._boxes = np.empty((len(parts), 4))
        self._longest = kernels.box_curves(self.points, self._bounds, self._boxes)

    def way_of(self, memory: Memory, expected: FloatArray, dt: float) -> Way:
        """Route a track through the samples that are not taken yet."""
        count = self.nodes_of(memory) + 1
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
            self.points,
            self._tangents,
            self._of,
            self._bounds,
            self._boxes,
            self._longest,
            self._extra,
            memory.length / (count - 1),
            self._slack(memory),
            at,
        )
        runs = self._runs(at)
        return Way(runs, price, sum(r.last - r.first + 1 for r in runs) / count)

    def _slack(self, memory: Memory) -> float:
        return memory.slack_px + self._spacing

    def _runs(self, at: npt.NDArray[np.int64]) -> list[Run]:
        """Return what goes on along one part, of at least some nodes where there is more."""
        found = np.empty((len(at), 6), np.int64)
        count = kernels.find_runs(at, self._of, LEAST_NODES, found)
        return [
            Run(part, start, end, first, last, 0.5 * twice)
            for part, start, end, first, last, twice in found[:count].tolist()
        ]

    def overlap(self, runs: Sequence[Run]) -> float:
        """Return how much of some runs is taken, in nodes."""
        return sum(int(np.count_nonzero(self.taken[run.samples])) for run in runs) / kernels.STEPS

    def take(self, runs: Sequence[Run]) -> None:
        """Take what runs cover."""
        for run in runs:
            self.taken[run.samples] = True
            self._extra[run.samples] = _TAKEN

    def give_back(self, runs: Sequence[Run]) -> None:
        """Free what runs cover."""
        for run in runs:
            self.taken[run.samples] = False

    def share_taken(self, part: int) -> float:
        """Return which share of a part is taken."""
        first, last = self.bounds[part]
        return self.count_taken(part) / (last - first + 1)

    def count_taken(self, part: int) -> int:
        """Return how many samples of a part are taken."""
        first, last = self.bounds[part]
        return int(np.count_nonzero(self.taken[first : last + 1]))

    def nodes_of(self, memory: Memory) -> int:
        """Return the number of a track's last node."""
        return max(round(memory.length / self._spacing), LEAST_NODES)

    def step(self, part: int) -> float:
        """Return the distance from sample to sample, px."""
        first, last = self.bounds[part]
        return self.parts[part].length / (last - first)

    def length(self, run: Run) -> float:
        """Return the length of a run, px."""
        return abs(run.end - run.start) * self.step(run.part)

    def span(self, run: Run) -> tuple[float, float]:
        """Return which stretch of its detection a run is, in ``u`` of the detection run in the track's direction."""
        (low, high), (first, last) = self.parts[run.part].of, self.bounds[run.part]
        start, end = (low + (i - first) / (last - first) * (high - low) for i in (run.start, run.end))
        return (start, end) if run.way > 0 else (1.0 - start, 1.0 - end)

    def stretch(self, run: Run) -> Seen:
        """Return what a run is seen as, in the track's direction."""
        part = self.parts[run.part]
        return (part if run.way > 0 else part.reversed()).between(*self.span(run))

    def follows(self, run: Run, after: Run) -> bool:
        """Tell whether the detector, too, has one run after the other."""
        same = self.parts[run.part].number == self.parts[after.part].number and run.way == after.way
        return same and (after.start - run.end) * run.way > 0


def spacing_of(memory: Memory) -> float:
    """Return the distance from node to node that suits a track, px."""
    width = 0.0 if math.isnan(memory.width) else memory.width
    return max(width, memory.length / _MOST_NODES if width else memory.length / SAMPLES)
