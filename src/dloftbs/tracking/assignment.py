"""Assignment of observations to tracks as a whole, one to one: unambiguous ones, and by the least total cost.

A cost is made of distance and length; width and colour exclude.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from scipy.optimize import linear_sum_assignment

from dloftbs._arrays import FloatArray
from dloftbs.config import TrackingConfig
from dloftbs.observation import Observation
from dloftbs.tracking.alignment import match_whole, place_part
from dloftbs.tracking.appearance import MAX_WIDTH_RATIO, colours_differ, width_ratio, widths_differ
from dloftbs.tracking.frame_view import View
from dloftbs.tracking.kernels import alignment as kernels
from dloftbs.tracking.partial_match import WHOLE, PartialMatch, TrackObservation
from dloftbs.tracking.track_model import MAX_WIDENING, WIDENING_PER_S, TrackModel

_MAX_MEAN = 0.02
"""Largest mean distance of an unambiguous match, as a share of the length.

Source: by hand; a hand's motion from frame to frame, and well below the gate.
"""

_MAX_ANYWHERE = 0.03
"""Largest distance of a sample of an unambiguous match, as a share of the length.

Source: by hand; one and a half times `_MAX_MEAN`, so that no end is missing.
"""

_MARGIN_RATIO = 3.0
"""Number of times that any other candidate must be farther than an unambiguous match.

Source: by hand.
"""

_MAX_PAIR_RATIO = 1.5
"""Ratio of widths, and of lengths in space, up to which two may be one object that moved fast.

Source: by hand.
"""

_MISFIT_CAP = 1.5
"""Largest distance of a sample that counts, as a multiple of the gate.

Source: by hand; beyond the gate, so that outliers do not decide.
"""

_MIN_GATE_WIDTHS = 3.0
"""Least gate, widths.

Source: by hand; short objects move by more than a share of their length.
"""


def match_unambiguous(
    models: Sequence[TrackModel], predicted: FloatArray, observations: Sequence[Observation]
) -> list[int]:
    """Return for each track one more than the index of its observation, negative if that is reversed, 0 if ambiguous.

    A match is unambiguous if the track was seen as a whole before and lies on the observation, which is as long, and
    nothing else is near.
    """
    closed = np.array([one.curve.closed for one in observations])
    points = np.array([one.points for one in observations])
    whole = np.array([not (m.sight.hidden or m.misses or m.curve.closed) for m in models])
    partner: list[int] = kernels.match_unambiguous(
        predicted,
        np.array([m.length for m in models]),
        whole,
        points,
        closed,
        _MAX_MEAN,
        _MAX_ANYWHERE,
        _MARGIN_RATIO,
    ).tolist()
    differ = colours_differ(models, observations)
    for t, p in enumerate(partner):
        if p:
            one = observations[abs(p) - 1]
            other = abs(one.length - models[t].length) > models[t].length_tolerance_px
            other = other or widths_differ(models[t].width, one.width) or models[t].is_torn_in(one)
            other = other or (one.curve_3d is not None and models[t].is_short(one))
            if other or differ[t, abs(p) - 1]:
                partner[t] = 0
    return partner


def match_by_length(
    models: Sequence[TrackModel], predicted: FloatArray, observations: Sequence[Observation], gate: float
) -> list[int]:
    """Return the same for tracks that no observation is unambiguously near: those as long as a clear one.

    An object that a frame shows without a gap, from end to end, and as long as it usually is, has not exchanged a part
    with another one, wherever its track was routed before. `gate` is a share of the length.
    """
    length = np.array([one.length for one in observations])
    usual = np.array([m.lengths.usual_px for m in models])[:, None]
    in_view = np.multiply.outer([m.lengths.metres for m in models], [one.px_per_m for one in observations])
    expected = np.where(np.isnan(in_view), usual, in_view)
    tolerance = np.array([m.length_tolerance_px for m in models])[:, None]
    as_long = (np.abs(expected - length) <= tolerance) & [one.contiguous for one in observations] & ~np.isnan(usual)
    as_long &= ~colours_differ(models, observations)
    if not as_long.any():
        return [0] * len(models)
    partner = kernels.match_unambiguous(
        predicted,
        np.array([m.length for m in models]),
        as_long.any(axis=1) & np.array([not m.curve.closed for m in models]),
        np.array([one.points for one in observations]),
        np.array([one.curve.closed for one in observations]),
        gate,
        np.inf,
        _MARGIN_RATIO,
    )
    return [p if p and as_long[t, abs(p) - 1] else 0 for t, p in enumerate(partner.tolist())]


def match_remaining(
    models: Sequence[TrackModel],
    predicted: FloatArray,
    shown: list[TrackObservation],
    unassigned: list[Observation],
) -> None:
    """Match the only track of the last frame that is left with the only observation left, however far it moved.

    Something may have hidden it since. Both lists are changed. Width, colour and length, in space if it is known there,
    may not clearly differ.
    """
    left = [
        t for t, one in enumerate(shown) if not one.matches and (not models[t].misses or models[t].sight.is_covered)
    ]
    if len(left) != 1 or len(unassigned) != 1:
        return
    model, (one,) = models[left[0]], unassigned
    wider, longer = width_ratio(model.width, one.width), one.length / model.length_as_seen(one)
    is_like = all(1.0 / _MAX_PAIR_RATIO <= ratio <= _MAX_PAIR_RATIO for ratio in (wider, longer))
    same_kind = one.curve_span == WHOLE and model.curve.closed == one.curve.closed
    if is_like and same_kind and not colours_differ([model], [one])[0, 0]:
        shown[left[0]] = TrackObservation((match_whole(predicted[left[0]], one),))
        unassigned.clear()


def assign(
    models: Sequence[TrackModel],
    predicted: FloatArray,
    observations: Sequence[Observation],
    config: TrackingConfig,
    view: View,
) -> dict[int, tuple[int, PartialMatch]]:
    """Map tracks to observations and how these show them: as many pairs as possible, with the least total cost.

    The keys are indices of tracks; the values are an index of an observation, and the match.
    """
    found = np.array([one.points for one in observations])
    usual, is_loop = np.array([m.length for m in models]), np.array([m.curve.closed for m in models])
    lengths = np.array([one.length for one in observations])
    closed = np.array([one.curve.closed for one in observations])
    gate = _compute_gates(models, lengths, config.gate)
    cap = _MISFIT_CAP * gate
    possible = _have_similar_widths(models, observations) & ~colours_differ(models, observations)
    possible &= _box_distances(predicted, found) < cap
    misfit, start, backwards = kernels.align_all(predicted, usual, is_loop, found, lengths, closed, possible * cap)
    ratio = np.divide.outer(usual, lengths)
    covered = np.minimum(ratio, 1.0 / ratio)
    cost = covered * misfit / gate + 1.0 - covered
    # Beyond the gate all pairs cost the same, more than all others together, and are dropped afterwards.
    fits, beyond = misfit < gate, _MISFIT_CAP * min(cost.shape) + 1.0
    rows, columns = linear_sum_assignment(np.where(fits, cost, beyond))
    result = {}
    for t, d in zip(rows.tolist(), columns.tolist(), strict=True):
        if fits[t, d]:
            oriented = observations[d].reversed() if backwards[t, d] else observations[d]
            low = float(start[t, d])
            match = _match(models[t], oriented, low, config, view, backwards=bool(backwards[t, d]))
            result[t] = d, match
    return result


def _compute_gates(models: Sequence[TrackModel], lengths: FloatArray, share: float) -> FloatArray:
    """Return the largest distance for each pair, shape (tracks, observations)."""
    widening = [min(1.0 + WIDENING_PER_S * float(m.sight.unseen_s.mean()), MAX_WIDENING) * share for m in models]
    least = [0.0 if math.isnan(m.width) else _MIN_GATE_WIDTHS * m.width for m in models]
    mean = np.sqrt(np.multiply.outer([m.length for m in models], lengths))
    gates: FloatArray = np.maximum(np.array(widening)[:, None] * mean, np.array(least)[:, None])
    return gates


def _box_distances(tracks: FloatArray, found: FloatArray) -> FloatArray:
    """Return the distances between the boxes of tracks (t, m, 2) and of curves (d, m, 2), shape (t, d)."""
    before = tracks.min(axis=1)[:, None] - found.max(axis=1)
    after = found.min(axis=1) - tracks.max(axis=1)[:, None]
    distances: FloatArray = np.linalg.norm(np.maximum(np.maximum(before, after), 0.0), axis=2)
    return distances


def _have_similar_widths(models: Sequence[TrackModel], observations: Sequence[Observation]) -> npt.NDArray[np.bool_]:
    ratio = np.divide.outer([m.width for m in models], [one.width for one in observations])
    differs: npt.NDArray[np.bool_] = (ratio > MAX_WIDTH_RATIO) | (ratio < 1.0 / MAX_WIDTH_RATIO)
    return ~differs  # an unknown width agrees with any


def _match(
    model: TrackModel, oriented: Observation, start: float, config: TrackingConfig, view: View, *, backwards: bool
) -> PartialMatch:
    """Return the match of a track with an observation in its direction; `start` is that of the shorter one."""
    if oriented.curve.closed:
        share = min(model.length / oriented.length, 1.0)
        seam = -start if model.curve.closed else 1.0 - start - share if backwards else start
        return PartialMatch(oriented, WHOLE, (seam % 1.0, seam % 1.0 + 1.0))
    overrides = model.conflict.overrides(oriented, config.override_frames, model.width_or_0)
    if model.curve.closed or overrides:
        return PartialMatch(oriented, WHOLE, oriented.curve_span)
    start_px = start * model.length
    if oriented.length > model.length:
        start_px = (start - 1.0) * oriented.length + model.length if backwards else -start * oriented.length
    return place_part(model, oriented, start_px, view)
