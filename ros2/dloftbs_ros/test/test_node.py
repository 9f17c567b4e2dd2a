"""The node in a process of its own, spoken to by topics alone."""

from __future__ import annotations

import json
import signal
from pathlib import Path
from time import monotonic

import cv2
import numpy as np
import pytest
from conftest import FRAME_ID, MAKE, PERIOD_NS, T0_NS, header, rows_of, values_of
from dloftbs_ros.parameters import Parameters
from geometry_msgs.msg import TransformStamped
from rcl_interfaces.srv import GetParameters, ListParameters
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, JointState
from std_msgs.msg import String
from std_srvs.srv import Empty

from dloftbs.ros import camera_message, image_message, mask_message, picture_message
from dloftbs_lab.synthetic import rgbd_artificial

SIZE = (240, 426)
FRAMES = 8
OFF_M = 0.005
"""Half the width of the cable."""
_WARN, _ERROR = 1, 2
_DELETE, _DELETE_ALL = 2, 3
STAND_IN = str(Path(__file__).with_name("stand_in"))
TOPICS = {
    "image": "/camera/camera/color/image_raw",
    "depth": "/camera/camera/aligned_depth_to_color/image_raw",
    "camera_info": "/camera/camera/color/camera_info",
}
REMAPS = [part for name, topic in TOPICS.items() for part in ("-r", f"{name}:={topic}")]


def red(shift: int = 0) -> np.ndarray:
    """Return an image with a red cable on black."""
    image = np.zeros((*SIZE, 3), np.uint8)
    rows = (120 + 30 * np.sin(np.linspace(0, 4, 300))).astype(int)
    points = np.stack([np.arange(60, 360) + shift, rows], axis=1)
    cv2.polylines(image, [points.reshape(-1, 1, 2)], False, (0, 0, 255), 8)
    return image


def jpeg(index: int, shift: int = 0) -> CompressedImage:
    """Return that image as a compressed message."""
    return picture_message(MAKE, header(index), cv2.imencode(".jpg", red(shift))[1].tobytes())


class Camera:
    """Publishes images, depth and camera as a driver does, of a cable that is known."""

    def __init__(self, peer, depth: bool = True) -> None:
        self.sequence = rgbd_artificial(size=SIZE)[0]
        self._image, self._info = (
            peer.publisher(Image, TOPICS["image"]),
            peer.publisher(CameraInfo, TOPICS["camera_info"]),
        )
        self._depth = peer.publisher(Image, TOPICS["depth"]) if depth else None
        self.publishers = [found for found in (self._image, self._depth, self._info) if found is not None]

    def send(self, index: int) -> None:
        frame = self.sequence.frame(index % FRAMES)
        self._info.publish(camera_message(MAKE, header(index), self.sequence.camera, SIZE))
        self._image.publish(mask_message(MAKE, header(index), frame.mask))  # as drivers do that align depth to it
        if self._depth is not None:
            millimetres = np.round(frame.depth * 1000).astype(np.uint16)
            self._depth.publish(image_message(MAKE, header(index), millimetres))

    def off_m(self, points: np.ndarray, index: int) -> float:
        """Return how far points are from the cable of a frame, as a median."""
        truth = self.sequence.truth(index % FRAMES).curves_3d[0](np.linspace(0, 1, 2000))
        return float(np.median(np.linalg.norm(points[:, None] - truth[None], axis=2).min(axis=1)))


def points_of(cloud) -> np.ndarray:
    """Return the points of a cloud (n, 3)."""
    rows = rows_of(cloud)
    return np.stack([rows[axis] for axis in "xyz"], axis=1)


def send_until_answered(peer, publisher, index: int) -> None:
    """Send a frame, and the next ones, since best effort may lose one, until there are the curves of one."""
    for number in range(index, index + 20):
        publisher.publish(jpeg(number))
        if peer.holds_within(2.0, lambda stamp=T0_NS + number * PERIOD_NS: stamp in peer.stamps("diagnostics")):
            return
    pytest.fail(f"no answer to twenty frames; the node said:\n{peer.log()}")


def test_curves_in_metres_come_back_with_time_frame_and_id(peer):
    sequence = rgbd_artificial(size=SIZE)[0]
    image, depth, info = (
        peer.publisher(kind, topic)
        for kind, topic in ((Image, "/image"), (Image, "/depth"), (CameraInfo, "/camera_info"))
    )
    peer.start()
    peer.wait_matched(image, depth, info)
    sent = []
    info.publish(camera_message(MAKE, header(0), sequence.camera, SIZE))
    peer.listen(0.5)  # so that it goes first
    for index in range(FRAMES):
        frame = sequence.frame(index)
        info.publish(camera_message(MAKE, header(index), sequence.camera, SIZE))
        millimetres = np.round(frame.depth * 1000).astype(np.uint16)
        depth.publish(image_message(MAKE, header(index), millimetres))
        image.publish(mask_message(MAKE, header(index), frame.mask))
        sent.append(T0_NS + index * PERIOD_NS)
        peer.wait(f"curves of frame {index}", lambda: peer.stamps("diagnostics")[-1:] == sent[-1:])

    assert peer.stamps("points") == peer.stamps("points_px") == peer.stamps("markers") == sent
    ids = set()
    for index, (cloud, flat) in enumerate(zip(peer.heard["points"], peer.heard["points_px"], strict=True)):
        assert cloud.header.frame_id == FRAME_ID
        assert flat.header.frame_id == f"{FRAME_ID}/pixels"
        points = rows_of(cloud)
        ids |= set(points["id"].tolist())
        truth = sequence.truth(index).curves_3d[0](np.linspace(0, 1, 2000))
        ours = np.stack([points[axis] for axis in "xyz"], axis=1)
        distance = np.linalg.norm(ours[:, None] - truth[None], axis=2).min(axis=1)
        assert len(points) == 100
        assert np.median(distance) < OFF_M
        assert len(rows_of(flat)) == 100
    assert len(ids) == 1
    older, *markers = [marker for message in peer.heard["markers"] for marker in message.markers]
    assert (older.action, older.ns) == (_DELETE_ALL, "")
    assert {marker.id for marker in markers} == ids
    last = values_of(peer.heard["diagnostics"][-1])
    assert (last["received"], last["answered"], last["dropped"], last["unreadable"]) == (
        str(FRAMES),
        str(FRAMES),
        "0",
        "0",
    )
    assert peer.interrupt() == 0, peer.log()
    assert "Traceback" not in peer.log()


ARM = """
joints:
  - {name: rail, type: prismatic, parent: base, child: arm, axis: [1, 0, 0]}
capsules:
  - {link: arm, start_m: [0, -0.5, 0.3], end_m: [0, 0.5, 0.3], radius_m: 0.03}
grippers:
  - {link: arm, point_m: [0, 0, 0.3], radius_m: 5.0}
"""
"""A beam before the camera, whose gripper reaches everything."""


def test_a_robot_by_joints_and_tf_holds_the_ends_and_answers_come_as_lines_of_json(peer, tmp_path):
    (tmp_path / "robot.yaml").write_text(ARM)
    camera = Camera(peer)
    joints = peer.publisher(JointState, "/joint_states")
    transform = peer.publisher(TransformStamped, "/transform")
    answers = []
    peer.node.create_subscription(String, "/dloftbs/answers", answers.append, 50)
    asked = [*REMAPS, "-p", f"robot:={tmp_path / 'robot.yaml'}", "-p", "answers:=topology,std"]
    peer.start(*asked, PYTHONPATH=STAND_IN)
    peer.wait_matched(*camera.publishers, joints, transform)
    camera.send(0)  # nobody knows where the robot is
    peer.wait("a frame without the robot", lambda: peer.heard["diagnostics"])
    assert "a frame goes without the robot: joints are unknown" in peer.heard["diagnostics"][0].status[0].message
    for index in range(1, 4):
        placed = TransformStamped(header=header(index), child_frame_id=FRAME_ID)
        placed.header.frame_id = "base"
        transform.publish(placed)
        joints.publish(JointState(header=header(index), name=["rail"], position=[-0.2]))
        peer.listen(0.2)
        camera.send(index)
        peer.wait(f"frame {index}", lambda last=T0_NS + index * PERIOD_NS: last in peer.stamps("diagnostics"))
    peer.wait("answers", lambda: len(answers) == 4)
    assert values_of(peer.heard["diagnostics"][-1])["without robot"] == "1"
    rows = [json.loads(answer.data) for answer in answers]
    assert rows[0]["tracks"][0]["ends"] != ["held", "held"] == rows[-1]["tracks"][0]["ends"]
    assert rows[-1]["topology"]["is_knotted"] is False
    assert len(rows[-1]["tracks"][0]["std"]["m"]) == 11


def test_topics_of_a_realsense_give_metres_once_they_are_named(peer):
    camera = Camera(peer)
    peer.start(*REMAPS)
    peer.wait_matched(*camera.publishers)
    for index in range(3):
        camera.send(index)
        peer.wait(f"frame {index}", lambda stamp=T0_NS + index * PERIOD_NS: stamp in peer.stamps("diagnostics"))
    assert len(rows_of(peer.heard["points"][-1])) == 100
    assert camera.off_m(points_of(peer.heard["points"][-1]), 2) < OFF_M


def test_masks_of_a_topic_go_with_the_images_of_their_stamps(peer):
    sequence = rgbd_artificial(size=SIZE)[0]
    image, mask = peer.publisher(Image, "/image"), peer.publisher(Image, "/sam2/mask")
    peer.start("-p", "mask_topic:=/sam2/mask")
    peer.wait_matched(image, mask)
    photo = np.full((*SIZE, 3), 90, np.uint8)
    for index in range(4):
        image.publish(image_message(MAKE, header(index), photo))
    wanted: list[int] = []
    for index in (1, 3):  # a segmenter that is slower than the camera; the node takes the newest of what waits for it
        mask.publish(mask_message(MAKE, header(index), sequence.frame(index).mask))
        wanted.append(T0_NS + index * PERIOD_NS)
        peer.wait(f"curves of frame {index}", lambda: peer.stamps("points_px") == wanted)
    missing = "two images without a mask"
    peer.wait(missing, lambda: values_of(peer.heard["diagnostics"][-1])["without mask"] == "2")
    assert all(len(rows_of(cloud)) == 100 for cloud in peer.heard["points_px"])


def test_a_depth_that_is_not_published_is_missed_with_the_argument_that_turns_it_on(peer):
    camera = Camera(peer, depth=False)
    other = peer.publisher(Image, "/camera/camera/depth/image_rect_raw")
    peer.start(*REMAPS)
    peer.wait_matched(*camera.publishers)
    end = monotonic() + 8.0
    index = 0
    while monotonic() < end:
        camera.send(index)
        peer.listen(0.5)
        index += 1
    said = [status.message for message in peer.heard["diagnostics"] for status in message.status]
    (said,) = [text for text in said if "no depth" in text]
    assert f"no depth on {TOPICS['depth']}" in said
    assert "align_depth.enable:=true" in said
    assert "/camera/camera/depth/image_rect_raw (sensor_msgs/msg/Image, reliable)" in said
    assert said in peer.log()
    assert peer.heard["points_px"]
    assert "no camera" not in peer.log()
    assert other.get_subscription_count() == 0


def test_a_transport_that_is_asked_for_is_taken_from_its_topic(peer):
    image = peer.publisher(CompressedImage, "/cam/image_raw/compressed")
    raw = peer.publisher(Image, "/cam/image_raw")
    peer.start("-p", "hsv:=170:10", "-p", "image_transport:=compressed", "-r", "image:=/cam/image_raw")
    peer.wait_matched(image)
    send_until_answered(peer, image, 0)
    assert raw.get_subscription_count() == 0
    assert len(rows_of(peer.heard["points_px"][-1])) == 100


def test_the_parameters_of_the_node_are_those_of_the_table(peer):
    peer.start()
    listing = peer.node.create_client(ListParameters, "/dloftbs/list_parameters")
    peer.wait("the service", listing.service_is_ready)
    done = listing.call_async(ListParameters.Request())
    peer.wait("the names", done.done)
    names = set(done.result().result.names) - {"use_sim_time", "start_type_description_service"}
    assert names == set(Parameters.__dataclass_fields__)
    getting = peer.node.create_client(GetParameters, "/dloftbs/get_parameters")
    peer.wait("the service", getting.service_is_ready)
    done = getting.call_async(GetParameters.Request(names=["reliability", "depth_unit"]))
    peer.wait("the values", done.done)
    reliability, unit = done.result().values
    assert (reliability.string_value, unit.double_value) == ("auto", 0.001)


def stamped(index: int) -> TransformStamped:
    """Return the transform of the camera that looks down from 2 m above the base."""
    message = TransformStamped(child_frame_id=FRAME_ID)
    message.header = header(index)
    message.header.frame_id = "base"
    message.transform.rotation.x, message.transform.rotation.w = 1.0, 0.0
    message.transform.translation.z = 2.0
    return message


def test_curves_come_in_the_frame_that_was_asked_for_by_the_transform_of_their_time(peer):
    camera = Camera(peer)
    transforms = peer.publisher(TransformStamped, "/transform")
    peer.start(*REMAPS, "-p", "target_frame:=base", PYTHONPATH=STAND_IN)
    peer.wait_matched(*camera.publishers, transforms)
    camera.send(0)
    peer.wait("frame 0", lambda: peer.heard["diagnostics"])
    (status,) = peer.heard["diagnostics"][0].status
    assert status.level == bytes([_WARN])
    assert f"no transform from '{FRAME_ID}' to 'base'" in status.message
    assert values_of(peer.heard["diagnostics"][0])["without transform"] == "1"
    assert len(rows_of(peer.heard["points_px"][0])) == 100
    assert peer.heard["points"] == []
    assert [marker.action for marker in peer.heard["markers"][0].markers] == [_DELETE_ALL]

    transforms.publish(stamped(1))
    peer.listen(0.3)
    camera.send(1)
    peer.wait("frame 1", lambda: len(peer.heard["diagnostics"]) == 2)
    camera.send(2)  # its transform comes after it
    transforms.publish(stamped(2))
    peer.wait("frame 2", lambda: len(peer.heard["diagnostics"]) == 3)
    assert peer.stamps("points") == [T0_NS + index * PERIOD_NS for index in (1, 2)]
    assert peer.stamps("markers") == [T0_NS + index * PERIOD_NS for index in (0, 1, 2)]
    for index, cloud in enumerate(peer.heard["points"], start=1):
        assert cloud.header.frame_id == "base"
        assert camera.off_m(points_of(cloud) * (1, -1, -1) + (0, 0, 2), index) < OFF_M
    markers = peer.heard["markers"][-1].markers
    assert {marker.header.frame_id for marker in markers} == {"base"}
    first, point = points_of(peer.heard["points"][-1])[0], markers[0].points[0]
    assert np.allclose((point.x, point.y, point.z), first, atol=1e-6)
    assert 0.002 < markers[0].scale.x < 0.05
    assert peer.heard["points_px"][-1].header.frame_id == f"{FRAME_ID}/pixels"
    assert peer.heard["diagnostics"][-1].status[0].level == bytes([0])

    camera.send(3)  # without a transform of its time, markers of another place go
    peer.wait("frame 3", lambda: len(peer.heard["diagnostics"]) == 4)
    peer.wait("no markers", lambda: len(peer.heard["markers"]) == 4)
    assert {marker.action for marker in peer.heard["markers"][-1].markers} == {_DELETE}
    assert peer.interrupt() == 0, peer.log()
    assert "Traceback" not in peer.log()


def test_a_transform_is_not_asked_for_while_nobody_listens_to_curves_in_space(peer):
    camera = Camera(peer)
    peer.stop_listening("points", "markers")
    peer.start(*REMAPS, "-p", "target_frame:=base", PYTHONPATH=STAND_IN)
    peer.wait_matched(*camera.publishers)
    camera.send(0)
    peer.wait("frame 0", lambda: peer.heard["diagnostics"])
    assert "no transform" not in peer.heard["diagnostics"][0].status[0].message
    assert values_of(peer.heard["diagnostics"][0])["without transform"] == "0"
    assert peer.heard["points_px"]


def test_a_target_frame_needs_tf(peer):
    peer.start("-p", "target_frame:=base")
    assert peer.process.wait(40) == 2
    assert "tf2_ros_py" in peer.log()
    assert "Traceback" not in peer.log()


def test_a_frame_that_cannot_be_read_is_reported_and_tracking_can_begin_anew(peer):
    image = peer.publisher(Image, "/image")
    peer.start("-p", "hsv:=170:10")
    peer.wait_matched(image)
    wrong = image_message(MAKE, header(0), red())
    wrong.encoding = "nonsense"
    image.publish(wrong)
    peer.wait("diagnostics", lambda: peer.heard["diagnostics"])
    (status,) = peer.heard["diagnostics"][0].status
    assert status.level == bytes([_ERROR])
    assert "nonsense" in status.message
    assert values_of(peer.heard["diagnostics"][0])["unreadable"] == "1"
    image.publish(image_message(MAKE, header(1), red()))
    peer.wait("the answer", lambda: len(peer.heard["diagnostics"]) == 2)
    assert len(rows_of(peer.heard["points_px"][0])) == 100
    assert len(rows_of(peer.heard["points"][0])) == 0  # nobody told the camera

    reset = peer.node.create_client(Empty, "/dloftbs/reset")
    peer.wait("the service", reset.service_is_ready)
    done = reset.call_async(Empty.Request())
    peer.wait("reset", done.done)
    peer.wait("markers", lambda: len(peer.heard["markers"]) == 2)
    assert [(marker.action, marker.ns) for marker in peer.heard["markers"][1].markers] == [(_DELETE_ALL, "")]
    assert peer.interrupt(signal.SIGTERM) == 0, peer.log()
    assert "Traceback" not in peer.log()


def test_a_frame_that_cannot_be_processed_is_unreadable_and_not_answered(peer, tmp_path):
    (tmp_path / "config.yaml").write_text("tracking: {on_new_size: error}\n")
    image = peer.publisher(Image, "/image")
    peer.start("-p", "hsv:=170:10", "-p", f"config:={tmp_path / 'config.yaml'}")
    peer.wait_matched(image)
    image.publish(image_message(MAKE, header(0), red()))
    peer.wait("the answer", lambda: peer.heard["diagnostics"])
    image.publish(image_message(MAKE, header(1), red()[:200]))
    peer.wait("the error", lambda: len(peer.heard["diagnostics"]) == 2)
    counts = values_of(peer.heard["diagnostics"][1])
    assert (counts["answered"], counts["unreadable"]) == ("1", "1")


@pytest.mark.parametrize("peer", ["cables"], indirect=True)
def test_names_topics_and_parameters_are_those_that_were_asked_for(peer, tmp_path):
    (tmp_path / "cable.yaml").write_text("segmentation: {hsv: '90:100'}\n")  # the colour given beside it counts
    image = peer.publisher(CompressedImage, "/cam/image_raw/compressed")
    peer.start(
        *("-r", "__node:=cables", "-r", "image:=/cam/image_raw/compressed"),
        *("-p", f"config:={tmp_path / 'cable.yaml'}", "-p", "hsv:=170:10,80:255", "-p", "objects:=1"),
        *("-p", "frame_id:=base", "-p", "max_rate:=2"),
    )
    peer.wait_matched(image)
    for index in range(3):
        image.publish(jpeg(index))
    peer.wait("curves", lambda: peer.heard["points_px"])
    assert peer.heard["points_px"][0].header.frame_id == "base/pixels"
    assert len(rows_of(peer.heard["points_px"][0])) == 100
    peer.listen(1.0)  # half a second is the least between two
    image.publish(jpeg(3))
    peer.wait("the next answer", lambda: T0_NS + 3 * PERIOD_NS in peer.stamps("diagnostics"))
    assert int(values_of(peer.heard["diagnostics"][-1])["over max_rate"]) > 0


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("hsv:=1",), "HSV range"),
        (("objects:=many",), "objects must be an integer"),
        (("config:=nowhere.yaml",), "nowhere.yaml"),
    ],
)
def test_a_wrong_parameter_ends_the_node_with_a_word(peer, arguments, said):
    peer.start(*(part for argument in arguments for part in ("-p", argument)))
    assert peer.process.wait(40) == 2
    assert said in peer.log()
    assert "Traceback" not in peer.log()


def test_silence_is_explained_by_what_there_is(peer):
    other = peer.publisher(Image, "/camera/color/image_raw", reliable=False)
    peer.start()
    peer.wait("a word", lambda: peer.heard["diagnostics"])
    said = peer.heard["diagnostics"][0].status[0].message
    assert "no image on /image" in said
    assert "/camera/color/image_raw (sensor_msgs/msg/Image, best effort)" in said
    assert said in peer.log()
    assert other.get_subscription_count() == 0


def test_topics_are_looked_for_though_the_time_of_a_simulator_stands_still(peer):
    peer.start("-p", "hsv:=170:10", "-p", "use_sim_time:=true")
    peer.wait("kernels", lambda: "kernels are ready" in peer.log())
    image = peer.publisher(Image, "/image")  # after the look at the start
    peer.wait_matched(image)
    image.publish(image_message(MAKE, header(0), red()))
    peer.wait("curves", lambda: peer.heard["points_px"])


def test_a_camera_that_was_latched_before_the_node_started_is_heard(peer):
    sequence = rgbd_artificial(size=SIZE)[0]
    image, depth = peer.publisher(Image, "/image"), peer.publisher(Image, "/depth")
    qos = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    info = peer.node.create_publisher(CameraInfo, "/camera_info", qos)
    info.publish(camera_message(MAKE, header(0), sequence.camera, SIZE))
    peer.start()
    peer.wait_matched(image, depth, info)
    frame = sequence.frame(0)
    depth.publish(image_message(MAKE, header(0), np.round(frame.depth * 1000).astype(np.uint16)))
    image.publish(mask_message(MAKE, header(0), frame.mask))
    peer.wait("curves", lambda: peer.heard["points"])
    assert len(rows_of(peer.heard["points"][0])) == 100


def test_after_time_went_back_images_get_their_masks_again(peer):
    sequence = rgbd_artificial(size=SIZE)[0]
    image, mask = peer.publisher(Image, "/image"), peer.publisher(Image, "/sam2/mask")
    peer.start("-p", "mask_topic:=/sam2/mask")
    peer.wait_matched(image, mask)
    photo = np.full((*SIZE, 3), 90, np.uint8)
    for index in (300, 301, 0, 1):
        image.publish(image_message(MAKE, header(index), photo))
        peer.listen(0.3)
        mask.publish(mask_message(MAKE, header(index), sequence.frame(index % FRAMES).mask))
        stamp = T0_NS + index * PERIOD_NS
        peer.wait(f"curves of frame {index}", lambda last=stamp: peer.stamps("points_px")[-1:] == [last])


def test_the_mask_that_a_colour_finds_is_published_while_somebody_listens(peer):
    image = peer.publisher(Image, "/image")
    masks: list[Image] = []
    peer.start("-p", "hsv:=170:10")
    peer.wait_matched(image)
    image.publish(image_message(MAKE, header(0), red()))
    peer.wait("curves", lambda: peer.heard["points_px"])
    listening = peer.node.create_subscription(Image, "/dloftbs/mask", masks.append, 10)
    peer.wait("the mask's publisher", lambda: peer.node.count_publishers("/dloftbs/mask"))
    peer.listen(1.0)
    image.publish(image_message(MAKE, header(1), red(5)))
    # The first image's mask may come, too: the node asks for listeners when it has sent the points.
    peer.wait("a mask", lambda: [mask for mask in masks if mask.header.stamp == header(1).stamp])
    peer.node.destroy_subscription(listening)
    assert masks[-1].encoding == "mono8"
    found = np.frombuffer(bytes(masks[-1].data), np.uint8).reshape(SIZE)
    assert np.array_equal(found == 255, red(5).any(axis=2))


def test_of_more_frames_than_can_be_answered_the_others_are_counted(peer):
    image = peer.publisher(CompressedImage, "/image", reliable=False)
    peer.start("-p", "hsv:=170:10")
    peer.wait_matched(image)
    sent = 300
    for index in range(sent):
        image.publish(jpeg(index, index % 40))
    peer.listen(1.0)  # until all are answered, or lost
    send_until_answered(peer, image, sent)
    last = {key: int(value) for key, value in values_of(peer.heard["diagnostics"][-1]).items() if value.isdigit()}
    assert last["dropped"] > 0
    assert last["received"] == last["answered"] + last["dropped"]
    assert last["answered"] == len(peer.heard["points_px"])
    assert peer.stamps("points_px") == sorted(peer.stamps("points_px"))


def test_a_publisher_that_comes_back_otherwise_is_heard_again(peer):
    image = peer.publisher(CompressedImage, "/image")
    peer.start("-p", "hsv:=170:10")
    peer.wait_matched(image)
    send_until_answered(peer, image, 0)
    peer.node.destroy_publisher(image)
    image = peer.publisher(CompressedImage, "/image", reliable=False)
    peer.wait("subscribed anew", lambda: "best effort" in peer.log())
    peer.wait_matched(image)
    send_until_answered(peer, image, 20)
