"""Joints of a robot from a recording."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from cli.cli_inputs import run
from robot.arms import robot_of
from ros import bag_examples as bags

from dloftbs import sources
from dloftbs.data.frame import Frame
from dloftbs.errors import InputError, SourceError
from dloftbs.robot import RobotModel, RobotSource
from dloftbs.ros.joint_messages import JointRows, read_joints

TOPIC = "/joint_states"
ROBOT = """
joints:
  - {name: rail, type: prismatic, parent: base, child: arm, axis: [1, 0, 0]}
capsules:
  - {link: arm, start_m: [0, -0.5, 0.5], end_m: [0, 0.5, 0.5], radius_m: 0.03}
camera_pose: {translation_m: [0, 0, 0]}
"""


def joints_at(stamp_ns, names, positions, make=bags.MAKE2):
    empty = np.zeros(0)
    place = np.array(positions, np.float64)
    fields = {"name": names, "position": place, "velocity": empty, "effort": empty}
    return TOPIC, stamp_ns, make("sensor_msgs/msg/JointState", header=bags.header(make, stamp_ns), **fields)


def recorded(path, make=bags.MAKE2):
    entries = bags.entries(4, make=make)
    for i in range(4):
        at = bags.stamp_of(i)
        entries += [joints_at(at, ["rail"], [0.01 * i], make), joints_at(at + 1000, ["finger"], [0.5], make)]
    entries.append(joints_at(bags.stamp_of(3) + 5000, ["rail", "finger"], [], make))
    return bags.write_ros1(path, entries) if make is bags.MAKE1 else bags.write_mcap(path, entries)


@pytest.mark.parametrize(("name", "make"), [("a.mcap", bags.MAKE2), ("a.bag", bags.MAKE1)])
def test_joints_of_several_publishers_are_there_when_a_frame_was_taken(tmp_path, name, make):
    recorded(tmp_path / name, make)
    joints = read_joints(tmp_path / name, TOPIC)
    with sources.open(tmp_path / name, topic=bags.COLOUR_TOPIC) as source:
        found = [joints.at(frame, robot_of("rail", "finger")) for frame in source]
    assert [one["rail"] for one in found] == pytest.approx([0.0, 0.01, 0.02, 0.03], abs=1e-6)
    assert {one["finger"] for one in found} == {0.5}


def test_joints_that_stream_are_kept_for_a_while():
    rows = JointRows(keep_s=0.1)
    assert rows.states() is None
    for i in range(20):
        for entry in (joints_at(bags.stamp_of(i), ["rail"], [0.01 * i]), joints_at(bags.stamp_of(i) + 5, ["lid"], [1])):
            rows.take(entry[2], 0)
    frame = Frame(mask=np.ones((4, 4), bool), stamp=bags.stamp_of(19) / 1e9)
    robot = robot_of("rail", "lid")
    assert rows.states().at(frame, robot) == pytest.approx({"rail": 0.19, "lid": 1.0})
    assert rows.states().at(replace(frame, stamp=frame.stamp - 0.5), robot) is None
    with pytest.raises(InputError, match="a JointState has 1 names and 2 positions"):
        rows.take(joints_at(1, ["rail"], [1, 2])[2], 0)


def test_after_time_went_back_joints_are_those_of_the_new_time():
    rows = JointRows(keep_s=10.0)
    for i in range(50):
        rows.take(joints_at(bags.stamp_of(0) + i * 100_000_000, ["rail"], [5.0])[2], 0)
    for i in range(3):
        rows.take(joints_at(bags.stamp_of(0) + i * 100_000_000 + 7, ["rail"], [0.0])[2], 0)
    assert repr(rows.states()) == "JointStates(rail: 3 rows)"
    frame = Frame(mask=np.ones((4, 4), bool), stamp=bags.stamp_of(0) / 1e9 + 0.1)
    assert rows.states().at(frame, robot_of("rail")) == {"rail": 0.0}


def test_a_recording_keeps_all_joints_where_time_goes_back():
    rows = JointRows()
    for second in (5, 6, 1, 2):
        rows.take(joints_at(second * 10**9, ["rail"], [second])[2], 0)
    assert repr(rows.states()) == "JointStates(rail: 4 rows)"


def test_a_joint_whose_messages_stop_is_unknown_though_others_go_on():
    rows = JointRows()
    for i in range(200):
        if i < 100 and i % 2 == 0:
            rows.take(joints_at(i * 10_000_000 + 1, ["rail"], [0.01 * i])[2], 0)
        rows.take(joints_at(i * 10_000_000 + 1, ["finger"], [0.5])[2], 0)
    early, late = (Frame(mask=np.ones((4, 4), bool), stamp=stamp) for stamp in (0.5, 1.5))
    assert rows.states().at(early, robot_of("rail", "finger")) == pytest.approx({"rail": 0.5, "finger": 0.5})
    assert rows.states().at(late, robot_of("rail", "finger")) is None
    assert rows.states().at(late, robot_of("finger")) == pytest.approx({"finger": 0.5})


def test_a_message_that_is_wrong_is_left_out_with_a_warning(tmp_path, caplog):
    good = [joints_at(bags.stamp_of(i), ["rail"], [0.1]) for i in range(3)]
    bags.write_mcap(
        tmp_path / "a.mcap", [*good, *(joints_at(bags.stamp_of(3 + i), ["rail"], [1, 2]) for i in range(2))]
    )
    assert repr(read_joints(tmp_path / "a.mcap", TOPIC)) == "JointStates(rail: 3 rows)"
    assert len(caplog.messages) == 1
    assert "a message of /joint_states is left out: a JointState has 1 names and 2 positions" in caplog.text


def test_a_topic_without_joints_is_an_error(tmp_path):
    recorded(tmp_path / "a.mcap")
    with pytest.raises(SourceError, match=r"no joints on '/joints'; topics of JointState are: /joint_states"):
        read_joints(tmp_path / "a.mcap", "/joints")
    bags.write_mcap(tmp_path / "b.mcap", [joints_at(bags.stamp_of(0), ["rail"], [])])
    with pytest.raises(SourceError, match="no message of /joint_states holds the position of a joint"):
        read_joints(tmp_path / "b.mcap", TOPIC)


def test_the_command_takes_the_topic(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    recorded(tmp_path / "a.mcap")
    (tmp_path / "robot.yaml").write_text(ROBOT)
    run("track", "a.mcap", "--topic", bags.COLOUR_TOPIC, "--hsv", "170:10", "--robot", "robot.yaml", "--joints", TOPIC,
        "--out", "a.jsonl")  # fmt: skip
    assert len((tmp_path / "a.jsonl").read_text().splitlines()) == 4
    with sources.open("a.mcap", topic=bags.COLOUR_TOPIC) as source:
        frames = list(RobotSource(source, RobotModel.from_yaml("robot.yaml"), read_joints("a.mcap", TOPIC)))
    assert all(frame.occluders.any() for frame in frames)
    assert type(frames[0]).__name__ == "RosFrame"
