"""Topics are guessed where there is one choice, and listed where there is not."""

from __future__ import annotations

import re

import pytest
from ros import bag_examples as bags

from dloftbs.errors import SourceError
from dloftbs.ros import BagSource
from dloftbs.ros.bag_file import Topic
from dloftbs.ros.topic_choice import COMPRESSED_TYPE, IMAGE_TYPE, INFO_TYPE, choose_topics

COLOUR = Topic("/camera/color/image_raw", IMAGE_TYPE, 9)
PACKED = Topic("/camera/color/image_raw/compressed", COMPRESSED_TYPE, 9)
RECTIFIED = Topic("/camera/color/image_rect_color", IMAGE_TYPE, 9)
DEPTH = Topic("/camera/depth/image_rect_raw", IMAGE_TYPE, 9)
ALIGNED = Topic("/camera/aligned_depth_to_color/image_raw", IMAGE_TYPE, 9)
ALIGNED_PACKED = Topic("/camera/aligned_depth_to_color/image_raw/compressedDepth", COMPRESSED_TYPE, 9)
INFO, DEPTH_INFO = Topic("/camera/color/camera_info", INFO_TYPE, 9), Topic("/camera/depth/camera_info", INFO_TYPE, 9)
IMU = Topic("/imu", "sensor_msgs/msg/Imu", 900)
OVERLAY = Topic("/dloftbs/overlay/compressed", COMPRESSED_TYPE, 9)
SDK = (
    Topic("/device_0/sensor_0/Depth_0/image/data", IMAGE_TYPE, 8),
    Topic("/device_0/sensor_1/Color_0/image/data", IMAGE_TYPE, 8),
    Topic("/device_0/sensor_0/Depth_0/info/camera_info", INFO_TYPE, 1),
    Topic("/device_0/sensor_1/Color_0/info/camera_info", INFO_TYPE, 1),
)


def chosen(*topics, **named):
    found = choose_topics("run.mcap", topics, **named)
    return found.image, found.depth, found.info


@pytest.mark.parametrize(
    ("topics", "expected"),
    [
        ((IMU, COLOUR), (COLOUR, None, None)),
        ((COLOUR, PACKED, OVERLAY), (COLOUR, None, None)),
        ((PACKED, INFO), (PACKED, None, INFO)),
        ((COLOUR, DEPTH, INFO, DEPTH_INFO), (COLOUR, DEPTH, INFO)),
        ((COLOUR, DEPTH, ALIGNED, ALIGNED_PACKED), (COLOUR, ALIGNED, None)),
        ((COLOUR, ALIGNED_PACKED, DEPTH_INFO), (COLOUR, ALIGNED_PACKED, None)),
        (SDK, (SDK[1], SDK[0], SDK[3])),
    ],
)
def test_the_only_choice_is_taken(topics, expected):
    assert chosen(*topics) == expected


def test_two_depths_that_are_not_registered_are_no_choice():
    assert chosen(COLOUR, DEPTH, Topic("/other/depth", IMAGE_TYPE, 9)) == (COLOUR, None, None)


def test_an_image_without_messages_is_no_choice():
    assert chosen(COLOUR, Topic("/left/image_raw", IMAGE_TYPE, 0)) == (COLOUR, None, None)


def test_several_images_are_listed():
    said = r"2 topics of images; name one with --topic.*image_raw \(sensor_msgs/msg/Image, 9 messages\), .*rect_color"
    with pytest.raises(SourceError, match=said):
        chosen(COLOUR, RECTIFIED)


@pytest.mark.parametrize(("topics", "there"), [((IMU,), "there is none"), ((DEPTH,), "there is /camera/depth")])
def test_without_images_what_there_is_is_said(topics, there):
    with pytest.raises(SourceError, match=f"holds no topic of colour images or masks; {there}"):
        chosen(*topics)


@pytest.mark.parametrize("name", ["/camera/color/image_raw", "camera/color/image_raw"])
def test_the_transport_and_the_first_slash_may_be_left_out(name):
    assert chosen(PACKED, RECTIFIED, topic=name)[0] == PACKED
    assert chosen(PACKED, COLOUR, RECTIFIED, topic=name)[0] == COLOUR


def test_named_topics_are_taken():
    everything = (COLOUR, RECTIFIED, DEPTH, ALIGNED, INFO, DEPTH_INFO)
    found = chosen(*everything, topic=RECTIFIED.name, depth_topic=DEPTH.name, info_topic=DEPTH_INFO.name)
    assert found == (RECTIFIED, DEPTH, DEPTH_INFO)
    assert choose_topics("x", everything, RECTIFIED.name).is_rectified
    assert not choose_topics("x", everything, COLOUR.name).is_rectified


@pytest.mark.parametrize(
    ("named", "said"),
    [
        ({"topic": "/nowhere"}, "--topic /nowhere is no topic of Image or CompressedImage; there is /camera/color"),
        ({"topic": IMU.name}, "--topic /imu is no topic of Image"),
        ({"depth_topic": "/d"}, "--depth-topic /d is no topic"),
        ({"info_topic": COLOUR.name}, "--info-topic /camera/color/image_raw is no topic of CameraInfo"),
    ],
)
def test_a_name_that_is_not_there_is_answered_with_those_that_are(named, said):
    with pytest.raises(SourceError, match=said):
        chosen(COLOUR, IMU, **named)


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("/cam/image_rect", True),
        ("/cam/image_rect_color/compressed", True),
        ("/cam/image_rectified", True),
        ("/cam/image_raw", False),
        ("/cam/image_direct", False),
        ("/rect/image", False),
    ],
)
def test_rectified_images_are_known_by_their_name(name, expected):
    assert choose_topics("x", [Topic(name, IMAGE_TYPE)]).is_rectified is expected


FOREIGN = [
    ("/camera/color/video", "foxglove.CompressedVideo", "protobuf", "protobuf"),
    ("/camera/color/picture", "foxglove.RawImage", "json", "jsonschema"),
    ("/camera/color/jpeg", "foxglove_msgs/msg/CompressedImage", "cdr", "ros2msg"),
    ("/camera/color/image_raw/ffmpeg", "ffmpeg_image_transport_msgs/msg/FFMPEGPacket", "cdr", "ros2msg"),
    ("/camera/color/image_raw/theora", "theora_image_transport/msg/Packet", "cdr", "ros2msg"),
    ("/camera/color/image_raw", IMAGE_TYPE, "json", "jsonschema"),
]


@pytest.mark.parametrize("foreign", FOREIGN)
def test_images_of_a_type_that_cannot_be_read_are_named_as_what_they_are(foreign, tmp_path):
    name, kind, encoding, _ = foreign
    path = bags.write_foreign(
        tmp_path / "run.mcap", [foreign, ("/tf", "foxglove.FrameTransform", "protobuf", "protobuf")]
    )
    shown = kind if encoding == "cdr" else f"{kind} in {encoding}"
    said = (
        rf"{re.escape(name)} \({re.escape(shown)}, 1 messages\); convert them to sensor_msgs/Image or CompressedImage"
    )
    with pytest.raises(SourceError, match=f"holds only images that cannot be read: {said}"):
        BagSource(path)
    with pytest.raises(SourceError, match=f"--topic {name} cannot be read: it is {said}"):
        BagSource(path, topic=name)


def test_images_that_cannot_be_read_are_said_beside_those_that_can(tmp_path, caplog):
    depth = ("/camera/depth/image_raw/ffmpeg", *FOREIGN[3][1:])
    path = bags.write_foreign(tmp_path / "run.mcap", [FOREIGN[0], FOREIGN[3], depth], bags.entries(2, depth=False))
    with BagSource(path) as source:
        assert [frame.index for frame in source] == [0, 1]
    images, depths = [record.getMessage().partition(": ")[2] for record in caplog.records]
    unread = "/camera/color/video (foxglove.CompressedVideo in protobuf, which cannot be read)"
    assert images.startswith(f"images are taken from /camera/color/image_raw; not used: {unread}; convert them to")
    assert depths.startswith(
        "frames go without depth, which cannot be read: /camera/depth/image_raw/ffmpeg (ffmpeg_image"
    )


def test_a_type_that_is_no_image_is_not_named():
    others = [Topic("/disparity", "stereo_msgs/msg/DisparityImage", 3), Topic("/marks", "foxglove.ImageAnnotations", 3)]
    found = choose_topics("x", [COLOUR, *others])
    assert (found.image, found.remarks) == (COLOUR, ())
