"""First messages of a recording's topics, which state their camera and their clock."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from contextlib import closing, suppress
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from dloftbs.errors import InputError
from dloftbs.ros.bag_file import Topic
from dloftbs.ros.camera_messages import intrinsics_of
from dloftbs.ros.image_messages import pixels_of
from dloftbs.ros.message_fields import count_in, frame_id_of, stamp_ns_of
from dloftbs.ros.message_types import MessageTypes
from dloftbs.ros.recording import Recording
from dloftbs.support.arrays import AnyArray

LOOK_BYTES = 1 << 27
"""Bytes of messages that are searched: twenty colour images of full HD, enough for several cameras."""
_TRIES = 8
"""Number of messages of a topic that are searched for one with a time."""


@dataclass(frozen=True, eq=False)
class FirstMessage:
    """The first message of a topic that can be read.

    Parameters
    ----------
    message : object
    offset_ns : int, optional
        Time in the header minus that of the recording, of the first message that has one in its header.
    """

    message: Any
    offset_ns: int | None = None

    @property
    def frame_id(self) -> str:
        """Name of the coordinate frame; empty where the message has none."""
        try:
            return frame_id_of(self.message)
        except InputError:
            return ""

    @cached_property
    def pixels(self) -> AnyArray | None:
        """Pixels of an image; None where they cannot be read."""
        try:
            return pixels_of(self.message)
        except InputError:
            return None

    @property
    def size(self) -> tuple[int, int] | None:
        """Size ``(H, W)`` that an image or a camera has; None where it is not known."""
        if hasattr(self.message, "format"):
            return None if self.pixels is None else self.pixels.shape[:2]
        try:
            return count_in(self.message, "height"), count_in(self.message, "width")
        except InputError:
            return None

    @property
    def intrinsics(self) -> tuple[float, float, float, float] | None:
        """``(fx, fy, cx, cy)`` of a camera; None where it is not calibrated."""
        try:
            return intrinsics_of(self.message)
        except InputError:
            return None


def read_first_messages(
    recording: Recording, types: MessageTypes, topics: Iterable[Topic]
) -> Mapping[str, FirstMessage]:
    """Return the first messages of topics by name; topics that begin later than `LOOK_BYTES` are left out.

    Parameters
    ----------
    recording : Recording
    types : MessageTypes
        Reads the recording's messages.
    topics : iterable of Topic
    """
    wanted = {topic.name: topic for topic in topics if topic.count != 0}
    left = {name: min(_TRIES, topic.count or _TRIES) for name, topic in wanted.items()}
    found: dict[str, FirstMessage] = {}
    size = 0
    with closing(recording.peek(wanted)) as messages:
        while left and size < LOOK_BYTES and (raw := next(messages, None)) is not None:
            size += len(raw.data)
            if raw.topic not in left:
                continue
            left[raw.topic] -= 1
            with suppress(InputError):
                message = types.read(raw.data, wanted[raw.topic].type_name)
                header_ns = stamp_ns_of(message)
                first = found.setdefault(raw.topic, FirstMessage(message))
                if header_ns is not None:
                    found[raw.topic] = FirstMessage(first.message, header_ns - raw.stamp_ns)
                    left[raw.topic] = 0
            if not left[raw.topic]:
                del left[raw.topic]
    return found
