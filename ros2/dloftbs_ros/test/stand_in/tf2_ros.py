"""What the node uses of ``tf2_ros``, of which pip has none: one transform at a time, from ``/transform``."""

from __future__ import annotations

import time
from typing import Any

from geometry_msgs.msg import TransformStamped
from rclpy.duration import Duration
from rclpy.time import Time


class TransformException(Exception):
    """Base of what `Buffer.lookup_transform` raises."""


class LookupException(TransformException):
    """A frame is not known."""


class ExtrapolationException(TransformException):
    """A transform is older than the time that is asked for."""


class Buffer:
    """Keeps the last transform of each pair of frames."""

    def __init__(self) -> None:
        self._known: dict[tuple[str, str], TransformStamped] = {}

    def keep(self, transform: TransformStamped) -> None:
        self._known[transform.header.frame_id, transform.child_frame_id] = transform

    def clear(self) -> None:
        self._known.clear()

    def lookup_transform(self, target: str, source: str, at: Time, timeout: Duration | None = None) -> TransformStamped:
        end = time.monotonic() + (timeout.nanoseconds / 1e9 if timeout else 0.0)
        while True:
            found = self._known.get((target, source))
            if found is not None and Time.from_msg(found.header.stamp).nanoseconds >= at.nanoseconds:
                return found
            if time.monotonic() > end:
                break
            time.sleep(0.01)
        if found is None:
            raise LookupException(f'"{target}" passed to lookupTransform argument target_frame does not exist.')
        raise ExtrapolationException("Lookup would require extrapolation into the future.")


class TransformListener:
    """Fills a buffer."""

    def __init__(self, buffer: Buffer, node: Any) -> None:
        node.create_subscription(TransformStamped, "/transform", buffer.keep, 10)
