"""Making messages with the classes of a library: each function that builds results takes one of these.

A factory is called with a type's name and its fields: ``make("std_msgs/msg/Header", stamp=..., frame_id="camera")``.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from array import array
from typing import Any

import numpy as np

from dloftbs.errors import InputError
from dloftbs.ros.requirements import needed
from dloftbs.support.values import check_text, shown


class MessageFactory(ABC):
    """Makes messages by the name of their type."""

    @abstractmethod
    def __call__(self, type_name: str, **fields: Any) -> Any:
        """Return a message; fields that are not given have the defaults of their types."""


class RosbagsFactory(MessageFactory):
    """Makes messages of the classes of a ``rosbags`` type store.

    Parameters
    ----------
    store : rosbags.typesys.store.Typestore

    Raises
    ------
    InputError
        If it is no such store; when called, if the store has no such type or the type no such field.
    """

    def __init__(self, store: Any) -> None:
        if not hasattr(store, "fielddefs") or not hasattr(store, "types"):
            raise InputError(f"store must be a type store of rosbags, got {shown(store)}")
        self._store = store

    def __call__(self, type_name: str, **fields: Any) -> Any:
        """Return a message; fields that are not given have the defaults of their types."""
        if check_text("type_name", type_name) not in self._store.types:
            raise InputError(f"there is no type of message {type_name!r}")
        names = [name for name, _ in self._store.fielddefs[type_name][1]]
        unknown = sorted(fields.keys() - set(names))
        if unknown:
            raise InputError(f"{type_name} has the fields {', '.join(names)}; unknown: {', '.join(unknown)}")
        values = {
            name: fields[name] if name in fields else self._default(description)
            for name, description in self._store.fielddefs[type_name][1]
        }
        return self._store.types[type_name](**values)

    def _default(self, description: Any) -> Any:
        kind, detail = description
        match kind.name:
            case "NAME":
                return self(detail)
            case "BASE":
                return _DEFAULTS.get(detail[0], 0)
        element, size = detail
        if element[0].name == "BASE" and element[1][0] not in ("string",):
            return np.zeros(size if kind.name == "ARRAY" else 0, element[1][0])
        return [self._default(element) for _ in range(size)] if kind.name == "ARRAY" else []


_DEFAULTS: dict[str, Any] = {"string": "", "bool": False, "float32": 0.0, "float64": 0.0}


class RclpyFactory(MessageFactory):
    """Makes messages of the classes that ROS 2 has installed, which take fields by name alone.

    Raises
    ------
    InputError
        When called, if the name is none of a type.
    SourceError
        When called, if its package is not installed.
    """

    def __init__(self) -> None:
        self._kinds: dict[str, tuple[Any, frozenset[str]]] = {}

    def __call__(self, type_name: str, **fields: Any) -> Any:
        """Return a message; fields that are not given have the defaults of their types."""
        known = self._kinds.get(check_text("type_name", type_name))
        if known is None:
            known = self._kinds[type_name] = _class_of(type_name)
        kind, octets = known
        return kind(**{key: _as_rclpy(value, key in octets) for key, value in fields.items()})


def _class_of(type_name: str) -> tuple[Any, frozenset[str]]:
    """Return the class of a type, and the names of its fields of a single byte."""
    package, _, name = type_name.partition("/msg/")
    if not package.isidentifier() or not name.isidentifier():
        raise InputError(f"a type of message is named like std_msgs/msg/Header, got {shown(type_name)}")
    kind = getattr(needed(f"{package}.msg", f"ROS 2's package {package} (source ROS's setup.bash)"), name, None)
    if kind is None:
        raise InputError(f"there is no type of message {type_name!r}")
    return kind, frozenset(key for key, of in kind.get_fields_and_field_types().items() if of == "octet")


def _as_rclpy(value: Any, is_octet: bool) -> Any:
    if isinstance(value, np.ndarray):
        return array("B", value.tobytes()) if value.dtype == np.uint8 else value.tolist()
    return bytes([value]) if is_octet else value  # a byte is an integer to all others
