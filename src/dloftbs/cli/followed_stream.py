"""Streams that are followed from their sources to their results: what one and two views have in common."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from itertools import islice
from types import TracebackType
from typing import Any, Generic, TypeVar

from dloftbs.cli.input_options import InputOptions
from dloftbs.cli.stream_report import RunReport
from dloftbs.config import Config
from dloftbs.data.frame import Frame
from dloftbs.data.frame_result import FrameResult
from dloftbs.errors import SourceError
from dloftbs.sinks.overlay_pictures import MAX_FPS, MIN_FPS
from dloftbs.sources import Source
from dloftbs.support.overlap import Ahead, Behind

_FPS = 30.0
"""Of a recording that has no rate."""

Given = TypeVar("Given")
Own = TypeVar("Own", bound="FollowedStream[Any]")


@dataclass(frozen=True)
class StreamOptions:
    """Options of reading and following a stream.

    Parameters
    ----------
    inputs : InputOptions
    config : Config
    fps : float, optional
        Frames per second, for stamps; as the source says without it.
    every : int
        Every so manieth frame is used.
    limit : int, optional
        Number of frames used, at most.
    keep_messages : bool
        As `sources.open` has it.
    """

    inputs: InputOptions
    config: Config
    fps: float | None = None
    every: int = 1
    limit: int | None = None
    keep_messages: bool = False


class FollowedStream(ABC, Generic[Given]):
    """An open input and the report on it; a context manager that reads in its block, and closes what it reads.

    Subclasses open it, set the attributes, and say what to make of what was read.

    Attributes
    ----------
    source : Source
        Of the view whose results are written.
    report : RunReport
    options : StreamOptions
    """

    source: Source
    report: RunReport
    options: StreamOptions
    _nothing: str
    _read: Ahead[Given]
    _in_turn: bool = False

    @property
    def video_fps(self) -> float | None:
        """Frames per second of a video of those that are used; None where their stamps say when each is shown.

        A camera may be slower than it says, and frames of it are left out.
        """
        if self.source.live:
            return None
        rate = _FPS if self.source.fps is None else self.source.fps / self.options.every
        return min(max(rate, MIN_FPS), MAX_FPS)

    @property
    @abstractmethod
    def _skipped(self) -> int:
        """Number of frames that could not be read."""

    @abstractmethod
    def _result_of(self, given: Given) -> tuple[Frame, FrameResult]:
        """Return a frame and the result to write with it."""

    def __enter__(self: Own) -> Own:
        self._read.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._read.__exit__(kind, error, trace)
        self.report.skipped, self.report.missed = self._skipped, self._read.missed

    def check_frames(self) -> None:
        """Find out whether there was something to follow.

        Raises
        ------
        SourceError
            If no frame could be read, or no moment that both streams have.
        """
        if not self.report.frames:
            raise SourceError(self._nothing)

    def follow(
        self,
        write: Callable[[Frame, FrameResult], None],
        *,
        shown: Callable[[RunReport], None] = lambda report: None,
        stop: Callable[[], bool] = lambda: False,
    ) -> None:
        """Track from frame to frame, or from moment to moment.

        Parameters
        ----------
        write : callable
            Takes each frame and its result.
        shown : callable
            Takes the report after each frame.
        stop : callable
            Asked after each frame whether to end.

        Raises
        ------
        KeyboardInterrupt
            If it was stopped; what was read until then is written.
        DloftbsError, Failure
            As the sources and `write` do.
        """

        def add(done: tuple[Frame, FrameResult]) -> None:
            write(*done)
            self.report.skipped = self._skipped
            self.report.add(done[1])
            shown(self.report)

        with Behind(add, in_turn=self._in_turn) as written:
            for given in islice(self._read, self.options.limit):
                written.put(self._result_of(given))
                if stop():
                    raise KeyboardInterrupt
