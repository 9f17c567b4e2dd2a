"""Reading recordings: HD frames of bgr8 from MCAP, SQLite and ROS 1, against rosbags alone.

Run it with ``python -m benchmarks.recordings [--quick] [--docs PAGE]``. rosbags reads and deserializes each message;
this package also makes a frame of it. Both go through the whole file in turn, from the system's cache; "/ rosbags" is
the ratio of the two in the same run.
"""

from __future__ import annotations

import tempfile
from functools import partial
from pathlib import Path

import numpy as np
from mcap.writer import CompressionType, Writer

from benchmarks.docs import arguments, published
from benchmarks.timing import Table, interleaved
from dloftbs import sources
from dloftbs.ros import RosbagsFactory
from dloftbs.ros.message_types import MessageTypes
from dloftbs_lab.synthetic import DemoSequence

TOPIC, TYPE = "/camera/image_raw", "sensor_msgs/msg/Image"
PERIOD_NS = 33_333_333


def main() -> None:
    """Print the table."""
    given = arguments(__doc__, "few frames and rounds, to see that it runs").parse_args()
    frames, rounds = (4, 1) if given.quick else (40, 15)
    with published("recordings", given.docs), tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        print(f"{frames} frames of 1280 x 720, bgr8, ms for all of them")
        for kind, path in make_recordings(folder, frames).items():
            times = interleaved({"rosbags": partial(read_by_rosbags, path), "dloftbs": partial(read, path)}, rounds)
            table = Table(kind, {"rosbags": times["rosbags"]})
            for reader, ms in times.items():
                table.row(f"  {reader}", ms)
            table.end()


def make_recordings(folder: Path, frames: int) -> dict[str, Path]:
    """Write the demo's frames in each format, and return the paths by what they are."""
    types = MessageTypes()
    make = RosbagsFactory(types.store)
    messages = []
    for frame in DemoSequence(frames=frames):
        assert frame.image is not None  # the demo has pictures
        stamp = make("builtin_interfaces/msg/Time", sec=frame.index, nanosec=0)
        header = make("std_msgs/msg/Header", stamp=stamp, frame_id="camera")
        rows, columns, _ = frame.image.shape
        pixels = np.ascontiguousarray(frame.image).ravel()
        fields = {"height": rows, "width": columns, "encoding": "bgr8", "step": 3 * columns}
        messages.append(make(TYPE, header=header, data=pixels, **fields))
    written = {}
    for kind, compression in (("MCAP", CompressionType.NONE), ("MCAP, zstd", CompressionType.ZSTD)):
        written[kind] = write_mcap(folder / f"{kind}.mcap", types, messages, compression)
    written["SQLite"] = write_sqlite(folder / "sqlite", types, messages)
    return written


def write_mcap(path: Path, types: MessageTypes, messages: list[object], compression: CompressionType) -> Path:
    """Write messages as rosbag2 does by default, in chunks of 768 KiB."""
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=768 << 10, compression=compression)
        writer.start("ros2")
        schema = writer.register_schema(TYPE, "ros2msg", types.definition(TYPE).encode())
        channel = writer.register_channel(TOPIC, "cdr", schema)
        for i, message in enumerate(messages):
            writer.add_message(channel, i * PERIOD_NS, types.write(message), i * PERIOD_NS)
        writer.finish()  # type: ignore[no-untyped-call]  # mcap has no annotation there
    return path


def write_sqlite(path: Path, types: MessageTypes, messages: list[object]) -> Path:
    """Write messages as rosbag2 did before it had MCAP."""
    from rosbags.rosbag2 import StoragePlugin
    from rosbags.rosbag2 import Writer as Writer2

    with Writer2(path, version=9, storage_plugin=StoragePlugin.SQLITE3) as writer:
        connection = writer.add_connection(TOPIC, TYPE, typestore=types.store)
        for i, message in enumerate(messages):
            writer.write(connection, i * PERIOD_NS, types.write(message))
    return path


def read_by_rosbags(path: Path) -> int:
    """Read and deserialize all images by rosbags alone."""
    from rosbags.highlevel import AnyReader

    count = 0
    with AnyReader([path]) as reader:
        for connection, _, data in reader.messages(reader.connections):
            reader.deserialize(data, connection.msgtype)
            count += 1
    return count


def read(path: Path) -> int:
    """Read all frames by this package."""
    with sources.open(path) as source:
        return sum(1 for _ in source)


if __name__ == "__main__":
    main()
