"""Extension of a track's intervals to the ends of the visible parts, as far as no other track has claimed them."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from dloftbs.tracking.kernels import routing as kernels
from dloftbs.tracking.sample_graph import Interval, SampleGraph
from dloftbs.tracking.track_model import TrackModel

HIDDEN_UNCERTAINTY = 0.15
"""Uncertainty of a hidden length, as a share of it.

Source: by hand.
"""

_SHORT_EXTENSION = 2 * kernels.SAMPLES_PER_NODE
"""Number of samples of a short extension: two nodes, at an edge that is no end of the track.

Source: by hand.
"""


def complete_detection(graph: SampleGraph, intervals: list[Interval], model: TrackModel) -> list[Interval]:
    """Return intervals over all of a detection, if it is as long as the track and all given intervals follow it."""
    detection, direction = graph.parts[intervals[0].part].detection_index, intervals[0].direction
    parts = graph.parts_of[detection][::direction]
    length = graph.parts[parts[0]].object_length
    gaps = length - sum(graph.parts[p].length for p in parts)
    tolerance = model.length_tolerance_px + HIDDEN_UNCERTAINTY * gaps
    as_long = abs(length - model.length) <= tolerance or model.lengths.is_usual(length, model.length_tolerance_px)
    if not as_long or not all(graph.are_consecutive(*pair) for pair in pairwise(intervals)):
        return intervals
    covered = sum(abs(one.end - one.start) + 1 for one in intervals)
    if sum(graph.claimed_count(p) for p in parts) > covered:
        return intervals  # another track has a part of it
    result = []
    for p in parts:
        known = [one for one in intervals if one.part == p]
        start, end = graph.bounds[p][::direction]
        low, high = sorted(abs(float(u) - (direction < 0)) for u in graph.parts[p].curve_span)
        first, last = (known[0].first, known[-1].last) if known else _nearest_nodes(graph, model, low, high)
        origin = known[0].origin if known else float(kernels.SAMPLES_PER_NODE * first - direction * start)
        result.append(Interval(p, start, end, first, last, origin))
    graph.claim(result)
    return result


def _nearest_nodes(graph: SampleGraph, model: TrackModel, low: float, high: float) -> tuple[int, int]:
    last = graph.last_node(model)
    return round(low * last), round(high * last)


def extend_to_ends(graph: SampleGraph, intervals: Sequence[Interval], model: TrackModel) -> list[Interval]:
    """Return intervals extended to the ends of their parts: by a little, and outwards by what is hidden of the track.

    Samples of other tracks end an extension, and so do neighbours of consecutive nodes.
    """
    last_node = graph.last_node(model)
    result: list[Interval] = []
    for n, one in enumerate(intervals):
        start, end = one.start, one.end
        if n == 0 or one.first > intervals[n - 1].last + 1:
            limit = _SHORT_EXTENSION + (kernels.SAMPLES_PER_NODE * one.first if n == 0 else 0)
            limit = limit if one.first else len(graph.points)
            start = _extend_edge(graph, one, -one.direction, start, limit)
        if n == len(intervals) - 1 or intervals[n + 1].first > one.last + 1:
            hidden = kernels.SAMPLES_PER_NODE * (last_node - one.last) if n == len(intervals) - 1 else 0
            limit = _SHORT_EXTENSION + hidden if one.last < last_node else len(graph.points)
            end = _extend_edge(graph, one, one.direction, end, limit)
        result.append(one._replace(start=start, end=end))
        graph.claimed[result[-1].samples] = True
    return result


def _extend_edge(graph: SampleGraph, interval: Interval, direction: int, edge: int, limit: int) -> int:
    """Return the edge of an extended interval: its part's end, if that is near and nothing before it is claimed."""
    first, last = graph.bounds[interval.part]
    end = last if direction > 0 else first
    beyond = slice(edge + 1, end + 1) if direction > 0 else slice(end, edge)
    return end if abs(end - edge) <= limit and not np.count_nonzero(graph.claimed[beyond]) else edge


def fit_length(graph: SampleGraph, interval: Interval, model: TrackModel) -> Interval:
    """Return an interval as long as its track where the detection goes on beyond: only the length tells its end.

    It is extended no further than to the samples of other tracks.
    """
    first, last = graph.bounds[interval.part][:: interval.direction]
    free = [
        interval.first == 0 and interval.start != first,
        interval.last == graph.last_node(model) and interval.end != last,
    ]
    if not any(free):
        return interval
    missing = round((model.length - graph.length(interval)) / graph.sample_spacing(interval.part) / sum(free))
    start, end, direction = interval.start, interval.end, interval.direction
    start = _shift_edge(graph, interval.part, start, -direction, missing) if free[0] else start
    end = _shift_edge(graph, interval.part, end, direction, missing) if free[1] else end
    if (end - start) * direction <= 0:
        return interval
    result = interval._replace(start=start, end=end)
    graph.claimed[result.samples] = True
    return result


def _shift_edge(graph: SampleGraph, part: int, edge: int, direction: int, count: int) -> int:
    """Return an edge moved outwards by some samples, up to the next claimed one; inwards if `count` is negative."""
    if count <= 0:
        return edge + direction * count
    stop = graph.bounds[part][1 if direction > 0 else 0]
    onward = np.arange(edge + direction, stop + direction, direction)[:count]
    claimed = np.flatnonzero(graph.claimed[onward])
    return edge + direction * int(claimed[0] if len(claimed) else len(onward))
