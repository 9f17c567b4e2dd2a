"""Robots from YAML and URDF: where their links are, what they cover, what they hold, and what is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from robot.arms import YAML, write_urdf, write_yaml

from dloftbs.camera import PinholeCamera
from dloftbs.data.frame import Frame
from dloftbs.errors import InputError, SourceError
from dloftbs.robot import RobotModel
from dloftbs.robot.kinematics import RobotJoint, place_links
from dloftbs.robot.robot_gripper import RobotGripper
from dloftbs.support.documents import parse_yaml

CAMERA = PinholeCamera(600.0, 600.0, 319.5, 239.5)
SIZE = (480, 640)
AT = {"shoulder": 0.5, "elbow": 0.3, "slide": 0.01}


def test_links_go_where_the_joints_lead(tmp_path):
    robot = RobotModel.from_yaml(write_yaml(tmp_path))
    assert robot.joint_names == ("shoulder", "elbow", "slide")
    straight = robot.grippers({"shoulder": 0.0, "elbow": 0.0, "slide": 0.0}, np.eye(4))[0]
    yaw, roll = 0.1, 0.2
    assert straight == pytest.approx([0.3 + 0.2 * np.cos(yaw), 0.2 * np.sin(yaw), 0.0, 0.05])
    turned = robot.grippers({"shoulder": np.pi / 2, "elbow": 0.0, "slide": 0.01}, np.eye(4))[0]
    assert turned == pytest.approx([-0.21 * np.sin(yaw), 0.3 + 0.21 * np.cos(yaw), 0.0, 0.05])
    bent = robot.grippers({"shoulder": 0.0, "elbow": np.pi / 2, "slide": 0.0}, np.eye(4))[0]
    assert bent == pytest.approx(
        [0.3 - 0.2 * np.sin(yaw) * np.sin(roll), 0.2 * np.cos(yaw) * np.sin(roll), -0.2 * np.cos(roll), 0.05]
    )


def test_the_camera_sees_the_arm_where_it_is(tmp_path):
    robot = RobotModel.from_yaml(write_yaml(tmp_path))
    covered = robot.occluders({"shoulder": 0.0, "elbow": 0.0, "slide": 0.0}, CAMERA, SIZE)
    assert covered[239, 200:500].all()  # the camera is above 0.2 m along the arm, which runs to the right
    assert not covered[:200].any()
    assert not covered[:, :165].any()
    away = robot.occluders(AT, CAMERA, SIZE, {"translation_m": [0.0, 0.0, 1.0]})  # looks up
    assert not away.any()


def test_a_camera_on_a_link_moves_with_it(tmp_path):
    text = YAML.replace("camera_pose:", "camera_link: upper\ncamera_pose:")
    robot = RobotModel.from_yaml(write_yaml(tmp_path, text))
    here, there = (robot.occluders({**AT, "shoulder": angle}, CAMERA, SIZE) for angle in (0.0, 1.2))
    np.testing.assert_array_equal(here, there)
    assert here.any()


def test_a_pose_from_elsewhere_is_in_the_link_that_carries_the_camera(tmp_path):
    text, pose = YAML.split("camera_pose: ")
    own = RobotModel.from_yaml(write_yaml(tmp_path, YAML.replace("camera_pose:", "camera_link: upper\ncamera_pose:")))
    given = RobotModel.from_yaml(write_yaml(tmp_path, f"{text}camera_link: upper\n"))
    assert (own.camera_link, given.has_camera) == ("upper", False)
    with pytest.raises(InputError, match="the pose of the camera in the robot's link upper is unknown"):
        given.grippers(AT)
    (calibrated,) = parse_yaml(pose)
    np.testing.assert_array_equal(given.occluders(AT, CAMERA, SIZE, calibrated), own.occluders(AT, CAMERA, SIZE))
    np.testing.assert_array_equal(given.grippers(AT, calibrated), own.grippers(AT))


def test_a_gripper_that_is_open_holds_nothing(tmp_path):
    robot = RobotModel.from_yaml(write_yaml(tmp_path))
    assert robot.grippers({**AT, "slide": 0.03}).shape == (0, 4)
    assert robot.grippers(AT).shape == (1, 4)
    always = YAML.replace(", joint: slide, closed_below: 0.02", "")
    assert len(RobotModel.from_yaml(write_yaml(tmp_path, always)).grippers({**AT, "slide": 0.03})) == 1


def test_two_robots_in_a_frame_both_hold(tmp_path):
    robot = RobotModel.from_yaml(write_yaml(tmp_path))
    frame = Frame(mask=np.zeros(SIZE, bool), camera=CAMERA)
    bent = {**AT, "elbow": 0.6}
    both = robot.seen_in(robot.seen_in(frame, AT), bent)
    np.testing.assert_array_equal(both.grippers, np.concatenate((robot.grippers(AT), robot.grippers(bent))))
    np.testing.assert_array_equal(
        both.occluders, robot.occluders(AT, CAMERA, SIZE) | robot.occluders(bent, CAMERA, SIZE)
    )


def test_a_robot_without_joints_stands_still(tmp_path):
    robot = RobotModel.from_yaml(write_yaml(tmp_path, "capsules:\n  - {start_m: [0, 0, 1], radius_m: 0.1}\n"))
    covered = robot.occluders({}, (600, 600, 319.5, 239.5), SIZE, np.eye(4))
    assert covered.sum() == pytest.approx(np.pi * 60.0**2, rel=0.03)


def test_a_urdf_has_the_links_where_yourdfpy_has_them(tmp_path):
    yourdfpy = pytest.importorskip("yourdfpy")
    path = write_urdf(tmp_path)
    robot = RobotModel.from_urdf(path)
    assert robot.joint_names == ("shoulder", "elbow")
    urdf = yourdfpy.URDF.load(str(path), load_meshes=False)
    for shoulder, elbow in ((0.0, 0.0), (0.7, -0.4), (-2.0, 1.5)):
        urdf.update_cfg({"shoulder": shoulder, "elbow": elbow})
        links = place_links(robot._joints, "base", {"shoulder": shoulder, "elbow": elbow})
        for name, pose in links.items():
            assert pose == pytest.approx(urdf.get_transform(name, "base"), abs=1e-9), name


def test_a_urdf_covers_its_collision_geometry(tmp_path):
    pytest.importorskip("yourdfpy")
    robot = RobotModel.from_urdf(write_urdf(tmp_path))
    down = {"translation_m": [0.2, 0.0, 1.0], "rpy": [np.pi, 0.0, 0.0]}
    covered = robot.occluders({"shoulder": 0.0, "elbow": 0.0}, CAMERA, SIZE, down)
    assert covered[239, 201:500].all()  # from the base to the tool
    assert not covered[:, :190].any()  # a cylinder ends flat
    half = covered[:, 260].sum() / 2.0  # its nearest line is 0.95 m away
    assert half == pytest.approx(600.0 * 0.05 / np.sqrt(1.0 - 0.05**2), abs=1.5)
    extended = write_yaml(tmp_path, "urdf: robot.urdf\ngrippers:\n  - {link: tool, radius_m: 0.05}\n")
    named = RobotModel.from_yaml(extended)
    assert len(named.grippers({"shoulder": 0.0, "elbow": 0.0}, down)) == 1
    np.testing.assert_array_equal(named.occluders({"shoulder": 0.0, "elbow": 0.0}, CAMERA, SIZE, down), covered)


def test_a_fixed_joint_needs_no_axis(tmp_path):
    moved, fixed = (
        f"type: {kind}, parent: lower, child: tool, axis: {axis}"
        for kind, axis in (("prismatic", "[1, 0, 0]"), ("fixed", "[0, 0, 0]"))
    )
    assert RobotModel.from_yaml(write_yaml(tmp_path, YAML.replace(moved, fixed))).joint_names == ("shoulder", "elbow")


def test_a_fixed_joint_of_a_urdf_needs_no_axis(tmp_path):
    pytest.importorskip("yourdfpy")
    path = write_urdf(tmp_path)
    fixed = '<joint name="mount" type="fixed"><parent link="world"/><child link="base"/><axis xyz="0 0 0"/></joint>'
    path.write_text(path.read_text().replace("</robot>", f'<link name="world"/>{fixed}</robot>'))
    assert RobotModel.from_urdf(path).base == "world"


def test_a_joint_may_follow_one_that_follows_another():
    chain = {"c": ("b", 2.0, 0.1), "b": ("a", -0.5, 0.3), "a": None}
    joints = [
        RobotJoint(name, "prismatic", "base", f"{name}_link", np.eye(4), np.array([1.0, 0.0, 0.0]), mimic)
        for name, mimic in chain.items()
    ]
    robot = RobotModel(joints, [], [RobotGripper("c_link", np.zeros(3), 0.1, "c", 0.5)])
    assert robot.joint_names == ("a",)
    (held,) = robot.grippers({"a": 0.4}, np.eye(4))
    assert held == pytest.approx([2.0 * (-0.5 * 0.4 + 0.3) + 0.1, 0.0, 0.0, 0.1])
    assert len(robot.grippers({"a": 0.0}, np.eye(4))) == 0  # at 0.7, which is open
    with pytest.raises(InputError, match="joints follow each other in a circle: c, b, a, c"):
        RobotModel([*joints[:2], replace(joints[2], mimic=("c", 1.0, 0.0))], [])


def test_a_urdf_without_collision_geometry_covers_nothing(tmp_path):
    pytest.importorskip("yourdfpy")
    path = write_urdf(tmp_path)
    path.write_text(path.read_text().replace("collision", "visual"))
    with pytest.raises(SourceError, match="needs capsules in YAML, or <collision> geometry in a URDF"):
        RobotModel.from_urdf(path)
    capsules = "urdf: robot.urdf\ncapsules:\n  - {link: upper, start_m: [0, 0, 0], radius_m: 0.1}\n"
    assert len(RobotModel.from_yaml(write_yaml(tmp_path, capsules))._bodies) == 1


def test_a_urdf_of_one_link_stands_still(tmp_path):
    pytest.importorskip("yourdfpy")
    (tmp_path / "post.urdf").write_text(
        '<robot name="post"><link name="table"><collision><origin xyz="0 0 1"/><geometry><sphere radius="0.1"/>'
        "</geometry></collision></link></robot>"
    )
    post = RobotModel.from_urdf(tmp_path / "post.urdf")
    assert (post.base, post.joint_names) == ("table", ())
    covered = post.occluders({}, CAMERA, SIZE, np.eye(4))
    assert covered.sum() == pytest.approx(np.pi * 60.0**2, rel=0.03)
    with_gripper = "urdf: post.urdf\ngrippers:\n  - {link: table, radius_m: 0.05}\n"
    assert RobotModel.from_yaml(write_yaml(tmp_path, with_gripper)).grippers({}, np.eye(4)).shape == (1, 4)


def test_a_urdf_that_cannot_be_read_says_why(tmp_path):
    pytest.importorskip("yourdfpy")
    path = write_urdf(tmp_path)
    (tmp_path / "tool.obj").unlink()
    with pytest.raises(SourceError, match=r"the mesh 'tool\.obj' is not there; it was looked for at"):
        RobotModel.from_urdf(path)
    path.write_text(path.read_text().replace('type="continuous"', 'type="floating"'))
    with pytest.raises(SourceError, match="joint elbow is floating; known are revolute, continuous, prismatic, fixed"):
        RobotModel.from_urdf(path)
    path.write_text("<robot")
    with pytest.raises(SourceError, match="is no URDF that can be read"):
        RobotModel.from_urdf(path)
    with pytest.raises(SourceError, match="there is no such file"):
        RobotModel.from_urdf(tmp_path / "none.urdf")


@pytest.mark.parametrize(
    ("change", "what"),
    [
        (("capsules:", "cylinders:"), "a robot has urdf, joints, .* unknown: cylinders"),
        ((", radius_m: 0.04}", "}"), "a capsule lacks radius_m"),
        (("link: tool, start_m", "link: hand, start_m"), "unknown link hand; there are base, lower, tool, upper"),
        (("joint: slide", "joint: finger"), "unknown joint finger; there are elbow, shoulder, slide"),
        ((", closed_below: 0.02", ""), "a gripper that opens has both joint and closed_below"),
        (("type: prismatic", "type: planar"), "the type of joint slide must be one of revolute, .* got 'planar'"),
        (("axis: [1, 0, 0]", "axis: [0, 0, 0]"), "the axis of joint slide must have a length"),
        (("child: tool", "child: upper"), "a link is the child of two joints: upper"),
        (("name: slide", "name: elbow"), "a joint has the name of another: elbow"),
        (("parent: base", "parent: tool"), "one base, a link that is no joint's child; got none"),
        (("parent: lower", "parent: ground"), "one base, .* got base, ground"),
        (("camera_pose: {", "camera_pose: {rotated: 1, "), "camera_pose must be a matrix"),
    ],
)
def test_a_file_that_is_wrong_says_where(tmp_path, change, what):
    assert change[0] in YAML
    with pytest.raises(SourceError, match=rf"robot\.yaml: .*{what}"):
        RobotModel.from_yaml(write_yaml(tmp_path, YAML.replace(*change, 1)))


def test_joints_in_a_circle_and_no_bodies_are_refused(tmp_path):
    circle = YAML.replace("parent: lower", "parent: rod", 1) + ""
    circle = circle.replace("joints:\n", "joints:\n  - {name: x, parent: tool, child: rod}\n")
    with pytest.raises(SourceError, match="joints run in a circle: x, slide"):
        RobotModel.from_yaml(write_yaml(tmp_path, circle))
    for text, what in (("grippers: []\n", "covers nothing"), ("- 1\n", "a robot is one mapping"), ("[", "robot.yaml")):
        with pytest.raises(SourceError, match=what):
            RobotModel.from_yaml(write_yaml(tmp_path, text))


def test_what_is_asked_wrongly_is_an_input_error(tmp_path):
    robot = RobotModel.from_yaml(write_yaml(tmp_path))
    with pytest.raises(InputError, match="joints without a position: elbow; there are positions of shoulder, slide"):
        robot.occluders({"shoulder": 0.0, "slide": 0.0}, CAMERA, SIZE)
    with pytest.raises(InputError, match="position of joint elbow"):
        robot.occluders({**AT, "elbow": float("nan")}, CAMERA, SIZE)
    with pytest.raises(InputError, match="joints must map names to positions, got list"):
        robot.occluders([0.0], CAMERA, SIZE)
    with pytest.raises(InputError, match=r"pose must be an array of numbers, got 'pose\.yaml'"):
        robot.occluders(AT, CAMERA, SIZE, "pose.yaml")
    blind = RobotModel.from_yaml(write_yaml(tmp_path, YAML[: YAML.index("camera_pose")]))
    with pytest.raises(InputError, match="the pose of the camera in the robot's base is unknown"):
        blind.grippers(AT)
