"""Missing parts of a track: hidden, absent, or none, if the whole object is seen."""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from dloftbs.data.curve_samples import U
from dloftbs.tracking.alignment import find_whole_view
from dloftbs.tracking.frame_view import View
from dloftbs.tracking.length_record import MIN_SEEN_FRAMES
from dloftbs.tracking.partial_match import SAME_U, PartialMatch, TrackObservation, are_consecutive, hidden_spans
from dloftbs.tracking.reading_features import Reading
from dloftbs.tracking.track_model import TrackModel

_SPAN_SHARES = np.linspace(0.0, 1.0, 9)
"""Places of the samples of a span whose median is taken, as shares of it.

Source: bounds time; an odd number, so that it is one of them.
"""


def resolve(models: Sequence[TrackModel], shown: Reading, view: View) -> dict[int, TrackObservation]:
    """Resolve what is missing of each track: hidden, absent, or nothing, since the frame shows the whole object."""
    claims = [index for one in shown.values() if not one.is_unambiguous for index in one.detection_indices]
    return {
        model.id: one if one.is_unambiguous else _resolve(model, one, claims, view)
        for model in models
        if (one := shown.get(model.id)) is not None
    }


def _resolve(model: TrackModel, shown: TrackObservation, claims: Sequence[int], view: View) -> TrackObservation:
    """Return what is missing of one track; `claims` are the detections that show each of the tracks."""
    (index, *others), first = shown.detection_indices, shown.matches[0]
    if not others and claims.count(index) == 1:
        whole = find_whole_view(model, first.observation, first.track_span[0], view)
        shown = shown if whole is None else shown._replace(matches=(whole,))
    return _drop_absent_spans(model, shown)


def _drop_absent_spans(model: TrackModel, shown: TrackObservation) -> TrackObservation:
    """Return what belongs to a track.

    A span that is not seen is assumed hidden if it was seen in enough frames before, and hangs together with the
    visible part by more than a stretch that every frame so far has inferred. A gap that the detector bridges is not
    questioned. Matches that are connected by an absent span only are no parts of one track: the longest group stays.
    """
    matches = shown.matches
    bridged = {
        (one.track_span[1], next_.track_span[0]) for one, next_ in pairwise(matches) if are_consecutive(one, next_)
    }
    questioned = [span for span in hidden_spans(matches) if span not in bridged]
    absent = [part for span in questioned if (part := _absent_part(model, span)) is not None]
    if not absent:
        return shown
    kept = max(_split_at(matches, absent), key=lambda group: sum(m.track_span[1] - m.track_span[0] for m in group))
    low = max((high for _, high in absent if high <= kept[0].track_span[0] + SAME_U), default=0.0)
    high = min((low for low, _ in absent if low >= kept[-1].track_span[1] - SAME_U), default=1.0)
    return shown._replace(matches=tuple(match.within(low, high) for match in kept), scope=(low, high))


def _absent_part(model: TrackModel, span: tuple[float, float]) -> tuple[float, float] | None:
    """Return the part of a span that is assumed absent: at an end of the track, from the first unseen stretch on."""
    if _median_seen_frames(model, span) < MIN_SEEN_FRAMES:
        return span
    unseen = [(low, high) for low, high in model.sight.unseen_spans if low < span[1] and high > span[0]]
    if not unseen:
        return None
    if span[0] <= 0.0:
        return 0.0, min(unseen[-1][1], span[1])
    if span[1] >= 1.0:
        return max(unseen[0][0], span[0]), 1.0
    return span


def _split_at(matches: Sequence[PartialMatch], absent: Sequence[tuple[float, float]]) -> list[list[PartialMatch]]:
    """Return the matches in groups, split where a span is absent."""
    groups: list[list[PartialMatch]] = [[]]
    for match in matches:
        if groups[-1] and any(abs(match.track_span[0] - high) < SAME_U for _, high in absent):
            groups.append([])
        groups[-1].append(match)
    return groups


def _median_seen_frames(model: TrackModel, span: tuple[float, float]) -> float:
    """Return the median number of frames, bounded, in which the samples of a span were seen."""
    at = span[0] + _SPAN_SHARES * (span[1] - span[0])
    return statistics.median(np.interp(at, U, model.sight.seen_frames).tolist())
