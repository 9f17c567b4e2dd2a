"""MCAP files, finished or not: read from the beginning on, a record after the other."""

from __future__ import annotations

import struct
from collections.abc import Collection, Iterator
from contextlib import suppress
from pathlib import Path
from typing import IO, NamedTuple

from dloftbs.errors import SourceError
from dloftbs.ros.bag_file import (
    MAX_RECORD_BYTES,
    SCAN_BYTES,
    BagFile,
    Channel,
    CutError,
    RawMessage,
    Topic,
    check_magic,
    decompressed,
    ros2_name,
    unpack,
)

MAGIC = b"\x89MCAP0\r\n"
_HEADER, _FOOTER, _SCHEMA, _CHANNEL, _MESSAGE, _CHUNK, _STATISTICS, _DATA_END = 1, 2, 3, 4, 5, 6, 11, 15
"""Opcodes of the records that are looked at."""
_RECORD = struct.Struct("<BQ")
_MESSAGE_START = struct.Struct("<HIQQ")
_CHUNK_START = struct.Struct("<QQQI")
_FOOTER_FIELDS = struct.Struct("<QQI")
_U16, _U32, _U64 = struct.Struct("<H"), struct.Struct("<I"), struct.Struct("<Q")
_ENCODINGS = {"cdr": False, "ros1": True}
"""Serializations of messages, and whether it is that of ROS 1."""

Record = tuple[int, memoryview]


class _Channel(NamedTuple):
    topic: str
    type_name: str
    encoding: str
    recorded: Channel | None = None


class _Schema(NamedTuple):
    name: str
    encoding: str
    data: bytes


class McapFile(BagFile):
    """An MCAP file. The summary at its end lists its topics; without it they are looked for in its first part."""

    def _listed(self) -> tuple[Topic, ...]:
        with self.path.open("rb") as file:
            check_magic(file, MAGIC, "an MCAP file")
            channels, counts = self._channels(file)
        self.is_ros1 = any(channel.encoding == "ros1" for channel in channels.values())
        return tuple(
            Topic(
                channel.topic,
                channel.type_name,
                None if counts is None else counts.get(number, 0),
                "" if channel.encoding in _ENCODINGS else channel.encoding or "an unknown form",
            )
            for number, channel in channels.items()
        )

    def _channels(self, file: IO[bytes]) -> tuple[dict[int, _Channel], dict[int, int] | None]:
        """Return the channels by their numbers, and how many messages each has, if the file says so."""
        try:
            return self._summary(file)
        except CutError:
            pass
        reader = _Reader(self.path)
        try:
            for _ in reader.messages(None, SCAN_BYTES):
                pass
            self.is_whole = reader.ended
        except CutError:
            self.is_whole = False
        return reader.channels, None

    def _summary(self, file: IO[bytes]) -> tuple[dict[int, _Channel], dict[int, int] | None]:
        """Return what the summary at the end of the file lists.

        Raises
        ------
        CutError
            If there is none.
        """
        size = file.seek(0, 2)
        tail = _RECORD.size + _FOOTER_FIELDS.size + len(MAGIC)
        file.seek(max(0, size - tail))
        end = file.read(tail)
        if len(end) < tail or not end.endswith(MAGIC) or _RECORD.unpack_from(end) != (_FOOTER, _FOOTER_FIELDS.size):
            raise CutError("it has no footer")
        start, _, _ = _FOOTER_FIELDS.unpack_from(end, _RECORD.size)
        if not 0 < start <= size - tail:
            raise CutError("it has no summary")
        file.seek(start)
        schemas: dict[int, _Schema] = {}
        channels: dict[int, _Channel] = {}
        counts: dict[int, int] | None = None
        for opcode, body in _records(memoryview(file.read(min(size - tail - start, MAX_RECORD_BYTES)))):
            if opcode == _SCHEMA:
                number, schema = _schema(body)
                schemas[number] = schema
            elif opcode == _CHANNEL:
                number, channel = _channel(body, schemas)
                channels[number] = channel
            elif opcode == _STATISTICS:
                counts = _counts(body)
        if not channels and (counts is None or any(counts.values())):
            raise CutError("its summary lists no channels")
        return channels, counts

    def _messages(self, wanted: Collection[str]) -> Iterator[RawMessage]:
        yield from _Reader(self.path).messages(wanted)


class _Reader:
    """Reads a file once, and keeps the channels that it has come by."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._schemas: dict[int, _Schema] = {}
        self.channels: dict[int, _Channel] = {}
        self.ended = False

    def messages(self, wanted: Collection[str] | None, most_bytes: int | None = None) -> Iterator[RawMessage]:
        """Yield the messages of some topics, or of none where `wanted` is None; `most_bytes` of the file are read.

        Raises
        ------
        CutError
            Where the rest cannot be read; all whole messages before it were yielded.
        """
        try:
            with self._path.open("rb", buffering=0) as file:
                size = file.seek(0, 2)
                file.seek(len(MAGIC))
                yield from self._from_file(file, wanted, size, size if most_bytes is None else min(size, most_bytes))
        except SourceError:
            raise
        except OSError as error:
            raise CutError(error.strerror or str(error)) from error

    def _from_file(self, file: IO[bytes], wanted: Collection[str] | None, size: int, end: int) -> Iterator[RawMessage]:
        while file.tell() < end:
            opcode, length = unpack(_RECORD, _read(file, _RECORD.size))
            if opcode in (_DATA_END, _FOOTER):
                self.ended = True
                return
            if opcode not in (_SCHEMA, _CHANNEL, _MESSAGE, _CHUNK):
                if length > size - file.tell():
                    raise CutError("the last record is cut off")
                file.seek(length, 1)
                continue
            if length > MAX_RECORD_BYTES:
                raise CutError(f"a record of {length} bytes, {MAX_RECORD_BYTES} at most")
            body = memoryview(_read(file, length))
            if opcode == _CHUNK:
                yield from self._from_chunk(body, wanted, is_whole=len(body) == length)
            elif len(body) == length:
                yield from self._from_record(opcode, body, wanted)
            if len(body) < length:
                raise CutError("the last record is cut off")
        if end == size:
            raise CutError("it has no end mark")

    def _from_chunk(self, body: memoryview, wanted: Collection[str] | None, *, is_whole: bool) -> Iterator[RawMessage]:
        _, _, size, _ = unpack(_CHUNK_START, body)
        kind, at = _text(body, _CHUNK_START.size)
        content, is_all = decompressed(kind, body[at + _U64.size :], size)
        for opcode, record in _records(memoryview(content)):
            yield from self._from_record(opcode, record, wanted)
        if is_whole and not is_all:
            raise CutError("a chunk is damaged")

    def _from_record(self, opcode: int, body: memoryview, wanted: Collection[str] | None) -> Iterator[RawMessage]:
        if opcode == _MESSAGE:
            if wanted is None:
                return
            number, sequence, log_ns, published_ns = unpack(_MESSAGE_START, body)
            channel = self.channels.get(number)
            if channel is not None and channel.topic in wanted and channel.encoding in _ENCODINGS:
                data = body[_MESSAGE_START.size :]
                yield RawMessage(channel.topic, log_ns, data, published_ns, sequence, channel.recorded)
        elif opcode == _SCHEMA:
            number, schema = _schema(body)
            self._schemas[number] = schema
        elif opcode == _CHANNEL:
            number, channel = _channel(body, self._schemas)
            self.channels[number] = channel


def _records(data: memoryview) -> Iterator[Record]:
    """Yield the whole records in a chunk or a summary."""
    at = 0
    while at + _RECORD.size <= len(data):
        opcode, length = _RECORD.unpack_from(data, at)
        at += _RECORD.size
        if at + length > len(data):
            return
        yield opcode, data[at : at + length]
        at += length


def _read(file: IO[bytes], size: int) -> bytes:
    """Return as many bytes as there are, at most `size`: a read of much may give less."""
    data = file.read(size)
    while len(data) < size:
        more = file.read(size - len(data))
        if not more:
            break
        data += more
    return data


def _schema(body: memoryview) -> tuple[int, _Schema]:
    """Return a schema and its number; where the text of the definition is damaged, it has none."""
    name, at = _text(body, _U16.size)
    encoding, data = "", b""
    with suppress(CutError):
        encoding, at = _text(body, at)
        data, _ = _sized(body, at)
    return unpack(_U16, body)[0], _Schema(name, encoding, data)


def _channel(body: memoryview, schemas: dict[int, _Schema]) -> tuple[int, _Channel]:
    number, schema = unpack(_U16, body)[0], unpack(_U16, body, _U16.size)[0]
    topic, at = _text(body, 2 * _U16.size)
    encoding, at = _text(body, at)
    kind = schemas.get(schema, _Schema("", "", b""))
    recorded = None
    if encoding == "cdr":
        recorded = Channel(topic, kind.name, kind.data, kind.encoding, _metadata(body, at))
    return number, _Channel(topic, ros2_name(kind.name), encoding, recorded)


def _metadata(body: memoryview, at: int) -> tuple[tuple[str, str], ...]:
    """Return the pairs of a map of texts as far as they can be read."""
    pairs: list[tuple[str, str]] = []
    with suppress(CutError):
        content, _ = _sized(body, at)
        view, at = memoryview(content), 0
        while at < len(view):
            key, at = _text(view, at)
            value, at = _text(view, at)
            pairs.append((key, value))
    return tuple(pairs)


def _counts(body: memoryview) -> dict[int, int]:
    """Return the numbers of messages by channel, which stand at the end of the statistics as a map."""
    at = 42  # the other counts, and the first and the last time
    size = unpack(_U32, body, at)[0]
    entry = struct.Struct("<HQ")
    whole = min(size, len(body) - at - _U32.size) // entry.size
    starts = (at + _U32.size + i * entry.size for i in range(whole))
    return dict(entry.unpack_from(body, start) for start in starts)


def _text(body: memoryview, at: int) -> tuple[str, int]:
    """Return a text and where it ends."""
    data, end = _sized(body, at)
    return data.decode("utf-8", "replace"), end


def _sized(body: memoryview, at: int) -> tuple[bytes, int]:
    """Return bytes that stand behind their number, and where they end."""
    size = unpack(_U32, body, at)[0]
    end = at + _U32.size + size
    if end > len(body):
        raise CutError("a record is cut off")
    return bytes(body[at + _U32.size : end]), end
