"""Separation: an object that was seen as a whole and is now seen as two, with nothing of it missing, was cut.

What hides a part of an object takes visible length away from it. Where the visible parts are together as long as the
object was, nothing is hidden, and the gap between them is one between two objects.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from dloftbs.tracking.frame_view import View
from dloftbs.tracking.length_record import MIN_SEEN_FRAMES
from dloftbs.tracking.partial_match import WHOLE, PartialMatch, TrackObservation

_NOISE_SHARE = 0.5
"""Share of a length's tolerance by which a gap must be longer than whatever was missing, ratio.

Source: by hand; the noise of the lengths of two parts.
"""

_TREND_FRAMES = 16
"""Number of frames from which is known how the length grows, as of a cable that tilts or comes nearer.

Source: by hand; half a second at 30 per second.
"""


@dataclass(slots=True)
class Separation:
    """Evidence that a track is two objects.

    Parameters
    ----------
    whole_px : list of float
        Lengths of the object in the last frames that showed it from end to end without a gap; empty if something of it
        was missing since.
    since : int
        Number of frames since.
    missing_px : float
        Largest difference from the last few of these lengths since.
    frames : int
        Number of frames in a row, to the last one, that showed two parts which are together as long.
    """

    whole_px: list[float] = field(default_factory=list)
    since: int = 0
    missing_px: float = 0.0
    frames: int = 0

    def forget(self) -> None:
        """Forget what was seen so far."""
        self.whole_px, self.since, self.missing_px, self.frames = [], 0, 0.0, 0

    def see_whole(self, length: float) -> None:
        """Record the length of the object as a frame shows it from end to end, without a gap."""
        self.whole_px, self.since, self.missing_px = [*self.whole_px[1 - _TREND_FRAMES :], length], 0, 0.0

    @property
    def growth_px(self) -> float:
        """Growth of the length since, if it grows on as it did before."""
        return self.since * max(float(np.polyfit(np.arange(len(self.whole_px)), self.whole_px, 1)[0]), 0.0)

    def find_cut(
        self, shown: TrackObservation, tolerance_px: float, width: float, view: View
    ) -> tuple[TrackObservation, TrackObservation] | None:
        """Return what a frame shows of the two objects that one was cut into, the longer one first; None if it is one.

        Parameters
        ----------
        shown : TrackObservation
            What it shows of the one.
        tolerance_px : float
            Of its length.
        width : float
            Of the one, px; NaN if it is unknown.
        view : View
        """
        matches = shown.matches
        if not matches or shown.scope != WHOLE or matches[0].observation.curve.closed:
            self.forget()
            return None
        self.since, self.frames = self.since + 1, self.frames + 1
        if len(matches) == 1 and matches[0].is_complete and not matches[0].observation.gaps:
            self.frames = 0
            return None
        if len(self.whole_px) < MIN_SEEN_FRAMES:
            self.forget()
            return None
        parts = [part for match in matches for part in _split_at_gaps(match)]
        gaps = [math.dist(one.observation.points[-1], other.observation.points[0]) for one, other in pairwise(parts)]
        longest = max(gaps, default=0.0)
        at = gaps.index(longest) + 1 if gaps else 0
        lengths = [sum(part.observation.length for part in side) for side in (parts[:at], parts[at:])]
        usual = statistics.median(self.whole_px[-MIN_SEEN_FRAMES:])  # the last one may have lost an end already
        self.missing_px = max(self.missing_px, abs(sum(lengths) - usual))
        # An end that comes out beyond what hid it is short at first.
        if self.missing_px > tolerance_px or min(lengths) < longest or _is_cut(parts, width, view):
            self.forget()
            return None
        self.frames = self.frames if longest > self.missing_px + self.growth_px + _NOISE_SHARE * tolerance_px else 0
        if self.frames < MIN_SEEN_FRAMES:
            return None
        sides = _show(parts[:at], (0.0, parts[at - 1].track_span[1])), _show(parts[at:], (parts[at].track_span[0], 1.0))
        return sides if lengths[0] >= lengths[1] else sides[::-1]


def _show(parts: Sequence[PartialMatch], scope: tuple[float, float]) -> TrackObservation:
    return TrackObservation(tuple(part.within(*scope) for part in parts), scope=scope)


def _is_cut(parts: Sequence[PartialMatch], width: float, view: View) -> bool:
    """Return True if the image's border or something that hides the rest may cut any of some parts."""
    return any(end.is_cut for part in parts for end in view.ends(part.observation, width))


def _split_at_gaps(match: PartialMatch) -> list[PartialMatch]:
    """Return the parts of a match between the gaps that the detector bridged."""
    (low, high), (first, last) = match.track_span, match.curve_span
    inside = [gap for gap in match.observation.gaps if first < gap[0] and gap[1] < last]
    edges = [first, *(edge for gap in inside for edge in gap), last]
    scale = (high - low) / (last - first)
    return [
        PartialMatch(match.observation.between(a, b), (low + (a - first) * scale, low + (b - first) * scale), (a, b))
        for a, b in zip(edges[::2], edges[1::2], strict=True)
    ]
