"""Interface of a file of a recording, and what the readers of its formats share."""

from __future__ import annotations

import struct
from abc import ABC, abstractmethod
from collections.abc import Collection, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any, NamedTuple

from dloftbs.errors import SourceError
from dloftbs.ros.requirements import needed

MAX_RECORD_BYTES = 1 << 30
"""Size of the largest chunk or message: an image of `MAX_PIXELS` in colour is smaller."""
SCAN_BYTES = 1 << 28
"""Bytes from the beginning in which topics are looked for, where nothing at the end of the file lists them."""
_ZSTD = b"\x28\xb5\x2f\xfd"
"""Begin of a message that rosbag2 compressed by itself; one of CDR begins with two bytes of at most 1."""
_PIECE = 1 << 16  # bytes of a damaged chunk that are unpacked at a time


@dataclass(frozen=True)
class Topic:
    """A topic of a recording: its name, its type as in ``sensor_msgs/msg/Image``, how many messages, if known.

    `encoding` is how its messages are serialized where it is in no way that is read, as in ``protobuf``.
    """

    name: str
    type_name: str
    count: int | None = None
    encoding: str = ""


class Channel(NamedTuple):
    """A topic as a recording describes it, for copies of its messages, which are CDR.

    Without a definition the recording does not say what the type is made of; `metadata` has the publishers' QoS.
    """

    topic: str
    type_name: str
    definition: bytes = b""
    definition_encoding: str = "ros2msg"
    metadata: tuple[tuple[str, str], ...] = ()


class RawMessage(NamedTuple):
    """A message as it was recorded: where it was published, when it came, in nanoseconds, and its bytes.

    `channel` is what a copy of it needs, and None where it is not CDR.
    """

    topic: str
    stamp_ns: int
    data: bytes | memoryview
    published_ns: int = 0
    sequence: int = 0
    channel: Channel | None = None


class CutError(Exception):
    """A file ends in the middle of something, or what follows is damaged; the message says what is wrong."""


class BagFile(ABC):
    """One file of a recording, read from the beginning to the end, in the order in which it was written.

    A subclass lists its topics in `_listed`, and says in `_messages` with a `CutError` where nothing more can be read.

    Parameters
    ----------
    path : Path

    Attributes
    ----------
    path : Path
    topics : tuple of Topic
    is_ros1 : bool
        Messages are serialized as ROS 1 does.
    is_whole : bool
        The file was finished by whoever wrote it, so that its topics are all that there are.
    cut : str or None
        After `messages`: reason why not all of the file could be read.

    Raises
    ------
    SourceError
        If it is no such file.
    """

    topics: tuple[Topic, ...]
    is_ros1: bool = False
    is_whole: bool = True
    cut: str | None = None

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            self.topics = self._listed()
        except CutError as error:
            raise SourceError(f"{path}: cannot be read as a recording: {error}") from error
        except OSError as error:
            raise SourceError(f"{path}: cannot be read as a recording: {error.strerror or error}") from error

    def messages(self, wanted: Collection[str]) -> Iterator[RawMessage]:
        """Yield the messages of some topics, as far as they can be read."""
        self.cut = None
        try:
            for message in self._messages(wanted):
                yield message if message.data[:4] != _ZSTD else message._replace(data=_plain(message.data))
        except CutError as error:
            self.cut = str(error)

    @abstractmethod
    def _listed(self) -> tuple[Topic, ...]:
        """Return the topics, as far as they can be known without reading all of the file.

        Raises
        ------
        CutError, OSError
            If it is no such file.
        """

    @abstractmethod
    def _messages(self, wanted: Collection[str]) -> Iterator[RawMessage]:
        """Yield the messages of some topics.

        Raises
        ------
        CutError
            Where the rest cannot be read.
        """


def check_magic(file: IO[bytes], magic: bytes, what: str) -> None:
    """Read the mark at the beginning of a file.

    Raises
    ------
    CutError
        If it is another one.
    """
    if file.read(len(magic)) != magic:
        raise CutError(f"it does not begin as {what} does")


def ros2_name(type_name: str) -> str:
    """Return the name of a type as ROS 2 has it: ``sensor_msgs/msg/Image`` for ``sensor_msgs/Image``."""
    parts = type_name.split("/")
    return type_name if len(parts) != 2 else f"{parts[0]}/msg/{parts[1]}"


def decompressed(kind: str, data: bytes | memoryview, size: int) -> tuple[bytes | memoryview, bool]:
    """Return the content of a chunk as far as it can be unpacked, and whether that is all of it.

    Parameters
    ----------
    kind : str
        ``""`` and ``"none"``: not compressed. ``"zstd"``, ``"lz4"``, ``"bz2"``.
    data : bytes
    size : int
        Size of the content, as the file says.

    Raises
    ------
    CutError
        If the kind is unknown, or the content too large.
    """
    if size > MAX_RECORD_BYTES:
        raise CutError(f"a chunk of {size} bytes, {MAX_RECORD_BYTES} at most")
    if kind in ("", "none"):
        return data, len(data) == size
    content = _unpacked(kind, data, size)
    return content, len(content) == size


def _unpacked(kind: str, data: bytes | memoryview, size: int) -> bytes:
    """Return what can be unpacked, at most one byte more than it should be; of what is corrupt, what stands before."""
    begun = _decompressor(kind)
    with suppress(Exception):  # three libraries, each with errors of its own, that all say: corrupt
        if kind == "zstd":  # whose other way has no limit
            return bytes(needed("zstandard").ZstdDecompressor().stream_reader(data).read(size + 1))
        return bytes(begun.decompress(data, max_length=size + 1))
    begun, parts = _decompressor(kind), []
    with suppress(Exception):  # in pieces, since one that fails gives nothing of what it was given at once
        for at in range(0, len(data), _PIECE):
            parts.append(begun.decompress(bytes(data[at : at + _PIECE])))
    return b"".join(parts)


def _decompressor(kind: str) -> Any:
    """Return an object whose `decompress` takes what is packed piece by piece.

    Raises
    ------
    CutError
        If the kind is unknown.
    """
    if kind == "zstd":
        return needed("zstandard").ZstdDecompressor().decompressobj()
    if kind == "lz4":
        return needed("lz4.frame").LZ4FrameDecompressor()
    if kind == "bz2":
        return needed("bz2").BZ2Decompressor()
    raise CutError(f"a chunk with the unknown compression {kind!r}")


def unpack(form: struct.Struct, data: bytes | memoryview, at: int = 0) -> tuple[Any, ...]:
    """Return the numbers at a place.

    Raises
    ------
    CutError
        If there are too few bytes.
    """
    try:
        return form.unpack_from(data, at)
    except struct.error as error:
        raise CutError("a record is cut off") from error


def _plain(data: bytes | memoryview) -> bytes | memoryview:
    """Return a message as it was before it was compressed; what is corrupt stays, and fails when it is read."""
    zstandard = needed("zstandard")
    try:
        stated = zstandard.frame_content_size(data)
        size = MAX_RECORD_BYTES if stated < 0 else min(stated, MAX_RECORD_BYTES)
        return bytes(zstandard.ZstdDecompressor().stream_reader(data).read(size))
    except zstandard.ZstdError:
        return data
