"""Files that are valid whenever the process dies: appended to in whole pieces, or replaced as a whole."""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from dloftbs.errors import SinkError
from dloftbs.support.claims import Claim, hidden_beside


@contextmanager
def sink_errors(path: Path) -> Iterator[None]:
    """Raise a system error in the block as a `SinkError` that names the path and the cause."""
    try:
        yield
    except SinkError:
        raise
    except OSError as error:
        raise SinkError(f"cannot write {str(path)!r}: {error}") from error


def is_special(path: Path) -> bool:
    """Return whether a path leads to a pipe, a socket or a device: written to, but never replaced nor removed."""
    return os.path.exists(path) and not os.path.isfile(path) and not os.path.isdir(path)


def _check_replaceable(path: Path) -> None:
    if is_special(path):
        raise OSError("it is a pipe, a socket or a device, and this kind of result must be a file")


def claim_file(path: Path) -> Claim:
    """Make a file's folder, and keep all others from writing the file for as long as the claim is held.

    Raises
    ------
    SinkError
        If the folder cannot be made, or somebody else writes the file.
    """
    with sink_errors(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        return Claim(path)


def claim_folder(folder: Path) -> Claim:
    """Make a folder, and keep all others from writing there for as long as the claim is held.

    Raises
    ------
    SinkError
        If it cannot be made, or somebody else writes there.
    """
    with sink_errors(folder):
        folder.mkdir(parents=True, exist_ok=True)
        return Claim(folder)


def claim_replaceable(path: Path) -> Claim:
    """Claim a file that is replaced as a whole later, and find out now whether it can be, as `check_writable` does.

    Raises
    ------
    SinkError
        If it cannot, or somebody else writes it; an older file of the name is left as it was.
    """
    claim = claim_file(path)
    try:
        check_writable(path)
    except BaseException:
        claim.release()
        raise
    return claim


class AppendFile:
    """A new file that grows by whole pieces, each handed to the system before `append` returns.

    Unbuffered, so that a killed process loses nothing and closing cannot fail for want of space. Nobody else writes
    the file as long as it is open. An older file of the name is replaced by the first piece, and not before.

    Parameters
    ----------
    path : Path
    head : bytes
        What the file begins with, also where no piece follows.

    Raises
    ------
    SinkError
        If the file cannot be opened, or somebody else writes it; an older file of the name is then left as it was.
    """

    def __init__(self, path: Path, head: bytes = b"") -> None:
        self.path = path
        self._size = 0
        self._head = head
        with ExitStack() as undo:
            self._claim = claim_file(path)
            undo.callback(self._claim.release)
            with sink_errors(path):
                self._keeps_older = os.path.isfile(path) and os.path.getsize(path) > 0
                self._file = undo.enter_context(path.open("r+b" if self._keeps_older else "wb", buffering=0))
            if not self._keeps_older:
                self.append(b"")
            undo.pop_all()

    @property
    def keeps_older(self) -> bool:
        """Whether the file is still an older one, since no piece came."""
        return self._keeps_older

    @property
    def size(self) -> int:
        """Bytes in the whole pieces appended so far, the head included."""
        return self._size

    def append(self, data: bytes) -> None:
        """Add a piece at the end, or nothing of it where that fails."""
        data = self._head + data
        with sink_errors(self.path):
            try:
                if self._keeps_older:
                    self._cut(0)
                    self._keeps_older = False
                self._write_all(data)
            except BaseException:
                with suppress(OSError):  # the first error says more
                    self._cut(self._size)
                raise
        self._head = b""
        self._size += len(data)

    def _write_all(self, data: bytes) -> None:
        rest = memoryview(data)
        while rest:
            rest = rest[self._file.write(rest) :]

    def shorten(self, size: int) -> None:
        """Cut off what came after the first `size` bytes; an older file, of which nothing is replaced yet, stays."""
        if self._keeps_older:
            return
        with sink_errors(self.path):
            self._cut(size)
        self._size = size

    def _cut(self, size: int) -> None:
        self._file.seek(size)
        self._file.truncate()

    def close(self) -> None:
        """Let go of the file; closing again does nothing."""
        try:
            with sink_errors(self.path):
                self._file.close()
        finally:
            self._claim.release()

    def discard(self) -> None:
        """Remove the file, unless it is an older one, and close it."""
        with sink_errors(self.path):
            self._file.close()
            if not self._keeps_older and not is_special(self.path):
                self.path.unlink(missing_ok=True)
        self._claim.release()


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield the name of a temporary file beside `path`, which takes its place when the block ends well.

    The name is always the same, so that what a killed process leaves behind is reused and does not pile up. Of a link,
    the file that it leads to is replaced.

    Raises
    ------
    OSError
        If `path` leads to a pipe, a socket or a device.
    """
    _check_replaceable(path)
    path = Path(os.path.realpath(path))
    temporary = hidden_beside(path, ".tmp")
    try:
        yield temporary
        os.replace(temporary, path)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


def write_whole(path: Path, data: bytes) -> None:
    """Write or replace a file as a whole, and make its folder; what is written to a pipe or a device goes into it.

    Raises
    ------
    SinkError
        If it cannot be written; an older file of the name is then left as it was.
    """
    with sink_errors(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        if is_special(path):
            path.write_bytes(data)
            return
        with replacing(path) as temporary:
            temporary.write_bytes(data)


def check_writable(path: Path) -> None:
    """Find out whether a file can be replaced as a whole, as far as a try beside it shows; the file is left as it is.

    Raises
    ------
    SinkError
        If it cannot.
    """
    with sink_errors(path):
        if path.is_dir():
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
        _check_replaceable(path)
        temporary = hidden_beside(Path(os.path.realpath(path)), ".tmp")
        try:
            with temporary.open("wb"):
                pass
        finally:
            temporary.unlink(missing_ok=True)


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
