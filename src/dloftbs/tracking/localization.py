"""Localisation of a track's intervals: how far each follows its part, and where it lies along the track."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import accumulate, pairwise

import numpy as np

from dloftbs.kernels.polyline_lengths import arc_lengths
from dloftbs.tracking.alignment import place_part
from dloftbs.tracking.frame_view import View
from dloftbs.tracking.kernels.interpolation import interpolate
from dloftbs.tracking.kernels.routing import SAMPLES_PER_NODE
from dloftbs.tracking.partial_match import WHOLE, PartialMatch
from dloftbs.tracking.sample_graph import Interval, SampleGraph
from dloftbs.tracking.track_model import TrackModel

_HIDDEN_UNCERTAINTY = 0.15
"""Uncertainty of the length of a gap that the detector bridged, as a share of it.

Source: by hand.
"""

_SHORT_EXTENSION = 2 * SAMPLES_PER_NODE
"""Number of samples of a short extension: two nodes, at an edge that is no end of the track.

Source: by hand.
"""

_SPAN_SHARES = np.linspace(0.0, 1.0, 33)
"""Places of the samples of a hidden span whose chord is measured, as shares of it.

Source: bounds time; half as many as a curve's `SAMPLES`.
"""

_MAX_BEND = 3.0
"""Ratio of length to chord of a hidden span beyond which the chord says nothing about the length.

Source: by hand; of a hairpin, whose ends meet.
"""


def localize(graph: SampleGraph, intervals: Sequence[Interval], model: TrackModel, view: View) -> list[PartialMatch]:
    """Return the matches of all intervals of a track, laid along it together with the hidden spans between them."""
    whole = _match_detection(graph, intervals, model)
    if whole is not None:
        return [whole]
    extended = _extend_to_ends(graph, intervals, model)
    if len(extended) == 1:
        extended = [_fit_length(graph, extended[0], model)]
    observed = [graph.observe(one) for one in extended]
    before, after = graph.place(extended[0], model)[0], model.length - graph.place(extended[-1], model)[1]
    if len(observed) == 1:
        return [place_part(model, observed[0], before, view)]
    # A little that is left over is none of the ends': it may as well be between, where a bend is seen to span little.
    before, after = (px if px > model.position_tolerance_px else 0.0 for px in (before, after))
    lengths = [one.length for one in observed]
    between = [_hidden_length(graph, *pair, model) for pair in pairwise(extended)]
    steps = [before, *(px for pair in zip(lengths, between, strict=False) for px in pair), lengths[-1], after]
    total = sum(steps)
    u = [edge / total for edge in accumulate(steps)]
    u[-2] = u[-2] if after else 1.0  # not by a rounding error before it
    for n, (one, other) in enumerate(pairwise(extended)):
        if other.first == one.last + 1:  # the track changes from one to the other: nothing is hidden
            u[2 * n + 1] = u[2 * n + 2] = 0.5 * (u[2 * n + 1] + u[2 * n + 2])
    return [
        PartialMatch(one, span, one.curve_span)
        for one, span in zip(observed, zip(u[:-1:2], u[1::2], strict=True), strict=True)
    ]


def _match_detection(graph: SampleGraph, intervals: Sequence[Interval], model: TrackModel) -> PartialMatch | None:
    """Return the match with a detection that all intervals follow, if it is as long as the track and no other's."""
    part = graph.parts[intervals[0].part]
    own = [p for p, one in enumerate(graph.parts) if one.detection_index == part.detection_index]
    samples = slice(graph.bounds[own[0]][0], graph.bounds[own[-1]][1] + 1)
    gaps = part.object_length - sum(graph.parts[p].length for p in own)
    tolerance = model.length_tolerance_px + _HIDDEN_UNCERTAINTY * gaps
    as_long = abs(part.object_length - model.length) <= tolerance
    as_long = as_long or model.lengths.is_usual(part.object_length, model.length_tolerance_px)
    shared = np.count_nonzero(graph.claimed[samples]) > sum(abs(one.end - one.start) + 1 for one in intervals)
    if not as_long or shared or not all(graph.are_consecutive(*pair) for pair in pairwise(intervals)):
        return None
    graph.claimed[samples] = True
    whole = part if intervals[0].direction > 0 else part.reversed()
    return PartialMatch(whole.between(*WHOLE), WHOLE, WHOLE)


def _extend_to_ends(graph: SampleGraph, intervals: Sequence[Interval], model: TrackModel) -> list[Interval]:
    """Return intervals extended to the ends of their parts: by a little, and outwards by what is hidden of the track.

    Where the track ends, so does its part. Samples of other tracks end an extension, and so do neighbours of
    consecutive nodes.
    """
    outer = intervals[0].first, graph.last_node(model) - intervals[-1].last
    limits = [_SHORT_EXTENSION if other.first > one.last + 1 else 0 for one, other in pairwise(intervals)]
    before, after = (_SHORT_EXTENSION + SAMPLES_PER_NODE * n if n else len(graph.points) for n in outer)
    result = []
    for one, back, onward in zip(intervals, [before, *limits], [*limits, after], strict=True):
        first, last = graph.bounds[one.part][:: one.direction]
        start = first if graph.is_free(one.start, first, back) else one.start
        end = last if graph.is_free(one.end, last, onward) else one.end
        result.append(one._replace(start=start, end=end))
        graph.claimed[result[-1].samples] = True
    return result


def _fit_length(graph: SampleGraph, interval: Interval, model: TrackModel) -> Interval:
    """Return an interval as long as its track where the detection goes on beyond: only the length shows its end.

    It is extended no further than to the samples of other tracks.
    """
    first, last = graph.bounds[interval.part][:: interval.direction]
    from_first = interval.first == 0 and interval.start != first
    to_last = interval.last == graph.last_node(model) and interval.end != last
    if not (from_first or to_last):
        return interval
    missing_px = (model.length - graph.length(interval)) / (from_first + to_last)
    missing = round(missing_px / graph.sample_spacing(interval.part))
    start, end, direction = interval.start, interval.end, interval.direction
    start = _shift_edge(graph, interval.part, start, -direction, missing) if from_first else start
    end = _shift_edge(graph, interval.part, end, direction, missing) if to_last else end
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


def _hidden_length(graph: SampleGraph, interval: Interval, following: Interval, model: TrackModel) -> float:
    """Return the hidden length between two intervals, px: the detector's, or as bent as it was last seen."""
    chord = math.dist(graph.points[interval.end], graph.points[following.start])
    if following.first == interval.last + 1:
        return chord
    if graph.are_consecutive(interval, following):
        share = graph.curve_span(following)[0] - graph.curve_span(interval)[1]
        return share * graph.parts[interval.part].object_length
    # By the median of their nodes: those beside a hidden span lie closer together, to be visible.
    places = graph.place(interval, model)[1], graph.place(following, model)[0]
    shape = interpolate(model.shape, (places[0] + _SPAN_SHARES * (places[1] - places[0])) / model.length)
    length = float(arc_lengths(shape)[-1])
    shape_chord = math.dist(shape[0], shape[-1])
    return chord * length / shape_chord if length < _MAX_BEND * shape_chord else max(length, chord)
