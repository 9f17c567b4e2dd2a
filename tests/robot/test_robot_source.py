"""Frames with the robot in them: its occluders, its grippers, and what tracking makes of both."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest
from cli.cli_inputs import run
from drawings import draw_cable

from dloftbs import sources
from dloftbs.camera import PinholeCamera
from dloftbs.data.frame import Frame
from dloftbs.data.tracks import EndKind
from dloftbs.errors import InputError
from dloftbs.pipeline import Pipeline
from dloftbs.robot import JointStates, RobotModel, RobotSource

SIZE = (240, 320)
CAMERA = PinholeCamera(300.0, 300.0, 159.5, 119.5)
ARM = """
joints:
  - {name: rail, type: prismatic, parent: base, child: arm, axis: [1, 0, 0]}
capsules:
  - {link: arm, start_m: [0, -0.5, 0.5], end_m: [0, 0.5, 0.5], radius_m: 0.03}
camera_pose: {translation_m: [0, 0, 0]}
"""
"""A beam half a metre before the camera, across the image, that moves from left to right."""
FRAMES = 12
PLACES = np.linspace(-0.31, 0.31, FRAMES)


def cables():
    """Return the mask of three cables that lie across the image, each with a bend."""
    x = np.linspace(20.0, 300.0, 40)
    lines = [np.column_stack((x, y + 12.0 * np.sin(x / 60.0 + y))) for y in (60.0, 120.0, 180.0)]
    return np.maximum.reduce([draw_cable(line, 7, SIZE) for line in lines]) > 0


@pytest.fixture
def robot(tmp_path):
    (tmp_path / "robot.yaml").write_text(ARM)
    return RobotModel.from_yaml(tmp_path / "robot.yaml")


@pytest.fixture
def joints(tmp_path):
    rows = "".join(f"{i},{place}\n" for i, place in enumerate(PLACES))
    (tmp_path / "joints.csv").write_text(f"frame,rail\n{rows}")
    return JointStates.from_csv(tmp_path / "joints.csv")


def stack(robot):
    """Return the masks of the cables behind the arm."""
    return np.stack([cables() & ~robot.occluders({"rail": place}, CAMERA, SIZE) for place in PLACES])


def test_three_cables_behind_a_moving_arm_keep_their_identities_and_their_ends(robot, joints):
    pipeline = Pipeline()
    with RobotSource(sources.open(stack(robot), camera=CAMERA), robot, joints) as source:
        results = [pipeline.process(frame) for frame in source]
    assert len(results) == FRAMES
    for result in results[3:]:
        assert [track.id for track in result.tracks] == [1, 2, 3]
        for track in result.tracks:
            assert track.curve.length == pytest.approx(results[0].tracks[track.id - 1].curve.length, rel=0.15)


def test_known_as_occluders_or_as_a_robot_results_are_the_same(robot, joints):
    by_robot, by_mask = Pipeline(), Pipeline()
    with RobotSource(sources.open(stack(robot), camera=CAMERA), robot, joints) as source:
        for frame in source:
            covered = robot.occluders({"rail": PLACES[frame.index]}, CAMERA, SIZE)
            plain = replace(frame, occluders=covered, grippers=None)
            np.testing.assert_array_equal(frame.occluders, covered)
            known = by_robot.process(frame).to_dict(), by_mask.process(plain).to_dict()
            assert [{**one, "stage_ms": {}} for one in known[:1]] == [{**one, "stage_ms": {}} for one in known[1:]]


def test_what_hides_cables_already_still_does(robot, joints):
    hand = np.zeros((1, *SIZE), np.uint8)
    hand[0, :20, :20] = 7
    frames = [Frame(mask=np.zeros(SIZE, bool), occluders=hand[0], camera=CAMERA)]

    class Hands(sources.Source):
        name = "hands"

        def __iter__(self):
            return iter(frames)

    (frame,) = RobotSource(Hands(), robot, joints)
    arm = robot.occluders({"rail": PLACES[0]}, CAMERA, SIZE)
    np.testing.assert_array_equal(frame.occluders, arm | (hand[0] > 0))


def test_a_frame_whose_joints_are_unknown_goes_without(robot, joints, caplog):
    masks = np.zeros((FRAMES + 2, *SIZE), bool)
    with RobotSource(sources.open(masks, camera=CAMERA), robot, joints) as source:
        assert [frame.occluders is None for frame in source] == [False] * FRAMES + [True] * 2
    assert caplog.messages == [
        f"frame {FRAMES} goes without the robot: its joints are unknown then",
        "2 frames went without the robot, since its joints are unknown then",
    ]


def test_what_is_missing_is_an_error_that_says_so(robot, joints, tmp_path):
    masks = np.zeros((1, *SIZE), bool)
    with pytest.raises(InputError, match="rendered by the camera's intrinsics, and the frame has none: --camera"):
        list(RobotSource(sources.open(masks), robot, joints))
    (tmp_path / "blind.yaml").write_text(ARM[: ARM.index("camera_pose")])
    blind = RobotModel.from_yaml(tmp_path / "blind.yaml")
    with pytest.raises(InputError, match="the pose of the camera in the robot's base is unknown"):
        RobotSource(sources.open(masks, camera=CAMERA), blind, joints)
    assert len(list(RobotSource(sources.open(masks, camera=CAMERA), blind, joints, np.eye(4)))) == 1


def held(grippers, **more):
    frame = Frame(mask=cables(), camera=CAMERA, grippers=grippers, **more)
    pipeline = Pipeline()
    return {round(track.curve.start[1] / 60): track.ends for track in pipeline.process(frame).tracks}


def test_an_end_in_a_gripper_is_held():
    free = (EndKind.FREE, EndKind.FREE)
    before = held(None)
    assert list(before.values()) == [free] * 3
    ends = Pipeline().process(Frame(mask=cables(), camera=CAMERA)).tracks[1].curve
    at = np.append(CAMERA.deproject(ends.end, np.array(0.5)), 0.02)
    found = Pipeline().process(Frame(mask=cables(), camera=CAMERA, grippers=[at])).tracks
    assert [track.ends for track in found] == [free, (EndKind.FREE, EndKind.HELD), free]
    assert found[1].to_dict()["ends"] == ["free", "held"]
    assert list(held([[*at[:3], 0.0]]).values()) != [free] * 2
    assert list(held([[*at[:2], -1.0, 5.0]]).values()) == [free] * 3  # behind the camera


def test_with_depth_a_gripper_at_another_distance_holds_nothing():
    depth = np.full(SIZE, 500, np.uint16)
    frame = Frame(mask=cables(), depth=depth, camera=CAMERA)
    track = Pipeline().process(frame).tracks[0]
    assert track.curve_3d is not None
    for distance, kind in ((1.0, EndKind.HELD), (1.3, EndKind.FREE)):
        grippers = [[*(distance * track.curve_3d.start), 0.03]]
        assert Pipeline().process(replace(frame, grippers=grippers)).tracks[0].ends == (kind, EndKind.FREE)


@pytest.mark.parametrize("grippers", [[0.0, 0.0, 1.0, 0.1], [[0.0, 0.0, 1.0]], [[0.0, 0.0, 1.0, -1.0]]])
def test_grippers_have_a_place_and_a_radius(grippers):
    with pytest.raises(InputError, match=r"grippers must have shape \(n, 4\), x, y, z and a radius"):
        Frame(mask=cables(), grippers=grippers)


def test_the_command_takes_a_robot(robot, joints, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "masks").mkdir()
    for i, mask in enumerate(stack(robot)):
        cv2.imwrite(f"masks/{i:02d}.png", 255 * mask.astype(np.uint8))
    command = ["track", "masks", "--kind", "mask", "--camera", "300,300,159.5,119.5", "--out", "a.jsonl"]
    run(*command, "--robot", "robot.yaml", "--joints", "joints.csv")
    lines = (tmp_path / "a.jsonl").read_text().splitlines()
    assert len(lines) == FRAMES
    assert lines[-1].count('"hits"') == 3
    alone = run(*command, "--robot", "robot.yaml", code=2)
    assert "--robot and --joints go together" in alone.output
