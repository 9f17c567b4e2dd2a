"""Bytes of recorded messages to objects with fields."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

from dloftbs.errors import DloftbsError, InputError, SourceError
from dloftbs.ros.requirements import PIP_LINE, needed

_PADDING = bytes(4)
"""Bytes that librealsense's recorder of ROS 1 appends to each image."""


class MessageTypes:
    """Reads and writes the bytes of messages of the types that this package knows, which never changed within a ROS.

    Parameters
    ----------
    is_ros1 : bool
        Whether messages are serialized as ROS 1 does, or as CDR.
    error : type of DloftbsError
        Raised if rosbags is not installed.

    Attributes
    ----------
    store : rosbags.typesys.store.Typestore

    Raises
    ------
    DloftbsError
        If rosbags is not installed.
    """

    def __init__(self, *, is_ros1: bool = False, error: type[DloftbsError] = SourceError) -> None:
        typesys = needed("rosbags.typesys", PIP_LINE, error)
        self._is_ros1 = is_ros1
        self.store = typesys.get_typestore(typesys.Stores.ROS1_NOETIC if is_ros1 else typesys.Stores.ROS2_JAZZY)

    def read(self, data: bytes | memoryview, type_name: str) -> Any:
        """Return a message.

        Raises
        ------
        InputError
            If the bytes are corrupt, cut off or of another type.
        """
        try:
            return self._read(data, type_name)
        except Exception as error:
            if self._is_ros1 and data[-len(_PADDING) :] == _PADDING:
                with suppress(Exception):
                    return self._read(data[: -len(_PADDING)], type_name)
            raise InputError(f"no message of {type_name}: {error or type(error).__name__}") from error

    def _read(self, data: bytes | memoryview, type_name: str) -> Any:
        if self._is_ros1:
            return self.store.deserialize_ros1(data, type_name)
        return self.store.deserialize_cdr(data, type_name)

    def write(self, message: Any) -> bytes:
        """Return the bytes of a message, as CDR."""
        return bytes(self.store.serialize_cdr(message, message.__msgtype__))

    def definition(self, type_name: str) -> str:
        """Return the text that defines a type, with all that it is made of, as ROS 2 has it in recordings."""
        text, _ = self.store.generate_msgdef(type_name, ros_version=2)
        return str(text)
