"""Recordings and messages for tests, written by rosbags and mcap, which are independent of our readers."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import cv2
import numpy as np
from drawings import draw_cable, wave
from mcap.writer import CompressionType
from mcap.writer import Writer as McapWriter
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_typestore

from dloftbs.ros import RosbagsFactory
from dloftbs.ros.message_types import MessageTypes

IMAGE = "sensor_msgs/msg/Image"
COMPRESSED = "sensor_msgs/msg/CompressedImage"
INFO = "sensor_msgs/msg/CameraInfo"
COLOUR_TOPIC, DEPTH_TOPIC = "/camera/color/image_raw", "/camera/aligned_depth_to_color/image_raw"
INFO_TOPIC = "/camera/color/camera_info"
SIZE = (120, 160)
START_NS = 1_700_000_000_123_456_789
PERIOD_NS = 33_333_333
STORE1, STORE2 = get_typestore(Stores.ROS1_NOETIC), get_typestore(Stores.ROS2_JAZZY)
MAKE1, MAKE2 = RosbagsFactory(STORE1), RosbagsFactory(STORE2)

Entry = tuple[str, int, Any]
"""Topic, time of recording and message."""


def header(make: RosbagsFactory, stamp_ns: int, frame_id: str = "camera_optical") -> Any:
    stamp = make("builtin_interfaces/msg/Time", sec=stamp_ns // 10**9, nanosec=stamp_ns % 10**9)
    return make("std_msgs/msg/Header", stamp=stamp, frame_id=frame_id)


def raw_image(pixels, encoding, stamp_ns=START_NS, *, make=MAKE2, big=False, padding=0, size=None) -> Any:
    """Return an image whose rows of bytes are those of an array, padded; `size` where it is not that of the array."""
    height, width = size or pixels.shape[:2]
    pixels = np.asarray(pixels).astype(pixels.dtype.newbyteorder(">" if big else "<"))
    rows = np.frombuffer(np.ascontiguousarray(pixels).tobytes(), np.uint8).reshape(height, -1)
    rows = np.pad(rows, ((0, 0), (0, padding)), constant_values=77)
    fields = {"height": height, "width": width, "encoding": encoding, "is_bigendian": int(big), "step": rows.shape[1]}
    return make(IMAGE, header=header(make, stamp_ns), data=rows.ravel(), **fields)


def compressed(data: bytes, form: str, stamp_ns=START_NS, *, make=MAKE2) -> Any:
    return make(COMPRESSED, header=header(make, stamp_ns), format=form, data=np.frombuffer(data, np.uint8))


def encoded(pixels, suffix) -> bytes:
    return cv2.imencode(suffix, pixels)[1].tobytes()


def camera_info(stamp_ns=START_NS, *, make=MAKE2, size=SIZE, k=None, d=(), model="plumb_bob", p=None, **fields) -> Any:
    rows, columns = size
    k = [150.0, 0.0, columns / 2, 0.0, 150.0, rows / 2, 0.0, 0.0, 1.0] if k is None else k
    p = [*k[:3], 0.0, *k[3:6], 0.0, *k[6:], 0.0] if p is None else p
    names = "DKP" if make is MAKE1 else "dkp"
    numbers = dict(zip(names, (np.array(d, float), np.array(k, float), np.array(p, float)), strict=True))
    return make(
        INFO, header=header(make, stamp_ns), height=rows, width=columns, distortion_model=model, **numbers, **fields
    )


def mask_of(i: int) -> np.ndarray:
    return draw_cable(wave(SIZE, 1.0, 0.05 * i), 7, SIZE)


def photo_of(i: int) -> np.ndarray:
    image = np.full((*SIZE, 3), (90, 120, 90), np.uint8)
    image[mask_of(i) > 0] = (30, 20, 210)
    return image


def stamp_of(i: int) -> int:
    return START_NS + i * PERIOD_NS


def entries(count=6, *, make=MAKE2, depth=True, info=True) -> list[Entry]:
    """Return what a camera publishes of a red cable: depth comes a little after colour, the camera with it."""
    found: list[Entry] = []
    for i in range(count):
        at = stamp_of(i)
        if info:
            found.append((INFO_TOPIC, at + 1_000_000, camera_info(at, make=make)))
        found.append((COLOUR_TOPIC, at + 2_000_000, raw_image(photo_of(i), "bgr8", at, make=make)))
        if depth:
            counts = np.full(SIZE, 600 + i, np.uint16)
            found.append((DEPTH_TOPIC, at + 5_000_000, raw_image(counts, "16UC1", at + 300_000, make=make)))
    return found


def write_ros2(folder: Path, given: Iterable[Entry], storage="mcap", **options) -> Path:
    """Write a rosbag2 folder; `storage` is "mcap" or "sqlite3"."""
    plugin = StoragePlugin.MCAP if storage == "mcap" else StoragePlugin.SQLITE3
    writer = Writer2(folder, version=9, storage_plugin=plugin)
    if options:
        writer.set_compression(options["mode"], options["form"])
    with writer:
        connections: dict[str, Any] = {}
        for topic, at, message in given:
            kind = message.__msgtype__
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=STORE2)
            writer.write(connections[topic], at, bytes(STORE2.serialize_cdr(message, kind)))
    return folder


def write_ros1(path: Path, given: Iterable[Entry], compression=None, padding=0) -> Path:
    """Write a bag of ROS 1, with as many zeros behind each message."""
    writer = Writer1(path)
    if compression is not None:
        writer.set_compression(compression)
    with writer:
        connections: dict[str, Any] = {}
        for topic, at, message in given:
            kind = message.__msgtype__
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=STORE1)
            writer.write(connections[topic], at, bytes(STORE1.serialize_ros1(message, kind)) + bytes(padding))
    return path


def write_mcap(path: Path, given: Iterable[Entry], compression=CompressionType.NONE, chunk_bytes=1 << 16, **options):
    """Write an MCAP file with chunks of a size, with the options of mcap's writer."""
    types = MessageTypes()
    with path.open("wb") as file:
        writer = McapWriter(file, chunk_size=chunk_bytes, compression=compression, **options)
        writer.start("ros2")
        channels: dict[str, int] = {}
        for topic, at, message in given:
            if topic not in channels:
                kind = message.__msgtype__
                schema = writer.register_schema(kind, "ros2msg", types.definition(kind).encode())
                channels[topic] = writer.register_channel(topic, "cdr", schema)
            writer.add_message(channels[topic], at, types.write(message), at)
        writer.finish()
    return path


def like_rclpy(message: Any) -> Any:
    """Return a message whose sequences of bytes are array.array, as those of rclpy are."""
    from array import array

    fields = {name: getattr(message, name) for name in vars(message)}
    if "data" in fields:
        fields["data"] = array("B", bytes(fields["data"]))
    return SimpleNamespace(**fields)


def write_foreign(path: Path, topics: Iterable[tuple[str, str, str, str]], given: Iterable[Entry] = ()) -> Path:
    """Write an MCAP file with a message each of topics of other types, and messages that can be read.

    A topic is its name, type, encoding of messages and encoding of the type's definition.
    """
    types = MessageTypes()
    with path.open("wb") as file:
        writer = McapWriter(file)
        writer.start("")
        for name, kind, encoding, definition in topics:
            channel = writer.register_channel(name, encoding, writer.register_schema(kind, definition, b""))
            writer.add_message(channel, START_NS, b"{}", START_NS)
        for topic, at, message in given:
            kind = message.__msgtype__
            schema = writer.register_schema(kind, "ros2msg", types.definition(kind).encode())
            writer.add_message(writer.register_channel(topic, "cdr", schema), at, types.write(message), at)
        writer.finish()
    return path
