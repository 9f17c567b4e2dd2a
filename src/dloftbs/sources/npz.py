"""Reading .npz archives a frame at a time, compressed or not."""

from __future__ import annotations

import zipfile
import zlib
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.lib import format as npy_format

from dloftbs.errors import SourceError
from dloftbs.sources.pixels import AnyArray

_BROKEN = (OSError, ValueError, EOFError, KeyError, NotImplementedError, RuntimeError, zipfile.BadZipFile, zlib.error)
"""What zipfile and numpy raise on an archive that is corrupt, encrypted or compressed in an unknown way."""
_PIECE = 1 << 20  # bytes skipped at a time


class NpzMember:
    """One array of an archive, indexed along its first axis; numpy would load all of it.

    Reading in order is fast; going back unpacks the array anew.

    Parameters
    ----------
    path : Path
    key : str

    Raises
    ------
    SourceError
        If the array is corrupt, holds Python objects, or is stored in Fortran order.
    """

    def __init__(self, path: Path, key: str) -> None:
        self._path = path
        self._key = key
        self._stream: IO[bytes] | None = None
        try:
            stream = self._open()
            version = npy_format.read_magic(stream)
            read = npy_format.read_array_header_1_0 if version == (1, 0) else npy_format.read_array_header_2_0
            self.shape, fortran, self.dtype = read(stream)
            self._start = stream.tell()
        except _BROKEN as error:
            raise self._broken(error) from error
        finally:
            self.close()
        if self.dtype.hasobject:
            raise self._broken("it holds Python objects, which are not loaded")
        if fortran:
            raise self._broken("it is in Fortran order; save numpy.ascontiguousarray of it")

    @property
    def ndim(self) -> int:
        """Number of axes."""
        return len(self.shape)

    def __getitem__(self, index: int) -> AnyArray:
        size = self.dtype.itemsize * int(np.prod(self.shape[1:]))
        try:
            stream = self._at(self._start + index * size)
            data = stream.read(size)
            return np.frombuffer(data, self.dtype).reshape(self.shape[1:])
        except _BROKEN as error:
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

    def _open(self) -> IO[bytes]:
        # The stream keeps the file open until it is closed itself.
        with zipfile.ZipFile(self._path) as archive:
            self._stream = archive.open(f"{self._key}.npy")
        return self._stream

    def _broken(self, why: Any) -> SourceError:
        return SourceError(f"{self._path}: the array {self._key!r} cannot be read: {why}")


def read_whole(path: Path, keys: tuple[str, ...]) -> tuple[list[str], dict[str, AnyArray]]:
    """Return the names of all arrays of an archive, and those of `keys` that it has, whole: for small ones.

    Raises
    ------
    SourceError
        If the archive cannot be read.
    """
    try:
        with zipfile.ZipFile(path) as archive:  # np.load leaves the file open if it is corrupt
            found = [name[:-4] for name in archive.namelist() if name.endswith(".npy")]
            return found, {key: _read_array(archive, key) for key in keys if key in found}
    except _BROKEN as error:
        raise SourceError(f"{path}: cannot be read as a .npz file: {error}") from error


def _read_array(archive: zipfile.ZipFile, key: str) -> AnyArray:
    with archive.open(f"{key}.npy") as stream:
        array: AnyArray = npy_format.read_array(stream, allow_pickle=False)
    return array
