"""An .npz whose arrays grow row by row, and which `numpy.load` can read at any moment."""

from __future__ import annotations

import math
import struct
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np
import numpy.typing as npt

from dloftbs.sinks._safe_files import replacing

HEADER_BYTES = 128
"""Size of the .npy header, the same for every number of rows so that it can be rewritten in place."""
SPARE_BYTES = 1 << 16
"""Never filled at the end of an array: `zipfile` reads ahead by 4 KiB, and compares checksums where a member ends."""
COPY_BYTES = 1 << 20


@dataclass(frozen=True)
class Column:
    """An array of the file that grows along its first axis: its type, and the shape of a row."""

    name: str
    dtype: npt.DTypeLike
    row_shape: tuple[int, ...] = ()

    @property
    def row_bytes(self) -> int:
        """Bytes of a row."""
        return np.dtype(self.dtype).itemsize * math.prod(self.row_shape)

    def header(self, rows: int) -> bytes:
        """Return the .npy header for a number of rows (format 1.0, padded to a fixed size)."""
        descr = np.lib.format.dtype_to_descr(np.dtype(self.dtype))
        text = repr({"descr": descr, "fortran_order": False, "shape": (rows, *self.row_shape)})
        prefix = np.lib.format.magic(1, 0) + struct.pack("<H", HEADER_BYTES - 10)
        return prefix + text.ljust(HEADER_BYTES - 11).encode() + b"\n"


class GrowingNpz:
    """Columns of one uncompressed .npz, each with room to grow.

    New rows go into the room behind an array, where no reader looks; then the number of rows in the array's header is
    raised, in place. When some room is used up, the whole file is copied with twice the room and replaced in one
    step. So it is readable whenever the process dies, what it costs is linear in its length, and no row stays in
    memory. Until `close`, which copies once more without the room, the checksums of the zip are out of date: numpy does
    not look at them, ``unzip`` does.

    Parameters
    ----------
    path : Path
        In a folder that exists; an older file is replaced.
    columns : sequence of Column
        Their headers are raised in this order: a process that dies in between leaves the last column shortest.

    Raises
    ------
    OSError
        If the file cannot be written.
    """

    def __init__(self, path: Path, columns: Sequence[Column]) -> None:
        self._path = path
        self._columns = tuple(columns)
        self._rows = [0] * len(self._columns)
        self._starts: list[int] = []
        self._rooms: list[int] = []
        self._file: IO[bytes] | None = None
        self._copy([0] * len(self._columns), SPARE_BYTES)

    def append(self, arrays: Mapping[str, npt.NDArray[Any]]) -> None:
        """Add rows to every column, or to none where that fails; the counts may differ between columns."""
        blocks = [np.ascontiguousarray(arrays[column.name], column.dtype) for column in self._columns]
        rows = [old + len(block) for old, block in zip(self._rows, blocks, strict=True)]
        try:
            self._extend(blocks, rows)
        except BaseException:
            self._release()  # what is where is read from the file again
            raise
        self._rows = rows  # only now: what Ctrl-C interrupted above is overwritten by the next rows

    def _extend(self, blocks: Sequence[npt.NDArray[Any]], rows: Sequence[int]) -> None:
        """Write rows behind those that are there, then the headers with their new numbers."""
        needed = self._bytes(rows)
        file = self._opened()
        if any(size > room for size, room in zip(needed, self._rooms, strict=True)):
            # A share of the whole for each keeps a column that starts late from causing many copies of a long file.
            share = sum(needed) // len(needed)
            self._copy([max(2 * size, share, SPARE_BYTES) for size in needed], SPARE_BYTES)
            file = self._opened()
        for start, used, block in zip(self._starts, self._bytes(self._rows), blocks, strict=True):
            _put(file, start + HEADER_BYTES + used, block.tobytes())
        for start, column, count in zip(self._starts, self._columns, rows, strict=True):
            _put(file, start, column.header(count))

    def close(self) -> None:
        """Give the room back and bring the checksums up to date."""
        try:
            self._copy(self._bytes(self._rows), 0)
        finally:
            self._release()

    def _bytes(self, rows: Sequence[int]) -> list[int]:
        return [count * column.row_bytes for count, column in zip(rows, self._columns, strict=True)]

    def _copy(self, rooms: Sequence[int], spare: int) -> None:
        """Replace the file by a copy with the given room, in bytes, for each column."""
        with replacing(self._path) as temporary:
            with zipfile.ZipFile(temporary, "w") as archive:
                for number, room in enumerate(rooms):
                    self._copy_column(archive, number, room + spare)
            self._release()  # Windows does not replace an open file

    def _copy_column(self, archive: zipfile.ZipFile, number: int, room: int) -> None:
        column, rows = self._columns[number], self._rows[number]
        used = rows * column.row_bytes
        with archive.open(zipfile.ZipInfo(f"{column.name}.npy"), "w", force_zip64=True) as member:
            member.write(column.header(rows))
            if used:
                source = self._opened()
                source.seek(self._starts[number] + HEADER_BYTES)
                for size in _chunks(used):
                    member.write(_get(source, size))
            for size in _chunks(room - used):
                member.write(bytes(size))

    def _opened(self) -> IO[bytes]:
        """Return the file; where its arrays start is read from itself, so it is right whatever was interrupted."""
        if self._file is None:
            self._file = self._path.open("r+b", buffering=0)
            with zipfile.ZipFile(self._file) as archive:
                members = [archive.getinfo(f"{column.name}.npy") for column in self._columns]
            self._starts = [_member_start(self._file, member) for member in members]
            self._rooms = [member.file_size - HEADER_BYTES - SPARE_BYTES for member in members]
        return self._file

    def _release(self) -> None:
        if self._file is not None:
            self._file.close()
            self._file = None


def _chunks(total: int) -> list[int]:
    whole, rest = divmod(total, COPY_BYTES)
    return [COPY_BYTES] * whole + [rest] * (rest > 0)


def _put(file: IO[bytes], offset: int, data: bytes) -> None:
    file.seek(offset)
    rest = memoryview(data)
    while rest:
        rest = rest[file.write(rest) :]


def _get(file: IO[bytes], size: int) -> bytes:
    data = file.read(size)
    if len(data) != size:
        raise OSError(f"the file was cut off by somebody else: expected {size} bytes, got {len(data)}")
    return data


def _member_start(file: IO[bytes], member: zipfile.ZipInfo) -> int:
    """Return where a member's content starts: behind a local header of 30 bytes, its name and its extra field."""
    file.seek(member.header_offset + 26)
    name_bytes, extra_bytes = struct.unpack("<HH", _get(file, 4))
    return member.header_offset + 30 + int(name_bytes) + int(extra_bytes)
