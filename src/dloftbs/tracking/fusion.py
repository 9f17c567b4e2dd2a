"""Fusion of the partial matches of one track: their inferred spans, and new objects of what is left."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

from dloftbs.observation import Observation, sample_curve
from dloftbs.tracking import loop_start
from dloftbs.tracking.partial_match import PartialMatch, hidden_spans
from dloftbs.tracking.reconstruction import VisiblePart


def collect_new_objects(
    unassigned: Sequence[Observation], parts: Sequence[Observation], observations: Sequence[Observation]
) -> list[Observation]:
    """Return the objects that start tracks: those of which no part is assigned."""
    left, counts = (Counter(part.detection_index for part in some) for some in (unassigned, parts))
    return [one for one in observations if left[one.detection_index] == counts[one.detection_index]]


def restart_loop(observation: Observation, u: float) -> Observation:
    """Return a loop that starts at the former `u`."""
    curve = loop_start.move_start(observation.curve, u)
    if curve is observation.curve:
        return observation
    points, length = sample_curve(curve)
    detection = None if observation.detection is None else replace(observation.detection, curve=curve)
    return observation._replace(curve=curve, points=points, length=length, detection=detection)


def gaps_on_track(match: PartialMatch) -> list[tuple[float, float]]:
    """Return the spans of a match that the detector inferred, in the track's ``u``."""
    (low, high), (first, last) = match.track_span, match.curve_span
    spans = [(max(a, first), min(b, last)) for a, b in match.observation.gaps]
    # The division comes first: its result is 1 at most, so that rounding never leads beyond the track's end.
    shares = [((a - first) / (last - first), (b - first) / (last - first)) for a, b in spans if b > a]
    return [(low + a * (high - low), low + b * (high - low)) for a, b in shares]


def merge_spans(spans: Sequence[tuple[float, float]]) -> tuple[tuple[float, float], ...]:
    """Return ascending spans, those that touch merged."""
    result: list[tuple[float, float]] = []
    for low, high in spans:
        if result and low <= result[-1][1]:
            result[-1] = (result[-1][0], max(high, result[-1][1]))
        else:
            result.append((low, high))
    return tuple(result)


def inferred_spans(matches: Sequence[PartialMatch]) -> tuple[tuple[float, float], ...]:
    """Return the spans of a track that are hidden, or that the detector inferred."""
    return merge_spans(sorted([*hidden_spans(matches), *(gap for match in matches for gap in gaps_on_track(match))]))


def visible_parts(matches: Sequence[PartialMatch]) -> list[VisiblePart]:
    """Return the visible parts of a track, in the image."""
    return [VisiblePart(match.observation.curve, match.track_span, match.curve_span) for match in matches]
