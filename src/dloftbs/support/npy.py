"""Arrays in .npy and .npz files, whose headers are looked at before what they promise is believed."""

from __future__ import annotations

import ast
import io
import math
import os
import re
import struct
import zipfile
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import IO, Any, NamedTuple

import numpy as np
import numpy.typing as npt
from numpy.lib import format as npy_format

BROKEN = (
    *(OSError, EOFError, ValueError, TypeError, LookupError, OverflowError, AttributeError, SyntaxError),
    *(RuntimeError, MemoryError, zipfile.BadZipFile, zlib.error, struct.error),
)
"""Exceptions of zipfile and numpy for corrupt or encrypted files and for no arrays.

NotImplementedError and RecursionError are RuntimeErrors, and a header is read as Python is.
"""

_PLAIN_TYPE = re.compile("[<>|=]?[?biufcSU][0-9]{0,9}")
MAX_HEADER_BYTES = 10_000
"""Of a .npy header; numpy's own limit."""
_VERSIONS = ((1, 0), (2, 0), (3, 0))
_COMPRESSIONS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
"""Those that numpy writes; others unpack to any multiple of their size."""


class InMemory(NamedTuple):
    """A file that was read from somewhere else than the disk, with the name that messages give it."""

    name: str
    data: bytes

    def __str__(self) -> str:
        return self.name


File = Path | InMemory
"""A file on disk or in memory."""


def opened(file: File) -> Path | IO[bytes]:
    """Return what `zipfile` opens as the file.

    Raises
    ------
    OSError
        If it is a pipe, whose reading would wait for a writer, a socket or a device.
    """
    if isinstance(file, Path) and os.path.exists(file) and not os.path.isfile(file):
        raise OSError("it is no file")
    return io.BytesIO(file.data) if isinstance(file, InMemory) else file


class NpyHeader(NamedTuple):
    """Header before the values of an array, with its own size and that of the whole file in bytes."""

    shape: tuple[int, ...]
    fortran: bool
    dtype: np.dtype[Any]
    start: int
    size: int

    @property
    def n_bytes(self) -> int:
        """Bytes that the values take."""
        return math.prod(self.shape) * self.dtype.itemsize


def is_npy(data: bytes) -> bool:
    """Return whether a file begins as arrays of numpy do."""
    return data.startswith(npy_format.MAGIC_PREFIX)


def read_header(stream: IO[bytes], size: int) -> NpyHeader:
    """Read the header of an array.

    Parameters
    ----------
    stream : file
        At the beginning; is left at the first value.
    size : int
        Bytes that there are, header included.

    Raises
    ------
    ValueError
        If it is none, promises more values than there are bytes, or Python objects; and what else is in `BROKEN`.
    """
    begin = stream.read(npy_format.MAGIC_LEN)
    if len(begin) < npy_format.MAGIC_LEN or not is_npy(begin):
        raise ValueError("it does not begin as arrays of numpy do")
    if tuple(begin[-2:]) not in _VERSIONS:
        raise ValueError(f"its format must be 1.0, 2.0 or 3.0, got {begin[-2]}.{begin[-1]}")
    field = stream.read(2 if begin[-2] == 1 else 4)
    length = int.from_bytes(field, "little")
    if length > MAX_HEADER_BYTES:
        raise ValueError(f"its header must have at most {MAX_HEADER_BYTES} bytes, got {length}")
    # numpy's own reader takes more for a header, and warns.
    stated = ast.literal_eval(stream.read(length).decode("utf-8"))
    if not isinstance(stated, dict) or set(stated) != {"descr", "fortran_order", "shape"}:
        raise ValueError("its header must state descr, fortran_order and shape")
    descr, fortran, shape = stated["descr"], stated["fortran_order"], stated["shape"]
    if not isinstance(descr, str) or _PLAIN_TYPE.fullmatch(descr) is None:
        raise ValueError(f"it must hold numbers or text, got {descr!r}; Python objects are not loaded")
    if not isinstance(shape, tuple) or not all(type(side) is int and 0 <= side < 2**63 for side in shape):
        raise ValueError(f"its shape must be integers of at least 0, got {shape}")
    if not isinstance(fortran, bool):
        raise ValueError(f"its fortran_order must be True or False, got {fortran!r}")
    dtype = np.dtype(descr)
    header = NpyHeader(shape, fortran, dtype, npy_format.MAGIC_LEN + len(field) + length, size)
    if header.start + header.n_bytes > size:
        raise ValueError(f"it is cut off: {shape} of {dtype} takes {header.n_bytes} bytes, and the file has {size}")
    return header


def open_mapped(file: File) -> npt.NDArray[Any]:
    """Map a .npy file into memory, read-only; no value is read before it is looked at.

    Raises
    ------
    OSError, ValueError
        If it cannot be read; and what else is in `BROKEN`.
    """
    if isinstance(file, InMemory):
        header = read_header(io.BytesIO(file.data), len(file.data))
        return _shaped(np.frombuffer(file.data, header.dtype, math.prod(header.shape), header.start), header)
    with file.open("rb") as stream:
        read_header(stream, os.fstat(stream.fileno()).st_size)
    array: npt.NDArray[Any] = np.load(file, mmap_mode="r", allow_pickle=False)
    return array


def open_member(archive: zipfile.ZipFile, key: str) -> tuple[IO[bytes], NpyHeader]:
    """Open an array of an archive; the stream is at its first value.

    Raises
    ------
    KeyError, ValueError
        If there is none, or it cannot be read; and what else is in `BROKEN`.
    """
    member = archive.getinfo(f"{key}.npy")
    if member.compress_type not in _COMPRESSIONS:
        raise ValueError("it is compressed in a way that numpy does not write")
    stream = archive.open(member)
    try:
        return stream, read_header(stream, member.file_size)
    except BROKEN:
        stream.close()
        raise


def read_member(archive: zipfile.ZipFile, key: str, most_bytes: int) -> npt.NDArray[Any]:
    """Read an array of an archive as a whole.

    Raises
    ------
    ValueError
        If it takes more bytes; and what else is in `BROKEN`.
    """
    stream, header = open_member(archive, key)
    with stream:
        if header.n_bytes > most_bytes:
            raise ValueError(f"{key!r} must take at most {most_bytes} bytes, got {header.shape} of {header.dtype}")
        data = stream.read(header.n_bytes)
        stream.read(1)  # its sum is checked where it ends
    if len(data) != header.n_bytes:
        raise ValueError(f"{key!r} is cut off: it must hold {header.n_bytes} bytes, got {len(data)}")
    return _shaped(np.frombuffer(data, header.dtype), header)


def _shaped(values: npt.NDArray[Any], header: NpyHeader) -> npt.NDArray[Any]:
    return values.reshape(header.shape[::-1]).T if header.fortran else values.reshape(header.shape)


def read_members(file: File, keys: Sequence[str], most_bytes: int) -> tuple[list[str], dict[str, npt.NDArray[Any]]]:
    """Return the names of all arrays of an archive, and those of `keys` that it has, whole.

    Raises
    ------
    OSError, ValueError
        If it cannot be read; and what else is in `BROKEN`.
    """
    with zipfile.ZipFile(opened(file)) as archive:  # np.load leaves the file open if it is corrupt
        found = [name[:-4] for name in archive.namelist() if name.endswith(".npy")]
        return found, {key: read_member(archive, key, most_bytes) for key in keys if key in found}
