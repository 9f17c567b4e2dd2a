"""Curves live over their video, for `dloftbs view` and `dloftbs track --view`."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable, Generator, Iterable
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from threading import Event, Thread
from time import monotonic, sleep
from typing import Any

from dloftbs.config import Config
from dloftbs.data.frame import Frame
from dloftbs.data.frame_result import FrameResult
from dloftbs.errors import InputError
from dloftbs.pipeline import Pipeline
from dloftbs.pipeline.steadiness import Steadiness
from dloftbs.support.arrays import ByteArray
from dloftbs.support.overlap import Ahead
from dloftbs.ui.advice import set_cables
from dloftbs.ui.audience import Audience
from dloftbs.ui.messages import Ack, Loop, Pause, Restart, SetObjects, Step, TuneMessage, ViewMessage
from dloftbs.ui.payload import describe
from dloftbs.ui.playback import Playback
from dloftbs.ui.viewer import Viewer
from dloftbs.ui.wire import encode_jpeg, encode_picture
from dloftbs.viz.overlay import as_picture
from dloftbs.viz.style import Style

DEFAULT_FPS = 30.0
"""Rate at which a recording that does not tell its own is shown, frames/s."""
_RATE_OVER = 30  # frames
_PATIENCE_S = 2.0
_POLL_S = 0.02

Process = Callable[[Frame], FrameResult]


class ViewFeed:
    """Shows what is published: the newest frame and its curves, to each browser at its own pace.

    Parameters
    ----------
    name : str
        Of the source.
    length : int, optional
        Number of frames, if known.
    live : bool
        Whether frames come at their own pace.
    objects : int, optional
        Number of cables, where it is known.
    """

    has_controls = False

    def __init__(self, name: str, *, length: int | None = None, live: bool = False, objects: int | None = None) -> None:
        self._name, self._length, self._live = name, length, live
        self.audience = Audience()
        self.visited = Event()
        self._shown: _Shown | None = None
        self._count = 0
        self._ended = False
        self._error: str | None = None
        self._objects = objects
        self._steadiness = Steadiness(objects)
        self._warnings: list[str] = []
        self._times: deque[float] = deque(maxlen=_RATE_OVER)
        self._sent: dict[Viewer, tuple[int, float]] = {}
        self._delays: dict[Viewer, float] = {}
        self._painted: dict[Viewer, int] = {}
        self._pool = ThreadPoolExecutor(1, "dloftbs-encoding")

    def publish(self, frame: Frame, result: FrameResult) -> None:
        """Show a frame with its curves. Takes no time: pictures are encoded elsewhere, and only those that are sent."""
        self._times.append(monotonic())
        self._count += 1
        self._steadiness.add(result.tracks, len(result))
        self._shown = _Shown(self._count, frame, result, monotonic() - 1e-3 * result.total_ms, self._rate())
        if self._count % _RATE_OVER == 0:
            self._look_for_warnings()
        self.audience.refresh()

    def _look_for_warnings(self) -> None:
        usual = self._steadiness.usual_number()
        cables = set_cables(self._steadiness) if self.has_controls else usual and usual[1].replace("; if", "; perhaps")
        warnings = [text for text in (self._steadiness.warning(), cables) if text is not None]
        if warnings != self._warnings:
            self._warnings = warnings
            self.tell_state()

    def end(self, error: str | None = None) -> None:
        """Say that nothing follows, and why, if something went wrong."""
        self._ended, self._error = True, error
        self._look_for_warnings()
        self.tell_state()

    def finish(self) -> None:
        """Say that nothing follows, and give the browsers a moment to paint the last picture."""
        self.end()
        until = monotonic() + _PATIENCE_S
        while self._shown is not None and monotonic() < until:
            if all(self._painted.get(viewer) == self._shown.number for viewer in self.audience):
                return
            sleep(_POLL_S)

    def _rate(self) -> float:
        if len(self._times) < 2:
            return 0.0
        return (len(self._times) - 1) / max(self._times[-1] - self._times[0], 1e-6)

    def state(self) -> dict[str, Any]:
        """Return how things stand, as the page shows it."""
        return {
            "mode": "view",
            "name": self._name,
            "live": self._live,
            "length": self._length,
            "controls": self.has_controls,
            "paused": False,
            "loop": False,
            "ended": self._ended,
            "error": self._error,
            "warnings": self._warnings,
            "objects": self._objects,
        }

    def tell_state(self) -> None:
        """Send all browsers how things stand."""
        self.audience.tell("state", **self.state())

    def open(self, loop: asyncio.AbstractEventLoop) -> None:
        """Begin, see `Session`."""
        self.audience.open(loop)

    def join(self, viewer: Viewer) -> None:
        """Show a browser what is there."""
        self.audience.add(viewer)
        self.visited.set()
        self.tell_state()
        viewer.refresh()

    def leave(self, viewer: Viewer) -> None:
        """Forget a browser."""
        self.audience.remove(viewer)
        self._sent.pop(viewer, None)
        self._delays.pop(viewer, None)
        self._painted.pop(viewer, None)

    def handle(self, viewer: Viewer, message: TuneMessage | ViewMessage) -> None:
        """Do what a message asks.

        Raises
        ------
        InputError
            If this page cannot do that.
        """
        if not isinstance(message, Ack):
            raise InputError(f"this page does not take the message {type(message).__name__}")
        self._painted[viewer] = message.number
        number, since = self._sent.get(viewer, (-1, 0.0))
        if number == message.number:
            self._delays[viewer] = 1e3 * (monotonic() - since)
        if self._shown is not None and self._shown.number != number:  # a newer one has come meanwhile
            viewer.refresh()

    async def render(self, viewer: Viewer) -> tuple[int, bytes] | None:
        """Return the newest picture, unless this browser has it."""
        shown = self._shown
        if shown is None or self._sent.get(viewer, (-1, 0.0))[0] == shown.number:
            return None
        self._sent[viewer] = (shown.number, shown.since)
        extra = {"delay_ms": self._delays.get(viewer), "viewers": len(self.audience)}
        data = await asyncio.get_running_loop().run_in_executor(self._pool, shown.encode, extra)
        return shown.number, data

    def close(self) -> None:
        """End."""
        self.audience.close()
        self._pool.shutdown(wait=False)


class _Shown:
    """One published frame; encoded once, in the encoding thread, when the first browser asks for it."""

    def __init__(self, number: int, frame: Frame, result: FrameResult, since: float, rate: float) -> None:
        self.number, self.since = number, since
        self._frame, self._result, self._rate = frame, result, rate
        self._made: tuple[dict[str, Any], bytes] | None = None

    def encode(self, extra: dict[str, Any]) -> bytes:
        """Return the picture with what concerns one browser alone."""
        if self._made is None:
            picture: ByteArray = as_picture(self._frame, Style())
            header = {
                **describe(self._result),
                "number": self.number,
                "rate": round(self._rate, 1),
                "name": self._frame.name,
            }
            self._made = header, encode_jpeg(picture)
        header, image = self._made
        return encode_picture({**header, **extra}, {"image": image})


class ViewSession(ViewFeed):
    """Runs frames through a pipeline at the pace of their source, and shows them; pause, step, loop.

    A recording waits until somebody looks. Of a camera the newest frame is taken.

    Parameters
    ----------
    frames : iterable of Frame
        Iterated again to begin anew, unless live.
    config : Config
        Of the pipeline, a new one for each pass; the page may change its number of cables.
    name, length, live
        As for `ViewFeed`.
    fps : float, optional
        Of a recording.
    """

    has_controls = True

    def __init__(
        self,
        frames: Iterable[Frame],
        config: Config,
        name: str,
        *,
        length: int | None = None,
        live: bool = False,
        once: bool = False,
        fps: float | None = None,
    ) -> None:
        super().__init__(name, length=length, live=live, objects=config.linking.objects)
        self._frames, self._config = frames, config
        self._once = live or once
        self._playback = Playback(None if live else fps or DEFAULT_FPS, needs_viewers=not live)
        self._failure: BaseException | None = None
        self._thread = Thread(target=self._run, name="dloftbs-view", daemon=True)

    def state(self) -> dict[str, Any]:
        """Return how things stand, as the page shows it."""
        return {**super().state(), "paused": self._playback.paused, "loop": self._playback.loop}

    def open(self, loop: asyncio.AbstractEventLoop) -> None:
        """Begin to read."""
        super().open(loop)
        self._thread.start()

    def join(self, viewer: Viewer) -> None:
        """Show a browser what is there, and go on if it is the first."""
        super().join(viewer)
        self._playback.steer(viewers=len(self.audience))

    def leave(self, viewer: Viewer) -> None:
        """Forget a browser, and wait if it was the last."""
        super().leave(viewer)
        self._playback.steer(viewers=len(self.audience))

    def handle(self, viewer: Viewer, message: TuneMessage | ViewMessage) -> None:
        """Do what a message asks.

        Raises
        ------
        InputError
            If this page cannot do that.
        ConfigError
            If the number of cables does not go with the other settings.
        """
        match message:
            case Pause():
                self._playback.steer(paused=message.paused)
            case Step():
                self._playback.steer(steps=1)
            case Loop():
                self._playback.steer(loop=message.loop)
            case Restart():
                if self._once:
                    raise InputError("a stream has no beginning to go back to")
                self._playback.restart()
            case SetObjects():
                self._config = self._config.replace({"linking.objects": message.objects})
                self._objects = message.objects
            case _:
                super().handle(viewer, message)
                return
        self.tell_state()

    def close(self) -> None:
        """End, and wait for the frame at hand."""
        self._playback.close()
        if self._thread.is_alive():
            self._thread.join(_PATIENCE_S)
        super().close()

    def wait(self, timeout_s: float) -> bool:
        """Wait for some time; False once nothing can follow. Raises what ended the run, if anything did."""
        self._thread.join(timeout_s)
        if self._failure is not None:
            raise self._failure
        return self._thread.is_alive()

    def _run(self) -> None:
        try:
            while True:
                whole = self._one_pass()
                if whole and (self._once or not self._playback.loop):
                    self.end()
                if self._once or not self._playback.wait_for_restart():
                    return
                self._ended = False
                self.tell_state()
        except BaseException as error:  # noqa: BLE001 - it is raised by `wait`
            self._failure = error
            self.end(str(error))

    def _one_pass(self) -> bool:
        """Show the frames from the first on; False if that was interrupted."""
        config = self._config
        process = self._begin(config)
        with Ahead(_all_of(self._frames), newest=self._live) as read, closing(_all_of(read)) as frames:
            for frame in frames:
                if not self._playback.wait_turn():
                    return False
                if self._config != config:
                    config = self._config
                    process = self._begin(config)
                self.publish(frame, process(frame))
        return True

    def _begin(self, config: Config) -> Process:
        """Return what follows cables from the next frame on; what was strange before is no longer."""
        self._steadiness = Steadiness(config.linking.objects)
        return Pipeline(config).process


def _all_of(frames: Iterable[Frame]) -> Generator[Frame, None, None]:
    yield from frames
