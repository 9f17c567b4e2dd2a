"""Localisation of all intervals along a track, with hidden spans between them as long as the evidence tells."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import accumulate, pairwise

import numpy as np

from dloftbs.observation import Observation
from dloftbs.tracking.extension import HIDDEN_UNCERTAINTY, fit_length
from dloftbs.tracking.frame_view import View
from dloftbs.tracking.kernels import routing as kernels
from dloftbs.tracking.partial_match import PartialMatch
from dloftbs.tracking.sample_graph import Interval, SampleGraph
from dloftbs.tracking.track_model import TrackModel
from dloftbs.tracking.track_samples import interpolate_samples

_SPAN_SAMPLES = 33
"""Number of samples of a hidden span whose chord is measured.

Source: bounds time; half of a curve's `SAMPLES`.
"""

_MAX_BEND = 3.0
"""Ratio of length to chord of a hidden span beyond which the chord says nothing about the length.

Source: by hand; of a hairpin, whose ends meet.
"""


def localize(graph: SampleGraph, intervals: Sequence[Interval], model: TrackModel, view: View) -> list[PartialMatch]:
    """Return the matches of all intervals of a track, laid along it together with the hidden spans between them."""
    intervals = [fit_length(graph, intervals[0], model)] if len(intervals) == 1 else intervals
    observed = [graph.observe(one) for one in intervals]
    hidden = [_hidden_length(graph, *pair, model) for pair in pairwise(intervals)]
    lengths = [graph.length(one) for one in intervals]
    total = sum(lengths) + sum(hidden)
    excess = total - model.length
    tolerance = model.length_tolerance_px + HIDDEN_UNCERTAINTY * sum(hidden)
    low, high = 0.0, 1.0
    usual = len(intervals) == 1 and model.lengths.is_usual(total, model.length_tolerance_px)
    ends = view.ends_in_sight(observed[0], model)[0], view.ends_in_sight(observed[-1], model)[1]
    if abs(excess) > tolerance and not (usual or (len(intervals) > 1 and all(ends))):
        start = _mean_start(graph, intervals, lengths, hidden, model)
        if excess < 0.0:
            low = _missing_before(start, -excess, observed, model, view) / model.length
            high = low + total / model.length
        elif len(intervals) == 1:  # of several, a hidden span may as well be shorter than it seems
            before = min(max(-start, 0.0), excess)
            low, high = -before / model.length, 1.0 + (excess - before) / model.length
    edges = accumulate([0.0, *(px for pair in zip(lengths, hidden, strict=False) for px in pair), lengths[-1]])
    u = [low + edge / total * (high - low) for edge in edges]
    u[-1] = high
    spans = [[first, last] for first, last in zip(u[::2], u[1::2], strict=True)]
    for n, (one, following) in enumerate(pairwise(intervals)):
        if following.first == one.last + 1:  # the track changes from one to the other: nothing is hidden
            spans[n][1] = spans[n + 1][0] = 0.5 * (spans[n][1] + spans[n + 1][0])
    return [
        PartialMatch(one, (first, last), one.curve_span) for one, (first, last) in zip(observed, spans, strict=True)
    ]


def _hidden_length(graph: SampleGraph, interval: Interval, following: Interval, model: TrackModel) -> float:
    """Return the hidden length between two intervals, px: the detector's, or as bent as it was last seen."""
    chord = math.dist(graph.points[interval.end], graph.points[following.start])
    if following.first == interval.last + 1:
        return chord
    if graph.are_consecutive(interval, following):
        (_, low), (high, _) = graph.curve_span(interval), graph.curve_span(following)
        return (high - low) * graph.parts[interval.part].object_length
    # By the median of their nodes: those beside a hidden span lie closer together, to be visible.
    low, high = (one.origin + one.direction * i for one, i in ((interval, interval.end), (following, following.start)))
    u = np.linspace(low, high, _SPAN_SAMPLES) / (kernels.SAMPLES_PER_NODE * graph.last_node(model))
    shape = interpolate_samples(model.shape, u)
    length = float(np.hypot(*np.diff(shape, axis=0).T).sum())
    shape_chord = math.dist(shape[0], shape[-1])
    return chord * length / shape_chord if length < _MAX_BEND * shape_chord else max(length, chord)


def _mean_start(
    graph: SampleGraph,
    intervals: Sequence[Interval],
    lengths: Sequence[float],
    hidden: Sequence[float],
    model: TrackModel,
) -> float:
    """Return the start of the intervals along the predicted track, px: the mean over all their nodes."""
    step = model.length / (graph.last_node(model) * kernels.SAMPLES_PER_NODE)
    done = offset = nodes = 0.0
    for one, length, gap in zip(intervals, lengths, [*hidden, 0.0], strict=True):
        count = one.last - one.first + 1
        offset += count * ((one.origin + one.direction * one.start) * step - done)
        nodes += count
        done += length + gap
    return offset / nodes


def _missing_before(
    start: float,
    missing: float,
    observed: Sequence[Observation],
    model: TrackModel,
    view: View,
) -> float:
    """Return the missing length before the intervals, px: all or nothing of it, unless it clearly differs.

    `start` is the intervals' start by the motion so far, px.
    """
    start = min(max(start, 0.0), missing)
    after = missing - start
    cut = view.cut_ends(observed[0], model)[0], view.cut_ends(observed[-1], model)[1]
    if cut[0] != cut[1] and (after if cut[0] else start) < 2.0 * model.position_tolerance_px:
        return missing if cut[0] else 0.0
    if min(start, after) > model.position_tolerance_px:
        return start
    return 0.0 if start <= after else missing
