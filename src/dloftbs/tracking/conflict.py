"""Conflict of a track with what is seen: a detection that contradicts it, or that it shares with another track."""

from __future__ import annotations

from dataclasses import dataclass

from dloftbs.tracking.observation import Observation
from dloftbs.tracking.partial_match import WHOLE

_SAME_SHARE = 0.01
"""Difference of two lengths that are the same, as a share of the length.

Source: by hand; a curve's noise from frame to frame.
"""

_SAME_WIDTHS = 0.75
"""The same in addition, widths.

Source: by hand; an end's noise from frame to frame.
"""


@dataclass(slots=True, eq=False)
class Conflict:
    """Counts of the frames in which a track was contradicted.

    Parameters
    ----------
    frames : int
        Number of frames with a detection that contradicts the track, less those without.
    length_px : float
        Length of that detection, which alone shows the object.
    """

    frames: int = 0
    length_px: float = 0.0

    def clear(self) -> None:
        """Forget the frames so far."""
        self.frames = 0

    def count(self, observation: Observation, width: float, *, is_small: bool) -> None:
        """Count a frame in which an observation, part of the object or more than it, contradicts the track.

        It counts only if its length stays the same: an occluder may move. A small contradiction in length counts twice:
        a wrong end was probably adopted before.
        """
        if self.frames == 0 or self._is_same(observation, width):
            if self.frames == 0:
                self.length_px = observation.object_length
            self.frames += 2 if is_small else 1
        else:
            self.frames = max(self.frames - 1, 0)

    def is_with(self, observation: Observation, width: float) -> bool:
        """Return True if an observation, which is a whole detection, is the one that contradicts the track."""
        return observation.curve_span == WHOLE and self._is_same(observation, width)

    def _is_same(self, observation: Observation, width: float) -> bool:
        length = observation.object_length
        return abs(length - self.length_px) < _SAME_SHARE * length + _SAME_WIDTHS * width
