"""Depth and cameras are those of the images by coordinate frame, then by intrinsics and by name; the rest is said."""

from __future__ import annotations

import sqlite3

import numpy as np
import pytest
from ros import bag_examples as bags

from dloftbs import PinholeCamera, SourceError, sources
from dloftbs.camera import DepthRegistration
from dloftbs.ros.bag_file import Topic
from dloftbs.ros.topic_choice import choose_topics

COLOUR, DEPTH = "/camera/color/image_raw", "/camera/depth/image_rect_raw"
ALIGNED, ALIGNED_IR = "/camera/aligned_depth_to_color/image_raw", "/camera/aligned_depth_to_infra1/image_raw"
INFO = "/camera/color/camera_info"
IN_COLOUR, IN_DEPTH = "camera_color_optical_frame", "camera_depth_optical_frame"
IN_IR = "camera_infra1_optical_frame"
OTHER_K = [132.0, 0.0, 79.0, 0.0, 132.0, 61.0, 0.0, 0.0, 1.0]
COUNT = 3


def colour(topic=COLOUR, frame_id=IN_COLOUR, **options):
    return topic, frame_id, lambda at: bags.raw_image(bags.photo_of(0), "bgr8", at, **options)


def depth(topic=ALIGNED, frame_id=IN_COLOUR, value=600, size=bags.SIZE, encoding="16UC1", **options):
    return topic, frame_id, lambda at: bags.raw_image(np.full(size, value, np.uint16), encoding, at, **options)


def grey(topic="/camera/infra1/image_rect_raw", frame_id=IN_IR, dtype=np.uint8):
    encoding = "mono8" if dtype == np.uint8 else "32FC1"
    return topic, frame_id, lambda at: bags.raw_image(bags.mask_of(0).astype(dtype), encoding, at)


def info(topic=INFO, frame_id=IN_COLOUR, **options):
    return topic, frame_id, lambda at: bags.camera_info(at, **options)


def packed(stream):
    """Return a stream of depth as compressedDepth has it."""
    topic, frame_id, make = stream

    def message(at):
        image = make(at)
        counts = np.frombuffer(image.data.tobytes(), np.uint16).reshape(image.height, image.width)
        return bags.compressed(bytes(12) + bags.encoded(counts, ".png"), "16UC1; compressedDepth png", at)

    return f"{topic}/compressedDepth", frame_id, message


def write(path, *streams, count=COUNT):
    given = []
    for i in range(count):
        for topic, frame_id, make in streams:
            message = make(bags.stamp_of(i))
            message.header.frame_id = frame_id
            given.append((topic, bags.stamp_of(i) + 1000, message))
    return bags.write_ros2(path, given)


def read(path, *streams, **options):
    """Return a source's topics and its first frame, of a recording of some streams."""
    if not path.exists():
        write(path, *streams)
    with sources.open(path, **options) as source:
        frames = list(source)
        assert len(frames) == COUNT
        return source.topics, frames[0]


def value_of(frame):
    return None if frame.depth is None else int(frame.depth[0, 0])


def said(caplog):
    return [record.getMessage().partition(": ")[2] for record in caplog.records]


RAW, IR_ALIGNED = depth(DEPTH, IN_DEPTH, 700), depth(ALIGNED_IR, IN_IR, 800)


@pytest.mark.parametrize(
    ("streams", "expected", "unused"),
    [
        ([RAW, depth()], 600, [DEPTH]),
        ([RAW, IR_ALIGNED, depth()], 600, [DEPTH, ALIGNED_IR]),
        ([RAW, depth("/camera/depth_b/image", IN_COLOUR, 610)], 610, [DEPTH]),  # no name says so
        ([RAW, depth("/camera/depth_b/image", "/" + IN_COLOUR, 610)], 610, [DEPTH]),  # as ROS 1 has it
        ([RAW, depth("/camera/depth_b/image", "camera_color_frame", 610)], 610, [DEPTH]),
        ([RAW, depth(ALIGNED, "camera_aligned_depth_to_color_frame")], 600, [DEPTH]),
        ([RAW, packed(depth())], 600, [DEPTH]),
        ([depth("/camera/depth_registered/image", IN_COLOUR, 1), depth("/camera/depth_registered/image_raw")], 1, []),
        ([depth("/camera/depth/half", IN_COLOUR, 1, (60, 80)), depth("/camera/depth/whole")], 600, []),
        ([colour("/camera/color/depth_preview"), depth()], 600, []),
        # The name of one says that it is registered to another camera, and frames say nothing.
        ([depth(ALIGNED, ""), depth(ALIGNED_IR, "", 800)], 600, [ALIGNED_IR]),
        ([depth(DEPTH, "", 700), depth(ALIGNED, "")], 600, [DEPTH]),
        ([RAW, depth("/depth_to_rgb/image_raw", "")], 600, [DEPTH]),  # as Azure Kinects name it
    ],
)
def test_of_several_depths_the_one_in_the_images_frame_is_taken(streams, expected, unused, tmp_path, caplog):
    _, frame = read(tmp_path / "run", colour(), *streams)
    assert value_of(frame) == expected
    (line,) = said(caplog)
    assert line.startswith("depth is taken from /")
    assert line.endswith("--depth-topic (depth_topic=) takes another")
    for name in unused:
        assert name in line.partition("not used: ")[2]
    chosen = line.partition("taken from ")[2].partition(";")[0]
    assert value_of(read(tmp_path / "run", depth_topic=chosen)[1]) == expected


@pytest.mark.parametrize(
    ("streams", "why"),
    [
        ([IR_ALIGNED], f"it is in the frame '{IN_IR}', the images are in '{IN_COLOUR}' ({ALIGNED_IR})"),
        ([depth(ALIGNED, IN_DEPTH)], f"it is in the frame '{IN_DEPTH}'"),  # whatever its name says
        ([depth(DEPTH, IN_DEPTH), IR_ALIGNED], f"({ALIGNED_IR}); it is in the frame '{IN_DEPTH}'"),
        ([depth(ALIGNED_IR, IN_COLOUR)], "its name says that it is aligned to infra1"),
        ([depth(ALIGNED_IR, "")], "its name says that it is aligned to infra1"),
        ([depth(DEPTH, "")], "it is in the frame ''"),
        ([packed(IR_ALIGNED)], "it is in the frame"),
        # As the recorder of ROS 1 in librealsense: one frame for all, but not one camera.
        (
            [depth(DEPTH, IN_COLOUR), info(), info("/camera/depth/camera_info", IN_COLOUR, k=OTHER_K)],
            "other intrinsics",
        ),
    ],
)
def test_depth_that_is_not_in_the_images_frame_is_left_out_with_one_word(streams, why, tmp_path, caplog):
    _, frame = read(tmp_path / "run", colour(), *streams, topic=COLOUR)
    assert value_of(frame) is None
    (line,) = said(caplog)
    assert line.startswith("frames go without depth, which is not registered to the images: ")
    assert why in line
    assert "--depth-topic (depth_topic=) takes it all the same, --registration brings it into the images" in line
    caplog.clear()
    assert value_of(read(tmp_path / "run", topic=COLOUR, depth_topic=streams[0][0])[1]) is not None
    (line,) = said(caplog)
    assert line.startswith("depth is taken for registered to the images, as its topic was named, but ")


def test_two_depths_of_which_nothing_tells_which_is_registered(tmp_path, caplog):
    _, frame = read(tmp_path / "run", colour(frame_id=""), depth("/a/depth", ""), depth("/b/depth", "", 700))
    assert value_of(frame) is None
    (line,) = said(caplog)
    assert line.startswith("frames go without depth: several topics fit; name one with --depth-topic")
    assert value_of(read(tmp_path / "run", depth_topic="/b/depth")[1]) == 700


def test_the_only_depth_is_taken_where_no_frame_has_a_name(tmp_path, caplog):
    assert value_of(read(tmp_path / "run", colour(frame_id=""), depth(DEPTH, ""))[1]) == 600
    assert not said(caplog)


def test_a_registration_takes_the_depth_of_the_other_sensor(tmp_path):
    camera = PinholeCamera(150.0, 150.0, 80.0, 60.0, size=bags.SIZE)
    registration = DepthRegistration(camera, camera, np.eye(3), np.zeros(3))
    topics, _ = read(tmp_path / "run", colour(), depth(), RAW, registration=registration)
    assert topics.depth.name == DEPTH


@pytest.mark.parametrize(
    ("cameras", "expected", "why"),
    [
        ([info()], 150.0, None),
        ([info(frame_id="/camera_color_frame")], 150.0, None),
        ([info(frame_id="")], 150.0, None),
        ([info("/calibration/camera_info")], 150.0, None),
        ([info("/camera/depth/camera_info", IN_DEPTH, k=OTHER_K)], None, f"it is in the frame '{IN_DEPTH}'"),
        ([info("/camera/depth/camera_info", "", k=OTHER_K)], None, "by its name it is that of another sensor"),
        ([info(INFO, IN_DEPTH, k=OTHER_K)], None, f"it is in the frame '{IN_DEPTH}'"),
        ([info(INFO, IN_DEPTH, k=OTHER_K), info("/camera/rgb/camera_info")], 150.0, None),
        ([info("/camera/half", size=(60, 80)), info("/camera/whole")], 150.0, None),
        ([info(size=(60, 80), k=OTHER_K), info("/camera/whole")], 150.0, None),
        ([info("/camera/a"), info("/camera/b", k=OTHER_K)], None, "several topics fit; name one with --info-topic"),
        ([info(size=(60, 80))], None, "it is for images of (60, 80), got (120, 160); --camera (camera=) gives one"),
        ([info(k=[0.0] * 9)], None, "it is not calibrated, its matrix K is 0"),
    ],
)
def test_the_camera_is_that_of_the_images_frame(cameras, expected, why, tmp_path, caplog):
    _, frame = read(tmp_path / "run", colour(), *cameras)
    assert (None if frame.camera is None else frame.camera.fx) == expected
    if why is None:
        assert not said(caplog)
        return
    (line,) = said(caplog)
    assert line.startswith("frames go without a camera")
    assert why in line
    if "--info-topic" in line:
        named = read(tmp_path / "run", info_topic=cameras[0][0])[1].camera
        assert named.fx in (132.0, 150.0)


def test_a_camera_without_messages_is_said(tmp_path, caplog):
    path = bags.write_ros2(tmp_path / "run", bags.entries(COUNT, depth=False), "sqlite3")
    with sqlite3.connect(path / "run.db3") as database:
        database.execute("DELETE FROM messages WHERE topic_id = (SELECT id FROM topics WHERE name LIKE '%info')")
    database.close()
    assert read(path)[1].camera is None
    assert said(caplog)[0].startswith(f"frames go without a camera: it has no messages ({bags.INFO_TOPIC})")


def test_a_camera_of_which_no_message_comes_is_said(tmp_path, caplog):
    """A recording that was not finished does not say how many messages a topic has."""
    path = tmp_path / "run.mcap"
    given = bags.entries(COUNT, depth=False)
    last = [(bags.INFO_TOPIC, bags.stamp_of(9), bags.camera_info())]
    bags.write_mcap(path, [*given[1::2], *last], use_chunking=False)
    data = path.read_bytes()
    path.write_bytes(data[: data.rindex(b"plumb_bob") - 60])
    assert read(path)[1].camera is None
    assert f"frames go without a camera: no message of {bags.INFO_TOPIC} came" in caplog.text


def test_the_camera_and_depth_of_another_robot_are_not_taken(tmp_path, caplog):
    """Both robots name their coordinate frames alike."""
    streams = [
        colour("/robot1/camera/color/image_raw"),
        colour("/robot2/camera/color/image_raw"),
        depth("/robot2/camera/aligned_depth_to_color/image_raw", value=700),
        info("/robot2/camera/color/camera_info"),
    ]
    with pytest.raises(SourceError, match="2 topics of images; name one with --topic"):
        read(tmp_path / "run", *streams)
    _, frame = read(tmp_path / "run", topic="/robot1/camera/color/image_raw")
    assert (frame.depth, frame.camera) == (None, None)
    assert all("by its name it is that of /robot2/camera/color/image_raw" in line for line in said(caplog))
    caplog.clear()
    _, frame = read(tmp_path / "run", topic="/robot2/camera/color/image_raw")
    assert (value_of(frame), frame.camera.fx) == (700, 150.0)
    own = depth("/robot1/camera/aligned_depth_to_color/image_raw")
    _, frame = read(tmp_path / "both", *streams, own, topic="/robot1/camera/color/image_raw")
    assert value_of(frame) == 600


def test_the_camera_of_the_other_side_of_a_pair_is_not_taken(tmp_path, caplog):
    """Both cameras of a pair are in the frame of the left one, by convention."""
    streams = [colour("/pair/left/image_raw", "left_optical"), info("/pair/right/camera_info", "left_optical")]
    assert read(tmp_path / "run", *streams)[1].camera is None
    assert "by its name it is that of the other side (/pair/right/camera_info)" in said(caplog)[0]
    both = [*streams, colour("/pair/right/image_raw", "left_optical"), info("/pair/left/camera_info", "left_optical")]
    topics, frame = read(tmp_path / "both", *both, topic="/pair/left/image_raw")
    assert (topics.info.name, frame.camera.fx) == ("/pair/left/camera_info", 150.0)


@pytest.mark.parametrize(
    "others",
    [
        [grey(), grey("/camera/infra2/image_rect_raw", "camera_infra2_optical_frame")],
        [grey("/camera/ir/image", "")],
        [grey("/device_0/sensor_0/Infrared_1/image/data", "0")],
        [grey("/thermal/image_raw", "thermal_optical")],  # by its channels and its frame
    ],
)
def test_one_colour_image_beside_others_is_taken(others, tmp_path, caplog):
    topics, _ = read(tmp_path / "run", *others, colour())
    assert topics.image.name == COLOUR
    (line,) = said(caplog)
    assert line.startswith(f"images are taken from {COLOUR}; not used: {others[0][0]} (")
    assert line.endswith("; --topic (topic=) takes another")


def test_an_image_of_more_than_8_bits_beside_colour_is_depth_only_if_it_is_named(tmp_path, caplog):
    """OAK cameras call their depth stereo; others publish confidence and labels beside it."""
    wide = [grey("/oak/confidence", IN_COLOUR, np.float32), depth("/oak/stereo/image_raw")]
    topics, frame = read(tmp_path / "run", *wide, colour())
    assert (topics.image.name, value_of(frame)) == (COLOUR, None)
    (line,) = said(caplog)
    named = (
        "--depth-topic (depth_topic=) takes one of /oak/confidence (in the frame 'camera_color_optical_frame'), /oak/"
    )
    assert line.startswith(f"frames go without depth: no topic is called so; {named}")
    assert value_of(read(tmp_path / "run", depth_topic="/oak/stereo/image_raw")[1]) == 600
    caplog.clear()
    read(tmp_path / "both", *wide, colour(), depth())
    (line,) = said(caplog)
    assert line.startswith(f"depth is taken from {ALIGNED}; not used: /oak/confidence (in the frame")


def test_depth_without_messages_is_said():
    topics = [
        Topic(COLOUR, bags.IMAGE, 9),
        Topic(ALIGNED, bags.IMAGE, 0),
        Topic(f"{DEPTH}/compressed", bags.COMPRESSED, 0),
    ]
    assert choose_topics("run", topics).remarks == (
        f"frames go without depth, which has no messages: {ALIGNED} ({bags.IMAGE}, 0 messages), "
        f"{DEPTH}/compressed ({bags.COMPRESSED}, 0 messages)",
    )


@pytest.mark.parametrize("others", [[grey("/mask", IN_COLOUR)], [grey("/mask", "")], [colour("/b", "b")]])
def test_what_may_be_a_mask_or_another_camera_is_asked_for(others, tmp_path):
    with pytest.raises(SourceError, match="2 topics of images; name one with --topic"):
        read(tmp_path / "run", *others, colour())


def test_a_camera_that_is_called_depth_as_a_whole(tmp_path):
    streams = [colour("/depth_camera/image_raw"), depth("/depth_camera/depth/image_raw")]
    topics, frame = read(tmp_path / "run", *streams)
    assert (topics.image.name, value_of(frame)) == ("/depth_camera/image_raw", 600)


def test_infrared_alone_is_taken(tmp_path, caplog):
    topics, frame = read(tmp_path / "run", grey())
    assert topics.image.name == grey()[0]
    assert frame.mask is not None
    assert not said(caplog)


def frames_of(path, **options):
    with sources.open(path, **options) as source:
        return list(source)


@pytest.mark.parametrize("info", ["camera_info", "image/camera_info"])
def test_what_was_recorded_by_a_realsense(info, tmp_path, caplog):
    """Names, types, formats and frames as the recorder of librealsense 2.59 writes them."""
    at = [1192 + i * bags.PERIOD_NS for i in range(4)]
    base = "/device_0/sensor_{}/{}_0/image/data/{}"
    given = []
    for i, stamp_ns in enumerate(at):
        depth = np.full(bags.SIZE, 600 + i, np.uint16)
        packed = bags.compressed(bytes(12) + bags.encoded(depth, ".png"), "16UC1; compressedDepth png", stamp_ns)
        colour = bags.encoded(bags.photo_of(i), ".png")
        picture = bags.compressed(colour, "rgb8; png compressed bgr8", stamp_ns + 100)
        grey = bags.compressed(bags.encoded(bags.mask_of(i), ".png"), "mono8; png compressed mono8", stamp_ns + 50)
        given += [
            (base.format(0, "Depth", "compressedDepth"), stamp_ns, packed),
            (
                f"/device_0/sensor_0/Depth_0/{info}",
                stamp_ns,
                bags.camera_info(stamp_ns, k=[99.0, 0, 80, 0, 99, 60, 0, 0, 1]),
            ),
            ("/device_0/sensor_0/Infrared_1/image/data/compressed", stamp_ns, grey),
            (base.format(1, "Color", "compressed"), stamp_ns, picture),
            (f"/device_0/sensor_1/Color_0/{info}", stamp_ns, bags.camera_info(stamp_ns)),
        ]
        for (_, _, message), name in zip(given[-5:], ("Depth", "Depth", "Infrared1", "Color", "Color"), strict=True):
            message.header.frame_id = name
    path = bags.write_ros2(tmp_path / "run", given, "sqlite3")
    frames = frames_of(path)
    assert [frame.stamp_ns for frame in frames] == [stamp_ns + 100 for stamp_ns in at]
    assert all(frame.depth is None for frame in frames)  # of another sensor
    assert all(frame.camera.fx == 150.0 for frame in frames)
    np.testing.assert_array_equal(frames[2].image, bags.photo_of(2))
    assert len(caplog.records) == 2
    assert "images are taken from /device_0/sensor_1/Color_0/image/data/compressed" in caplog.text
    assert "it is in the frame 'Depth', the images are in 'Color'" in caplog.text
    frames = frames_of(path, depth_topic=base.format(0, "Depth", "compressedDepth"))
    assert [frame.depth[0, 0] for frame in frames] == [600, 601, 602, 603]


def test_what_was_recorded_by_a_realsense_for_ros_1(tmp_path, caplog):
    """As the recorder of librealsense 2.55 does: one camera message without a frame, and one frame for all images."""
    base, given = "/device_0/sensor_{}/{}_0/{}", []
    for sensor, name, focal in ((0, "Depth", 99.0), (1, "Color", 150.0)):
        info = bags.camera_info(0, make=bags.MAKE1, k=[focal, 0, 80, 0, focal, 60, 0, 0, 1])
        info.header.frame_id = ""
        given.append((base.format(sensor, name, "info/camera_info"), 1, info))
    for i in range(COUNT):
        counts = np.full(bags.SIZE, 600 + i, np.uint16)
        pictures = ((0, "Depth", counts, "mono16"), (1, "Color", bags.photo_of(i)[..., ::-1], "rgb8"))
        for sensor, name, pixels, encoding in pictures:
            image = bags.raw_image(pixels, encoding, 10**9 + i * bags.PERIOD_NS, make=bags.MAKE1)
            image.header.frame_id = "0"
            given.append((base.format(sensor, name, "image/data"), 2 + i * bags.PERIOD_NS, image))
    path = bags.write_ros1(tmp_path / "run.bag", given, padding=4)
    frames = frames_of(path)
    assert len(frames) == COUNT
    np.testing.assert_array_equal(frames[2].image, bags.photo_of(2))
    assert {(frame.camera.fx, frame.depth is None) for frame in frames} == {(150.0, True)}
    (line,) = [record.getMessage() for record in caplog.records]
    assert (
        "its camera (/device_0/sensor_0/Depth_0/info/camera_info) has other intrinsics than that of the images" in line
    )
    frames = frames_of(path, depth_topic=base.format(0, "Depth", "image/data"))
    assert [frame.depth[0, 0] for frame in frames] == list(range(600, 600 + COUNT))
