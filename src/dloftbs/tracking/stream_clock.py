"""Time of a stream: how long each frame took, and how much of that the stream had no frames."""

from __future__ import annotations

from collections import deque
from statistics import median_low
from typing import NamedTuple

from dloftbs.support.values import ROUNDING_S

_RECENT_FRAMES = 5
"""Number of frames whose median time is that of a frame.

Source: by hand; two pauses among them do not count.
"""


class Step(NamedTuple):
    """Time from a stream's last frame to the next one.

    Parameters
    ----------
    seconds : float
        0 if the next frame is the last one once more, negative if it comes before it.
    frameless_s : float
        Seconds of these in which further frames were due, and none came: the stream paused, or frames were dropped.
    """

    seconds: float
    frameless_s: float


class StreamClock:
    """Time of a stream by the stamps of its frames; those without one come between the stamps before and after.

    Parameters
    ----------
    frame_s : float
        Seconds that a frame without a stamp takes. No frame is due sooner.
    """

    def __init__(self, frame_s: float) -> None:
        self._frame_s = frame_s
        self._stamp: float | None = None
        self._assumed_s = 0.0  # by the frames without a stamp since then
        self._recent = deque[float](maxlen=_RECENT_FRAMES)

    @property
    def stamp(self) -> float | None:
        """The last stamp, None before the first one."""
        return self._stamp

    def step_to(self, stamp: float | None) -> Step:
        """Return the time from the last frame to a stamp, or to a frame without one."""
        seconds = self._frame_s
        if stamp is not None and self._stamp is not None:
            since_stamp = stamp - self._stamp
            if abs(since_stamp) <= ROUNDING_S:
                return Step(0.0, 0.0)
            # Frames without a stamp may have taken less than was assumed, but no frame takes no time.
            seconds = since_stamp if since_stamp < 0.0 else max(since_stamp - self._assumed_s, ROUNDING_S)
        # Until the stream has shown how long a frame takes, none is due.
        due = max(self._frame_s, median_low(self._recent) if self._recent else seconds)
        return Step(seconds, seconds - due if round(seconds / due) > 1 else 0.0)

    def advance(self, stamp: float | None) -> Step:
        """Go on to the next frame, and return the time that it took."""
        step = self.step_to(stamp)
        if stamp is None:
            self._assumed_s += step.seconds
        elif step.seconds:
            if self._stamp is not None:
                self._recent.append(step.seconds)
            self._stamp, self._assumed_s = stamp, 0.0
        return step
