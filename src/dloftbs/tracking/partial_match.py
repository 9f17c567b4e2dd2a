"""Matches of a frame's observations with tracks, span by span."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from dloftbs.data.curve import BSplineCurve
from dloftbs.data.tracks import SeenPart
from dloftbs.tracking.observation import Observation

WHOLE = (0.0, 1.0)
"""Share of a curve that is all of it.

Source: by definition.
"""

SAME_U = 1e-9
"""Difference in ``u`` below which two parameters are the same, units of ``u``.

Source: numerics.
"""


class PartialMatch(NamedTuple):
    """A span of a track that is seen on a span of an observation.

    Parameters
    ----------
    observation : Observation
        In the track's direction.
    track_span : (float, float)
        Interval of the track's ``u``; beyond 0 or 1 where the object is longer than was known.
    curve_span : (float, float)
        Interval of the observed curve's ``u``; of a loop, one turn from the track's start.
    """

    observation: Observation
    track_span: tuple[float, float]
    curve_span: tuple[float, float]

    @property
    def is_complete(self) -> bool:
        """True if the match is a whole detection, and nothing of the track is missing."""
        covers_track = self.track_span[0] <= 0.0 and self.track_span[1] >= 1.0
        return self.observation.curve.closed or (self.curve_span == WHOLE and covers_track)

    def within(self, low: float, high: float) -> PartialMatch:
        """Return the match with a span of the track as all of it."""
        first, last = [(edge - low) / (high - low) for edge in self.track_span]
        return PartialMatch(self.observation, (first, last), self.curve_span)

    def clip_to_track(self) -> PartialMatch:
        """Return the match without the parts beyond the known ends of the track."""
        (low, high), (first, last) = self.track_span, self.curve_span
        span = (max(low, 0.0), min(high, 1.0))
        if span == self.track_span:
            return self
        scale = (last - first) / (high - low)
        seen = first + (span[0] - low) * scale, last - (high - span[1]) * scale
        return PartialMatch(self.observation, span, seen)


class TrackObservation(NamedTuple):
    """The parts of a frame's observations that show one track.

    Parameters
    ----------
    matches : tuple of PartialMatch
        In the track's order.
    is_unambiguous : bool
        True if nothing else than the match, which shows the whole track, is near.
    apart_from : frozenset of int
        Ids of the tracks that it shares a detection with and is known to be another object than.
    scope : (float, float)
        Span of the track's former ``u`` that is left, seen or hidden and not absent: the ``u`` of the matches.
    """

    matches: tuple[PartialMatch, ...] = ()
    is_unambiguous: bool = False
    apart_from: frozenset[int] = frozenset()
    scope: tuple[float, float] = WHOLE

    @property
    def is_whole(self) -> bool:
        """True if the track is one whole detection."""
        return len(self.matches) == 1 and self.matches[0].is_complete

    def agrees_with(self, other: TrackObservation) -> bool:
        """Return whether both begin with the same detection, in the same direction."""
        one, two = self.matches[0].observation, other.matches[0].observation
        return one.detection_index == two.detection_index and one.backwards == two.backwards

    @property
    def detection_indices(self) -> set[int]:
        """Indices of the detections that show the track."""
        return {match.observation.detection_index for match in self.matches}


class VisibleCurve(NamedTuple):
    """Published curve of a track that may not be all of it: it ends where the visible part ends.

    Parameters
    ----------
    curve : BSplineCurve
    curve_3d : BSplineCurve or None
    inferred : tuple of (float, float)
        The intervals of its ``u`` that are hidden or bridged.
    confidence : float
        In 0..1.
    track_span : (float, float)
        Interval of the track's ``u`` that it covers.
    parts : tuple of SeenPart
        What the frame shows of it, if that is not one detection.
    """

    curve: BSplineCurve
    curve_3d: BSplineCurve | None
    inferred: tuple[tuple[float, float], ...]
    confidence: float
    track_span: tuple[float, float] = WHOLE
    parts: tuple[SeenPart, ...] = ()


def seen_parts(matches: Sequence[PartialMatch]) -> tuple[SeenPart, ...]:
    """Return the detections that some matches are of."""
    found = [(match.observation.detection, match.track_span, match.curve_span) for match in matches]
    return tuple([SeenPart(detection, *spans) for detection, *spans in found if detection is not None])


def hidden_spans(matches: Sequence[PartialMatch]) -> tuple[tuple[float, float], ...]:
    """Return the spans of a track's ``u`` that no match covers, ascending."""
    return tuple([(low, high) for low, high in _spans_between(matches) if high - low > SAME_U])


def hidden_before(matches: Sequence[PartialMatch]) -> list[float]:
    """Return the length of what no match covers of a track's ``u`` before each match, and after the last one."""
    return [high - low if high - low > SAME_U else 0.0 for low, high in _spans_between(matches)]


def _spans_between(matches: Sequence[PartialMatch]) -> Iterable[tuple[float, float]]:
    """Return the spans of a track's ``u`` before each match, and after the last one; they may be of no length."""
    spans = [match.track_span for match in matches]
    return zip([0.0, *[high for _, high in spans]], [*[low for low, _ in spans], 1.0], strict=True)


def are_consecutive(first: PartialMatch, second: PartialMatch) -> bool:
    """Return True if the detector also has the second match after the first, in the same direction."""
    one, other = first.observation, second.observation
    same = one.detection_index == other.detection_index and one.backwards == other.backwards
    return same and first.curve_span[1] <= second.curve_span[0]


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
