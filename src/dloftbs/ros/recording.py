"""Recordings: a file, or the files of a folder, one after the other."""

from __future__ import annotations

import os
import re
from collections.abc import Collection, Generator, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

from dloftbs.errors import InputError, SourceError
from dloftbs.ros.bag_file import BagFile, RawMessage, Topic
from dloftbs.ros.mcap_file import McapFile
from dloftbs.ros.requirements import needed
from dloftbs.ros.ros1_file import Ros1File
from dloftbs.ros.sqlite_file import SqliteFile
from dloftbs.sources.image_files import natural_key
from dloftbs.sources.recordings import COMPRESSED, files_in, is_active
from dloftbs.sources.source import logger
from dloftbs.support.values import check_path, shown

_FORMATS: dict[str, type[BagFile]] = {".mcap": McapFile, ".db3": SqliteFile, ".bag": Ros1File}
_PART = re.compile(r"_[0-9]+$")


class Recording:
    """A recording of ROS, whatever wrote it: an MCAP, SQLite or ROS 1 file, or a folder of the first two.

    Files that are compressed as a whole are unpacked into a temporary folder until `close`.

    Parameters
    ----------
    path : str or Path

    Raises
    ------
    InputError
        If it is no path.
    SourceError
        If there is nothing there, it cannot be read, or a folder holds several recordings.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = path = check_path("path", path)
        self._unpacked: TemporaryDirectory[str] | None = None
        paths = _parts(path) if os.path.isdir(path) else [path]
        try:
            self._files = [self._open(part) for part in paths]
        except BaseException:
            self.close()
            raise
        if len({file.is_ros1 for file in self._files}) > 1:
            raise SourceError(f"{path}: holds messages of ROS 1 and of ROS 2; name one of its files")

    @property
    def is_ros1(self) -> bool:
        """True if messages are serialized as ROS 1 does."""
        return self._files[0].is_ros1

    @property
    def topics(self) -> tuple[Topic, ...]:
        """Topics of all files, each once; the number of messages only where all of its files say it."""
        counts: dict[tuple[str, str, str], int | None] = {}
        for file in self._files:
            for topic in file.topics:
                key = (topic.name, topic.type_name, topic.encoding)
                before = counts.get(key, 0)
                counts[key] = None if before is None or topic.count is None else before + topic.count
        return tuple(Topic(name, kind, count, encoding) for (name, kind, encoding), count in counts.items())

    def messages(self, wanted: Collection[str]) -> Iterator[RawMessage]:
        """Yield the messages of some topics, and say in a warning where a file cannot be read to its end.

        Raises
        ------
        InputError
            If the topics are no collection of names.
        """
        _check_names(wanted)
        for file in self._files:
            count = 0
            for message in file.messages(wanted):
                count += 1
                yield message
            if file.cut is not None or not file.is_whole:
                why = "it was not finished" if file.cut is None else f"it is unfinished or damaged: {file.cut}"
                logger.warning("%s: read as far as it goes, %d messages; %s", file.path, count, why)

    def peek(self, wanted: Collection[str]) -> Generator[RawMessage, None, None]:
        """Yield the messages of some topics as `messages` does, without warnings: for a search of the first ones.

        Raises
        ------
        InputError
            If the topics are no collection of names.
        """
        _check_names(wanted)
        for file in self._files:
            yield from file.messages(wanted)

    def close(self) -> None:
        """Remove what was unpacked; closing again does nothing."""
        if self._unpacked is not None:
            self._unpacked.cleanup()
            self._unpacked = None

    def _open(self, path: Path) -> BagFile:
        if not os.path.isfile(path):
            raise SourceError(f"there is no file or folder {str(path)!r}")
        if path.suffix.lower() == COMPRESSED:
            path = self._unpack(path)
        suffix = ".bag" if is_active(path) else path.suffix.lower()
        if suffix not in _FORMATS:
            raise SourceError(f"{path}: is no recording by its name; known are {', '.join(_FORMATS)}")
        return _FORMATS[suffix](path)

    def _unpack(self, path: Path) -> Path:
        zstandard = needed("zstandard")
        if self._unpacked is None:
            self._unpacked = TemporaryDirectory(prefix="dloftbs-")
        target = Path(self._unpacked.name, path.stem)
        try:
            with path.open("rb") as packed, target.open("wb") as file:
                zstandard.ZstdDecompressor().copy_stream(packed, file)
        except zstandard.ZstdError as error:
            logger.warning("%s: unpacked as far as it goes: %s", path, error)
        except OSError as error:
            raise SourceError(f"{path}: cannot be unpacked: {error}") from error
        return target


def _check_names(wanted: object) -> None:
    """Raise an `InputError` if the topics that are wanted are no collection of names."""
    if isinstance(wanted, (str, bytes)) or not isinstance(wanted, Collection):
        raise InputError(f"the topics that are wanted must be a collection of names, got {shown(wanted)}")


def _parts(folder: Path) -> list[Path]:
    """Return the files of a recording in their order, as rosbag2 names them: ``NAME_0.mcap`` and so on."""
    paths = sorted(files_in(folder), key=natural_key)
    if not paths:
        raise SourceError(f"{folder}: holds no recording: no .mcap, .db3 or .bag")
    names = {_PART.sub("", path.name.partition(".")[0]) for path in paths}
    if len(names) > 1 or (len(paths) > 1 and any(path.suffix == ".bag" for path in paths)):
        listed = ", ".join(path.name for path in paths[:10])
        raise SourceError(f"{folder}: holds several recordings; name one of {listed}")
    return paths
