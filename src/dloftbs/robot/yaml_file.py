"""Robots in YAML: capsules, joints, grippers and the pose of the camera."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from dloftbs.camera import as_pose
from dloftbs.errors import InputError, source_errors
from dloftbs.robot.bodies import Body
from dloftbs.robot.kinematics import DEFAULT_BASE, FIXED, SLIDING, TURNING, RobotJoint, checked_axis
from dloftbs.robot.robot_arguments import RobotArguments
from dloftbs.robot.robot_gripper import RobotGripper
from dloftbs.robot.urdf_file import read_urdf
from dloftbs.support.arrays import FloatArray, as_vector
from dloftbs.support.documents import parse_yaml, read_text
from dloftbs.support.values import check_number, check_text, list_of, shown

_KEYS = ("urdf", "joints", "capsules", "grippers", "camera_pose", "camera_link")
_FARTHEST = 1e6
_LARGEST_M = 1e3


def read_yaml(path: Path) -> RobotArguments:
    """Return the arguments of the robot of a file.

    Raises
    ------
    SourceError
        As `RobotModel.from_yaml`.
    """
    with source_errors(path, InputError):
        documents = parse_yaml(read_text(path))
        if len(documents) != 1 or not isinstance(documents[0], Mapping):
            raise InputError(f"a robot is one mapping with some of {', '.join(_KEYS)}, got {shown(documents)}")
        return _robot(documents[0], path)


def _robot(given: Mapping[str, Any], path: Path) -> RobotArguments:
    _check_keys("a robot", given, (), _KEYS)
    robot = RobotArguments([], [], [])
    if "urdf" in given:
        robot = read_urdf(path.parent / check_text("urdf", given["urdf"]))
    robot.joints += [_joint(row) for row in list_of("joints", given.get("joints", []))]
    robot.bodies += [_capsule(row) for row in list_of("capsules", given.get("capsules", []))]
    robot.grippers += [_gripper(row) for row in list_of("grippers", given.get("grippers", []))]
    pose, link = given.get("camera_pose"), given.get("camera_link")
    robot.camera_pose = None if pose is None else as_pose("camera_pose", pose)
    robot.camera_link = None if link is None else check_text("camera_link", link)
    return robot


def _joint(row: object) -> RobotJoint:
    data = _check_keys("a joint", row, ("name", "parent", "child"), ("type", "axis", "origin"))
    name = check_text("the name of a joint", data["name"])
    kind = data.get("type", TURNING[0])
    if kind not in (*TURNING, *SLIDING, *FIXED):
        known = ", ".join((*TURNING, *SLIDING, *FIXED))
        raise InputError(f"the type of joint {name} must be one of {known}, got {shown(kind)}")
    axis = checked_axis(name, kind, as_vector(f"the axis of joint {name}", data.get("axis", (0.0, 0.0, 1.0)), 3))
    links = [check_text(f"the {end} of joint {name}", data[end]) for end in ("parent", "child")]
    origin = as_pose(f"the origin of joint {name}", data["origin"]) if "origin" in data else np.eye(4)
    return RobotJoint(name, kind, links[0], links[1], origin, axis)


def _capsule(row: object) -> Body:
    data = _check_keys("a capsule", row, ("start_m", "radius_m"), ("end_m", "link"))
    ends = [_point(f"{end} of a capsule", data[end]) for end in ("start_m", "end_m") if end in data]
    radius = check_number("radius_m of a capsule", data["radius_m"], 0.0, _LARGEST_M)
    return Body(check_text("the link of a capsule", data.get("link", DEFAULT_BASE)), np.array(ends), radius)


def _gripper(row: object) -> RobotGripper:
    data = _check_keys("a gripper", row, ("radius_m",), ("link", "point_m", "joint", "closed_below"))
    if ("joint" in data) != ("closed_below" in data):
        raise InputError("a gripper that opens has both joint and closed_below; one that always holds has neither")
    joint = data.get("joint")
    return RobotGripper(
        check_text("the link of a gripper", data.get("link", DEFAULT_BASE)),
        _point("point_m of a gripper", data.get("point_m", (0.0, 0.0, 0.0))),
        check_number("radius_m of a gripper", data["radius_m"], 0.0, _LARGEST_M),
        None if joint is None else check_text("the joint of a gripper", joint),
        check_number("closed_below of a gripper", data.get("closed_below", 0.0), -_FARTHEST, _FARTHEST),
    )


def _point(name: str, value: Any) -> FloatArray:
    return as_vector(name, value, 3)


def _check_keys(what: str, row: object, needed: tuple[str, ...], others: tuple[str, ...]) -> Mapping[str, Any]:
    """Return a mapping that has all keys that are needed, and none that nobody knows."""
    if not isinstance(row, Mapping):
        raise InputError(f"{what} must be a mapping with {', '.join((*needed, *others))}, got {shown(row)}")
    missing = [key for key in needed if key not in row]
    if missing:
        raise InputError(f"{what} lacks {', '.join(missing)}")
    unknown = [str(key) for key in row if key not in (*needed, *others)]
    if unknown:
        raise InputError(f"{what} has {', '.join((*needed, *others))}; unknown: {', '.join(unknown)}")
    return row
