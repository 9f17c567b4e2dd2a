"""Outputs that one process alone writes, by a lock of the operating system that ends with its process."""

from __future__ import annotations

import errno
import hashlib
import logging
import os
import sys
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import IO, Any

from dloftbs.errors import SinkError

if sys.platform == "win32":
    import msvcrt
else:
    import fcntl

logger = logging.getLogger("dloftbs.sinks")

_HELD = (errno.EAGAIN, errno.EACCES, errno.EDEADLK)
"""Errors of locking that say that somebody else has the lock; all others say that there are no locks there."""


_MAX_NAME_BYTES = 255
"""Of a file, on all common file systems."""


def hidden_beside(path: Path, suffix: str) -> Path:
    """Return the name of a hidden file beside another, always the same; for a very long name, made of its digest."""
    name = f".{path.name}{suffix}"
    if len(os.fsencode(name)) > _MAX_NAME_BYTES:
        name = f".{hashlib.sha256(os.fsencode(path.name)).hexdigest()}{suffix}"
    return path.with_name(name)


class Claim:
    """The right to write an output, until `release` or the end of the process.

    The lock is on an empty file of its own, ``.NAME.lock`` beside a file and ``.dloftbs.lock`` in a folder: outputs
    are replaced and moved while they are written, and a lock would not follow. Releasing removes that file; one that a
    killed process left there is not locked any more, and keeps nobody out.

    Devices and pipes are not claimed. Where there can be no lock, in some network file systems or for want of a
    permission, the claim is given with a warning in the log.

    Parameters
    ----------
    path : Path
        A file, which need not exist, in a folder that does; or a folder.

    Raises
    ------
    SinkError
        If somebody else writes there, in this process or another.
    OSError
        If the lock's file cannot be made.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._file: IO[bytes] | None = None
        real = Path(os.path.realpath(path))
        if real.exists() and not real.is_file() and not real.is_dir():
            return
        self._place = real / ".dloftbs.lock" if real.is_dir() else hidden_beside(real, ".lock")
        try:
            self._file = self._locked()
        except PermissionError as error:  # the output may be writable yet, and says so itself where it is not
            logger.warning("%s is not locked against other writers: %s", path, error)

    def __enter__(self) -> Claim:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.release()

    def release(self) -> None:
        """Let others write; releasing again does nothing."""
        file, self._file = self._file, None
        if file is None:
            return
        with file:
            if sys.platform != "win32":
                self._remove()  # while it is locked: who opened it meanwhile sees that it is gone
        if sys.platform == "win32":
            self._remove()  # an open file cannot be removed there, by nobody

    def _remove(self) -> None:
        with suppress(OSError):  # what stays is not locked, and keeps nobody out
            self._place.unlink(missing_ok=True)

    def _locked(self) -> IO[bytes]:
        while True:
            file = self._opened()
            try:
                self._lock(file)
                if self._still_there(file):
                    return file
            except BaseException:
                file.close()
                raise
            file.close()

    def _opened(self) -> IO[bytes]:
        try:
            return self._place.open("ab", buffering=0)
        except PermissionError:
            if not self._place.exists():
                raise
            return self._place.open("rb", buffering=0)  # what another user left behind can be locked all the same

    def _lock(self, file: IO[bytes]) -> None:
        try:
            _lock(file)
        except OSError as error:
            if error.errno in _HELD:
                raise SinkError(
                    f"cannot write {str(self._path)!r}: somebody else is writing it; "
                    "wait until that has ended, or choose another name"
                ) from error
            logger.warning("%s is not locked against other writers: %s", self._path, error.strerror)

    def _still_there(self, file: IO[bytes]) -> bool:
        """Return whether the file has its name yet: who held the lock before may have removed it."""
        try:
            return os.path.samestat(os.fstat(file.fileno()), self._place.stat())
        except FileNotFoundError:
            return False


def _lock(file: IO[Any]) -> None:
    """Lock an open file, or raise an OSError at once."""
    if sys.platform == "win32":
        file.seek(0)
        msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
    else:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
