"""A robot: bodies on links, moved by joints, seen by a camera, with grippers that hold cables."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from dloftbs.camera import CameraLike, as_camera, as_pose, inverse_of
from dloftbs.data.frame import Frame
from dloftbs.errors import InputError, source_errors
from dloftbs.robot.bodies import Body, Mask, cover
from dloftbs.robot.kinematics import CONTINUOUS, DEFAULT_BASE, RobotJoint, place_links, sort_joints
from dloftbs.robot.robot_arguments import RobotArguments
from dloftbs.robot.robot_gripper import RobotGripper
from dloftbs.support.arrays import FloatArray
from dloftbs.support.values import check_path, check_size, check_type

PoseLike = npt.ArrayLike | Mapping[str, Any]
"""Poses as `dloftbs.camera.as_pose` takes them."""


class RobotModel:
    """A robot's bodies, joints and grippers; `from_yaml` and `from_urdf` read it.

    Parameters
    ----------
    joints : sequence of RobotJoint
    bodies : sequence of Body
    grippers : sequence of RobotGripper
    camera_pose : numpy.ndarray, shape (4, 4), optional
        Pose of the camera in `camera_link`.
    camera_link : str, optional
        Link that poses of the camera are relative to; the base without one.
    base : str
        Name of the only link of a robot without joints; with joints, these say which link is the base.

    Raises
    ------
    InputError
        If the joints form no tree, or a body, a gripper or the camera is on a link that there is not.
    """

    def __init__(
        self,
        joints: Sequence[RobotJoint],
        bodies: Sequence[Body],
        grippers: Sequence[RobotGripper] = (),
        camera_pose: FloatArray | None = None,
        camera_link: str | None = None,
        base: str = DEFAULT_BASE,
    ) -> None:
        self._joints = sort_joints(joints)
        self._base = self._joints[0].parent if self._joints else base
        self._bodies, self._grippers = tuple(bodies), tuple(grippers)
        self._camera_pose, self._camera_link = camera_pose, camera_link or self._base
        links = {self._base, *(joint.child for joint in self._joints)}
        named = {self._camera_link, *(body.link for body in bodies), *(one.link for one in grippers)}
        if named - links:
            raise InputError(f"unknown link {', '.join(sorted(named - links))}; there are {', '.join(sorted(links))}")
        movable = {joint.name for joint in self._joints}
        unknown = sorted({one.joint for one in grippers if one.joint is not None} - movable)
        if unknown:
            raise InputError(f"unknown joint {', '.join(unknown)}; there are {', '.join(sorted(movable)) or 'none'}")

    def __repr__(self) -> str:
        return f"RobotModel({len(self._bodies)} bodies, {len(self.joint_names)} joints, {len(self._grippers)} grippers)"

    @classmethod
    def from_yaml(cls, path: str | Path) -> RobotModel:
        """Read a robot from a YAML file: capsules, joints, grippers, the camera's pose, or a URDF with more to it.

        Raises
        ------
        SourceError
            If the file, or the URDF that it names, cannot be read or says something else.
        """
        from dloftbs.robot.yaml_file import read_yaml

        return cls._read(check_path("path", path), read_yaml)

    @classmethod
    def from_urdf(cls, path: str | Path) -> RobotModel:
        """Read a robot from a URDF: its joints, and the collision geometry of its links.

        Cylinders, boxes and spheres are taken as they are, meshes as their convex hulls. It needs the extra ``robot``.

        Raises
        ------
        SourceError
            If yourdfpy is not installed, the file or a mesh cannot be read, there are floating or planar joints, or no
            link has collision geometry.
        """
        from dloftbs.robot.urdf_file import read_urdf

        return cls._read(check_path("path", path), read_urdf)

    @classmethod
    def _read(cls, path: Path, read: Callable[[Path], RobotArguments]) -> RobotModel:
        """Build a robot from the arguments that a reader finds in a file."""
        arguments = read(path)
        with source_errors(path, InputError):
            if not arguments.bodies:
                raise InputError(
                    "a robot without bodies covers nothing: it needs capsules in YAML, or <collision> geometry in a "
                    "URDF, where <visual> geometry does not count"
                )
            return cls(**vars(arguments))

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints whose positions are needed."""
        return tuple(joint.name for joint in self._joints if joint.moves)

    @property
    def continuous_joints(self) -> tuple[str, ...]:
        """Names of the joints that turn without limit, whose positions may leap by a turn."""
        return tuple(joint.name for joint in self._joints if joint.kind == CONTINUOUS)

    @property
    def has_camera(self) -> bool:
        """True if the robot knows its camera's pose."""
        return self._camera_pose is not None

    @property
    def base(self) -> str:
        """Name of the link that the others are placed from."""
        return self._base

    @property
    def camera_link(self) -> str:
        """Name of the link that poses of the camera are relative to: the base, unless its file names another one."""
        return self._camera_link

    def seen_in(self, frame: Frame, joints: Mapping[str, float], pose: PoseLike | None = None) -> Frame:
        """Return a frame with the pixels that the robot covers as occluders, and the grippers that hold.

        Occluders and grippers that the frame has already stay, such as those of another robot.

        Parameters
        ----------
        frame : Frame
            With a camera.
        joints, pose
            As `occluders`.

        Raises
        ------
        InputError
            As `occluders`, or if the frame has no camera.
        """
        check_type("frame", frame, Frame)
        if frame.camera is None:
            raise InputError(
                f"frame {frame.index}: a robot is rendered by the camera's intrinsics, and the frame has none: --camera"
            )
        covered = self.occluders(joints, frame.camera, frame.size, pose)
        if frame.occluders is not None:
            covered |= frame.occluders != 0
        grippers = self.grippers(joints, pose)
        if frame.grippers is not None:
            grippers = np.concatenate((frame.grippers, grippers))
        return replace(frame, occluders=covered, grippers=grippers)

    def occluders(
        self, joints: Mapping[str, float], camera: CameraLike, size: tuple[int, int], pose: PoseLike | None = None
    ) -> Mask:
        """Return the pixels that the robot covers.

        Parameters
        ----------
        joints : mapping of str to float
            Positions by the joints' names, radians or metres; others are left out of account.
        camera : PinholeCamera, or what stands for one
        size : (int, int)
            ``(H, W)`` of the image.
        pose : array_like, shape (4, 4), or mapping, optional
            Pose of the camera in `camera_link`, ``p_link = pose @ p_camera``, in the place of the robot's own.

        Returns
        -------
        numpy.ndarray, shape (H, W), bool

        Raises
        ------
        InputError
            If a joint has no position, nobody knows the camera's pose, or a value is wrong.
        """
        seen_by = as_camera(camera)
        rows_columns = check_size("size", size)
        seen_by.check_size(rows_columns)
        links = self._links_seen(joints, pose)
        return cover([body.moved(links[body.link]) for body in self._bodies], seen_by, rows_columns)

    def grippers(self, joints: Mapping[str, float], pose: PoseLike | None = None) -> FloatArray:
        """Return where grippers are that hold, as `Frame.grippers` takes them.

        Parameters
        ----------
        joints, pose
            As `occluders`.

        Returns
        -------
        numpy.ndarray, shape (n, 4)
            x, y, z in the camera's frame, and the radius, metres.

        Raises
        ------
        InputError
            As `occluders`.
        """
        links = self._links_seen(joints, pose)
        holding = [
            one for one in self._grippers if one.joint is None or self._position(one.joint, joints) < one.closed_below
        ]
        points = [(*(links[one.link] @ (*one.point, 1.0))[:3], one.radius_m) for one in holding]
        return np.array(points, dtype=np.float64).reshape(-1, 4)

    def _position(self, name: str, joints: Mapping[str, float]) -> float:
        (joint,) = [joint for joint in self._joints if joint.name == name]
        source, factor, offset = joint.mimic or (name, 1.0, 0.0)
        return factor * joints.get(source, 0.0) + offset

    def _links_seen(self, joints: Mapping[str, float], pose: PoseLike | None) -> dict[str, FloatArray]:
        """Return the poses of the links in the camera's frame."""
        if not isinstance(joints, Mapping):
            raise InputError(f"joints must map names to positions, got {type(joints).__name__}")
        links = place_links(self._joints, self._base, joints)
        in_link = self._camera_pose if pose is None else as_pose("pose", pose)
        if in_link is None:
            raise self._no_camera_pose()
        from_base = inverse_of(links[self._camera_link] @ in_link)
        return {name: from_base @ at for name, at in links.items()}

    def _no_camera_pose(self) -> InputError:
        where = "the robot's base" if self._camera_link == self._base else f"the robot's link {self._camera_link}"
        return InputError(
            f"the pose of the camera in {where} is unknown: give pose=, --camera-pose, or camera_pose in the robot's "
            "YAML file"
        )
