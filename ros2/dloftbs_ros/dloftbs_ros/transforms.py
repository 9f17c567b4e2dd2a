"""Curves in another coordinate frame, by the transforms that are published on ``/tf`` and ``/tf_static``."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from importlib import import_module
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from dloftbs.errors import DloftbsError
from dloftbs.ros import SampledTrack

WAIT_S = 0.1
"""Longest wait for a transform at a frame's time: two of those that a slow robot publishes, at 20 a second."""


class TransformError(DloftbsError):
    """There is no transform into the target frame at a frame's time."""


class Transforms:
    """The transforms that are known, kept by ``tf2_ros``.

    Parameters
    ----------
    node : rclpy.node.Node
        Subscribes; another thread than that of `move` has to spin it.

    Raises
    ------
    DloftbsError
        If ``tf2_ros`` is not installed.
    """

    def __init__(self, node: Any) -> None:
        try:
            self._tf2 = import_module("tf2_ros")  # late: it is needed where a target frame is asked for
        except ModuleNotFoundError as error:
            raise DloftbsError(f"target_frame needs the ROS package tf2_ros_py: {error}") from error
        self._buffer = self._tf2.Buffer()
        self._listener = self._tf2.TransformListener(self._buffer, node)

    def move(self, samples: Iterable[SampledTrack], source: str, target: str, stamp_ns: int) -> list[SampledTrack]:
        """Return points in the target frame.

        Parameters
        ----------
        samples : iterable of SampledTrack
            In metres, in the source frame.
        source, target : str
            Coordinate frames.
        stamp_ns : int
            Time of the points.

        Raises
        ------
        TransformError
            If there is no transform at that time.
        """
        if source == target:
            return list(samples)
        try:
            transform = self._at(source, target, stamp_ns).transform
        except self._tf2.TransformException as error:
            raise TransformError(f"no transform from {source!r} to {target!r}: {error}") from error
        return moved(samples, transform)

    def forget(self) -> None:
        """Forget the transforms of the past, as for a recording that begins anew."""
        self._buffer.clear()

    def _at(self, source: str, target: str, stamp_ns: int) -> Any:
        """Return the transform at a time; one that is not yet there is waited for, one of unknown frames is not."""
        from rclpy.duration import Duration
        from rclpy.time import Time

        time = Time(nanoseconds=stamp_ns)
        try:
            return self._buffer.lookup_transform(target, source, time)
        except self._tf2.ExtrapolationException:
            return self._buffer.lookup_transform(target, source, time, Duration(seconds=WAIT_S))


def moved(samples: Iterable[SampledTrack], transform: Any) -> list[SampledTrack]:
    """Return points as a ``geometry_msgs/Transform`` moves them."""
    turn, shift = transform.rotation, transform.translation
    rotation = Rotation.from_quat([turn.x, turn.y, turn.z, turn.w]).as_matrix()
    offset = np.array([shift.x, shift.y, shift.z])
    return [replace(sample, points=sample.points @ rotation.T + offset) for sample in samples]
