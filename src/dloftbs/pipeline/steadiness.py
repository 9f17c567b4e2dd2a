"""Signs that the tracks of a run are not those of objects but of a mask that breaks up."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from dloftbs.data.tracks import Track, TrackState

_MAX_IDS = 10_000
"""Number of tracks that are remembered: one that comes back after as many others were new counts again.

Source: by hand; some hundred kilobytes.
"""
_SHORT_FRAMES = 30
"""Life of a track that is short, frames.

Source: by hand; a second of most videos, and cables stay longer.
"""
_MIN_SHORT = 5
"""Number of short tracks below which they may be chance.

Source: by hand.
"""
_FLICKERING = 0.25
"""Share of frames in which the number of objects may change.

Source: by hand; what comes, goes or hides does so rarely.
"""
_MIN_FRAMES = 10
"""Number of frames with objects below which one number of objects is not yet the usual one.

Source: by hand; a third of a second of most videos.
"""
_USUAL = 0.8
"""Share of the frames with objects that have the usual number of them, at least.

Source: by hand; with fewer, objects come and go.
"""
_MAX_COUNTS = 1000
"""Largest number of objects in a frame that is distinguished from larger ones, which bounds the memory."""


class Steadiness:
    """Counts tracks, the short ones among them, and how often the number of objects changes.

    Its size does not grow with the stream.

    Parameters
    ----------
    objects : int, optional
        Number of objects, where the configuration states it.
    """

    def __init__(self, objects: int | None = None) -> None:
        self.tracks = 0
        self._is_known = objects is not None
        self._found: Counter[int] = Counter()  # frames by their number of objects
        self._frames = 0
        self._changes = 0
        self._short = 0  # of those no longer remembered
        self._count: int | None = None
        self._lives: dict[int, int] = {}  # frames by id, the oldest first
        self.shown: frozenset[int] = frozenset()

    def add(self, tracks: Sequence[Track], found: int) -> None:
        """Count the tracks of a frame, and the objects that were found in it."""
        self._frames += 1
        self._found[min(found, _MAX_COUNTS)] += 1
        self._changes += self._count not in (None, len(tracks))
        self._count = len(tracks)
        self.shown = frozenset(track.id for track in tracks if track.state is not TrackState.TENTATIVE)
        for number in sorted(self.shown):
            if number not in self._lives:
                self.tracks += 1
            self._lives[number] = self._lives.get(number, 0) + 1
        while len(self._lives) > _MAX_IDS:
            self._short += self._lives.pop(next(iter(self._lives))) < _SHORT_FRAMES

    def warning(self) -> str | None:
        """Return the signs of a broken mask; None if there are none."""
        ended = (life for number, life in self._lives.items() if number not in self.shown)
        short = self._short + sum(life < _SHORT_FRAMES for life in ended)
        signs = []
        if short >= _MIN_SHORT and 2 * short > self.tracks:
            total = f"{self.tracks} tracks in {self._frames} frames"
            signs.append(f"{total}, {short} of them for less than {_SHORT_FRAMES} frames")
        if self._frames >= _SHORT_FRAMES and self._changes > _FLICKERING * self._frames:
            signs.append(f"the number of objects changes in {self._changes} of {self._frames} frames")
        return f"{' and '.join(signs)}: the mask is probably broken" if signs else None

    def usual_number(self) -> tuple[int, str] | None:
        """Return the number of objects in nearly all frames, and the evidence in words, if few frames have more.

        None where there is no such number, no frame has more, or the number is known.
        """
        frames = self._frames - self._found[0]
        if self._is_known or frames < _MIN_FRAMES:
            return None
        usual = max(range(1, max(self._found) + 1), key=lambda number: self._found[number])
        more = sum(count for number, count in self._found.items() if number > usual)
        if not more or self._found[usual] < _USUAL * frames:
            return None
        objects, cables = ("object", "is one cable") if usual == 1 else ("objects", f"are {usual} cables")
        evidence = f"{usual} {objects} in {self._found[usual]} of {frames} frames, more in {more}"
        return usual, f"{evidence}; if there {cables}"
