"""Interface of every sink, and a sink that writes to several at once."""

from __future__ import annotations

import logging
import os
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from pathlib import Path
from types import TracebackType
from typing import TypeVar

from dloftbs.data.frame import Frame
from dloftbs.data.frame_result import FrameResult
from dloftbs.errors import InputError, SinkError
from dloftbs.support.values import check_path, shown

logger = logging.getLogger("dloftbs.sinks")

Identity = tuple[int, int] | str
"""Identity of a file or folder, whatever its name."""

SinkType = TypeVar("SinkType", bound="Sink")


def identity_of(path: str | Path) -> Identity:
    """Return what distinguishes files and folders whatever links lead to them: device and inode, or the whole path.

    The path, with links followed, is for what does not exist yet.
    """
    try:
        found = os.stat(path)
    except OSError:
        return os.path.realpath(path)
    return found.st_dev, found.st_ino


class Sink(ABC):
    """A place where results go; a context manager that closes itself, whatever ends the block.

    What `write` returned for stays readable whatever happens next, a killed process included; each sink says in what
    form. Only a `NpzSink` and a `CocoSink` keep it in memory until `close`, and an `UsdSink` up to half of it.
    """

    @abstractmethod
    def write(self, frame: Frame, result: FrameResult) -> None:
        """Write what was found in a frame.

        Raises
        ------
        SinkError
            If it cannot be written, or the sink is closed.
        """

    @abstractmethod
    def close(self) -> None:
        """Finish and release open files; closing again does nothing.

        Raises
        ------
        SinkError
            If the rest cannot be written.
        """

    def __enter__(self: SinkType) -> SinkType:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            self.close()
        except SinkError as late:
            if error is None:
                raise
            logger.error("%s", late)  # what ended the block says more, and only one can be raised


class PathSink(Sink):
    """A sink that writes to one path: knows whether it is closed, and turns system errors into `SinkError`.

    Subclasses open what they need in their constructor and implement `_write` and `_close`.

    Raises
    ------
    InputError
        If the path is empty.
    """

    def __init__(self, path: str | Path) -> None:
        self._path = Path(os.path.expanduser(check_path("path", path)))
        if isinstance(path, str) and not path:
            raise InputError("the path of a result is empty; the current folder is '.'")
        self._closed = False
        self._began = False

    def __repr__(self) -> str:
        return f"{type(self).__name__}({shown(str(self._path))})"

    @property
    def path(self) -> Path:
        """Path that the results are written to."""
        return self._path

    def write(self, frame: Frame, result: FrameResult) -> None:
        """Write what was found in a frame.

        Raises
        ------
        SinkError
            If it cannot be written, or the sink is closed.
        """
        if self._closed:
            raise SinkError(f"cannot write to {str(self._path)!r}: the sink is closed")
        self._write(frame, result)
        self._began = True

    def close(self) -> None:
        """Finish and release open files; closing again does nothing.

        Raises
        ------
        SinkError
            If the rest cannot be written.
        """
        if not self._closed:
            self._closed = True
            self._close()

    @property
    def _keeps_older(self) -> bool:
        """Whether no frame came, and an older file, which would be lost for nothing, stays."""
        return not self._began and self._path.exists() and self._path.stat().st_size > 0

    @abstractmethod
    def _write(self, frame: Frame, result: FrameResult) -> None: ...

    @abstractmethod
    def _close(self) -> None: ...


class MultiSink(Sink):
    """Several sinks as one.

    A sink that fails costs the others nothing: each frame goes to all of them, all are closed, and only then is the
    first error raised.

    Parameters
    ----------
    sinks : iterable of Sink
        Owned from now on: closing this closes them.

    Raises
    ------
    InputError
        If one of them is no sink, or two write to the same place.
    """

    def __init__(self, sinks: Iterable[Sink]) -> None:
        self._sinks = tuple(sinks)
        self._closed = False
        places: dict[Identity, Path] = {}
        for sink in self._sinks:
            if not isinstance(sink, Sink):
                raise InputError(f"MultiSink takes sinks, got {type(sink).__name__}")
            if isinstance(sink, PathSink):
                other = places.setdefault(identity_of(sink.path), sink.path)
                if other is not sink.path:
                    raise InputError(f"two sinks write to the same place: {str(other)!r} and {str(sink.path)!r}")

    def write(self, frame: Frame, result: FrameResult) -> None:
        """Write a frame to every sink, in order.

        Raises
        ------
        SinkError
            If this is closed, or as the first sink that failed.
        """
        if self._closed:
            raise SinkError("cannot write: the sink is closed")
        self._each(lambda sink: sink.write(frame, result))

    def close(self) -> None:
        """Close every sink, in order; closing again does nothing.

        Raises
        ------
        SinkError
            As the first sink that failed.
        """
        if not self._closed:
            self._closed = True
            self._each(lambda sink: sink.close())

    def _each(self, action: Callable[[Sink], None]) -> None:
        first: BaseException | None = None
        for sink in self._sinks:
            try:
                action(sink)
            except BaseException as error:  # noqa: BLE001 - Ctrl-C must not leave the sinks out of step either
                if first is None or not isinstance(error, Exception):
                    first = error
                else:
                    logger.error("%s", error)  # only one can be raised
        if first is not None:
            raise first
