"""Bags of ROS 1 (format 2.0), finished or not: read from the beginning on, a record after the other."""

from __future__ import annotations

import struct
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import IO

from dloftbs.errors import SourceError
from dloftbs.ros.bag_file import (
    MAX_RECORD_BYTES,
    SCAN_BYTES,
    BagFile,
    CutError,
    RawMessage,
    Topic,
    check_magic,
    decompressed,
    ros2_name,
    unpack,
)
from dloftbs.ros.message_fields import NS_PER_S

MAGIC = b"#ROSBAG V2.0\n"
_MESSAGE, _BAG_HEADER, _CHUNK, _CHUNK_INFO, _CONNECTION = 2, 3, 5, 6, 7
"""Values of the field ``op`` of the records that are looked at."""
_U32, _U64, _TIME, _COUNT = struct.Struct("<I"), struct.Struct("<Q"), struct.Struct("<II"), struct.Struct("<II")

Fields = dict[str, bytes]


class Ros1File(BagFile):
    """A ``.bag`` file. The index at its end lists its topics; without it they are looked for in its first part."""

    is_ros1 = True

    def _listed(self) -> tuple[Topic, ...]:
        with self.path.open("rb") as file:
            check_magic(file, MAGIC, "a bag of ROS 1, format 2.0,")
            try:
                return _index(file)
            except CutError:
                self.is_whole = False
        reader = _Reader(self.path)
        try:
            for _ in reader.messages(None, SCAN_BYTES):
                pass
        except CutError:
            pass
        return tuple(Topic(name, kind) for name, kind in dict.fromkeys(reader.connections.values()))

    def _messages(self, wanted: Collection[str]) -> Iterator[RawMessage]:
        yield from _Reader(self.path).messages(wanted)


def _index(file: IO[bytes]) -> tuple[Topic, ...]:
    """Return the topics that the index at the end of the file lists.

    Raises
    ------
    CutError
        If there is none.
    """
    size = file.seek(0, 2)
    file.seek(len(MAGIC))
    fields, _ = _record(file)
    start = unpack(_U64, fields.get("index_pos", b""))[0]
    if not len(MAGIC) < start < size:
        raise CutError("it has no index")
    file.seek(start)
    connections: dict[int, tuple[str, str]] = {}
    counts: dict[int, int] = {}
    while file.tell() < size:
        fields, data = _record(file)
        op = _op(fields)
        if op == _CONNECTION:
            connections[_number(fields, "conn")] = _connection(fields, data)
        elif op == _CHUNK_INFO:
            for at in range(0, len(data) - _COUNT.size + 1, _COUNT.size):
                number, count = unpack(_COUNT, data, at)
                counts[number] = counts.get(number, 0) + count
    names: dict[tuple[str, str], int] = {}
    for number, found in connections.items():  # a topic has a connection for each of its publishers
        names[found] = names.get(found, 0) + counts.get(number, 0)
    return tuple(Topic(name, kind, count) for (name, kind), count in names.items())


class _Reader:
    """Reads a file once, and keeps the connections that it has come by: topic and type by their numbers."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self.connections: dict[int, tuple[str, str]] = {}

    def messages(self, wanted: Collection[str] | None, most_bytes: int | None = None) -> Iterator[RawMessage]:
        """Yield the messages of some topics, or of none where `wanted` is None; `most_bytes` of the file are read.

        Raises
        ------
        CutError
            Where the rest cannot be read; all whole messages before it were yielded.
        """
        try:
            with self._path.open("rb") as file:
                size = file.seek(0, 2)
                file.seek(len(MAGIC))
                while file.tell() < (size if most_bytes is None else min(size, most_bytes)):
                    yield from self._from_file(file, wanted)
        except SourceError:
            raise
        except OSError as error:
            raise CutError(error.strerror or str(error)) from error

    def _from_file(self, file: IO[bytes], wanted: Collection[str] | None) -> Iterator[RawMessage]:
        fields = _fields(_sized(file))
        if _op(fields) != _CHUNK:
            data = _sized(file)
            yield from self._from_record(fields, memoryview(data), wanted)
            return
        length = unpack(_U32, file.read(_U32.size))[0]
        packed = file.read(min(length, MAX_RECORD_BYTES))
        kind = fields.get("compression", b"").decode("utf-8", "replace")
        content, is_all = decompressed(kind, packed, _number(fields, "size"))
        yield from self._from_chunk(memoryview(content), wanted)
        if len(packed) < length:
            raise CutError("the last chunk is cut off")
        if not is_all:
            raise CutError("a chunk is damaged")

    def _from_chunk(self, content: memoryview, wanted: Collection[str] | None) -> Iterator[RawMessage]:
        at = 0
        while at + _U32.size <= len(content):
            header, at = _slice(content, at)
            data, at = _slice(content, at)
            if header is None or data is None:
                return
            yield from self._from_record(_fields(header), data, wanted)

    def _from_record(self, fields: Fields, data: memoryview, wanted: Collection[str] | None) -> Iterator[RawMessage]:
        op = _op(fields)
        if op == _CONNECTION:
            self.connections[_number(fields, "conn")] = _connection(fields, data)
        elif op == _MESSAGE and wanted is not None:
            topic, _ = self.connections.get(_number(fields, "conn"), ("", ""))
            if topic in wanted:
                seconds, nanoseconds = unpack(_TIME, fields.get("time", b""))
                yield RawMessage(topic, seconds * NS_PER_S + nanoseconds, data)


def _record(file: IO[bytes]) -> tuple[Fields, memoryview]:
    return _fields(_sized(file)), memoryview(_sized(file))


def _sized(file: IO[bytes]) -> bytes:
    """Return bytes that stand behind their number."""
    size = unpack(_U32, file.read(_U32.size))[0]
    if size > MAX_RECORD_BYTES:
        raise CutError(f"a record of {size} bytes, {MAX_RECORD_BYTES} at most")
    data = file.read(size)
    if len(data) < size:
        raise CutError("the last record is cut off")
    return data


def _slice(content: memoryview, at: int) -> tuple[memoryview | None, int]:
    """Return bytes that stand behind their number and where they end; None where they are cut off."""
    if at + _U32.size > len(content):
        return None, at
    end = at + _U32.size + _U32.unpack_from(content, at)[0]
    return (content[at + _U32.size : end] if end <= len(content) else None), end


def _fields(header: bytes | memoryview) -> Fields:
    fields: Fields = {}
    view, at = memoryview(header), 0
    while at < len(view):
        part, at = _slice(view, at)
        name, equals, value = (b"" if part is None else bytes(part)).partition(b"=")
        if not equals:
            raise CutError("the header of a record is damaged")
        fields[name.decode("utf-8", "replace")] = value
    return fields


def _op(fields: Fields) -> int:
    return (fields.get("op") or b"\0")[0]


def _number(fields: Fields, name: str) -> int:
    return int(unpack(_U32, fields.get(name, b""))[0])


def _connection(fields: Fields, data: memoryview) -> tuple[str, str]:
    """Return topic and type."""
    described = _fields(data)
    topic = fields.get("topic") or described.get("topic", b"")
    return topic.decode("utf-8", "replace"), ros2_name(described.get("type", b"").decode("utf-8", "replace"))
