"""Poses from matrices, quaternions and angles, and from files."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from dloftbs.camera import as_pose, read_pose
from dloftbs.errors import InputError, SourceError

ANGLES = st.tuples(*[st.floats(-3.2, 3.2)] * 3)


@given(ANGLES, st.tuples(*[st.floats(-5.0, 5.0)] * 3))
def test_all_forms_of_a_pose_are_one(rpy, translation):
    turn = Rotation.from_euler("xyz", rpy)
    expected = np.eye(4)
    expected[:3, :3], expected[:3, 3] = turn.as_matrix(), translation
    for form in ({"rpy": rpy}, {"quaternion_xyzw": turn.as_quat()}, {"rotation": turn.as_matrix().tolist()}):
        assert as_pose("pose", {"translation_m": translation, **form}) == pytest.approx(expected, abs=1e-9)
    assert as_pose("pose", expected.tolist()) == pytest.approx(expected)


def test_what_is_left_out_is_nothing():
    assert as_pose("pose", {"translation_m": [1, 2, 3]})[:3, 3].tolist() == [1.0, 2.0, 3.0]
    assert as_pose("pose", {"rpy": [0, 0, 0]}) == pytest.approx(np.eye(4))


@pytest.mark.parametrize(
    ("value", "what"),
    [
        (np.eye(3), r"pose must be a matrix \(4, 4\), .* got shape \(3, 3\)"),
        (-np.eye(4), "the last row of pose must be 0 0 0 1, got"),
        (np.diag([1.0, 1.0, -1.0, 1.0]), "the rotation of pose must be one"),
        ({}, "pose must be a matrix"),
        ({"translation": [1, 2, 3]}, "the keys 'translation'"),
        ({"rpy": [0, 0, 0], "rotation": np.eye(3)}, "pose must be a matrix"),
        ({"rotation": np.eye(2)}, r"rotation of pose must have shape \(3, 3\), got \(2, 2\)"),
        ({"quaternion_xyzw": [0, 0, 0, 2]}, "quaternion_xyzw of pose must have the length 1, got 2"),
        ({"translation_m": [1, 2]}, "translation_m of pose"),
        ("pose.yaml", "pose must be"),
    ],
)
def test_wrong_poses_are_refused(value, what):
    with pytest.raises(InputError, match=what):
        as_pose("pose", value)


def test_a_pose_is_read_from_a_file(tmp_path):
    file = tmp_path / "pose.yaml"
    file.write_text("translation_m: [0.1, 0.0, 1.0]\nrpy: [3.141592653589793, 0, 0]\n")
    assert read_pose(file) == pytest.approx(np.array([[1, 0, 0, 0.1], [0, -1, 0, 0], [0, 0, -1, 1], [0, 0, 0, 1.0]]))
    file.write_text("- [1, 0, 0, 0]\n- [0, 1, 0, 0]\n- [0, 0, 1, 2]\n- [0, 0, 0, 1]\n")
    assert read_pose(file)[2, 3] == 2.0
    for text, what in (("", "documents"), ("a: 1", "a pose must be"), ("[", "pose.yaml: ")):
        file.write_text(text)
        with pytest.raises(SourceError, match=what):
            read_pose(file)
    with pytest.raises(SourceError, match="cannot be read"):
        read_pose(tmp_path / "none.yaml")
