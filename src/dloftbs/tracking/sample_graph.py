"""Evenly spaced samples of one frame's observations, and the routes of tracks through them."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import accumulate
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from dloftbs.data.curve_samples import SAMPLES, sample_curve
from dloftbs.tracking.kernels import routing as kernels
from dloftbs.tracking.observation import Observation
from dloftbs.tracking.track_model import TrackModel

MIN_NODES = 3
"""Number of nodes of a track, and of an interval, at least.

Source: by hand; fewer have no bend.
"""

_MAX_NODES = 128
"""Number of nodes of a track at most.

Source: bounds time.
"""

_REACH_WIDTHS = 2.0
"""Distance from where a node is expected in which it is sought, widths.

Source: by hand.
"""

_REACH_SHARE = 0.025
"""The same distance as a share of the length; the larger one counts.

Source: by hand.
"""

_CLAIMED_COST = 1.5
"""Extra cost of a sample that another track has claimed, or that is of another object by its colour.

Source: by hand; above that of a node that is hidden: rather hidden than shared.
"""


class Interval(NamedTuple):
    """Nodes `first` to `last` of a track on the samples `start` to `end` of a part, descending if it is reversed.

    By the median over its nodes, its sample i lies at `origin` + `direction` i along the track, in samples.
    """

    part: int
    start: int
    end: int
    first: int
    last: int
    origin: float = 0.0

    @property
    def direction(self) -> int:
        """1, or -1 if the part is reversed."""
        return 1 if self.end >= self.start else -1

    @property
    def samples(self) -> slice:
        """Samples that the interval covers, ascending."""
        return slice(min(self.start, self.end), max(self.start, self.end) + 1)


class Route(NamedTuple):
    """Route of a track through a frame: its intervals, the mean cost of its visible nodes, and their share of all."""

    intervals: list[Interval]
    cost: float
    seen_share: float


class SampleGraph:
    """The samples of all parts, one part after the other, and whether a track has claimed them.

    Parameters
    ----------
    parts : sequence of Observation
    spacing : float
        Distance from node to node of a track, px.

    Attributes
    ----------
    parts : sequence of Observation
    points : numpy.ndarray, shape (n, 2)
        The samples, px.
    bounds : list of (int, int)
        First and last sample of each part.
    claimed : numpy.ndarray, shape (n,), bool
    """

    def __init__(self, parts: Sequence[Observation], spacing: float) -> None:
        self.parts = parts
        self._spacing = spacing
        counts = [max(round(kernels.SAMPLES_PER_NODE * part.length / spacing), 1) + 1 for part in parts]
        self.bounds = [(end - count, end - 1) for count, end in zip(counts, accumulate(counts), strict=True)]
        self._bounds = np.array(self.bounds)
        self._part_of = np.arange(len(parts)).repeat(counts)
        self._samples = np.zeros((len(self._part_of), 5))
        self.points = self._samples[:, :2]
        for part, count, (first, last) in zip(parts, counts, self.bounds, strict=True):
            self.points[first : last + 1] = sample_curve(part.curve, *part.curve_span, count)[0]
        self.claimed = np.zeros(len(self.points), np.bool_)
        self._longest_step = kernels.describe_curves(self._samples, self._bounds)

    def find_route(self, model: TrackModel, others: npt.NDArray[np.bool_]) -> Route:
        """Find the cheapest route of a track; claimed samples have an extra cost, and those of `others`, parts."""
        count = self.last_node(model) + 1
        reach = max(_REACH_WIDTHS * model.width_or_0, _REACH_SHARE * model.length)
        nodes = kernels.place_nodes(model.predicted, model.sight.unseen_s, model.frameless_s, reach, count)
        assignment = np.empty(count, np.int64)
        self._samples[:, 4] = _CLAIMED_COST * (self.claimed.astype(np.float64) + others[self._part_of])
        step, slack = model.length / (count - 1), model.position_tolerance_px + self._spacing
        cost = kernels.find_route(nodes, self._samples, self._bounds, self._longest_step, step, slack, assignment)
        intervals = self._find_intervals(assignment)
        return Route(intervals, cost, sum(one.last - one.first + 1 for one in intervals) / count)

    def _find_intervals(self, assignment: npt.NDArray[np.int64]) -> list[Interval]:
        """Return the intervals of a route: `MIN_NODES` nodes or more that follow one part."""
        found = np.empty((len(assignment), 6), np.int64)
        count = kernels.find_intervals(assignment, self._part_of, MIN_NODES, found)
        return [Interval._make((*ends, 0.5 * twice)) for *ends, twice in found[:count].tolist()]

    def overlap(self, intervals: Sequence[Interval]) -> float:
        """Return the length of the intervals that is already claimed, in nodes."""
        return sum([np.count_nonzero(self.claimed[one.samples]) for one in intervals]) / kernels.SAMPLES_PER_NODE

    def claim(self, intervals: Sequence[Interval]) -> None:
        """Claim the samples of a track's intervals."""
        for one in intervals:
            self.claimed[one.samples] = True

    def last_node(self, model: TrackModel) -> int:
        """Return the index of a track's last node."""
        return max(round(model.length / self._spacing), MIN_NODES)

    def sample_spacing(self, part: int) -> float:
        """Return the distance from sample to sample, px."""
        first, last = self.bounds[part]
        return self.parts[part].length / (last - first)

    def length(self, interval: Interval) -> float:
        """Return the length of an interval, px."""
        return abs(interval.end - interval.start) * self.sample_spacing(interval.part)

    def place(self, interval: Interval, model: TrackModel) -> tuple[float, float]:
        """Return where an interval begins and ends along a track as predicted, px, by the median of its nodes."""
        step = model.length / (self.last_node(model) * kernels.SAMPLES_PER_NODE)
        origin, direction = interval.origin, interval.direction
        return step * (origin + direction * interval.start), step * (origin + direction * interval.end)

    def is_free(self, edge: int, end: int, limit: int) -> bool:
        """Return True if an interval's edge is near the end of its part, and no sample beyond it is claimed."""
        low, high = sorted((edge, end))
        return high - low <= limit and np.count_nonzero(self.claimed[low : high + 1]) == 1

    def curve_span(self, interval: Interval) -> tuple[float, float]:
        """Return the span of an interval, in ``u`` of the detection in the track's direction."""
        (low, high), (first, last) = self.parts[interval.part].curve_span, self.bounds[interval.part]
        start, end = [low + (i - first) / (last - first) * (high - low) for i in (interval.start, interval.end)]
        return (start, end) if interval.direction > 0 else (1.0 - start, 1.0 - end)

    def observe(self, interval: Interval) -> Observation:
        """Return the observation of an interval, in the track's direction."""
        part = self.parts[interval.part]
        return (part if interval.direction > 0 else part.reversed()).between(*self.curve_span(interval))

    def are_consecutive(self, first: Interval, second: Interval) -> bool:
        """Return True if the detector also has the second interval after the first."""
        one, other = self.parts[first.part], self.parts[second.part]
        same = one.detection_index == other.detection_index and first.direction == second.direction
        return same and (second.start - first.end) * first.direction > 0


def node_spacing(model: TrackModel) -> float:
    """Return a suitable distance from node to node of a track, px: a width, unless that makes too many nodes."""
    return max(model.width_or_0, model.length / (_MAX_NODES if model.width_or_0 else SAMPLES))
