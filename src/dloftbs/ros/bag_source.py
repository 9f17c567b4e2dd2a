"""Frames from a recording of ROS."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from dloftbs._values import LONGEST_S, MILLIMETRE_M, check_flag, check_number, check_text
from dloftbs.camera import DepthRegistration, PinholeCamera
from dloftbs.errors import InputError
from dloftbs.frame import Frame
from dloftbs.ros.bag_file import RawMessage
from dloftbs.ros.frame_messages import FrameMaker, ImageAndMask
from dloftbs.ros.message_fields import stamp_ns_of
from dloftbs.ros.message_types import MessageTypes
from dloftbs.ros.recording import Recording
from dloftbs.ros.stamp_pairing import TOLERANCE_S, WAITING, StampPairing
from dloftbs.ros.topic_choice import OWN_TOPICS, choose_topics
from dloftbs.sources.pixels import Kind
from dloftbs.sources.source import Source, logger


@dataclass(frozen=True)
class _Item:
    """A message, and its place among those of its topic."""

    index: int
    message: Any
    log_ns: int


Pair = tuple[_Item, _Item | None]
T = TypeVar("T")


class BagSource(Source):
    """Images of a recording, with the depth of the same moment and the camera, in one pass over the file.

    Times are those of the messages' headers, and where these are 0 those of the recording. A recording that was not
    finished, or is damaged, is read as far as it goes, with a warning; a message that cannot be read is skipped.

    Parameters
    ----------
    path : str or Path
        A file or a folder, as `Recording` has it.
    topic, depth_topic, info_topic : str, optional
        As `choose_topics` has them.
    kind : {"auto", "image", "mask"}
        "auto" takes images of one channel for masks.
    camera : PinholeCamera, optional
        Takes the place of what the recording says.
    registration : DepthRegistration, optional
        Brings the depth into the images.
    depth_unit_m : float
        Metres per count of integer depth.
    fps : float, optional
        Gives the stamps ``index / fps``, in place of the messages' times.
    guess_depth : bool
        Whether depth is looked for where none is named.
    tolerance_s : float
        Largest difference between the stamps of an image and its depth.
    keep_messages : bool
        Whether frames carry the messages of all topics of ROS 2 (`RosFrame.recorded`), each exactly once, so that
        `BagSink` can copy them: all but those of our own results. Where frames are made of these, none is kept.

    Attributes
    ----------
    topics : Topics
        Those that the frames are made of.

    Raises
    ------
    InputError
        If an argument is of another type or out of range.
    SourceError
        If it cannot be read, has no images, or has several and none is named; or if packages are missing.
    """

    def __init__(
        self,
        path: str | Path,
        *,
        topic: str | None = None,
        depth_topic: str | None = None,
        info_topic: str | None = None,
        kind: Kind = "auto",
        camera: PinholeCamera | None = None,
        registration: DepthRegistration | None = None,
        depth_unit_m: float = MILLIMETRE_M,
        fps: float | None = None,
        guess_depth: bool = True,
        tolerance_s: float = TOLERANCE_S,
        keep_messages: bool = False,
    ) -> None:
        for name, text in (("topic", topic), ("depth_topic", depth_topic), ("info_topic", info_topic)):
            if text is not None:
                check_text(name, text)
        self.fps = None if fps is None else check_number("fps", fps, 1e-9, 1e9)
        check_flag("guess_depth", guess_depth)
        check_flag("keep_messages", keep_messages)
        self._tolerance_s = check_number("tolerance_s", tolerance_s, 0.0, LONGEST_S)
        self._recording = Recording(path)
        self.name = str(path)
        self._kind: Kind = kind
        self._camera = camera
        self._registration = registration
        self._depth_unit_m = depth_unit_m
        try:
            self._types = MessageTypes(is_ros1=self._recording.is_ros1)
            self.topics = choose_topics(
                self.name, self._recording.topics, topic, depth_topic, info_topic, guess_depth=guess_depth
            )
            self._maker()  # wrong arguments are refused here, not at the first frame
        except BaseException:
            self._recording.close()
            raise
        self._kept: set[str] = set()
        if keep_messages and not any(name.startswith(OWN_TOPICS) for name in self.topics.names):
            self._kept = {topic.name for topic in self._recording.topics if not topic.name.startswith(OWN_TOPICS)}
        if self._recording.is_ros1:
            self._kept.clear()  # its messages are serialized otherwise
        self.length = self.topics.image.count
        self.has_depth = self.topics.depth is not None

    def close(self) -> None:
        """Let go of what was unpacked."""
        super().close()
        self._recording.close()

    def __iter__(self) -> Iterator[Frame]:
        """Yield the frames.

        Raises
        ------
        SourceError
            If the source is closed.
        InputError
            If depth that was named has another size than its image and there is no registration, or the camera is not
            that of the images.
        """
        self._begin()
        return self._frames()

    def _maker(self) -> FrameMaker:
        topics = self.topics
        return FrameMaker(
            self.name,
            kind=self._kind,
            rectified=topics.is_rectified,
            camera=self._camera,
            registration=self._registration,
            depth_unit_m=self._depth_unit_m,
            depth_is_meant=topics.depth_is_meant,
            info_is_meant=topics.info_is_meant,
            depth_is_registered=topics.depth_is_registered,
        )

    def _frames(self) -> Iterator[Frame]:
        topics, maker = self.topics, self._maker()
        kept: list[RawMessage] = []
        readable = self._readable(maker, kept)
        count = 0
        # A frame late, so that the last one takes what came after it.
        for (image, depth), pixels in _one_late(readable) if self._kept else readable:
            count += 1
            recorded = tuple(kept) if self._kept else None
            kept.clear()
            yield maker.make(
                image.message,
                pixels,
                None if depth is None else depth.message,
                index=image.index,
                stamp=None if self.fps is None else image.index / self.fps,
                stamp_ns=image.log_ns,
                name=f"{self.name}:{topics.image.name}#{image.index}",
                recorded=recorded,
            )
            if self._closed:
                return
        if self.length is not None and count + self.skipped < self.length:
            self.skipped = self.length - count  # which the recording has said that it cannot be read to its end

    def _readable(self, maker: FrameMaker, kept: list[RawMessage]) -> Iterator[tuple[Pair, ImageAndMask]]:
        """Yield what has an image that can be read, and add the messages that were come by to those that are kept."""
        for pair in self._with_camera(maker, kept):
            try:
                yield pair, maker.pixels(pair[0].message)
            except InputError as error:
                self._skip(f"message {pair[0].index} of {self.topics.image.name}", error)

    def _with_camera(self, maker: FrameMaker, kept: list[RawMessage]) -> Iterator[Pair]:
        """Yield images and their depth, the first ones only once the camera is known, if one is to come."""
        waiting: list[Pair] = []
        waits = self.topics.info is not None
        for pair in self._pairs(maker, kept):
            waits = waits and not maker.knows_camera and len(waiting) < WAITING
            waiting.append(pair)
            if not waits:
                yield from waiting
                waiting.clear()
        yield from waiting

    def _pairs(self, maker: FrameMaker, kept: list[RawMessage]) -> Iterator[Pair]:
        topics = self.topics
        pairing: StampPairing[_Item] = StampPairing(self._tolerance_s)
        types = {topic.name: topic.type_name for topic in (topics.image, topics.depth, topics.info) if topic}
        index = -1
        for raw in self._recording.messages(self._kept | types.keys()):
            if raw.topic in self._kept and raw.channel is not None:
                kept.append(raw)
            if raw.topic not in types:
                continue
            is_image = raw.topic == topics.image.name
            index += is_image
            try:
                message = self._types.read(raw.data, types[raw.topic])
                stamp_ns = stamp_ns_of(message) or raw.stamp_ns
            except InputError as error:
                if is_image:
                    self._skip(f"message {index} of {raw.topic}", error)
                else:
                    logger.warning("%s: a message of %s is left out: %s", self.name, raw.topic, error)
                continue
            item = _Item(index, message, raw.stamp_ns)
            if topics.info is not None and raw.topic == topics.info.name:
                maker.take_info(message)
            elif not is_image:
                yield from pairing.add_depth(stamp_ns, item)
            elif topics.depth is None:
                yield item, None
            else:
                yield from pairing.add_image(stamp_ns, item)
        yield from pairing.rest()


def _one_late(items: Iterable[T]) -> Iterator[T]:
    """Yield items, each after the next one was taken."""
    waiting: deque[T] = deque()
    for item in items:
        waiting.append(item)
        if len(waiting) > 1:
            yield waiting.popleft()
    yield from waiting
