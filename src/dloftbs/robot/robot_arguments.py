"""Contents of a file that describes a robot."""

from __future__ import annotations

from dataclasses import dataclass

from dloftbs.robot.bodies import Body
from dloftbs.robot.kinematics import DEFAULT_BASE, RobotJoint
from dloftbs.robot.robot_gripper import RobotGripper
from dloftbs.support.arrays import FloatArray


@dataclass
class RobotArguments:
    """Arguments of `RobotModel`, by their names."""

    joints: list[RobotJoint]
    bodies: list[Body]
    grippers: list[RobotGripper]
    camera_pose: FloatArray | None = None
    camera_link: str | None = None
    base: str = DEFAULT_BASE
