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
from dloftbs.tracking.alignment import locate_on_track
from dloftbs.tracking.appearance import MAX_WIDTH_RATIO, colours_differ, widths_differ
from dloftbs.tracking.frame_view import View
from dloftbs.tracking.kernels import alignment as kernels
from dloftbs.tracking.partial_match import WHOLE, PartialMatch
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

_CLEAR_CONFIDENCE = 0.9
"""Least confidence of a detection that reads clearly, as a share of such detections that are right.

Source: by hand; confidences are calibrated, so that nine of ten are one whole object.
"""

_MISFIT_CAP = 1.5
"""Largest distance of a sample that counts, as a multiple of the gate.

Source: by hand; beyond the gate, so that outliers do not decide.
"""

_HIDDEN_LENGTH_COST = 0.5
"""Cost of a track of which an observation shows nothing, as a share of the gate.

Source: by hand; half of what no match at all costs.
"""

_NEW_LENGTH_COST = 1.0
"""Cost of an observation that is nothing of what is known of a track, as a share of the gate.

Source: by definition; what no match at all costs, so that an object that comes out of hiding is not taken for a piece
of it that came out before.
"""

_MIN_GATE_WIDTHS = 3.0
"""Least gate, widths.

Source: by hand; short objects move by more than a share of their length.
"""

_BORDER_STRIDE = 9
"""Step between the samples that are tested for the image's border.

Source: bounds time; eight samples along a curve.
"""


def match_unambiguous(
    models: Sequence[TrackModel], predicted: FloatArray, observations: Sequence[Observation]
) -> list[int]:
    """Return for each track one more than the index of its observation, negative if that is reversed, 0 if ambiguous.

    A match is unambiguous if the track was seen as a whole before and lies on the observation, which may end a little
    earlier or later, and nothing else is near.
    """
    if not observations:
        return [0] * len(models)
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
            other = widths_differ(models[t].width, one.width) or models[t].is_torn_in(one)
            other = other or (one.curve_3d is not None and models[t].is_short(one))
            if other or differ[t, abs(p) - 1]:
                partner[t] = 0
    return partner


def match_by_length(
    models: Sequence[TrackModel], predicted: FloatArray, observations: Sequence[Observation], gate: float
) -> list[int]:
    """Return the same for tracks that no observation is unambiguously near: those as long as a clear one.

    An object that a frame shows clearly and without a gap, from end to end, and as long as it usually is, has not
    exchanged a part with another one, wherever its track was routed before. `gate` is a share of the length.
    """
    length = np.array([one.length for one in observations])
    clear = [
        one.detection is not None and one.contiguous and one.detection.confidence >= _CLEAR_CONFIDENCE
        for one in observations
    ]
    usual = np.array([m.lengths.usual_px for m in models])[:, None]
    in_view = np.multiply.outer([m.lengths.metres for m in models], [one.px_per_m for one in observations])
    expected = np.where(np.isnan(in_view), usual, in_view)
    tolerance = np.array([m.length_tolerance_px for m in models])[:, None]
    as_long = (np.abs(expected - length) <= tolerance) & np.array(clear) & ~np.isnan(usual)
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
    measured = kernels.box_distances(predicted, found) < _MISFIT_CAP * gate
    measured &= _have_similar_widths(models, observations, view) & ~colours_differ(models, observations)
    misfit, start, backwards = kernels.align_all(
        predicted, usual, is_loop, found, lengths, closed, measured * (_MISFIT_CAP * gate)
    )
    ratio = np.divide.outer(usual, lengths)
    covered = np.minimum(ratio, 1.0 / ratio)
    cost = covered * misfit / gate + (1.0 - covered) * np.where(ratio > 1.0, _HIDDEN_LENGTH_COST, _NEW_LENGTH_COST)
    # Beyond the gate all pairs cost the same, more than all others together, and are dropped afterwards.
    fits, beyond = misfit < gate, float(min(cost.shape)) * (_MISFIT_CAP + _NEW_LENGTH_COST) + 1.0
    rows, columns = linear_sum_assignment(np.where(fits, cost, beyond))
    result = {}
    for t, d in zip(rows.tolist(), columns.tolist(), strict=True):
        if fits[t, d]:
            oriented = observations[d].reversed() if backwards[t, d] else observations[d]
            low = float(start[t, d])
            match = _match(models[t], predicted[t], oriented, low, config, view, backwards=bool(backwards[t, d]))
            result[t] = d, match
    return result


def _compute_gates(models: Sequence[TrackModel], lengths: FloatArray, share: float) -> FloatArray:
    """Return the largest distance for each pair, shape (tracks, observations)."""
    widening = [min(1.0 + WIDENING_PER_S * float(m.sight.unseen_s.mean()), MAX_WIDENING) * share for m in models]
    least = [0.0 if math.isnan(m.width) else _MIN_GATE_WIDTHS * m.width for m in models]
    mean = np.sqrt(np.multiply.outer([m.length for m in models], lengths))
    gates: FloatArray = np.maximum(np.array(widening)[:, None] * mean, np.array(least)[:, None])
    return gates


def _have_similar_widths(
    models: Sequence[TrackModel], observations: Sequence[Observation], view: View
) -> npt.NDArray[np.bool_]:
    ratio = np.divide.outer([m.width for m in models], [_uncut_width(one, view) for one in observations])
    differs: npt.NDArray[np.bool_] = (ratio > MAX_WIDTH_RATIO) | (ratio < 1.0 / MAX_WIDTH_RATIO)
    return ~differs  # an unknown width agrees with any


def _uncut_width(observation: Observation, view: View) -> float:
    """Return an observation's width, NaN if it lies along the image's border, which cuts it lengthwise."""
    along = all(view.is_at_border(p, observation.width) for p in observation.points[::_BORDER_STRIDE])
    return math.nan if along else observation.width


def _match(
    model: TrackModel,
    predicted: FloatArray,
    oriented: Observation,
    start: float,
    config: TrackingConfig,
    view: View,
    *,
    backwards: bool,
) -> PartialMatch:
    """Return the match of a track with an observation in its direction; `start` is that of the shorter one."""
    if oriented.curve.closed:
        share = min(model.length / oriented.length, 1.0)
        seam = -start if model.curve.closed else 1.0 - start - share if backwards else start
        return PartialMatch(oriented, WHOLE, (seam % 1.0, seam % 1.0 + 1.0))
    span, share = WHOLE, oriented.length / model.length
    as_long = abs(oriented.length - model.length) <= model.length_tolerance_px
    overrides = model.conflict.overrides(oriented, config.override_frames, model.width_or_0)
    if not (model.curve.closed or as_long or overrides):
        if share > 1.0:
            low = (1.0 - start - 1.0 / share) if backwards else start
            span = min(-low * share, 0.0), max((1.0 - low) * share, 1.0)
        else:
            span = locate_on_track(model, predicted, oriented, start, view)
    return PartialMatch(oriented, span, oriented.curve_span)
