"""Reading .npz archives a frame at a time, compressed or not."""

from __future__ import annotations

import math
import zipfile
from typing import IO, Any

import numpy as np

from dloftbs.errors import SourceError, source_errors
from dloftbs.sources.pixels import MAX_PIXELS
from dloftbs.support.arrays import AnyArray
from dloftbs.support.npy import BROKEN, File, NpyHeader, open_member, opened, read_members

_MAX_WHOLE = 64 << 20
"""Bytes of an array that is read whole: stamps of three days at 30 frames per second."""
_PIECE = 1 << 20  # bytes skipped at a time


class NpzMember:
    """One array of an archive, indexed along its first axis; numpy would load all of it.

    Reading in order is fast; going back unpacks the array anew.

    Parameters
    ----------
    file : File
    key : str

    Raises
    ------
    SourceError
        If the array is corrupt, holds Python objects, or is stored in Fortran order.
    """

    def __init__(self, file: File, key: str) -> None:
        self._file = file
        self._key = key
        self._stream: IO[bytes] | None = None
        try:
            header = self._open()
        except BROKEN as error:
            raise self._broken(error) from error
        finally:
            self.close()
        self.shape, self.dtype, self._start = header.shape, header.dtype, header.start
        if header.fortran:
            raise self._broken("it is in Fortran order; save numpy.ascontiguousarray of it")
        channels = 3 if self.ndim == 4 and self.shape[3] == 3 else 1
        if math.prod(self.shape[1:]) > channels * MAX_PIXELS:
            raise self._broken(f"a frame must have at most {MAX_PIXELS} pixels, got {self.shape}")

    @property
    def ndim(self) -> int:
        """Number of axes."""
        return len(self.shape)

    def __getitem__(self, index: int) -> AnyArray:
        size = self.dtype.itemsize * math.prod(self.shape[1:])
        try:
            stream = self._at(self._start + index * size)
            data = stream.read(size)
            return np.frombuffer(data, self.dtype).reshape(self.shape[1:])
        except BROKEN as error:
            raise self._broken(error) from error

    def close(self) -> None:
        """Close the file; indexing opens it again."""
        if self._stream is not None:
            self._stream.close()
            self._stream = None

    def _at(self, position: int) -> IO[bytes]:
        """Return the stream at a position, reached by reading: Python 3.13 no longer checks the sum after seeking."""
        if self._stream is None or self._stream.tell() > position:
            self.close()
            self._open()
        stream = self._stream
        assert stream is not None  # just opened, or open already
        while (ahead := position - stream.tell()) > 0:
            if not stream.read(min(ahead, _PIECE)):
                break  # cut off; reading on will say so
        return stream

    def _open(self) -> NpyHeader:
        # The stream keeps the file open until it is closed itself.
        with zipfile.ZipFile(opened(self._file)) as archive:
            self._stream, header = open_member(archive, self._key)
        return header

    def _broken(self, why: Any) -> SourceError:
        return SourceError(f"{self._file}: the array {self._key!r} cannot be read: {why}")


def read_whole(file: File, keys: tuple[str, ...]) -> tuple[list[str], dict[str, AnyArray]]:
    """Return the names of all arrays of an archive, and those of `keys` that it has, whole: for small ones.

    Raises
    ------
    SourceError
        If the archive cannot be read.
    """
    with source_errors(f"{file}: cannot be read as a .npz file", BROKEN):
        return read_members(file, keys, _MAX_WHOLE)
