"""Positions of joints from a CSV file, at the times of frames."""

from __future__ import annotations

import numpy as np
import pytest
from robot.arms import robot_of

from dloftbs.data.frame import Frame
from dloftbs.errors import InputError, SourceError
from dloftbs.robot import JointStates
from dloftbs.support.documents import MAX_BYTES

MASK = np.zeros((4, 5), bool)


ROBOT = robot_of("a")


def states(tmp_path, text):
    (tmp_path / "joints.csv").write_text(text)
    return JointStates.from_csv(tmp_path / "joints.csv")


def test_between_two_rows_positions_are_in_proportion(tmp_path):
    joints = states(tmp_path, "time, a, b\n10.0, 0.0, 1.0\n\n10.1, 1.0, 1.0\n10.2, 3.0, 1.0\n")
    assert joints.at(Frame(mask=MASK, stamp=10.15), ROBOT) == pytest.approx({"a": 2.0, "b": 1.0})
    assert joints.at(Frame(mask=MASK, stamp=10.25), ROBOT) == pytest.approx({"a": 3.0, "b": 1.0})
    assert joints.at(Frame(mask=MASK, stamp=9.8), ROBOT) is None
    assert joints.at(Frame(mask=MASK, stamp=10.4), ROBOT) is None


def test_in_a_long_gap_they_are_unknown(tmp_path):
    rows = "".join(f"{t},{t}\n" for t in (0.0, 0.1, 0.2, 1.0, 1.1, 1.2))
    joints = states(tmp_path, f"time,a\n{rows}")
    assert joints.at(Frame(mask=MASK, stamp=0.6), ROBOT) is None
    assert joints.at(Frame(mask=MASK, stamp=0.3), ROBOT) is not None


def test_a_joint_with_a_single_row_stays_there(tmp_path):
    joints = states(tmp_path, "time,a\n10.0,0.7\n")
    assert [joints.at(Frame(mask=MASK, stamp=stamp), ROBOT) for stamp in (2.0, 10.0, 60.0)] == [{"a": 0.7}] * 3
    assert states(tmp_path, "frame,a\n3,0.7\n").at(Frame(mask=MASK, index=4), ROBOT) is None


def test_a_recording_of_a_minute_at_a_kilohertz_is_read(tmp_path):
    names = [f"joint_{number}" for number in range(7)]
    times = np.arange(60_000) / 1000.0
    rows = np.column_stack([times, *(np.sin(times + number) for number in range(7))])
    path = tmp_path / "joints.csv"
    np.savetxt(path, rows, "%.9f", ",", header=",".join(("time", *names)), comments="")
    assert path.stat().st_size > MAX_BYTES
    at = JointStates.from_csv(path).at(Frame(mask=MASK, stamp=59.9985), robot_of(*names))
    assert at == pytest.approx({name: np.sin(59.9985 + number) for number, name in enumerate(names)}, abs=1e-6)


def test_each_joint_has_times_of_its_own():
    slow, fast = np.arange(0.0, 1.0, 0.02), np.arange(0.0, 2.0, 0.01)
    joints = JointStates({"arm": (slow, slow), "finger": (fast, fast)})
    frame = Frame(mask=MASK, stamp=1.5)
    assert joints.at(frame, robot_of("arm", "finger")) is None
    assert joints.at(frame, robot_of("finger")) == pytest.approx({"finger": 1.5})
    assert joints.at(Frame(mask=MASK, stamp=0.99), robot_of("arm", "finger")) == pytest.approx(
        {"arm": 0.98, "finger": 0.99}
    )


def test_a_continuous_joint_turns_the_short_way_where_its_angle_wraps(tmp_path):
    joints = states(tmp_path, "time,a\n0,3.03\n1,3.13\n2,-3.13\n3,-3.03\n")
    robot = robot_of("a", kind="continuous")
    turned = [joints.at(Frame(mask=MASK, stamp=stamp), robot)["a"] for stamp in (1.0, 1.4, 1.5, 1.6, 2.0)]
    half = 0.5 * (2.0 * np.pi - 6.26)
    assert np.cos(turned) == pytest.approx(np.cos([3.13, np.pi - 0.2 * half, np.pi, np.pi - 0.2 * half, 3.13]))
    assert (turned[0], turned[-1]) == (3.13, -3.13)
    assert joints.at(Frame(mask=MASK, stamp=1.5), ROBOT) == pytest.approx({"a": 0.0})


def test_frames_are_found_by_their_index(tmp_path):
    joints = states(tmp_path, "frame,a\n0,0.5\n2,0.7\n")
    assert joints.at(Frame(mask=MASK, index=2), ROBOT) == {"a": 0.7}
    assert joints.at(Frame(mask=MASK, index=1, stamp=1.0), ROBOT) is None


def test_times_need_stamps(tmp_path):
    joints = states(tmp_path, "time,a\n0,0.5\n")
    with pytest.raises(InputError, match="joints with times need frames with stamps: give --fps, or a column frame"):
        joints.at(Frame(mask=MASK), ROBOT)


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("", "joints need a header: time .* got nothing"),
        ("a,b\n1,2\n", "joints need a header: .* got a,b"),
        ("time\n1\n", "got time"),
        ("time,a,a\n1,2,3\n", "got time,a,a"),
        ("time,a\n", "times of joints must be one or more"),
        ("time,a\n1,2\n1,3\n", "rise from row to row"),
        ("frame,a\n2,2\n1,3\n", "frames of joints must be one or more, and rise"),
        ("time,a\n1,x\n", "line 2: could not convert"),
        ("time,a\n1,2\n2\n", "line 3 must have 2 finite numbers, got 2"),
        ("time,a\n\n1,2\n2\n", "line 4 must have 2 finite numbers, got 2"),
        ("time,a\n1,nan\n", "line 2 must have 2 finite numbers, got 1,nan"),
    ],
)
def test_a_file_that_is_wrong_says_where(tmp_path, text, what):
    with pytest.raises(SourceError, match=rf"joints\.csv: {what}|joints\.csv: .*{what}"):
        states(tmp_path, text)
