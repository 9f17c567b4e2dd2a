"""The standard streams as the command uses them: they take any text, and a stream that fails does so once."""

from __future__ import annotations

import codecs
import io
import os
import select
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, TextIO


@contextmanager
def standard_streams(lost: Callable[[OSError], None]) -> Iterator[None]:
    r"""Put streams in place that write at once, and whatever the encoding lacks as an escape such as ``\xe4``.

    What cannot be written to standard error is dropped: a message that nobody can read ends no run.

    Parameters
    ----------
    lost : callable
        Takes the first error of standard output, and raises. Later output is dropped, so that closing
        everything stays quiet.
    """
    before = sys.stdout, sys.stderr
    if sys.stdin is None:
        _plug()  # in the order of the descriptors: the system gives out the lowest that is free
    sys.stdout = _text(sys.stdout, lost)
    sys.stderr = _text(sys.stderr, _drop)
    try:
        yield
    finally:
        sys.stdout, sys.stderr = before


def _plug() -> int:
    """Return what stands for a stream that was closed before the start, and takes nothing either.

    Without it, the next file that is opened would be in the stream's place.
    """
    number = os.open(os.devnull, os.O_RDONLY)
    os.set_inheritable(number, True)
    return number


def _drop(_error: OSError) -> None:
    """Let go of a message."""


def _text(stream: TextIO | None, failed: Callable[[OSError], None]) -> TextIO:
    below: Any
    if stream is None:
        below, encoding = io.FileIO(_plug(), "w", closefd=False), "utf-8"
    elif not hasattr(stream, "buffer"):
        return stream  # text of somebody's own in the place of a stream
    else:
        stream.flush()
        below, encoding = getattr(stream.buffer, "raw", stream.buffer), stream.encoding
    if codecs.lookup(encoding).name == "ascii":
        encoding = "utf-8"  # as Python does in a POSIX locale, and as click would, with ? in place of escapes
    whole: Any = _Whole(below, failed)
    return io.TextIOWrapper(whole, encoding, "backslashreplace", write_through=True)


class _Whole(io.RawIOBase):
    """Writes to a raw stream without a buffer, which would fail again when the interpreter ends.

    Parameters
    ----------
    below : raw binary stream
        Stays open.
    failed : callable
        Takes the first error.
    """

    def __init__(self, below: Any, failed: Callable[[OSError], None]) -> None:
        self._below = below
        self._failed = failed
        self._broken = False

    def writable(self) -> bool:
        """Return True."""
        return True

    def isatty(self) -> bool:
        """Return whether a terminal is below."""
        return bool(self._below.isatty())

    def fileno(self) -> int:
        """Return the descriptor of the stream below."""
        return int(self._below.fileno())

    def write(self, data: Any) -> int:
        """Write all of it."""
        whole = rest = memoryview(data).cast("B")
        try:
            while rest and not self._broken:
                count = self._below.write(rest)
                if count is None:  # a full pipe that its other users have made non-blocking
                    select.select([], [self._below], [])
                else:
                    rest = rest[count:]
        except OSError as error:
            self._broken = True
            self._failed(error)
        return len(whole)
