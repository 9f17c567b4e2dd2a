"""Assignment of observations to tracks as a whole, one to one: unambiguous ones, and by the least total cost.

A cost is made of distance and length; width and colour exclude.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.optimize import linear_sum_assignment

from dloftbs.data.tracks import TrackState
from dloftbs.support.arrays import FloatArray
from dloftbs.tracking.alignment import match_whole, place_part
from dloftbs.tracking.appearance import colour_differs, objects_differ, width_ratio, widths_differ
from dloftbs.tracking.frame_view import View
from dloftbs.tracking.kernels import alignment as kernels
from dloftbs.tracking.kernels.pairs import box_distances
from dloftbs.tracking.kernels.routing import MAX_WIDENING, WIDENING_PER_S
from dloftbs.tracking.observation import Observation
from dloftbs.tracking.partial_match import WHOLE, PartialMatch, TrackObservation
from dloftbs.tracking.track_model import TrackModel

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
    models: Sequence[TrackModel], observations: Sequence[Observation], gate: float
) -> dict[int, TrackObservation]:
    """Map ids of tracks to observations that lie within the gate, a share of their length, and nothing else near.

    The track was seen as a whole before, and the observation is as long.
    """
    lengths, predicted = np.array([m.length for m in models]), np.array([m.predicted for m in models])
    points = np.array([one.points for one in observations])
    found = kernels.find_partners(predicted, lengths, points, gate).tolist()
    result = {}
    for model, partner in zip(models, found, strict=True):
        if not partner:
            continue
        one = observations[abs(partner) - 1]
        if (
            not (model.curve.closed or one.curve.closed)
            and _is_unchanged(model, one)
            and not colour_differs(model, one)
        ):
            match = PartialMatch(one if partner > 0 else one.reversed(), WHOLE, WHOLE)
            result[model.id] = TrackObservation((match,), is_unambiguous=True)
    return result


def _is_unchanged(model: TrackModel, one: Observation) -> bool:
    """Return True if an observation, as it lies on a track, shows all of it, and nothing that it was not."""
    if model.sight.hidden or model.misses or widths_differ(model.width, one.width):
        return False
    as_long = abs(one.length - model.length) <= model.length_tolerance_px
    return as_long and (one.curve_3d is None or not model.is_short(one))


def match_remaining(models: Sequence[TrackModel], unassigned: Sequence[Observation]) -> dict[int, TrackObservation]:
    """Match the only track of the last frame that is left with the only observation left, if so, by the track's id.

    It may have moved however far, and something may have hidden it since. Width, colour and length, in space if it is
    known there, may not clearly differ.
    """
    left = [model for model in models if not model.misses or model.sight.is_covered]
    if len(left) != 1 or len(unassigned) != 1:
        return {}
    (model,), (one,) = left, unassigned
    wider, longer = width_ratio(model.width, one.width), one.length / model.length_as_seen(one)
    is_like = all(1.0 / _MAX_PAIR_RATIO <= ratio <= _MAX_PAIR_RATIO for ratio in (wider, longer))
    same_kind = one.curve_span == WHOLE and model.curve.closed == one.curve.closed
    if not (is_like and same_kind) or colour_differs(model, one):
        return {}
    return {model.id: TrackObservation((_match_loop(model, one) if one.curve.closed else match_whole(model, one),))}


def assign(
    models: Sequence[TrackModel], observations: Sequence[Observation], view: View, share: float
) -> dict[int, tuple[int, PartialMatch]]:
    """Map ids of tracks to observations and how these show them: as many pairs as possible, with the least total cost.

    The values are an index of an observation, and the match. The gate is a share of the length.
    """
    predicted, found = np.array([m.predicted for m in models]), np.array([one.points for one in observations])
    usual, is_loop = np.array([m.length for m in models]), np.array([m.curve.closed for m in models])
    lengths = np.array([one.length for one in observations])
    closed = np.array([one.curve.closed for one in observations])
    gate = compute_gates(models, lengths, share)
    cap = _MISFIT_CAP * gate
    possible = (box_distances(predicted, found) < cap) & ~objects_differ(models, observations)
    misfit, start, backwards = kernels.align_all(predicted, usual, is_loop, found, lengths, closed, possible * cap)
    ratio = np.divide.outer(usual, lengths)
    covered = np.minimum(ratio, 1.0 / ratio)
    # One that was seen too little, and then not, takes what fits no other one.
    is_doubtful = np.array([m.misses > 0 and m.state is TrackState.TENTATIVE for m in models])
    cost = covered * misfit / gate + 1.0 - covered + is_doubtful[:, None]
    # Beyond the gate all pairs cost the same, more than all others together, and are dropped afterwards.
    fits, beyond = misfit < gate, 2.0 * min(cost.shape) + 1.0
    rows, columns = linear_sum_assignment(np.where(fits, cost, beyond))
    result = {}
    for t, d in zip(rows.tolist(), columns.tolist(), strict=True):
        if fits[t, d]:
            one = observations[d].reversed() if backwards[t, d] else observations[d]
            match = _match(models[t], one, float(start[t, d]), view, backwards=bool(backwards[t, d]))
            result[models[t].id] = d, match
    return result


def compute_gates(models: Sequence[TrackModel], lengths: FloatArray, share: float) -> FloatArray:
    """Return the largest distance for each pair, shape (tracks, observations)."""
    unseen_s = [m.sight.mean_unseen_s + m.frameless_s for m in models]
    widening = [min(1.0 + WIDENING_PER_S * seconds, MAX_WIDENING) * share for seconds in unseen_s]
    least = [0.0 if math.isnan(m.width) else _MIN_GATE_WIDTHS * m.width for m in models]
    mean = np.sqrt(np.multiply.outer([m.length for m in models], lengths))
    gates: FloatArray = np.maximum(np.array(widening)[:, None] * mean, np.array(least)[:, None])
    return gates


def _match_loop(model: TrackModel, one: Observation) -> PartialMatch:
    """Return the match of a loop with one that has moved however far: turned and started where it fits best."""
    both = (np.array([True]), np.array([[math.inf]]))
    track = model.predicted[None], np.array([model.length]), both[0]
    _, start, backwards = kernels.align_all(*track, one.points[None], np.array([one.length]), *both)
    seam = -float(start[0, 0]) % 1.0
    return PartialMatch(one.reversed() if backwards[0, 0] else one, WHOLE, (seam, seam + 1.0))


def _match(model: TrackModel, oriented: Observation, start: float, view: View, *, backwards: bool) -> PartialMatch:
    """Return the match of a track with an observation in its direction; `start` is that of the shorter one."""
    if oriented.curve.closed:
        share = min(model.length / oriented.length, 1.0)
        seam = -start if model.curve.closed else 1.0 - start - share if backwards else start
        return PartialMatch(oriented, WHOLE, (seam % 1.0, seam % 1.0 + 1.0))
    if model.curve.closed or model.belief.is_refuted:
        return PartialMatch(oriented, WHOLE, oriented.curve_span)
    start_px = start * model.length
    if oriented.length > model.length:
        start_px = (start - 1.0) * oriented.length + model.length if backwards else -start * oriented.length
    return place_part(model, oriented, start_px, view)
