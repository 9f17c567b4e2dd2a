"""Alignment of an observation with a track: its position along it, and which of the track's ends it has."""

from __future__ import annotations

import math

from dloftbs.kernels.polyline_lengths import arc_lengths
from dloftbs.tracking.appearance import width_ratio
from dloftbs.tracking.frame_view import View
from dloftbs.tracking.kernels import alignment as kernels
from dloftbs.tracking.observation import Observation
from dloftbs.tracking.partial_match import WHOLE, PartialMatch
from dloftbs.tracking.track_model import TrackModel

_SHIFT_WEIGHT = 0.3
"""Weight of the mean shift in the misfit of a part, ratio.

Source: by hand; unexpected motion must not hide where a part lies.
"""

_CUT_FIT = 0.25
"""Share of the misfit as a whole below which the rest fits better as a part: an end may have been cut off.

Source: by hand; on sequences of five seeds, 89 % of cut views and 5 % of whole ones of cables that bend and tilt.
"""


def place_part(model: TrackModel, observation: Observation, start_px: float, view: View) -> PartialMatch:
    """Return the match of an observation that is all that is seen of a track.

    It is at an end of a longer track, unless it clearly lies elsewhere, and adds to a shorter one.

    Parameters
    ----------
    model : TrackModel
    observation : Observation
        In the track's direction.
    start_px : float
        Where it begins along the track by the motion so far, px.
    view : View
    """
    excess, tolerance = observation.length - model.length, model.length_tolerance_px
    if abs(excess) <= tolerance or model.lengths.is_usual(observation.length, tolerance):
        span = WHOLE
    elif excess < 0.0:
        low = _missing_before(model, observation, start_px, -excess, view) / model.length
        span = low, low + observation.length / model.length
    else:
        before = min(max(-start_px, 0.0), excess)
        span = -before / model.length, 1.0 + (excess - before) / model.length
    return PartialMatch(observation, span, observation.curve_span)


def _missing_before(model: TrackModel, observation: Observation, start_px: float, missing: float, view: View) -> float:
    """Return the missing length before an observation, px: all or nothing of it, unless it clearly differs."""
    start = min(max(start_px, 0.0), missing)
    after = missing - start
    cut = [end.is_cut for end in view.ends(observation, model.width)]
    if cut[0] != cut[1] and (after if cut[0] else start) < 2.0 * model.position_tolerance_px:
        return missing if cut[0] else 0.0
    if min(start, after) > model.position_tolerance_px:
        return start
    return 0.0 if start <= after else missing


def find_whole_view(model: TrackModel, observation: Observation, start: float, view: View) -> PartialMatch | None:
    """Return the match with the whole object of an observation that shows one track alone; None if that is not known.

    It is the whole track, whatever its length, tilt and bend, unless the image's border or an occluder cuts it. Where
    no evidence decides, an end may have been cut off or added, which shows in the rest keeping its shape; what came
    nearer or went away is as long in widths as before.

    Parameters
    ----------
    model : TrackModel
    observation : Observation
        In the track's direction.
    start : float
        Its start if it is a part, in ``u`` of the track.
    view : View
    """
    if observation.curve.closed or model.curve.closed:
        return None
    whole = observation.between(0.0, 1.0)
    if model.is_short(whole) and any(end.hidden for end in view.ends(whole, model.width)):
        first, last = view.ends(whole, model.width)
        share = whole.length / model.length_in_view(whole)
        told = first.hidden != last.hidden and not math.isnan(share)  # the length in metres shows how much is hidden
        return PartialMatch(whole, (1.0 - share, 1.0) if first.hidden else (0.0, share), WHOLE) if told else None
    length = float(arc_lengths(model.predicted)[-1])
    if abs(whole.length - length) < model.position_tolerance_px:
        return match_whole(model, whole)  # all of it shows the direction better than a small part
    first, last = view.ends(whole, model.width)
    if not whole.contiguous or first.is_cut or last.is_cut:
        return None
    nearer = width_ratio(whole.width, model.width)
    as_long = abs(whole.length - nearer * length) < model.position_tolerance_px
    same = (first.in_sight and last.in_sight) or as_long or not _kept_shape(model, whole, start, whole.length / length)
    return PartialMatch(whole, WHOLE, WHOLE) if same else None


def match_whole(model: TrackModel, observation: Observation) -> PartialMatch:
    """Return the match of a whole track, as it is predicted, with an observation in the better direction."""
    both = observation.points, observation.points[::-1]
    there, back = (kernels.misfit_at(points, model.predicted, 1.0, 0.0, _SHIFT_WEIGHT) for points in both)
    return PartialMatch(observation.reversed() if back < there else observation, WHOLE, WHOLE)


def _kept_shape(model: TrackModel, whole: Observation, start: float, share: float) -> bool:
    """Return True if an observation fits clearly better as a part of a track, or with a new part, than as a whole.

    `share` is the ratio of its length to that of the track as predicted. How it moved as a whole does not count.
    """
    short, long = (whole.points, model.predicted) if share <= 1.0 else (model.predicted, whole.points)
    share = min(share, 1.0 / share)
    starts = (0.0, min(max(start, 0.0), 1.0 - share), 1.0 - share)
    misfit_if_cut = min(kernels.misfit_at(short, long, share, low, 0.0) for low in starts)
    return misfit_if_cut <= _CUT_FIT * kernels.misfit_at(whole.points, model.predicted, 1.0, 0.0, 0.0)
