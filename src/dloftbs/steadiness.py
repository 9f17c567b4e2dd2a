"""Signs that the tracks of a run are not those of objects but of a mask that breaks up."""

from __future__ import annotations

from collections.abc import Sequence

from dloftbs.tracks import Track, TrackState

_MOST_IDS = 10_000
"""Number of tracks that are remembered: one that comes back after as many others were new counts again.

Source: by hand; some hundred kilobytes.
"""
_SHORT_FRAMES = 30
"""Life of a track that is short, frames.

Source: by hand; a second of most videos, and cables stay longer.
"""
_LEAST_SHORT = 5
"""Number of short tracks below which they may be chance.

Source: by hand.
"""
_FLICKERING = 0.25
"""Share of frames in which the number of objects may change.

Source: by hand; what comes, goes or hides does so rarely.
"""


class Steadiness:
    """Counts tracks, the short ones among them, and how often the number of objects changes.

    Its size does not grow with the stream.
    """

    def __init__(self) -> None:
        self.tracks = 0
        self._frames = 0
        self._changes = 0
        self._short = 0  # of those no longer remembered
        self._count: int | None = None
        self._lives: dict[int, int] = {}  # frames by id, the oldest first
        self.shown: frozenset[int] = frozenset()

    def add(self, tracks: Sequence[Track]) -> None:
        """Count the tracks of a frame."""
        self._frames += 1
        self._changes += self._count not in (None, len(tracks))
        self._count = len(tracks)
        self.shown = frozenset(track.id for track in tracks if track.state is not TrackState.TENTATIVE)
        for number in sorted(self.shown):
            if number not in self._lives:
                self.tracks += 1
            self._lives[number] = self._lives.get(number, 0) + 1
        while len(self._lives) > _MOST_IDS:
            self._short += self._lives.pop(next(iter(self._lives))) < _SHORT_FRAMES

    def warning(self) -> str | None:
        """Return what is strange about the tracks; None if nothing is."""
        ended = (life for number, life in self._lives.items() if number not in self.shown)
        short = self._short + sum(life < _SHORT_FRAMES for life in ended)
        signs = []
        if short >= _LEAST_SHORT and 2 * short > self.tracks:
            told = f"{self.tracks} tracks in {self._frames} frames"
            signs.append(f"{told}, {short} of them for less than {_SHORT_FRAMES} frames")
        if self._frames >= _SHORT_FRAMES and self._changes > _FLICKERING * self._frames:
            signs.append(f"the number of objects changes in {self._changes} of {self._frames} frames")
        if not signs:
            return None
        return f"{' and '.join(signs)}: the mask is probably broken; look at --stages"
