"""The newest frames on their way from the thread that receives to the one that computes."""

from __future__ import annotations

import threading
from collections import deque
from statistics import median
from time import monotonic
from typing import Generic, TypeVar

T = TypeVar("T")

KEEPS_UP_S = 0.02
"""Longest time of a computation that catches up with a camera of 30 a second after a burst; with a longer one, the
newest item does not wait."""
PATIENCE_S = 0.05
"""Longest wait of the newest item for older ones. Transports deliver in bursts, of ten after a stall of a third of
a second: each frame of these is answered where that takes no longer."""
MAX_WAITING = 10
"""Items that wait behind the newest at most, however fast they are computed: 28 MB of HD."""
_REMEMBERED = 9
"""Computations of which the median is the time that one takes: a stall of the machine is not taken for it."""


class Newest(Generic[T]):
    """Hands over items in their order, and drops older ones where the newest would wait for them too long.

    The time between two calls of `take` is what an item takes; as long as that is not known, the newest wins.

    Parameters
    ----------
    max_rate : float
        Items a second that are taken in at most; 0: all.

    Attributes
    ----------
    dropped : int
        Items that nobody got, since a newer one would have waited for longer than `PATIENCE_S`.
    skipped : int
        Items that came sooner than the rate allows.
    """

    def __init__(self, max_rate: float = 0.0) -> None:
        self._period = 1.0 / max_rate if max_rate else 0.0
        self._due = 0.0
        self._items: deque[T] = deque()
        self._taken: float | None = None
        self._busy_s: deque[float] = deque(maxlen=_REMEMBERED)
        self._most_waiting = 0
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
            self._items.append(item)
            self._drop()
            self._changed.notify()

    def take(self, now: float | None = None) -> T | None:
        """Wait for an item and return it; None once it is closed. `now` is as in `put`."""
        with self._changed:
            if self._taken is not None:
                self._busy_s.append((monotonic() if now is None else now) - self._taken)
                busy_s = max(median(self._busy_s), 1e-6)
                self._most_waiting = min(MAX_WAITING, int(PATIENCE_S / busy_s)) if busy_s <= KEEPS_UP_S else 0
            self._changed.wait_for(lambda: self._closed or self._items)
            if self._closed:
                return None
            self._drop()
            self._taken = monotonic() if now is None else now
            return self._items.popleft()

    def close(self) -> None:
        """Let whoever waits go on."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()

    def _drop(self) -> None:
        while len(self._items) - 1 > self._most_waiting:
            self._items.popleft()
            self.dropped += 1
