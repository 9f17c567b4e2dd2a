"""Pause, step, loop and pace of frames that are shown."""

from __future__ import annotations

from threading import Condition
from time import monotonic


class Playback:
    """Says when the next frame is due. One thread waits for its turn, others steer.

    Parameters
    ----------
    fps : float, optional
        Rate at which frames are let through; None is as fast as they come.
    needs_viewers : bool
        Whether to wait while nobody looks.
    """

    def __init__(self, fps: float | None, *, needs_viewers: bool) -> None:
        self._period_s = 0.0 if fps is None else 1.0 / fps
        self._needs_viewers = needs_viewers
        self._changed = Condition()
        self._due = 0.0
        self._steps = 0
        self._closed = self._restarting = False
        self.viewers = 0
        self.paused = False
        self.loop = False

    def steer(
        self, *, paused: bool | None = None, loop: bool | None = None, viewers: int | None = None, steps: int = 0
    ) -> None:
        """Change what is given; a step holds the playback after it."""
        with self._changed:
            self.loop = self.loop if loop is None else loop
            self.viewers = self.viewers if viewers is None else viewers
            self.paused = self.paused if paused is None else paused
            if steps:
                self.paused = True
                self._steps += steps
            elif paused is not None:
                self._steps = 0
            self._changed.notify_all()

    def restart(self) -> None:
        """Begin at the first frame."""
        with self._changed:
            self._restarting = True
            self._changed.notify_all()

    def close(self) -> None:
        """Let nothing through any more."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()

    @property
    def closed(self) -> bool:
        """True once it is closed."""
        return self._closed

    def wait_turn(self) -> bool:
        """Wait until the next frame is due; False if it is not wanted, since all begins anew or ends."""
        with self._changed:
            while not self._interrupted:
                if not self._held:
                    wait = self._due - monotonic()
                    if wait <= 0.0:
                        self._pass()
                        return True
                    self._changed.wait(wait)
                else:
                    self._changed.wait()
            return False

    def wait_for_restart(self) -> bool:
        """Wait at the end until all is to begin anew; False if it is closed."""
        with self._changed:
            self._changed.wait_for(lambda: self._interrupted or self.loop)
            self._restarting = False
            return not self._closed

    @property
    def _interrupted(self) -> bool:
        return self._closed or self._restarting

    @property
    def _held(self) -> bool:
        alone = self._needs_viewers and self.viewers == 0
        return alone or (self.paused and self._steps == 0)

    def _pass(self) -> None:
        self._steps = max(0, self._steps - 1)
        # From the time that was due, so that the rate is kept; from now on, where that was long ago.
        self._due = max(self._due + self._period_s, monotonic())
