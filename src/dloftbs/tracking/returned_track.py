"""The only hidden track, returned: an object that appears as a whole, as long and as wide as the hidden one."""

from __future__ import annotations

import math
from collections.abc import Sequence

from dloftbs.observation import Observation
from dloftbs.tracking.alignment import match_whole
from dloftbs.tracking.appearance import colours_differ, widths_differ
from dloftbs.tracking.partial_match import WHOLE, TrackObservation
from dloftbs.tracking.prediction import PredictedTracks
from dloftbs.tracking.track_model import TrackModel
from dloftbs.tracks import TrackState


def match_returned(
    models: Sequence[TrackModel],
    predicted: PredictedTracks,
    shown: Sequence[TrackObservation],
    unassigned: Sequence[Observation],
) -> tuple[list[TrackObservation], list[Observation]]:
    """Return what the frame shows of the tracks, and the observations of none, after a hidden track has returned.

    Under what hides it, it may have moved anywhere. It has returned if it is the only one hidden, and one object alone
    is like it among those that are unassigned, or shown by a tentative track, which was a part of it.
    """
    result, rest = list(shown), list(unassigned)
    lost = [t for t, model in enumerate(models) if model.sight.was_covered and not shown[t].matches]
    if len(lost) != 1:
        return result, rest
    hidden = lost[0]
    tentative = [t for t, model in enumerate(models) if model.state is TrackState.TENTATIVE]
    found = [match.observation for t in tentative for match in shown[t].matches] + rest
    alike = [one for one in found if one.curve_span == WHOLE and _is_like(models[hidden], one)]
    if len(alike) == 1:
        result[hidden] = TrackObservation((match_whole(predicted.points[hidden], alike[0]),))
        rest = [one for one in rest if one is not alike[0]]
        for t in tentative:
            if any(match.observation is alike[0] for match in result[t].matches):
                result[t] = TrackObservation()
    return result, rest


def _is_like(model: TrackModel, one: Observation) -> bool:
    """Return True if an observation may be the whole object: as long, in space if it is known there, and as wide."""
    if model.curve.closed or one.curve.closed or not one.contiguous or widths_differ(model.width, one.width):
        return False
    in_view = model.length_in_view(one)
    length = model.length if math.isnan(in_view) else in_view
    same_length = abs(one.length - length) <= model.position_tolerance_px
    return same_length and not bool(colours_differ([model], [one])[0, 0])
