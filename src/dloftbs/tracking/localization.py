"""Localisation of all intervals along a track, with hidden spans between them as long as the evidence tells."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import accumulate, pairwise

import numpy as np

from dloftbs.observation import Observation
from dloftbs.tracking.alignment import place_part
from dloftbs.tracking.extension import HIDDEN_UNCERTAINTY, fit_length
from dloftbs.tracking.frame_view import View
from dloftbs.tracking.kernels import routing as kernels
from dloftbs.tracking.kernels.interpolation import interpolate
from dloftbs.tracking.partial_match import PartialMatch
from dloftbs.tracking.sample_graph import Interval, SampleGraph
from dloftbs.tracking.track_model import TrackModel

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
    if len(intervals) == 1:
        alone = fit_length(graph, intervals[0], model)
        return [place_part(model, graph.observe(alone), _own_margins(graph, alone, alone, model)[0], view)]
    observed = [graph.observe(one) for one in intervals]
    hidden = [_hidden_length(graph, *pair, model) for pair in pairwise(intervals)]
    lengths = [graph.length(one) for one in intervals]
    before, after = _hidden_at_ends(graph, intervals, observed, model, view)
    between = model.length - before - sum(lengths) - after
    uncertain = HIDDEN_UNCERTAINTY * sum(hidden) + before + after
    if min(between, sum(hidden)) > 0.0 and abs(between - sum(hidden)) <= uncertain:
        hidden = [one * between / sum(hidden) for one in hidden]
    total = sum(lengths) + sum(hidden)
    low, high = before / (before + total + after), 1.0 - after / (before + total + after)
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


def _hidden_at_ends(
    graph: SampleGraph,
    intervals: Sequence[Interval],
    observed: Sequence[Observation],
    model: TrackModel,
    view: View,
) -> tuple[float, float]:
    """Return the lengths before and after several intervals, px: by where the outer ones lie, 0 for an end in sight.

    What their lengths leave over is none of them: it may as well be between, where a bend is seen to span little.
    """
    least = model.position_tolerance_px
    margins = _own_margins(graph, intervals[0], intervals[-1], model)
    ends = view.ends(observed[0], model)[0], view.ends(observed[-1], model)[1]
    before, after = (px if px > least and not end.in_sight else 0.0 for px, end in zip(margins, ends, strict=True))
    return before, after


def _own_margins(graph: SampleGraph, first: Interval, last: Interval, model: TrackModel) -> tuple[float, float]:
    """Return the lengths of the predicted track before one interval and after another, px, by the median of nodes."""
    step = model.length / (graph.last_node(model) * kernels.SAMPLES_PER_NODE)
    before = (first.origin + first.direction * first.start) * step
    return before, model.length - (last.origin + last.direction * last.end) * step


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
    shape = interpolate(model.shape, u)
    length = float(np.hypot(*np.diff(shape, axis=0).T).sum())
    shape_chord = math.dist(shape[0], shape[-1])
    return chord * length / shape_chord if length < _MAX_BEND * shape_chord else max(length, chord)
