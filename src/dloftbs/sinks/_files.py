"""Files that are valid whenever the process dies: appended to in whole pieces, or replaced as a whole."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from dloftbs.errors import SinkError


@contextmanager
def sink_errors(path: Path) -> Iterator[None]:
    """Raise a system error in the block as a `SinkError` that names the path and the cause."""
    try:
        yield
    except SinkError:
        raise
    except OSError as error:
        raise SinkError(f"cannot write {str(path)!r}: {error}") from error


class AppendFile:
    """A new file that grows by whole pieces, each handed to the system before `append` returns.

    Unbuffered, so that a killed process loses nothing and closing cannot fail for want of space.

    Raises
    ------
    SinkError
        If the file cannot be opened; an older file of the name is then left as it was.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._size = 0
        with sink_errors(path):
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = path.open("wb", buffering=0)

    @property
    def size(self) -> int:
        """Bytes in the whole pieces appended so far."""
        return self._size

    def append(self, data: bytes) -> None:
        """Add a piece at the end."""
        with sink_errors(self.path):
            if self._file.tell() != self._size:  # what a full disk or Ctrl-C cut off would spoil the next piece
                self._file.seek(self._size)
                self._file.truncate()
            self._write_all(data)
        self._size += len(data)

    def patch(self, offset: int, data: bytes) -> None:
        """Overwrite bytes that were appended before."""
        with sink_errors(self.path):
            self._file.seek(offset)
            self._write_all(data)
            self._file.seek(self._size)

    def _write_all(self, data: bytes) -> None:
        rest = memoryview(data)
        while rest:
            rest = rest[self._file.write(rest) :]

    def close(self) -> None:
        """Release the file; closing again does nothing."""
        with sink_errors(self.path):
            self._file.close()


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield the name of a temporary file beside `path`, which takes its place when the block ends well.

    The name is always the same, so that what a killed process leaves behind is reused and does not pile up.
    """
    temporary = path.with_name(f".{path.name}.tmp")
    try:
        yield temporary
        os.replace(temporary, path)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


class UnusedNames:
    """Gives every name once: what comes again gets ``_1`` and so on. All of them stay in memory."""

    def __init__(self) -> None:
        self._repeats: dict[str, int] = {}

    def __call__(self, stem: str) -> str:
        """Return the name, or one made of it that was not given yet."""
        name = stem
        while name.casefold() in self._repeats:  # some file systems take a.png for A.png
            self._repeats[stem.casefold()] += 1
            name = f"{stem}_{self._repeats[stem.casefold()]}"
        self._repeats[name.casefold()] = 0
        return name
