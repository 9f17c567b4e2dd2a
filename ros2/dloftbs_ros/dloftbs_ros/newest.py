"""The newest frames on their way from the thread that receives to the one that computes."""

from __future__ import annotations

import threading
from collections import deque
from time import monotonic
from typing import Generic, TypeVar

T = TypeVar("T")

PATIENCE_S = 0.02
"""Longest wait of an item behind which a newer one has come. Transports deliver in bursts: where computing keeps up
with the camera on average, each frame of a burst is answered; where it does not, curves are no older than this for the
waiting. It is less than the period of a camera at 30 frames a second."""


class Newest(Generic[T]):
    """Hands over items in their order; the newest waits for as long as it takes, an older one gives way in time.

    Parameters
    ----------
    max_rate : float
        Items a second that are taken in at most; 0: all.

    Attributes
    ----------
    dropped : int
        Items that waited for longer than `PATIENCE_S` while a newer one was there.
    skipped : int
        Items that came sooner than the rate allows.
    """

    def __init__(self, max_rate: float = 0.0) -> None:
        self._period = 1.0 / max_rate if max_rate else 0.0
        self._due = 0.0
        self._items: deque[tuple[float, T]] = deque()
        self._closed = False
        self._changed = threading.Condition()
        self.dropped = 0
        self.skipped = 0

    def put(self, item: T, now: float | None = None) -> None:
        """Take an item in; `now`, in seconds, is the clock's unless it is given."""
        now = monotonic() if now is None else now
        with self._changed:
            if now < self._due:
                self.skipped += 1
                return
            # From when it was due, so that a camera of 30 a second gives 10 of 10 and not 7.5; never from long ago.
            self._due = max(self._due + self._period, now)
            self._items.append((now, item))
            self._drop(now)
            self._changed.notify()

    def take(self, now: float | None = None) -> T | None:
        """Wait for an item and return it; None once it is closed."""
        with self._changed:
            self._changed.wait_for(lambda: self._closed or self._items)
            if self._closed:
                return None
            self._drop(monotonic() if now is None else now)
            return self._items.popleft()[1]

    def close(self) -> None:
        """Let whoever waits go on."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()

    def _drop(self, now: float) -> None:
        """Drop what waited for too long, but for the newest."""
        while len(self._items) > 1 and now - self._items[0][0] > PATIENCE_S:
            self._items.popleft()
            self.dropped += 1
