"""Alignment of an observation with a track: its position along it, and which of the track's ends it has."""

from __future__ import annotations

import math

import numpy as np

from dloftbs._arrays import FloatArray
from dloftbs.observation import Observation
from dloftbs.tracking.frame_view import View
from dloftbs.tracking.kernels import alignment as kernels
from dloftbs.tracking.partial_match import WHOLE, PartialMatch
from dloftbs.tracking.track_model import TrackModel

_HIDDEN_BEFORE = 0.7
"""Weight of the misfit at one end of a track where only the other end was hidden before, ratio.

Source: by hand; less than that of the border, as an occluder moves.
"""

_INNER_FIT = 0.7
"""Share of the misfit at an end below which a part that fits elsewhere has both ends hidden.

Source: by hand; a part at an end is the commoner case.
"""

_SHIFT_WEIGHT = 0.3
"""Weight of the mean shift in the misfit of a part, ratio.

Source: by hand; unexpected motion must not hide where a part lies.
"""

_MOTION_WEIGHT = 0.2
"""Weight of the motion beside the shape in the misfit of a part, ratio.

Source: by hand; it only breaks ties between places of one shape.
"""

_MAJORITY = 0.5
"""Share of a curve that is most of it.

Source: by definition.
"""

_CUT_FIT = 0.5
"""Share of the misfit as a whole below which the rest fits better where it was: an end may have been cut off.

Source: by hand.
"""

_CUT_WIDTHS = 0.5
"""Misfit of the rest of a track up to which an end may have been cut off, widths.

Source: geometry; the predicted centre line of what stayed where it was lies on the mask still.
"""


def locate_on_track(
    model: TrackModel,
    predicted: FloatArray,
    observation: Observation,
    best_start: float,
    view: View,
) -> tuple[float, float]:
    """Return the span of a longer track that an observation shows: at an end, unless it clearly fits better elsewhere.

    Parameters
    ----------
    model : TrackModel
    predicted : numpy.ndarray, shape (SAMPLES, 2)
        Predicted samples of the track.
    observation : Observation
        In the track's direction.
    best_start : float
        Start that fits best, in ``u`` of the track.
    view : View
    """
    share = observation.length / model.length
    first, last, inner = (_misfit_at(model, predicted, observation, low) for low in (0.0, 1.0 - share, best_start))
    cut = [end.is_cut for end in view.ends(observation, model)]
    were_hidden = [any(low <= 0.0 for low, _ in model.sight.hidden), any(high >= 1.0 for _, high in model.sight.hidden)]
    if were_hidden[0] != were_hidden[1]:
        first, last = (first, last * _HIDDEN_BEFORE) if were_hidden[0] else (first * _HIDDEN_BEFORE, last)
    at_start = cut[1] if cut[0] != cut[1] else first <= last  # the cut end is inside of the track
    at_end = (0.0, share) if at_start else (1.0 - share, 1.0)
    inset_px = min(best_start, 1.0 - best_start - share) * model.length
    if inset_px > model.position_tolerance_px and inner < _INNER_FIT * min(first, last):
        return best_start, best_start + share
    return at_end


def find_whole_view(
    model: TrackModel, predicted: FloatArray, observation: Observation, start: float, view: View
) -> PartialMatch | None:
    """Return the match with the whole object of an observation that shows one track alone; None if that is not known.

    It is the whole track, whatever its length, tilt and bend, unless the image's border or an occluder cuts it. Where
    no evidence tells, an end may have been cut off or added, which shows in the rest staying where it was predicted.

    Parameters
    ----------
    model : TrackModel
    predicted : numpy.ndarray, shape (SAMPLES, 2)
        Predicted samples of the track.
    observation : Observation
        In the track's direction.
    start : float
        Its start if it is a part, in ``u`` of the track.
    view : View
    """
    if observation.curve.closed or model.curve.closed or model.is_torn_in(observation):
        return None
    whole = observation.between(0.0, 1.0)
    first, last = view.ends(whole, model)
    if (first.hidden or last.hidden) and model.is_short(whole):
        tells_how_much = not math.isnan(model.length_in_view(whole)) and first.hidden != last.hidden
        return _match_with_hidden_end(model, whole, at_start=first.hidden) if tells_how_much else None
    length = float(np.hypot(*np.diff(predicted, axis=0).T).sum())
    if abs(whole.length - length) < model.position_tolerance_px:
        if observation.length > _MAJORITY * whole.length:
            return PartialMatch(whole, WHOLE, WHOLE)
        return match_whole(predicted, whole)  # all of it tells the direction better than a small part
    if not whole.contiguous or first.is_cut or last.is_cut:
        return None
    share = whole.length / length
    same = (first.in_sight and last.in_sight) or not _stayed_but_for_an_end(model, predicted, whole, start, share)
    return PartialMatch(whole, WHOLE, WHOLE) if same else None


def match_whole(predicted: FloatArray, observation: Observation) -> PartialMatch:
    """Return the match of a whole track, by its predicted samples, with an observation in the better direction."""
    both = observation, observation.reversed()
    misfits = [kernels.misfit_at(one.points, predicted, 1.0, 0.0, _SHIFT_WEIGHT) for one in both]
    return PartialMatch(both[misfits[1] < misfits[0]], WHOLE, WHOLE)


def _match_with_hidden_end(model: TrackModel, whole: Observation, *, at_start: bool) -> PartialMatch:
    """Return the match with an object of which one end is hidden: its length in metres tells how much."""
    share = whole.length / model.length_in_view(whole)
    return PartialMatch(whole, (1.0 - share, 1.0) if at_start else (0.0, share), WHOLE)


def _stayed_but_for_an_end(
    model: TrackModel, predicted: FloatArray, whole: Observation, start: float, share: float
) -> bool:
    """Return True if an observation fits clearly better as a part of a track, or with a new part, than as a whole.

    `share` is the ratio of its length to that of the track as predicted.
    """
    short, long = (whole.points, predicted) if share <= 1.0 else (predicted, whole.points)
    share = min(share, 1.0 / share)
    starts = (0.0, min(max(start, 0.0), 1.0 - share), 1.0 - share)
    misfit_if_cut = min(kernels.misfit_at(short, long, share, low, 1.0) for low in starts)
    if share >= _MAJORITY and misfit_if_cut > _CUT_WIDTHS * model.width:  # never of an unknown width
        return False
    return misfit_if_cut <= _CUT_FIT * kernels.misfit_at(whole.points, predicted, 1.0, 0.0, 1.0)


def _misfit_at(model: TrackModel, predicted: FloatArray, observation: Observation, start: float) -> float:
    """Return the misfit of an observation at a start: by the last full shape, and by motion."""
    share = observation.length / model.length
    by_motion = kernels.misfit_at(observation.points, predicted, share, start, _SHIFT_WEIGHT)
    return kernels.misfit_at(observation.points, model.shape, share, start, 0.0) + _MOTION_WEIGHT * by_motion
