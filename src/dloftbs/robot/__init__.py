"""The robot as an occluder: its bodies rendered from its joints, and the grippers that hold cables."""

from __future__ import annotations

from dloftbs.robot.joint_states import JointStates
from dloftbs.robot.robot_model import RobotModel
from dloftbs.robot.robot_source import RobotSource

__all__ = ["JointStates", "RobotModel", "RobotSource"]
