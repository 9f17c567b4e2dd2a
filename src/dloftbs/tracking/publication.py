"""Publication of the tracks: what of each is seen, or known to be hidden, and what is said of it."""

from __future__ import annotations

import math
from collections.abc import Sequence

from dloftbs.data.curve_samples import SAMPLES, U, sample_curve
from dloftbs.data.tracks import EndKind, SeenPart, Track
from dloftbs.support.arrays import FloatArray, frozen
from dloftbs.support.values import unchecked
from dloftbs.tracking.frame_view import View
from dloftbs.tracking.kernels.hidden_spans import find_runs
from dloftbs.tracking.kernels.interpolation import interpolate
from dloftbs.tracking.partial_match import WHOLE, PartialMatch, VisibleCurve, inferred_spans, seen_parts
from dloftbs.tracking.reconstruction import cut
from dloftbs.tracking.sight import Spans
from dloftbs.tracking.track_model import TrackModel


def make_visible_curve(model: TrackModel, matches: Sequence[PartialMatch], view: View) -> VisibleCurve:
    """Return the published curve of a partly hidden track: it ends where it leaves the image, or enters plain sight."""
    first, last = matches[0], matches[-1]
    low, high = _unseen_limits(model, first.track_span[0], last.track_span[1])
    low = first.track_span[0] if view.are_at_border(first.observation.points, model.width)[0] else low
    high = last.track_span[1] if view.are_at_border(last.observation.points, model.width)[1] else high
    if len(matches) == 1 and (low, high) == first.track_span and first.curve_span == WHOLE:
        observation = first.observation
        return VisibleCurve(observation.curve, observation.curve_3d, observation.gaps, 1.0, (low, high))
    inside = [match.within(low, high).clip_to_track() for match in matches]
    return _cut_visible(model, (low, high), inferred_spans(inside), view, seen_parts(inside))


def _unseen_limits(model: TrackModel, first: float, last: float) -> tuple[float, float]:
    """Return the span of a track around `first` and `last` up to where it enters plain sight, unseen."""
    if not model.sight.in_sight[model.sight.in_sight.argmax()]:  # faster than any()
        return WHOLE
    shown, step = U[model.sight.in_sight], float(U[1])
    before, after = shown[shown < first], shown[shown > last]
    low = min(float(before[-1]) + step, first) if len(before) else 0.0
    return low, max(float(after[0]) - step, last) if len(after) else 1.0


def make_hidden_curve(model: TrackModel, view: View) -> VisibleCurve | None:
    """Return the published curve of a track that is hidden as a whole, as far as it is not in plain sight.

    None if less than half of it is under what is known to hide it, or if plain sight is in between.
    """
    if not model.sight.is_covered:
        return None
    first, end = max(find_runs(~model.sight.in_sight).tolist(), key=lambda run: run[1] - run[0], default=(0, 0))
    if end - first <= SAMPLES // 2:
        return None
    span = float(U[first]), float(U[end - 1])
    return _cut_visible(model, span, (WHOLE,), view)


def _cut_visible(
    model: TrackModel, span: tuple[float, float], inferred: Spans, view: View, parts: tuple[SeenPart, ...] = ()
) -> VisibleCurve:
    """Return a span of a track as its published curve, with the parts of it that are seen."""
    if span == WHOLE:
        return VisibleCurve(model.curve, model.curve_3d, inferred, model.sight.confidence, span, parts)
    curve_3d = None if model.curve_3d is None else cut(model.curve_3d, _in_space(model, span, view))
    return VisibleCurve(cut(model.curve, span), curve_3d, inferred, model.sight.confidence_in(span), span, parts)


def to_track(model: TrackModel, view: View, probability: float) -> Track:
    """Return the track as published; `probability` is that of its curve, but for what was not seen for long."""
    visible = model.visible or VisibleCurve(model.curve, model.curve_3d, model.sight.inferred, model.sight.confidence)
    motion, span = model.motion, visible.track_span
    velocity = _between(motion.velocity, span) if motion.is_known else None
    in_space = None if motion.velocity_3d is None else _between(motion.velocity_3d, _in_space(model, span, view))
    acceleration = None if motion.acceleration is None else _between(motion.acceleration, span)
    return unchecked(
        Track,
        id=model.id,
        state=model.state,
        curve=visible.curve,
        curve_3d=visible.curve_3d,
        hits=model.hits,
        misses=model.misses,
        detection=model.detection,
        confidence=probability * visible.confidence,
        width_px=None if math.isnan(model.width) else model.width,
        ends=_ends(model, visible, view),
        camera=model.camera,
        _fitted=(tuple([(float(low), float(high)) for low, high in visible.inferred]), velocity, in_space),
        _fitted_parts=visible.parts,
        _fitted_change=(acceleration, motion.age_s),
    )


def _ends(model: TrackModel, visible: VisibleCurve, view: View) -> tuple[EndKind, EndKind] | None:
    if visible.curve.closed:
        return None
    points = model.points if visible.curve is model.curve else sample_curve(visible.curve)[0]
    first, last = [
        EndKind.BORDER if end.at_border else EndKind.HIDDEN if end.hidden else EndKind.FREE
        for end in view.look_beyond(points, model.width, visible.curve_3d)
    ]
    if visible.inferred:
        first = EndKind.HIDDEN if visible.inferred[0][0] <= 0.0 else first
        last = EndKind.HIDDEN if visible.inferred[-1][1] >= 1.0 else last
    return first, last


def _in_space(model: TrackModel, span: tuple[float, float], view: View) -> tuple[float, float]:
    return span if model.curve_3d is None else view.span_in_space(model.curve_3d, span)


def _between(samples: FloatArray, span: tuple[float, float]) -> FloatArray:
    """Return samples (SAMPLES, d) of a part of a track, read-only."""
    if span == WHOLE:
        return frozen(samples.view())
    return frozen(interpolate(samples, span[0] + U * (span[1] - span[0])))
