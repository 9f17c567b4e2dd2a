"""MCAP files, finished or not: read from the beginning on, a record of the package ``mcap`` after the other.

The readers of that package give up a file that is cut, and unpack chunks without a limit; its records are whole.
"""

from __future__ import annotations

import struct
from collections.abc import Collection, Iterator
from contextlib import suppress
from io import BytesIO
from pathlib import Path
from typing import IO, Any

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
)
from dloftbs.ros.requirements import needed

MAGIC = b"\x89MCAP0\r\n"
_FOOTER, _SCHEMA, _CHANNEL, _MESSAGE, _CHUNK, _DATA_END = 2, 3, 4, 5, 6, 15
"""Opcodes of the records that are looked at."""
_RECORD = struct.Struct("<BQ")
_MESSAGE_START_BYTES = 22
_ENCODINGS = {"cdr": False, "ros1": True}
"""Serializations of messages, and whether it is that of ROS 1."""


class McapFile(BagFile):
    """An MCAP file. The summary at its end lists its topics; without it they are looked for in its first part."""

    def _listed(self) -> tuple[Topic, ...]:
        with self.path.open("rb") as file:
            check_magic(file, MAGIC, "an MCAP file")
            reader, counts = _Reader(self.path), None
            try:
                counts = reader.take_summary(file)
            except CutError:
                self.is_whole = False
                with suppress(CutError):
                    for _ in reader.messages((), SCAN_BYTES):
                        pass
                    self.is_whole = reader.ended
        self.is_ros1 = any(channel.message_encoding == "ros1" for channel in reader.channels.values())
        return tuple(
            Topic(
                channel.topic,
                ros2_name(reader.schema(channel)[0]),
                None if counts is None else counts.get(number, 0),
                "" if channel.message_encoding in _ENCODINGS else channel.message_encoding or "an unknown form",
            )
            for number, channel in reader.channels.items()
        )

    def _messages(self, wanted: Collection[str]) -> Iterator[RawMessage]:
        yield from _Reader(self.path).messages(wanted)


class _Reader:
    """Reads a file once, and keeps the channels and the schemas that it has come by."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._mcap = needed("mcap.records")
        self._stream = needed("mcap.data_stream").ReadDataStream
        self._broken = (needed("mcap.exceptions").McapError, struct.error, ValueError, OverflowError)
        self._schemas: dict[int, Any] = {}
        self.channels: dict[int, Any] = {}
        self.ended = False

    def take_summary(self, file: IO[bytes]) -> dict[int, int] | None:
        """Take the channels that the end of a file lists, and return how many messages each has, if it says so.

        Raises
        ------
        CutError
            If there is no summary, or it lists no channels.
        """
        file.seek(0)
        try:
            summary = needed("mcap.reader").SeekingReader(file, record_size_limit=MAX_RECORD_BYTES).get_summary()
        except (*self._broken, OSError) as error:
            raise CutError("it has no summary") from error
        counts = None if summary is None or summary.statistics is None else summary.statistics.channel_message_counts
        if summary is None or (not summary.channels and (counts is None or any(counts.values()))):
            raise CutError("it has no summary")
        self.channels, self._schemas = summary.channels, summary.schemas
        return counts

    def schema(self, channel: Any) -> tuple[str, bytes, str]:
        """Return the type of a channel's messages, its definition, and how that is written."""
        schema = self._schemas.get(channel.schema_id)
        return ("", b"", "") if schema is None else (schema.name, schema.data, schema.encoding)

    def messages(self, wanted: Collection[str], most_bytes: int | None = None) -> Iterator[RawMessage]:
        """Yield the messages of some topics; of the file, `most_bytes` are read.

        Raises
        ------
        CutError
            Where the rest cannot be read; all whole messages before it were yielded.
        """
        try:
            with self._path.open("rb") as file:
                size = file.seek(0, 2)
                file.seek(len(MAGIC))
                end = size if most_bytes is None else min(size, most_bytes)
                yield from self._from(file, end, wanted)
        except SourceError:
            raise
        except OSError as error:
            raise CutError(error.strerror or str(error)) from error
        if end == size and not self.ended:
            raise CutError("it has no end mark")

    def _from(self, file: IO[bytes], end: int, wanted: Collection[str]) -> Iterator[RawMessage]:
        """Yield the messages of a file or of a chunk's content, up to `end`."""
        try:
            while file.tell() < end and not self.ended:
                opcode, length = _RECORD.unpack(file.read(_RECORD.size))
                yield from self._from_record(file, opcode, length, wanted)
        except self._broken as error:
            raise CutError("a record is cut off or damaged") from error

    def _from_record(self, file: IO[bytes], opcode: int, length: int, wanted: Collection[str]) -> Iterator[RawMessage]:
        self.ended = opcode in (_DATA_END, _FOOTER)
        if opcode not in (_SCHEMA, _CHANNEL, _MESSAGE, _CHUNK):
            file.seek(length, 1)
            return
        if length > MAX_RECORD_BYTES:
            raise CutError(f"a record of {length} bytes, {MAX_RECORD_BYTES} at most")
        body = file.read(length)
        stream = self._stream(BytesIO(body))
        is_whole = len(body) == length
        if opcode == _CHUNK:
            yield from self._from_chunk(self._mcap.Chunk.read(stream), is_whole, wanted)
        if not is_whole:
            raise CutError("the last record is cut off")
        if opcode == _SCHEMA:
            schema = self._mcap.Schema.read(stream)
            self._schemas[schema.id] = schema
        elif opcode == _CHANNEL:
            channel = self._mcap.Channel.read(stream)
            self.channels[channel.id] = channel
        elif opcode == _MESSAGE and length > _MESSAGE_START_BYTES:
            message = self._mcap.Message.read(stream, length)
            channel = self.channels.get(message.channel_id)
            if channel is not None and channel.topic in wanted and channel.message_encoding in _ENCODINGS:
                times = message.log_time, message.data, message.publish_time, message.sequence
                yield RawMessage(channel.topic, *times, self._recorded(channel))

    def _from_chunk(self, chunk: Any, is_whole: bool, wanted: Collection[str]) -> Iterator[RawMessage]:
        content, is_all = decompressed(chunk.compression, chunk.data, chunk.uncompressed_size)
        try:
            yield from self._from(BytesIO(content), len(content), wanted)
        except CutError:
            is_all = False
        if is_whole and not is_all:
            raise CutError("a chunk is damaged")

    def _recorded(self, channel: Any) -> Channel | None:
        if channel.message_encoding != "cdr":
            return None
        return Channel(channel.topic, *self.schema(channel), tuple(channel.metadata.items()))
