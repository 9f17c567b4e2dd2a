"""The parts that need no ROS."""

from __future__ import annotations

import threading
from types import SimpleNamespace

import numpy as np
import pytest
from dloftbs_ros.newest import Newest
from dloftbs_ros.parameters import as_type
from dloftbs_ros.publishers import (
    Publisher,
    choose,
    missing_depth_text,
    missing_info_text,
    missing_mask_text,
    silence_text,
)
from dloftbs_ros.transforms import matrix_of, moved, moved_points
from dloftbs_ros.watch import SILENT_S, Watch

from dloftbs import BSplineCurve
from dloftbs.data.branch_point import BranchPoint
from dloftbs.data.tracks import Track, TrackState
from dloftbs.errors import ConfigError
from dloftbs.ros import SampledTrack

IMAGE, JPEG, INFO = "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage", "sensor_msgs/msg/CameraInfo"
TOPICS = {"image": "/cam/color", "depth": "/cam/aligned_depth_to_color/image_raw", "camera_info": "/cam/camera_info"}


def taken_every(busy_s: float) -> tuple[Newest[int], float]:
    """Return one from which an item was taken every so many seconds, and the time after that."""
    newest: Newest[int] = Newest()
    for turn in range(20):
        newest.put(-1, turn * busy_s)
        newest.take(turn * busy_s)
    return newest, 20 * busy_s


def test_at_first_the_newest_wins():
    newest: Newest[int] = Newest()
    for item in range(3):
        newest.put(item)
    assert (newest.take(), newest.dropped, newest.skipped) == (2, 2, 0)


def test_of_a_burst_each_item_is_answered_if_that_is_quickly_done():
    newest, now = taken_every(0.005)
    for item in range(4):
        newest.put(item, now)
    assert [newest.take(now + 0.005 * turn) for turn in range(4)] == [0, 1, 2, 3]
    assert newest.dropped == 0


def test_a_stall_is_not_taken_for_the_time_that_an_item_takes():
    newest, now = taken_every(0.005)
    now += 0.5
    for item in range(4):
        newest.put(item, now)
    assert [newest.take(now + 0.005 * turn) for turn in range(4)] == [0, 1, 2, 3]


@pytest.mark.parametrize(("busy_s", "waiting"), [(0.0001, 10), (0.0045, 10), (0.009, 5), (0.015, 3), (0.021, 0)])
def test_the_newest_waits_for_no_longer_than_it_may(busy_s, waiting):
    newest, now = taken_every(busy_s)
    for item in range(1000):
        newest.put(item, now)
    assert newest.take(now) == 999 - waiting
    assert newest.dropped == 999 - waiting


@pytest.mark.parametrize(("rate", "taken"), [(0.0, 300), (10.0, 100), (20.0, 200), (29.0, 290), (60.0, 300)])
def test_a_rate_is_kept_on_the_whole(rate, taken):
    newest: Newest[int] = Newest(rate)
    for item in range(300):
        newest.put(item, 1000.0 + item / 30)
    assert abs(300 - newest.skipped - taken) <= 1
    assert newest.dropped == 300 - newest.skipped - 1


def test_after_a_pause_no_burst_is_let_through():
    newest: Newest[int] = Newest(1.0)
    for now in (0.0, 100.0, 100.1, 100.2, 100.3):
        newest.put(0, now)
    assert newest.skipped == 2  # one comes early


def test_who_waits_goes_on_when_it_is_closed():
    newest: Newest[int] = Newest()
    got = []
    waiting = threading.Thread(target=lambda: got.append(newest.take()))
    waiting.start()
    newest.close()
    waiting.join(10)
    assert got == [None]


@pytest.mark.parametrize(
    ("offers", "reliability", "chosen", "said"),
    [
        ([], "auto", None, ""),
        ([(IMAGE, True)], "auto", (IMAGE, True), ""),
        ([(JPEG, False)], "auto", (JPEG, False), ""),
        ([(IMAGE, True), (IMAGE, False)], "auto", (IMAGE, False), ""),
        ([(IMAGE, True)], "best_effort", (IMAGE, False), ""),
        ([(IMAGE, False)], "reliable", (IMAGE, True), "best effort"),
        ([("std_msgs/msg/String", True)], "auto", None, "must be of type sensor_msgs/msg/Image"),
        ([("std_msgs/msg/String", True), (JPEG, True)], "auto", (JPEG, True), ""),
        ([(INFO, True, True)], "auto", (INFO, True, True), ""),
        ([(INFO, True, True), (INFO, True, False)], "auto", (INFO, True, False), ""),
        ([(INFO, True, True), ("std_msgs/msg/String", True)], "auto", (INFO, True, True), ""),
    ],
)
def test_type_reliability_and_durability_are_those_of_who_publishes(offers, reliability, chosen, said):
    found, problem = choose([Publisher("/a", *offer) for offer in offers], (IMAGE, JPEG, INFO), reliability)
    assert found == (None if chosen is None else Publisher("/a", *chosen))
    assert said in (problem or "") and bool(said) == (problem is not None)


@pytest.mark.parametrize(
    ("present", "said"),
    [
        ([], "nobody publishes images"),
        ([Publisher("/b", JPEG, False, True), Publisher("/b", JPEG, False)], "one of: /b (sensor_msgs/msg/Comp"),
        ([Publisher("/b", JPEG, False)], "one of: /b (sensor_msgs/msg/CompressedImage, best effort)"),
        (
            [Publisher("/depth", IMAGE, True), Publisher("/b", IMAGE, True)],
            "one of: /b (sensor_msgs/msg/Image, reliable)",
        ),
        ([Publisher("/depth", IMAGE, True)], "one of: /depth"),
        (
            [Publisher("/b", IMAGE, True), Publisher("/a/compressed", JPEG, True)],
            "set image_transport to that of: /a/compressed (",
        ),
        ([Publisher("/a", IMAGE, True)], "though it is published"),
    ],
)
def test_silence_is_explained(present, said):
    text = silence_text("/a", 5.2, [*present, Publisher("/other", "std_msgs/msg/String", True)])
    assert text.startswith("no image on /a for 5 s")
    assert said in text and "/other" not in text
    assert text.count("(sensor_msgs") == (" of: " in said)


@pytest.mark.parametrize(
    ("topic", "present", "said"),
    [
        (
            "/aligned_depth_to_color/image_raw",
            [Publisher("/depth/image_rect_raw", IMAGE, True)],
            "align_depth.enable:=true",
        ),
        (
            "/aligned_depth_to_color/image_raw",
            [Publisher("/depth/image_rect_raw", IMAGE, True)],
            "one of: /depth/image_rect_raw",
        ),
        ("/depth_registered", [], "no other topic of the kind is published"),
        ("/depth_registered", [Publisher("/depth_registered", IMAGE, True)], "it is published, but no message comes"),
    ],
)
def test_missing_depth_is_explained(topic, present, said):
    text = missing_depth_text(topic, [*present, Publisher("/color", IMAGE, True)], arrives=False)
    assert text.startswith(f"no depth on {topic}: curves are in pixels alone")
    assert said in text and "/color " not in text
    assert ("align_depth" in text) == ("aligned" in topic)
    assert "one clock" in missing_depth_text(topic, present, arrives=True)


def test_missing_masks_are_explained():
    assert "images are left out, nobody publishes there" in missing_mask_text("/m", [], arrives=False)
    assert "no message comes" in missing_mask_text("/m", [Publisher("/m", IMAGE, True)], arrives=False)
    assert "keep the images' stamps" in missing_mask_text("/m", [], arrives=True)


def test_a_missing_camera_is_explained():
    present = [Publisher("/b/camera_info", INFO, True), Publisher("/c", IMAGE, True)]
    text = missing_info_text("/a/camera_info", present)
    assert text.startswith("no camera on /a/camera_info") and "one of: /b/camera_info (" in text and "/c " not in text
    assert "no message comes" in missing_info_text("/b/camera_info", present)


class Listener:
    """A watch with its time, in steps of half a second, and what it said."""

    def __init__(self, topics: dict[str, str] = TOPICS) -> None:
        self.watch, self.now, self.said = Watch(topics, 0.0), 0.0, []

    def listen(
        self, seconds: float, *names: str, metres: bool = True, problems: dict[str, str] | None = None
    ) -> list[str]:
        said = []
        for _ in range(round(2 * seconds)):
            self.now += 0.5
            for name in names:
                self.watch.hear(name, self.now)
            said += self.watch.words(self.now, list, problems or {}, metres)
        return said


def test_images_that_do_not_come_are_missed_again_and_again():
    listener = Listener()
    assert listener.listen(SILENT_S - 0.5) == []
    said = listener.listen(10.5)
    assert [text.partition(" for ")[0] for text in said] == ["no image on /cam/color"] * 3
    assert listener.listen(4.0, "image", "camera_info", "pair") == []


def test_depth_and_camera_are_missed_once_in_a_silence():
    listener = Listener()
    said = listener.listen(30.0, "image")
    assert [text.partition(" on ")[0] for text in said] == ["no depth", "no camera"]
    assert listener.listen(10.0, "image", "camera_info", "depth", "pair") == []
    (said,) = listener.listen(30.0, "image")  # the camera is known
    assert said.startswith("no depth on /cam/aligned")
    listener.listen(1.0, "image", "pair")
    (said,) = listener.listen(30.0, "image", "depth")
    assert "one clock" in said


def test_masks_are_missed_once_in_a_silence_where_they_have_a_topic():
    listener = Listener({**TOPICS, "mask": "/sam2/mask"})
    (said,) = listener.listen(30.0, "image", metres=False)
    assert said.startswith("no mask on /sam2/mask")
    assert listener.listen(10.0, "image", "mask", "masked", metres=False) == []
    (said,) = listener.listen(30.0, "image", "mask", metres=False)
    assert said.startswith("images have no mask of their time")


def test_depth_is_not_missed_where_nobody_asked_for_metres_or_before_images_come():
    assert Listener().listen(30.0, "image", metres=False) == []
    listener = Listener()
    listener.listen(30.0)
    assert listener.listen(SILENT_S, "image") == []
    assert len(listener.listen(1.0, "image")) == 2


def test_a_known_problem_is_named_in_the_place_of_silence():
    said = Listener().listen(6.0, "image", "camera_info", problems={"depth": "/depth must be an image"})
    assert said == ["/depth must be an image"]


def test_points_are_moved_by_a_transform():
    knots, across = np.array([0.0] * 4 + [1.0] * 4), np.stack([np.arange(4.0), np.zeros(4)], axis=1)
    track = Track(1, TrackState.CONFIRMED, BSplineCurve(knots, across), None, 1, 0, None)
    points = np.array([[0.1, 0.2, 0.3], [1.0, 0.0, 0.0]])
    sample = SampledTrack(track, points, np.array([0.0, 1.0]), np.array([True, False]))
    half = np.sqrt(0.5)
    quarter_turn = SimpleNamespace(x=0.0, y=0.0, z=half, w=half)  # about z: x becomes y
    shift = SimpleNamespace(x=1.0, y=2.0, z=3.0)
    (there,) = moved([sample], matrix_of(SimpleNamespace(rotation=quarter_turn, translation=shift)))
    assert np.allclose(there.points, [[0.8, 2.1, 3.3], [1.0, 3.0, 3.0]])
    assert (
        there.track is track and np.array_equal(there.s, sample.s) and np.array_equal(there.inferred, sample.inferred)
    )
    points = [
        BranchPoint((1.0, 2.0), ((0, 0), (1, 0), (2, 1)), 0.9, (0.1, 0.2, 0.3), 4),
        BranchPoint((5.0, 6.0), (), 0.5),
    ]
    (point,) = moved_points(points, matrix_of(SimpleNamespace(rotation=quarter_turn, translation=shift)))
    assert point.position_3d == pytest.approx((0.8, 2.1, 3.3))
    assert (point.id, point.position) == (4, (1.0, 2.0))


@pytest.mark.parametrize(("value", "default", "taken"), [(1, "", "1"), (5, 0.0, 5.0), (2, 0, 2), ("a", "", "a")])
def test_a_parameter_comes_in_the_type_of_its_default(value, default, taken):
    got = as_type("name", value, default)
    assert got == taken and type(got) is type(taken)


@pytest.mark.parametrize(("value", "default"), [("a", 0), (2.5, 0), (True, 0), ("5", 0.0), (["a"], ""), (None, "")])
def test_another_type_is_refused(value, default):
    with pytest.raises(ConfigError, match="the parameter name must be"):
        as_type("name", value, default)
