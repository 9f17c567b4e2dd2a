"""The first messages of topics are found, and topics that begin late are judged when they come."""

from __future__ import annotations

import pytest
from ros import bag_examples as bags
from ros.test_camera_match import ALIGNED, IN_IR, INFO, OTHER_K, colour, depth, info, read, said, value_of, write

from dloftbs import sources
from dloftbs.ros import Recording, first_messages
from dloftbs.ros.first_messages import read_first_messages
from dloftbs.ros.message_types import MessageTypes

TOPIC = bags.COLOUR_TOPIC


def first_of(path):
    recording = Recording(path)
    return read_first_messages(recording, MessageTypes(), recording.topics)


def image(stamp_ns, encoding="bgr8"):
    return bags.raw_image(bags.photo_of(0), encoding, stamp_ns)


def test_what_first_messages_say(tmp_path):
    counts = depth(encoding="32FC1")[2](bags.START_NS)
    packed = bags.compressed(bags.encoded(bags.photo_of(0), ".png"), "png")
    given = [(TOPIC, 1, image(bags.START_NS)), ("/depth", 1, depth()[2](0)), (INFO, 1, bags.camera_info(k=OTHER_K))]
    given += [("/broken", 1, image(0, "bgr99")), ("/packed", 1, packed), (TOPIC, 2, counts)]
    first = first_of(bags.write_mcap(tmp_path / "run.mcap", given))
    assert first[TOPIC].frame_id == first["/packed"].frame_id == "camera_optical"
    assert first[TOPIC].size == first[INFO].size == first["/packed"].size == bags.SIZE
    assert (first[TOPIC].pixels == bags.photo_of(0)).all()
    assert (first["/broken"].pixels, first["/broken"].intrinsics) == (None, None)
    assert first[INFO].intrinsics == (132.0, 132.0, 79.0, 61.0)
    assert (first[TOPIC].offset_ns, first["/depth"].offset_ns) == (bags.START_NS - 1, None)


def test_a_clock_is_that_of_the_first_header_with_a_time(tmp_path):
    given = [(TOPIC, 1000 + i, image(0 if i < 3 else 5000 + i)) for i in range(5)]
    assert first_of(bags.write_mcap(tmp_path / "run.mcap", given))[TOPIC].offset_ns == 4000


def test_a_topic_that_begins_late_is_not_waited_for(tmp_path, monkeypatch):
    monkeypatch.setattr(first_messages, "LOOK_BYTES", 200_000)
    given = [(TOPIC, i, image(i + 1)) for i in range(5)] + [("/late", 9, image(9))]
    assert list(first_of(bags.write_mcap(tmp_path / "run.mcap", given))) == [TOPIC]


@pytest.mark.parametrize(
    ("stream", "why"),
    [
        (depth(ALIGNED, IN_IR), "frames go without depth, which is not registered to the images: it is in the frame"),
        (info(INFO, IN_IR, k=OTHER_K), "frames go without a camera: it is in the frame 'camera_infra1_optical_frame'"),
        (depth(), None),
        (info(), None),
    ],
)
def test_what_begins_late_is_taken_only_if_it_is_in_the_images_frame(stream, why, tmp_path, monkeypatch, caplog):
    monkeypatch.setattr(first_messages, "LOOK_BYTES", 1)
    path = write(tmp_path / "run", colour(), stream)
    _, frame = read(path)
    assert (value_of(frame) == 600, frame.camera is not None) == (
        why is None and stream[0] == ALIGNED,
        why is None and stream[0] == INFO,
    )
    assert [line.startswith(why) for line in said(caplog)] == ([True] if why else [])


def test_headers_count_even_where_no_first_message_was_found(tmp_path, monkeypatch):
    monkeypatch.setattr(first_messages, "LOOK_BYTES", 0)
    with sources.open(bags.write_ros2(tmp_path / "run", bags.entries(3))) as source:
        frames = list(source)
    assert [frame.stamp_ns for frame in frames] == [bags.stamp_of(i) for i in range(3)]
    assert [value_of(frame) for frame in frames] == [600, 601, 602]
