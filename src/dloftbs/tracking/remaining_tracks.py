"""Remaining tracks: the only one left is the only object left that is like it, however far it moved."""

from __future__ import annotations

from collections.abc import Sequence

from dloftbs._arrays import FloatArray
from dloftbs.observation import Observation
from dloftbs.tracking.alignment import match_whole
from dloftbs.tracking.appearance import MAX_WIDTH_RATIO, colours_differ, width_ratio
from dloftbs.tracking.partial_match import WHOLE, TrackObservation
from dloftbs.tracking.track_model import TrackModel
from dloftbs.tracks import TrackState

_MAX_PAIR_RATIO = 1.5
"""Ratio of widths, and of lengths in space, up to which two may be one object that moved fast.

Source: by hand.
"""


def match_remaining(
    models: Sequence[TrackModel],
    predicted: FloatArray,
    shown: Sequence[TrackObservation],
    unassigned: Sequence[Observation],
) -> tuple[list[TrackObservation], list[Observation]]:
    """Return what the frame shows of the tracks, and the observations of none, with the only track left matched.

    One that was seen a frame ago is the only object left, unless they clearly differ. One that something hid since it
    was seen may have come out anywhere, with its length: one object alone is like it among those that are unassigned,
    or shown by a tentative track, which was a part of it.
    """
    result, rest = list(shown), list(unassigned)
    left = [t for t, one in enumerate(shown) if not one.matches]
    seen = [t for t in left if not models[t].misses]
    if len(seen) == len(rest) == 1 and _are_alike(models[seen[0]], rest[0], _MAX_PAIR_RATIO, _MAX_PAIR_RATIO):
        result[seen[0]] = TrackObservation((match_whole(predicted[seen[0]], rest.pop()),))
    covered = [t for t in left if models[t].sight.was_covered]
    if len(covered) != 1:
        return result, rest
    (hidden,) = covered
    model = models[hidden]
    tentative = [t for t, one in enumerate(models) if one.state is TrackState.TENTATIVE]
    found = [match.observation for t in tentative for match in shown[t].matches] + rest
    ratio = 1.0 + model.position_tolerance_px / model.length
    alike = [one for one in found if one.contiguous and _are_alike(model, one, MAX_WIDTH_RATIO, ratio)]
    if len(alike) == 1 and not model.curve.closed:
        result[hidden] = TrackObservation((match_whole(predicted[hidden], alike[0]),))
        rest = [one for one in rest if one is not alike[0]]
        for t in tentative:
            if any(match.observation is alike[0] for match in result[t].matches):
                result[t] = TrackObservation()
    return result, rest


def _are_alike(model: TrackModel, one: Observation, max_width_ratio: float, max_length_ratio: float) -> bool:
    """Return True if an observation may be the whole object: by its width, its length and its colour."""
    if one.curve_span != WHOLE or model.curve.closed != one.curve.closed:
        return False
    wider, longer = width_ratio(model.width, one.width), one.length / model.length_as_seen(one)
    similar = max(wider, 1.0 / wider) <= max_width_ratio and max(longer, 1.0 / longer) <= max_length_ratio
    return similar and not bool(colours_differ([model], [one])[0, 0])
