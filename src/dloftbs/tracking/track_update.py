"""Update of the tracks by what a frame shows: whole objects as they are, and parts with the rest of the last shape."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from dloftbs.data.curve_samples import sample_curve
from dloftbs.tracking.curve_in_space import place_by_space, reconstruct_in_space
from dloftbs.tracking.frame_view import View
from dloftbs.tracking.loop_start import restart_in_space, restart_loop
from dloftbs.tracking.partial_match import (
    WHOLE,
    PartialMatch,
    TrackObservation,
    hidden_before,
    hidden_spans,
    inferred_spans,
)
from dloftbs.tracking.publication import make_visible_curve
from dloftbs.tracking.reconstruction import CURVE_SAMPLES, cut, reconstruct, visible_parts
from dloftbs.tracking.track_model import TrackModel
from dloftbs.tracking.track_motion import JUMP_SHARE


def update_seen(model: TrackModel, shown: TrackObservation, view: View, dt: float) -> None:
    """Update a track that a frame shows, wholly or in part."""
    model.cut_to(shown.scope)
    if len(shown.matches) == 1 and shown.matches[0].is_complete:
        _update_whole(model, shown.matches[0], dt)
    else:
        matches = _update_partly(model, shown, view, dt)
        model.visible = make_visible_curve(model, matches, view)
    model.apart |= shown.apart_from
    model.count_hit(max(match.observation.existence_log_odds for match in shown.matches))


def _update_whole(model: TrackModel, match: PartialMatch, dt: float) -> None:
    observation, start = match.observation, match.curve_span[0]
    if observation.curve.closed:
        observation = restart_loop(observation, start)
    longer = match.track_span != WHOLE
    if longer:
        model.resample(match.track_span)
    jump = abs(observation.length - model.length)
    if model.sight.hidden:  # the rest may have been placed wrongly along the object
        jump = max(jump, float(np.abs(observation.points - model.points).max()))
    same_shape = jump <= JUMP_SHARE * model.length and observation.curve.closed == model.curve.closed
    is_known = same_shape and not (longer or model.misses)
    model.motion.step(model.points, observation.points, dt, is_known=is_known)
    model.update_whole(observation)
    if observation is not match.observation:
        model.curve_3d = model.shape_3d = restart_in_space(match.observation, start)


def _update_partly(model: TrackModel, shown: TrackObservation, view: View, dt: float) -> list[PartialMatch]:
    """Return the matches as they are adopted."""
    # A part of a detection does not make its track longer: another object may continue there.
    matches = [match.clip_to_track() for match in shown.matches]
    metres = model.lengths.metres
    model.curve_3d, parts = reconstruct_in_space(model.shape_3d, shown.scope, metres, matches, view)
    placed = None
    # Beside an occluder depth may jump: what lies farther apart than the cable is long says nothing of what is hidden.
    longest_m = metres + model.position_tolerance_px / model.lengths.px_per_m
    if model.curve_3d is None or not sample_curve(model.curve_3d)[1] > longest_m:
        model.shape_3d = model.curve_3d
        placed = None if model.curve_3d is None else place_by_space(model.curve_3d, metres, matches, parts, view)
    elif model.shape_3d is not None and shown.scope != WHOLE:
        model.shape_3d = cut(model.shape_3d, view.span_in_space(model.shape_3d, shown.scope))
    if placed is None:
        _follow_view(model, matches)
        old, _ = sample_curve(model.curve, *shown.scope, CURVE_SAMPLES)
    else:
        matches, old, px_per_m = placed
        model.lengths.rescale(px_per_m, max(match.observation.width for match in matches))
        model.lengths.px = px_per_m * metres
    curve = reconstruct(old, visible_parts(matches), model.length)
    longest = max(matches, key=lambda m: m.observation.length).observation
    model.detection = longest.detection
    model.width = model.width if math.isnan(longest.width) else longest.width
    if not shown.apart_from and _contradict(matches, model.width, view):
        model.belief.add(-max(longest.log_odds, 0.0))
    points, _ = sample_curve(curve)
    model.update_partly(curve, points, hidden_spans(matches), inferred_spans(matches), view, dt)
    return matches


def _follow_view(model: TrackModel, matches: Sequence[PartialMatch]) -> None:
    """Take the length to the view's scale, by the width, and by what lies between both ends if they are seen."""
    model.lengths.follow_width(max(matches, key=lambda m: m.observation.length).observation.width)
    if _are_apart(matches) and matches[0].track_span[0] <= 0.0 and matches[-1].track_span[1] >= 1.0:
        share = sum(match.track_span[1] - match.track_span[0] for match in matches)
        model.lengths.follow_tilt(sum(match.observation.length for match in matches) / share)


def _contradict(matches: Sequence[PartialMatch], width: float, view: View) -> bool:
    """Return whether what is seen of a track of some width, px, speaks against its shape.

    It does if a detection goes on beyond what the track takes of it, or if there is but one part, with an end that
    nothing is known to cut where the track goes on.
    """
    if any(match.curve_span != WHOLE for match in matches):
        return True
    (low, high), (start, stop) = matches[0].track_span, view.ends(matches[0].observation, width)
    return len(matches) == 1 and ((low > 0.0 and not start.is_cut) or (high < 1.0 and not stop.is_cut))


def _are_apart(matches: Sequence[PartialMatch]) -> bool:
    """Return True if something of a track is hidden between its parts."""
    return any(hidden_before(matches)[1:-1])
