"""rosbag2's SQLite files, as recorders and RealSense write them, with or without ``metadata.yaml``."""

from __future__ import annotations

import sqlite3
from collections.abc import Collection, Iterator
from contextlib import closing
from typing import Any
from urllib.parse import quote

from dloftbs.ros.bag_file import BagFile, Channel, CutError, RawMessage, Topic, ros2_name

_BROKEN = (sqlite3.Error, UnicodeDecodeError)
"""What a damaged file raises: the second where the library cannot read what SQLite says about it."""
_METADATA = {"offered_qos_profiles": "offered_qos_profiles", "topic_type_hash": "type_description_hash"}
"""Keys of a channel's metadata in MCAP, as rosbag2 names them, and its columns for the same."""


class SqliteFile(BagFile):
    """A ``.db3`` file.

    Messages come in the order in which they were written, which is that of the pages in the file.
    """

    def _listed(self) -> tuple[Topic, ...]:
        try:
            with closing(self._connect()) as database:
                names = database.execute("SELECT id, name, type FROM topics ORDER BY id").fetchall()
                counts = self._counts(database)
        except _BROKEN as error:
            raise CutError(str(error)) from error
        return tuple(
            Topic(str(name), ros2_name(str(kind)), None if counts is None else counts.get(number, 0))
            for number, name, kind in names
        )

    def _counts(self, database: sqlite3.Connection) -> dict[int, int] | None:
        try:
            return dict(database.execute("SELECT topic_id, COUNT(*) FROM messages GROUP BY topic_id").fetchall())
        except _BROKEN:  # cut off: it says so again where the messages end
            self.is_whole = False
            return None

    def _connect(self) -> sqlite3.Connection:
        """Open the file without writing to it; what a recorder that was killed left beside it counts if it can be."""
        for options in ("mode=ro", "mode=ro&immutable=1"):
            place = f"file:{quote(str(self.path.absolute()))}?{options}"
            database = sqlite3.connect(place, uri=True, check_same_thread=False)  # whoever stops reading closes it
            try:
                database.execute("SELECT COUNT(*) FROM sqlite_master").fetchone()
                return database
            except sqlite3.OperationalError:
                database.close()
                if "immutable" in options:
                    raise
            except BaseException:
                database.close()
                raise
        raise AssertionError("the last way returns or raises")

    def _messages(self, wanted: Collection[str]) -> Iterator[RawMessage]:
        try:
            with closing(self._connect()) as database:
                names = dict(database.execute("SELECT id, name FROM topics").fetchall())
                numbers = [number for number, name in names.items() if name in wanted]
                marks = ",".join("?" * len(numbers))
                channels = _channels(database)
                query = f"SELECT topic_id, timestamp, data FROM messages WHERE topic_id IN ({marks})"
                for number, stamp_ns, data in database.execute(query, numbers):
                    if isinstance(data, bytes) and isinstance(stamp_ns, int):
                        yield RawMessage(names[number], stamp_ns, data, stamp_ns, 0, channels.get(number))
        except _BROKEN as error:
            raise CutError(str(error)) from error


def _channels(database: sqlite3.Connection) -> dict[int, Channel]:
    """Return what copies of messages need by the numbers of their topics; what a recorder did not write is left out."""
    definitions = {
        kind: (text.encode(), encoding)
        for kind, text, encoding in _rows(
            database, "SELECT topic_type, encoded_message_definition, encoding FROM message_definitions"
        )
        if isinstance(text, str) and isinstance(encoding, str)
    }
    metadata: dict[int, list[tuple[str, str]]] = {}
    for key, column in _METADATA.items():
        for number, text in _rows(database, f"SELECT id, {column} FROM topics"):
            if isinstance(text, str):
                metadata.setdefault(number, []).append((key, text))
    topics = _rows(database, "SELECT id, name, type FROM topics WHERE serialization_format = 'cdr'")
    return {
        number: Channel(str(name), str(kind), *definitions.get(kind, (b"", "")), tuple(metadata.get(number, ())))
        for number, name, kind in topics
    }


def _rows(database: sqlite3.Connection, query: str) -> list[tuple[Any, ...]]:
    """Return what a query finds; nothing where there is no such table or column, or it is damaged."""
    try:
        return database.execute(query).fetchall()
    except _BROKEN:
        return []
