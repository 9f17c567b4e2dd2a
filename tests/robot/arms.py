"""An arm of two links over a table, in YAML and as a URDF, for the tests of the robot."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from dloftbs.robot import RobotModel
from dloftbs.robot.kinematics import RobotJoint

YAML = """
joints:
  - {name: shoulder, parent: base, child: upper, axis: [0, 0, 1]}
  - {name: elbow, parent: upper, child: lower, axis: [0, 1, 0],
     origin: {translation_m: [0.3, 0, 0], rpy: [0.2, 0, 0.1]}}
  - {name: slide, type: prismatic, parent: lower, child: tool, axis: [1, 0, 0], origin: {translation_m: [0.2, 0, 0]}}
capsules:
  - {link: upper, start_m: [0, 0, 0], end_m: [0.3, 0, 0], radius_m: 0.05}
  - {link: lower, start_m: [0, 0, 0], end_m: [0.2, 0, 0], radius_m: 0.03}
  - {link: tool, start_m: [0, 0, 0], radius_m: 0.04}
grippers:
  - {link: tool, radius_m: 0.05, joint: slide, closed_below: 0.02}
camera_pose: {translation_m: [0.2, 0, 1.0], rpy: [3.141592653589793, 0, 0]}
"""
"""Its camera looks down from a metre above the base."""

URDF = """<robot name="arm">
  <link name="base"/>
  <link name="upper"><collision><origin xyz="0.15 0 0" rpy="0 1.5707963267948966 0"/>
    <geometry><cylinder radius="0.05" length="0.3"/></geometry></collision></link>
  <link name="lower"><collision><geometry><sphere radius="0.04"/></geometry></collision>
    <collision><origin xyz="0.1 0 0"/><geometry><box size="0.2 0.06 0.04"/></geometry></collision></link>
  <link name="tool"><collision><geometry><mesh filename="tool.obj" scale="0.1 0.1 0.1"/></geometry></collision></link>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 0 1"/>
    <limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
  <joint name="elbow" type="continuous"><parent link="upper"/><child link="lower"/><axis xyz="0 2 0"/>
    <origin xyz="0.3 0 0" rpy="0.2 0 0.1"/></joint>
  <joint name="wrist" type="revolute"><parent link="lower"/><child link="tool"/><axis xyz="1 0 0"/>
    <origin xyz="0.2 0 0"/><limit lower="-3" upper="3" effort="1" velocity="1"/>
    <mimic joint="elbow" multiplier="-0.5" offset="0.1"/></joint>
</robot>
"""

OBJ = "v -1 -1 -1\nv 1 -1 -1\nv 0 1 -1\nv 0 0 1\nf 1 2 3\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"
"""A pyramid."""


def write_yaml(folder: Path, text: str = YAML) -> Path:
    (folder / "robot.yaml").write_text(text)
    return folder / "robot.yaml"


def write_urdf(folder: Path) -> Path:
    (folder / "tool.obj").write_text(OBJ)
    (folder / "robot.urdf").write_text(URDF)
    return folder / "robot.urdf"


def robot_of(*names: str, kind: str = "revolute") -> RobotModel:
    """Return a robot without bodies whose joints are all on its base."""
    axis = np.array([0.0, 0.0, 1.0])
    return RobotModel([RobotJoint(name, kind, "base", f"{name}_link", np.eye(4), axis) for name in names], [])
