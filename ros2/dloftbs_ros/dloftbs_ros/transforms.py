"""Curves and cameras in another coordinate frame, by the transforms on ``/tf`` and ``/tf_static``."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from importlib import import_module
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from dloftbs.data.branch_point import BranchPoint
from dloftbs.errors import DloftbsError
from dloftbs.ros import SampledTrack

FloatArray = npt.NDArray[np.float64]

WAIT_S = 0.1
"""Longest wait for a transform at a frame's time: two of those that a slow robot publishes, at 20 a second."""


class TransformError(DloftbsError):
    """There is no transform between two coordinate frames at a frame's time."""


class Transforms:
    """The transforms that are known, kept by ``tf2_ros``.

    Parameters
    ----------
    node : rclpy.node.Node
        Subscribes; another thread than that of `pose` has to spin it.

    Raises
    ------
    DloftbsError
        If ``tf2_ros`` is not installed.
    """

    def __init__(self, node: Any) -> None:
        try:
            self._tf2 = import_module("tf2_ros")  # late: it is needed where a parameter asks for it
        except ModuleNotFoundError as error:
            raise DloftbsError(
                f"target_frame, or a robot without a camera_pose, needs the ROS package tf2_ros_py: {error}"
            ) from error
        self._buffer = self._tf2.Buffer()
        self._listener = self._tf2.TransformListener(self._buffer, node)

    def pose(self, source: str, target: str, stamp_ns: int) -> FloatArray:
        """Return the pose (4, 4) of one coordinate frame in another.

        Parameters
        ----------
        source, target : str
            Coordinate frames: ``p_target = pose @ p_source``.
        stamp_ns : int
            Time of the pose.

        Raises
        ------
        TransformError
            If there is no transform at that time.
        """
        try:
            return matrix_of(self._at(source, target, stamp_ns).transform)
        except self._tf2.TransformException as error:
            raise TransformError(f"no transform from {source!r} to {target!r}: {error}") from error

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


def matrix_of(transform: Any) -> FloatArray:
    """Return a ``geometry_msgs/Transform`` as a matrix (4, 4)."""
    turn, shift = transform.rotation, transform.translation
    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.from_quat([turn.x, turn.y, turn.z, turn.w]).as_matrix()
    matrix[:3, 3] = shift.x, shift.y, shift.z
    return matrix


def moved(samples: Iterable[SampledTrack], pose: FloatArray) -> list[SampledTrack]:
    """Return points in the frame in which theirs has a pose (4, 4)."""
    return [replace(sample, points=sample.points @ pose[:3, :3].T + pose[:3, 3]) for sample in samples]


def moved_points(points: Iterable[BranchPoint], pose: FloatArray) -> tuple[BranchPoint, ...]:
    """Return those of some branch points that are known in space, as `moved` does."""
    places = [(point, pose[:3, :3] @ point.position_3d + pose[:3, 3]) for point in points if point.position_3d]
    return tuple([replace(point, position_3d=tuple(place.tolist())) for point, place in places])
