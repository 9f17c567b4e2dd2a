"""Results as a recording of ROS."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import Any

from dloftbs.data.answers import BendLimit
from dloftbs.data.frame import Frame
from dloftbs.data.frame_result import FrameResult
from dloftbs.errors import SinkError
from dloftbs.ros.bag_file import Channel, RawMessage
from dloftbs.ros.bag_metadata import QOS, metadata_yaml
from dloftbs.ros.frame_messages import RosFrame
from dloftbs.ros.marker_messages import MarkerWriter
from dloftbs.ros.message_factory import RosbagsFactory
from dloftbs.ros.message_types import MessageTypes
from dloftbs.ros.requirements import PIP_LINE, needed
from dloftbs.ros.result_messages import (
    PIXELS,
    camera_message,
    diagnostics_message,
    header_of,
    image_message,
    mask_message,
    picture_message,
    points_message,
)
from dloftbs.ros.topic_choice import OWN_TOPICS
from dloftbs.ros.track_samples import objects_of, sample_px, sampled_m
from dloftbs.sinks._images import encode
from dloftbs.sinks.sink import PathSink
from dloftbs.sources.recordings import METADATA
from dloftbs.support.safe_files import AppendFile, sink_errors, write_whole
from dloftbs.support.values import check_flag, check_text, check_type

SUFFIX = ".mcap"


class BagSink(PathSink):
    """Writes an MCAP file, or the folder of a rosbag2 with one, that RViz and Foxglove show.

    The topics are below ``/dloftbs/``: ``points`` (PointCloud2, metres) and ``markers`` (MarkerArray) of the curves in
    space, ``points_px`` (PointCloud2, pixels, in a frame of its own) of all curves, ``overlay/compressed``, ``mask``
    where the frame brought one, ``diagnostics``; with the input, also ``image``, ``depth`` and ``camera_info``, or,
    where frames carry the messages of their recording (`RosFrame.recorded`), these as they are, on their own topics.
    All have the time and the coordinate frame of the input. The file has one clock: where messages are copied, results
    are logged at the time of the last one that was copied.

    The messages of each frame are a chunk of the file, on its way to the disk before `write` returns: whenever the
    process dies, every frame written is whole. Only the index at the end is then missing, which readers of unfinished
    recordings do without, `dloftbs.sources.open` among them.

    Parameters
    ----------
    path : str or Path
        A file that ends in ``.mcap``, or a folder. Missing folders are made, an older recording is replaced with the
        first frame.
    overlay : bool
        Whether the overlay is drawn.
    with_input : bool
        Whether images, depth and camera, or the messages of the frames' recording, are written, too.
    frame_id : str
        Name of the coordinate frame where the input has none.
    bend_limit : BendLimit, optional
        Least radius of bends; ``diagnostics`` warn of tighter ones.

    Raises
    ------
    InputError
        If an argument is of another type; in `write`, if a frame's time is none that messages can have.
    SinkError
        If the file cannot be written, or packages are missing.
    """

    def __init__(
        self,
        path: str | Path,
        *,
        overlay: bool = True,
        with_input: bool = False,
        frame_id: str = "camera",
        bend_limit: BendLimit | None = None,
    ) -> None:
        super().__init__(path)
        self._overlay, self._with_input = check_flag("overlay", overlay), check_flag("with_input", with_input)
        self._frame_id = check_text("frame_id", frame_id)
        if bend_limit is not None:
            check_type("bend_limit", bend_limit, BendLimit)
        self._bend_limit = bend_limit
        self._types = MessageTypes(error=SinkError)
        self._make = RosbagsFactory(self._types.store)
        self._markers = MarkerWriter(self._make)
        self._channels: dict[str, int] = {}
        self._copied: dict[Channel, int] = {}
        self._schemas: dict[tuple[str, str, bytes], int] = {}
        self._counts: dict[tuple[str, str], int] = {}
        self._qos: dict[str, str] = {}
        self._span_ns: tuple[int, int] | None = None
        self._copied_ns: int | None = None
        self._is_cut = False
        self._folder = None if self._path.suffix.lower() == SUFFIX else self._path
        self._buffer = _Buffer()
        self._writer: Any = needed("mcap.writer", PIP_LINE, SinkError).Writer(self._buffer)
        self._writer.start("ros2", "dloftbs")
        self._writer.flush()
        place = self._path if self._folder is None else self._folder / f"{self._folder.name}_0{SUFFIX}"
        self._file = AppendFile(place, self._buffer.taken())

    def _write(self, frame: Frame, result: FrameResult) -> None:
        make, header = self._make, header_of(frame, self._frame_id)
        metres, pixels = header.message(make), header.message(make, PIXELS)
        in_space = list(sampled_m(result))
        messages: dict[str, Any] = {
            "points": points_message(make, metres, in_space, 3),
            "markers": self._markers.message(metres, in_space, result.branch_points),
            "points_px": points_message(make, pixels, [sample_px(track) for track in objects_of(result)], 2),
            "diagnostics": diagnostics_message(make, metres, result, limit=self._bend_limit),
        }
        is_cable = frame.is_cable
        if is_cable is not None:
            messages["mask"] = mask_message(make, metres, is_cable)
        if self._overlay:
            from dloftbs import viz

            picture = encode(viz.draw(frame, result), ".jpg")
            messages["overlay/compressed"] = picture_message(make, metres, picture)
        if self._folder is not None and self._span_ns is None:  # an older recording's, which is about to go
            with sink_errors(self._folder), suppress(FileNotFoundError):
                (self._folder / METADATA).unlink()
        if self._with_input:
            recorded = frame.recorded if isinstance(frame, RosFrame) else None
            if recorded is None:
                messages |= self._input(frame, metres)
            for raw in recorded or ():
                self._copy(raw)
        log_ns = header.stamp_ns if self._copied_ns is None else self._copied_ns
        for name, message in messages.items():
            self._put(f"{OWN_TOPICS}{name}", message, log_ns, header.stamp_ns)
        self._flush()

    def _input(self, frame: Frame, header: Any) -> dict[str, Any]:
        messages: dict[str, Any] = {}
        if frame.image is not None:
            messages["image"] = image_message(self._make, header, frame.image)
        if frame.depth is not None:
            messages["depth"] = image_message(self._make, header, frame.depth, frame.depth_unit_m)
        if frame.camera is not None:
            messages["camera_info"] = camera_message(self._make, header, frame.camera, frame.size)
        return messages

    def _put(self, topic: str, message: Any, log_ns: int, published_ns: int) -> None:
        kind = message.__msgtype__
        if topic not in self._channels:
            schema = self._schema(kind, "ros2msg", self._types.definition(kind).encode())
            self._channels[topic] = self._writer.register_channel(topic, "cdr", schema)
        self._writer.add_message(self._channels[topic], log_ns, self._types.write(message), published_ns)
        self._count(topic, kind, log_ns)

    def _copy(self, raw: RawMessage) -> None:
        """Write a message as it was recorded."""
        channel = raw.channel
        if channel is None:
            return
        if channel not in self._copied:
            definition, encoding = channel.definition, channel.definition_encoding
            if not definition and channel.type_name in self._types.store.types:
                definition, encoding = self._types.definition(channel.type_name).encode(), "ros2msg"
            schema = self._schema(channel.type_name, encoding, definition)
            metadata = dict(channel.metadata)
            self._copied[channel] = self._writer.register_channel(channel.topic, "cdr", schema, metadata)
            self._qos[channel.topic] = metadata.get(QOS, "")
        self._writer.add_message(
            self._copied[channel], raw.stamp_ns, bytes(raw.data), raw.published_ns, sequence=raw.sequence
        )
        self._count(channel.topic, channel.type_name, raw.stamp_ns)
        self._copied_ns = raw.stamp_ns

    def _schema(self, kind: str, encoding: str, definition: bytes) -> int:
        """Return the number of a type's definition in the file."""
        key = kind, encoding, definition
        if key not in self._schemas:
            self._schemas[key] = self._writer.register_schema(*key)
        return self._schemas[key]

    def _count(self, topic: str, kind: str, stamp_ns: int) -> None:
        self._counts[topic, kind] = self._counts.get((topic, kind), 0) + 1
        first, last = self._span_ns or (stamp_ns, stamp_ns)
        self._span_ns = min(first, stamp_ns), max(last, stamp_ns)

    def _flush(self) -> None:
        """Hand the frame's messages to the system, in one piece."""
        self._writer.flush()
        self._append()

    def _append(self) -> None:
        try:
            self._file.append(self._buffer.taken())
        except BaseException:
            self._is_cut = True
            raise

    def _close(self) -> None:
        if self._file.keeps_older:
            self._file.close()
            return
        try:
            if not self._is_cut:  # an index of what is not there would be wrong
                self._writer.finish()
                self._append()
        finally:
            self._file.close()
        if self._folder is not None and not self._is_cut:
            text = metadata_yaml(self._file.path.name, self._counts, self._span_ns, self._qos)
            write_whole(self._folder / METADATA, text.encode())


class _Buffer:
    """A stream that keeps what is written until it is taken, and knows how much there was in all."""

    def __init__(self) -> None:
        self._parts: list[bytes] = []
        self._size = 0

    def write(self, data: bytes) -> int:
        """Keep bytes."""
        self._parts.append(bytes(data))
        self._size += len(data)
        return len(data)

    def tell(self) -> int:
        """Return the number of bytes so far."""
        return self._size

    def flush(self) -> None:
        """There is nothing below to flush."""

    def taken(self) -> bytes:
        """Return what was kept, and keep it no longer."""
        data = b"".join(self._parts)
        self._parts.clear()
        return data
