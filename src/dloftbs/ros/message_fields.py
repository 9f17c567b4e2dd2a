"""Fields of messages by name, whatever library made their class: rosbags, rclpy, rospy."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import numpy.typing as npt

from dloftbs.errors import InputError
from dloftbs.support.values import as_integer, shown

NS_PER_S = 1_000_000_000
_FRAME_ENDS = re.compile(r"(_(optical|frame|link))+$")
"""Suffixes that distinguish the coordinate frames of one sensor by their axes."""
_ALIGNED = "aligned_depth_to_"
"""Part of a frame's name that drivers add to that of the sensor to which depth is aligned."""


def field_of(message: object, *names: str) -> Any:
    """Return the first of the named fields that a message has; ROS 1 and ROS 2 name some of them differently.

    Raises
    ------
    InputError
        If it has none of them.
    """
    for name in names:
        if hasattr(message, name):
            return getattr(message, name)
    raise InputError(f"expected a message with the field {' or '.join(names)}, got {shown(message)}")


def count_in(message: object, name: str) -> int:
    """Return a field that is an integer of at least 0.

    Raises
    ------
    InputError
        If there is no such field, or it holds something else.
    """
    value = as_integer(field_of(message, name))
    if value is None or value < 0:
        raise InputError(f"{name} of a message must be an integer of at least 0, got {shown(field_of(message, name))}")
    return value


def text_in(message: object, name: str) -> str:
    """Return a field that is text.

    Raises
    ------
    InputError
        If there is no such field, or it holds something else.
    """
    value = field_of(message, name)
    if not isinstance(value, str):
        raise InputError(f"{name} of a message must be text, got {shown(value)}")
    return value


def bytes_in(message: object) -> npt.NDArray[np.uint8]:
    """Return the field ``data`` as bytes (n,), a view of it: of bytes, an array.array or a NumPy array.

    Raises
    ------
    InputError
        If there is no such field, or it holds no bytes.
    """
    data = field_of(message, "data")
    try:
        view = memoryview(data)
        return np.frombuffer(view.cast("B"), np.uint8) if view.nbytes else np.zeros(0, np.uint8)
    except (TypeError, ValueError) as error:
        raise InputError(f"data of a message must be bytes, got {shown(data)}") from error


def stamp_ns_of(message: object) -> int | None:
    """Return the time in a message's header, in nanoseconds; None where nobody set it, which is 0 in all libraries.

    Raises
    ------
    InputError
        If there is no header with a time.
    """
    stamp = field_of(field_of(message, "header"), "stamp")
    seconds = as_integer(field_of(stamp, "sec", "secs"))
    nanoseconds = as_integer(field_of(stamp, "nanosec", "nsecs"))
    if seconds is None or nanoseconds is None:
        raise InputError(f"the stamp of a message must be integers, got {shown(stamp)}")
    return seconds * NS_PER_S + nanoseconds or None


def frame_id_of(message: object) -> str:
    """Return the name of the coordinate frame in a message's header.

    Raises
    ------
    InputError
        If there is no header with one.
    """
    return text_in(field_of(message, "header"), "frame_id")


def is_same_sensor(frame_id: str, other_id: str) -> bool | None:
    """Return whether two coordinate frames are those of one sensor; None where one has no name."""
    names = [
        _FRAME_ENDS.sub("", name.strip().lstrip("/").lower()).replace(_ALIGNED, "") for name in (frame_id, other_id)
    ]
    return names[0] == names[1] if all(names) else None


def kind_of_reason(error: object) -> str:
    """Return the text of an error without its numbers, which differ from message to message."""
    return re.sub(r"[0-9]+", "#", str(error))
