"""The newest frame on its way from the thread that receives to the one that computes."""

from __future__ import annotations

import threading
from time import monotonic
from typing import Generic, TypeVar

T = TypeVar("T")


class Newest(Generic[T]):
    """Holds one item: a newer one takes its place, and that is counted.

    Parameters
    ----------
    max_rate : float
        Items a second that are taken in at most; 0: all.

    Attributes
    ----------
    dropped : int
        Items whose place a newer one took before anybody asked for them.
    skipped : int
        Items that came sooner than the rate allows.
    """

    def __init__(self, max_rate: float = 0.0) -> None:
        self._period = 1.0 / max_rate if max_rate else 0.0
        self._due = 0.0
        self._item: T | None = None
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
            self.dropped += self._item is not None
            self._item = item
            self._changed.notify()

    def take(self) -> T | None:
        """Wait for an item and return it; None once it is closed."""
        with self._changed:
            self._changed.wait_for(lambda: self._closed or self._item is not None)
            item, self._item = self._item, None
            return None if self._closed else item

    def close(self) -> None:
        """Let whoever waits go on."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
