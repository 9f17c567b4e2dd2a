"""Interface of every source of frames."""

from __future__ import annotations

import logging
from abc import ABC, abstractmethod
from collections.abc import Iterator
from types import TracebackType
from typing import TypeVar

from dloftbs.data.frame import Frame
from dloftbs.errors import SourceError
from dloftbs.support.values import shown

logger = logging.getLogger("dloftbs.sources")

S = TypeVar("S", bound="Source")


class Source(ABC):
    """A stream of frames: iterate over it, and close it, or let ``with`` do so.

    A subclass sets the attributes, and gives `__iter__`. Frames come one at a time; none is kept.

    Attributes
    ----------
    name : str
        For messages: a path, an address, ``"camera 0"``.
    fps : float or None
        Frames per second, None where unknown.
    length : int or None
        Number of frames, None where unknown.
    length_is_estimate : bool
        Whether there may be more frames than `length`, or fewer: containers of videos count wrongly.
    skipped : int
        Frames that could not be read so far, counted afresh by each iteration. Each leaves a hole in the indices, and
        is reported by a warning of the logger ``dloftbs.sources``.
    has_depth : bool
        Whether the source brings depth of its own.
    live : bool
        Whether frames come at their own pace: who is too slow does better to leave some out than to fall behind.
    single_pass : bool
        Whether it can be iterated over only once, as a camera or an address.
    """

    name: str
    fps: float | None = None
    length: int | None = None
    length_is_estimate: bool = False
    skipped: int = 0
    has_depth: bool = False
    live: bool = False
    single_pass: bool = False
    _closed: bool = False

    @property
    def exact_length(self) -> int | None:
        """Number of frames where it is known for sure."""
        return None if self.length_is_estimate else self.length

    @abstractmethod
    def __iter__(self) -> Iterator[Frame]:
        """Yield the frames, from the beginning where the source can go back to it."""

    def __repr__(self) -> str:
        return f"{type(self).__name__}({shown(self.name)}{'' if self.length is None else f', {self.length} frames'})"

    def close(self) -> None:
        """Let go of files and devices; an iteration under way ends. Closing twice does no harm."""
        self._closed = True

    def __enter__(self: S) -> S:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _begin(self) -> None:
        """Start an iteration.

        Raises
        ------
        SourceError
            If the source is closed.
        """
        if self._closed:
            raise SourceError(f"{self.name} is closed")
        self.skipped = 0

    def _skip(self, what: str, why: object, count: int = 1) -> None:
        self.skipped += count
        logger.warning("skipped %s: %s", what, why)


class ReadSource(Source):
    """A source of this package: a subclass gives `_frames`, the frames of an iteration that has begun."""

    def __iter__(self) -> Iterator[Frame]:
        """Yield the frames. What cannot be read is skipped, or ends the stream, and is reported.

        Raises
        ------
        SourceError
            If the source is closed, or nothing of it can be read.
        """
        self._begin()
        return self._frames()

    @abstractmethod
    def _frames(self) -> Iterator[Frame]: ...
