"""The node in a process of its own, spoken to by topics alone."""

from __future__ import annotations

import signal

import cv2
import numpy as np
import pytest
from conftest import FRAME_ID, MAKE, PERIOD_NS, T0_NS, header, rows_of, values_of
from sensor_msgs.msg import CameraInfo, CompressedImage, Image
from std_srvs.srv import Empty

from dloftbs.ros import camera_message, image_message, mask_message, picture_message
from dloftbs.synthetic import rgbd_artificial

SIZE = (240, 426)
FRAMES = 8
OFF_M = 0.005
"""Half the width of the cable."""
_ERROR, _DELETE_ALL = 2, 3


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
    assert {marker.id for message in peer.heard["markers"] for marker in message.markers} == ids
    last = values_of(peer.heard["diagnostics"][-1])
    assert (last["received"], last["answered"], last["dropped"], last["unreadable"]) == (
        str(FRAMES),
        str(FRAMES),
        "0",
        "0",
    )
    assert peer.interrupt() == 0, peer.log()
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
    assert [marker.action for marker in peer.heard["markers"][1].markers] == [_DELETE_ALL]
    assert peer.interrupt(signal.SIGTERM) == 0, peer.log()
    assert "Traceback" not in peer.log()


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
