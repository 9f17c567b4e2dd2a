"""Results as messages: every field can be read back, by the classes of rosbags and by those that take names alone."""

from __future__ import annotations

import json
from array import array
from dataclasses import replace
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from builders import curve_through
from hypothesis import given
from hypothesis import strategies as st
from ros import bag_examples as bags

import dloftbs
from dloftbs import FrameResult, InputError, PinholeCamera, Track, TrackState
from dloftbs.data.answers import BendLimit, with_answers
from dloftbs.data.branch_point import BranchPoint
from dloftbs.ros import (
    MarkerWriter,
    RclpyFactory,
    RosFrame,
    answers_message,
    diagnostics_message,
    header_of,
    mask_message,
    picture_message,
    pixels_of,
    points_message,
    sample_m,
    sample_px,
    sampled_m,
)
from dloftbs.ros.result_messages import PIXELS
from dloftbs.ros.track_samples import SAMPLES

CAMERA = PinholeCamera(300.0, 300.0, 160.0, 120.0)
SPACE = curve_through(np.array([(-0.2, 0.0, 0.6), (-0.1, 0.02, 0.7), (0.1, 0.0, 0.7), (0.2, 0.01, 0.6)]))
STATES = st.sampled_from(TrackState)
SPANS = st.lists(st.floats(0.0, 1.0), min_size=4, max_size=4, unique=True).map(sorted)


def track_of(number=1, state=TrackState.CONFIRMED, inferred=(), confidence=1.0, space=True, width=9.0) -> Track:
    image = curve_through(CAMERA.project(SPACE.sample(9)))
    return Track(number, state, image, SPACE if space else None, 3, 0, None, inferred, confidence, width, camera=CAMERA)


def result_of(*tracks: Track, **fields: Any) -> FrameResult:
    return FrameResult((), tracks, fields.pop("reason", None), (240, 320), **fields)


def header() -> Any:
    return header_of(RosFrame(mask=np.zeros((4, 4), bool), frame_id="optical", stamp_ns=bags.START_NS)).message(
        bags.MAKE2
    )


def rows_of(cloud: Any) -> np.ndarray:
    """Read a point cloud as any reader does: by its fields."""
    formats = {2: "u1", 6: "<u4", 7: "<f4"}
    row = np.dtype(
        {
            "names": [field.name for field in cloud.fields],
            "formats": [formats[field.datatype] for field in cloud.fields],
            "offsets": [field.offset for field in cloud.fields],
            "itemsize": cloud.point_step,
        }
    )
    assert cloud.row_step == cloud.width * cloud.point_step == len(cloud.data)
    assert all(field.count == 1 for field in cloud.fields)
    return np.frombuffer(bytes(cloud.data), row)


def sent(message: Any) -> Any:
    """Return a message after it went through its bytes."""
    kind = message.__msgtype__
    return bags.STORE2.deserialize_cdr(bags.STORE2.serialize_cdr(message, kind), kind)


@given(st.integers(1, 2**31 - 1), STATES, SPANS, st.floats(0.0, 1.0))
def test_points_in_metres_can_be_read_back(number, state, spans, confidence):
    track = track_of(number, state, ((spans[0], spans[1]), (spans[2], spans[3])), confidence)
    cloud = sent(points_message(bags.MAKE2, header(), [sample_m(track)], 3))
    rows = rows_of(cloud)
    u = np.linspace(0.0, 1.0, SAMPLES)
    np.testing.assert_array_equal(np.stack([rows[axis] for axis in "xyz"], 1), SPACE(u).astype(np.float32))
    assert set(rows["id"]) == {number}
    np.testing.assert_allclose(rows["s"], u * SPACE.length, rtol=1e-6)
    assert set(rows["confidence"]) == {np.float32(confidence)}
    at = track.u_2d(u)
    inside = [any(low <= place <= high for low, high in track.inferred) for place in at]
    assert rows["inferred"].astype(bool).tolist() == ([True] * SAMPLES if state is TrackState.HIDDEN else inside)
    assert (cloud.header.stamp.sec, cloud.header.stamp.nanosec) == divmod(bags.START_NS, 10**9)
    assert cloud.header.frame_id == "optical"


def test_points_in_pixels_have_no_z_and_are_in_a_frame_of_their_own():
    found = header_of(RosFrame(mask=np.zeros((4, 4), bool), frame_id="optical", stamp_ns=5)).message(bags.MAKE2, PIXELS)
    cloud = sent(points_message(bags.MAKE2, found, [sample_px(track_of(space=False)), sample_px(track_of(7))], 2))
    rows = rows_of(cloud)
    assert rows.dtype.names == ("x", "y", "id", "s", "confidence", "inferred")
    assert cloud.header.frame_id == "optical/pixels"
    assert sorted(set(rows["id"])) == [1, 7]
    assert len(rows) == cloud.width == 2 * SAMPLES


def test_curves_without_depth_are_not_in_metres():
    assert sample_m(track_of(space=False)) is None
    assert list(sampled_m(result_of(track_of(space=False)))) == []
    empty = sent(points_message(bags.MAKE2, header(), [], 3))
    assert (empty.width, empty.row_step, len(empty.data)) == (0, 0, 0)


def test_markers_come_go_and_are_dim_where_nothing_is_seen():
    writer = MarkerWriter(bags.MAKE2)

    def markers(*tracks: Track) -> list[Any]:
        return sent(writer.message(header(), sampled_m(result_of(*tracks)))).markers

    older, line = markers(track_of(3, inferred=((0.0, 0.3),)))
    assert (older.action, older.ns) == (3, "")  # of an earlier process
    assert (line.id, line.type, line.action, len(line.points)) == (3, 4, 0, SAMPLES)
    assert {color.a for color in line.colors} == {0.25, 1.0}
    assert line.colors[0].a == 0.25
    assert line.scale.x == pytest.approx(9.0 * 0.69 / 300.0, abs=1e-3)
    assert line.pose.orientation.w == 1.0
    both = markers(track_of(3), track_of(4, TrackState.HIDDEN))
    assert [(marker.id, marker.action) for marker in both] == [(3, 0), (4, 0)]
    assert {color.a for color in both[1].colors} == {0.25}
    assert [(marker.id, marker.action) for marker in markers(track_of(4))] == [(3, 2), (4, 0)]
    assert [(marker.id, marker.action) for marker in markers(track_of(4, space=False))] == [(4, 2)]
    assert markers() == []
    markers(track_of(9))
    assert [(marker.action, marker.ns) for marker in sent(writer.clear(header())).markers] == [(3, "")]
    assert markers() == []


def test_a_writer_that_was_cleared_at_first_removes_markers_once():
    writer = MarkerWriter(bags.MAKE2)
    writer.clear(header())
    assert writer.message(header(), []).markers == []


def test_branch_points_are_spheres_that_come_and_go():
    writer = MarkerWriter(bags.MAKE2)

    def spheres(*points: BranchPoint) -> list[Any]:
        made = sent(writer.message(header(), sampled_m(result_of(track_of(3))), points)).markers
        return [marker for marker in made if marker.ns == "dloftbs/branch_points"]

    point = BranchPoint((9.0, 9.0), ((0, 0), (1, 0), (2, 1)), 0.9, (0.1, 0.2, 0.7), 5)
    (sphere,) = spheres(point, replace(point, position_3d=None, id=6))
    assert (sphere.id, sphere.type, sphere.action) == (5, 2, 0)
    assert (sphere.pose.position.x, sphere.pose.position.y, sphere.pose.position.z) == (0.1, 0.2, 0.7)
    assert sphere.scale.x == sphere.scale.z > 0.002
    assert [(marker.id, marker.action) for marker in spheres(replace(point, id=None))] == [(5, 2), (1, 0)]
    assert [(marker.id, marker.action) for marker in spheres()] == [(1, 2)]
    assert spheres() == []


def test_a_line_is_as_wide_in_another_coordinate_frame():
    (sample,) = sampled_m(result_of(track_of()))
    elsewhere = replace(sample, points=sample.points[:, ::-1] + 5.0)
    lines = (
        MarkerWriter(bags.MAKE2).message(header(), [sample]),
        MarkerWriter(bags.MAKE2).message(header(), [elsewhere]),
    )
    own, other = (message.markers[-1] for message in lines)
    assert other.scale.x == own.scale.x
    assert [(point.x, point.z) for point in other.points[:1]] == [
        (sample.points[0, 2] + 5.0, sample.points[0, 0] + 5.0)
    ]


@pytest.mark.parametrize("width", [None, 0.01])
def test_a_line_can_be_seen_however_thin(width):
    _, line = MarkerWriter(bags.MAKE2).message(header(), sampled_m(result_of(track_of(width=width)))).markers
    assert line.scale.x == 0.002


def test_the_mask_and_the_picture_can_be_read_back():
    mask = bags.mask_of(0)
    np.testing.assert_array_equal(pixels_of(sent(mask_message(bags.MAKE2, header(), mask))), 255 * (mask > 0))
    jpeg = bags.encoded(bags.photo_of(0), ".jpg")
    message = sent(picture_message(bags.MAKE2, header(), jpeg))
    assert message.format == "jpeg"
    assert bytes(message.data) == jpeg


def test_diagnostics_warn_with_the_reason():
    result = dloftbs.detect(np.zeros((50, 50), bool))
    (status,) = sent(diagnostics_message(bags.MAKE2, header(), result)).status
    assert (status.level, status.message) == (1, result.reason)
    (status,) = sent(diagnostics_message(bags.MAKE2, header(), result_of(track_of(), stage_ms={"linking": 0.5}))).status
    values = {pair.key: pair.value for pair in status.values}
    assert (status.level, status.message, values["linking ms"], values["tracks"]) == (0, "1 tracks", "0.500", "1")


def test_diagnostics_warn_of_strange_input():
    result = result_of(track_of(), diagnosis=("60 % of the mask is set",))
    (status,) = sent(diagnostics_message(bags.MAKE2, header(), result)).status
    assert (status.level, status.message) == (1, "1 tracks; 60 % of the mask is set")


def test_diagnostics_warn_of_tight_bends():
    result = result_of(track_of())
    radius = result.tracks[0].tightest_bend_3d()[1]
    for limit, level in ((BendLimit(1.1 * radius), 1), (BendLimit(0.9 * radius), 0)):
        (status,) = sent(diagnostics_message(bags.MAKE2, header(), result, limit=limit)).status
        assert status.level == level
        assert ("; track 1 bends to " in status.message) is (level == 1)
    mask = np.zeros((60, 120), bool)
    mask[28:33, 10:110] = True
    (status,) = sent(diagnostics_message(bags.MAKE2, header(), dloftbs.detect(mask), limit=BendLimit(0.03))).status
    assert status.level == 1
    assert "bends cannot be compared with 30 mm: the frame has no depth" in status.message


def test_answers_are_a_line_of_json():
    mask = np.zeros((60, 120), bool)
    mask[28:33, 10:110] = True
    result = dloftbs.detect(mask)
    text = sent(answers_message(bags.MAKE2, result, ("std", "topology"))).data
    assert json.loads(text) == json.loads(json.dumps(with_answers(result, ("std", "topology"))))
    assert "\n" not in text
    with pytest.raises(InputError, match="answers are topology, shape, std, got 'knots'"):
        answers_message(bags.MAKE2, result, ("knots",))


def test_a_frame_that_comes_from_no_message_has_its_own_time():
    mask = np.zeros((4, 4), bool)
    assert header_of(dloftbs.Frame(mask=mask, stamp=1.5)).stamp_ns == 1_500_000_000
    assert header_of(dloftbs.Frame(mask=mask, index=3), "lens") == header_of(
        dloftbs.Frame(mask=mask, stamp=3.0), "lens"
    )
    assert header_of(RosFrame(mask=mask, stamp=2.0, frame_id="a"), "b").frame_id == "a"


def test_a_factory_refuses_what_there_is_not():
    with pytest.raises(InputError, match="no type of message 'odd_msgs/msg/Odd'"):
        bags.MAKE2("odd_msgs/msg/Odd")
    with pytest.raises(InputError, match="has the fields stamp, frame_id; unknown: seq"):
        bags.MAKE2("std_msgs/msg/Header", seq=1)


def test_classes_of_rclpy_get_what_they_take(monkeypatch):
    class Status:
        def __init__(self, *, level: bytes, data: Any, name: str) -> None:
            self.given = level, data, name

        @classmethod
        def get_fields_and_field_types(cls) -> dict[str, str]:
            return {"level": "octet", "data": "sequence<uint8>", "name": "string"}

    module = ModuleType("odd_msgs.msg")
    module.Status = Status
    monkeypatch.setitem(__import__("sys").modules, "odd_msgs.msg", module)
    monkeypatch.setitem(__import__("sys").modules, "odd_msgs", ModuleType("odd_msgs"))
    made = RclpyFactory()("odd_msgs/msg/Status", level=1, data=np.arange(3, dtype=np.uint8), name="x")
    assert made.given == (b"\x01", array("B", [0, 1, 2]), "x")
    with pytest.raises(dloftbs.SourceError, match="ROS 2's package absent_msgs"):
        RclpyFactory()("absent_msgs/msg/Odd")
