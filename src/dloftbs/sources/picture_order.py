"""Order and times of the pictures of a video, by the times in its packets."""

from __future__ import annotations

from collections import deque
from fractions import Fraction
from typing import Any

_MAX_DUE = 256
"""Packets whose pictures are waited for: more than codecs reorder (16) and any number of cores decodes at a time."""


class PictureOrder:
    """Pictures that are still to come out of a decoder, and times of those that came.

    Where the clock of the stream begins anew, as in joined recordings, times go on from those before.

    Parameters
    ----------
    unit_s : Fraction
        Seconds per count of time.
    step_s : float
        Time from one picture to the next, seconds, for a clock that begins anew.
    """

    def __init__(self, unit_s: Fraction, step_s: float) -> None:
        self._start: int | None = None  # time of the first picture, even if that is lost
        self._unit_s = unit_s
        self._step_s = step_s
        self._due: deque[tuple[int, int]] = deque(maxlen=_MAX_DUE)
        self._clock = 0  # number of the clock that packets are counted by
        self._last_dts: int | None = None
        self._shown_clock = 0
        self._shift_s = 0.0
        self._seconds: float | None = None

    @property
    def left(self) -> int:
        """Pictures that did not come yet."""
        return len(self._due)

    def send(self, packet: Any) -> None:
        """Note a packet before it is decoded; one that is decoded for the sake of others alone has no picture."""
        if packet.dts is not None:
            if self._last_dts is not None and packet.dts < self._last_dts:
                self._clock += 1
            self._last_dts = packet.dts
        if packet.pts is not None and not packet.is_discard:
            self._due.append((self._clock, packet.pts))

    def come(self, time: int | None) -> tuple[int, float | None]:
        """Take a picture of a time.

        Returns
        -------
        passed : int
            Pictures that should have come before it, and did not.
        seconds : float or None
            Time at which it is shown, counted from the first picture, never less than of the picture before.
        """
        if time is None:
            return 0, None
        if self._start is None:
            self._start = min([time, *(due[1] for due in self._due if due[0] == 0)])
        key = next((due for due in self._due if due[1] == time), None)
        if key is None:
            return 0, self._shown(time, self._clock)
        passed = sum(due < key for due in self._due)
        self._due = deque((due for due in self._due if due > key), _MAX_DUE)
        return passed, self._shown(time, key[0])

    def _shown(self, time: int, clock: int) -> float:
        assert self._start is not None  # set with the first picture
        seconds = float((time - self._start) * self._unit_s)
        if clock > self._shown_clock and self._seconds is not None:
            self._shift_s = self._seconds + self._step_s - seconds
        self._shown_clock = max(clock, self._shown_clock)
        self._seconds = max(seconds + self._shift_s, self._seconds or 0.0)
        return self._seconds
