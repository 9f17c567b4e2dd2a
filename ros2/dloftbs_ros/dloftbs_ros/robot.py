"""The robot in the camera's view, by its joints and, where its file has no pose of the camera, by tf."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import Any

from dloftbs.data.frame import Frame
from dloftbs.errors import DloftbsError
from dloftbs.robot import RobotModel
from dloftbs.ros.joint_messages import JointRows
from dloftbs_ros.transforms import Transforms

KEEP_S = 10.0
"""Time that joints are kept, as that of transforms in tf's buffer: 32 images wait for masks, 6.4 s at 5 a second."""
_URDF = (".urdf", ".xml")


class RobotError(DloftbsError):
    """The robot cannot be placed at a frame's time."""


class RobotInView:
    """Renders a robot into frames; joints come from one thread, frames from another.

    Parameters
    ----------
    robot : RobotModel
    topic : str
        Topic of the joints, for messages.
    transforms : Transforms, optional
        Needed where the robot has no pose of the camera.
    """

    def __init__(self, robot: RobotModel, topic: str, transforms: Transforms | None) -> None:
        self._robot, self._topic, self._transforms = robot, topic, transforms
        self._lock = threading.Lock()
        self.forget()

    def forget(self) -> None:
        """Forget the joints of the past, as for a recording that begins anew."""
        with self._lock:
            self._rows = JointRows(KEEP_S)

    def take(self, message: Any, stamp_ns: int) -> None:
        """Take a ``sensor_msgs/JointState``; the time is for one whose header has none.

        Raises
        ------
        InputError
            If it cannot be read.
        """
        with self._lock:
            self._rows.take(message, stamp_ns)

    def into(self, frame: Frame, camera_frame: str, stamp_ns: int) -> Frame:
        """Return a frame with the robot as an occluder, and its grippers.

        Parameters
        ----------
        frame : Frame
        camera_frame : str
            Coordinate frame of the camera.
        stamp_ns : int
            Time of the frame.

        Raises
        ------
        RobotError
            If its joints or its transform are not known at that time.
        InputError
            If the frame has no camera, or no message has a joint of the robot.
        """
        with self._lock:
            states = self._rows.states()
        joints = {} if not self._robot.joint_names else None if states is None else states.at(frame, self._robot)
        if joints is None:
            raise RobotError(f"joints are unknown at the time of the frame: {self._topic}")
        if self._transforms is None:
            return self._robot.seen_in(frame, joints)
        pose = self._transforms.pose(camera_frame, self._robot.camera_link, stamp_ns)
        return self._robot.seen_in(frame, joints, pose)


def read_robot(path: str) -> RobotModel:
    """Read a robot from a URDF, or from a YAML file.

    Raises
    ------
    SourceError
        If it cannot be read.
    """
    return RobotModel.from_urdf(path) if Path(path).suffix.lower() in _URDF else RobotModel.from_yaml(path)
