"""Frames from a recording of ROS."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from dloftbs.camera import DepthRegistration, PinholeCamera
from dloftbs.data.frame import Frame
from dloftbs.errors import InputError
from dloftbs.ros.bag_file import RawMessage, Topic
from dloftbs.ros.first_messages import read_first_messages
from dloftbs.ros.frame_messages import FrameMaker, ImageAndMask
from dloftbs.ros.message_fields import NS_PER_S, kind_of_reason, stamp_ns_of
from dloftbs.ros.message_types import MessageTypes
from dloftbs.ros.recording import Recording
from dloftbs.ros.stamp_pairing import (
    MASK_TOLERANCE_S,
    MOST_RECORDED,
    RECORDED_S,
    TOLERANCE_S,
    WAITING,
    WAITING_FOR_MASKS,
    StampPairing,
)
from dloftbs.ros.topic_choice import IMAGE_TYPES, INFO_TYPE, OWN_TOPICS, Topics, choose_topics
from dloftbs.ros.topic_clock import TopicClock
from dloftbs.sources.pixels import Kind
from dloftbs.sources.source import Source, logger
from dloftbs.support.values import LONGEST_S, MILLIMETRE_M, check_flag, check_number, check_text

_SAME_CLOCK_NS = NS_PER_S // 2
"""Largest difference between the latencies of two topics; more means that their headers have two clocks."""
_LOG_TOLERANCE_S = 0.05
"""Smallest tolerance of pairs by the time of recording, which includes the latency of messages."""


@dataclass(frozen=True)
class _Item:
    """A message, its place among those of its topic, its time by the clock of the topic, and that to pair masks by."""

    index: int
    message: Any
    time_ns: int
    mask_ns: int


Pair = tuple[_Item, _Item | None]
"""An image and its depth."""


class _Moment(NamedTuple):
    """An image, and what goes with it."""

    image: _Item
    depth: _Item | None = None
    mask: _Item | None = None


_Readable = tuple[_Moment, ImageAndMask]
_Kept = deque[tuple[int, RawMessage]]
"""Messages that no frame has yet, each with the index of the last image at that time."""


class BagSource(Source):
    """Images of a recording, with depth and mask of the same moment and the camera, in one pass over the file.

    Times are those of the messages' headers, or those of the recording if no header has one. Headers without a time
    and headers that go back are bridged by the time of the recording (see `TopicClock`). A recording that was not
    finished, or is damaged, is read as far as it goes, with a warning; a message that cannot be read is skipped. Where
    masks are named, images without one are left out, as of a segmenter that is slower than the camera; at the end their
    number is a warning.

    Parameters
    ----------
    path : str or Path
        A file or a folder, as `Recording` has it.
    topic, depth_topic, info_topic, mask_topic : str, optional
        As `choose_topics` has them.
    kind : {"auto", "image", "mask", "auto_image"}
        "auto" takes images of one channel for masks, "auto_image" for images. With `mask_topic`, all are images.
    mask_is : {"auto", "binary", "probability", "labels"}
        What the values of masks are, as `Frame` has it.
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
        mask_topic: str | None = None,
        kind: Kind = "auto",
        mask_is: str = "auto",
        camera: PinholeCamera | None = None,
        registration: DepthRegistration | None = None,
        depth_unit_m: float = MILLIMETRE_M,
        fps: float | None = None,
        guess_depth: bool = True,
        tolerance_s: float = TOLERANCE_S,
        keep_messages: bool = False,
    ) -> None:
        named = {"topic": topic, "depth_topic": depth_topic, "info_topic": info_topic, "mask_topic": mask_topic}
        for name, text in named.items():
            if text is not None:
                check_text(name, text)
        if mask_topic is not None and kind == "mask":
            raise InputError("kind must be 'image' where masks have a topic of their own, got 'mask'")
        self.fps = None if fps is None else check_number("fps", fps, 1e-9, 1e9)
        check_flag("guess_depth", guess_depth)
        check_flag("keep_messages", keep_messages)
        self._tolerance_s = check_number("tolerance_s", tolerance_s, 0.0, LONGEST_S)
        self._recording = Recording(path)
        self.name = str(path)
        self._kind: Kind = kind
        self._mask_is = mask_is
        self._camera = camera
        self._registration = registration
        self._depth_unit_m = depth_unit_m
        try:
            self._types = MessageTypes(is_ros1=self._recording.is_ros1)
            self.topics = self._chosen(topic, depth_topic, info_topic, mask_topic, guess_depth)
            self._maker()  # wrong arguments are refused here, not at the first frame
        except BaseException:
            self._recording.close()
            raise
        self._kept: set[str] = set()
        if keep_messages and not any(topic.name.startswith(OWN_TOPICS) for topic in self.topics.used):
            self._kept = {topic.name for topic in self._recording.topics if not topic.name.startswith(OWN_TOPICS)}
        if self._recording.is_ros1:
            self._kept.clear()  # its messages are serialized otherwise
        for remark in self.topics.remarks:
            logger.warning("%s: %s", self.name, remark)
        self._said: set[str] = set()
        self.length = self.topics.image.count if self.topics.mask is None else None
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
            If depth that was named has another size than its image and there is no registration, a mask has another
            size, or the camera is not that of the images.
        """
        self._begin()
        self._said.clear()
        return self._frames()

    def _chosen(
        self,
        topic: str | None,
        depth_topic: str | None,
        info_topic: str | None,
        mask_topic: str | None,
        guess_depth: bool,
    ) -> Topics:
        """Return the topics, and keep the clocks of images, depth and masks."""
        topics = self._recording.topics
        candidates = [found for found in topics if found.type_name in (*IMAGE_TYPES, INFO_TYPE) and not found.encoding]
        first = read_first_messages(self._recording, self._types, candidates)
        chosen = choose_topics(
            self.name,
            topics,
            topic,
            depth_topic,
            info_topic,
            mask_topic=mask_topic,
            guess_depth=guess_depth,
            guess_info=self._camera is None and self._registration is None,
            registration=self._registration,
            first=first,
        )
        found = [None if one is None else first.get(one.name) for one in (chosen.image, chosen.depth, chosen.mask)]
        known = next((message.offset_ns for message in found if message is not None), 0)
        offsets = [known if message is None else message.offset_ns for message in found]
        self._offset_ns, self._depth_offset_ns, self._mask_offset_ns = offsets
        return chosen

    def _maker(self) -> FrameMaker:
        topics = self.topics
        return FrameMaker(
            self.name,
            kind=self._kind,
            mask_is=self._mask_is,
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
        kept: _Kept = deque()
        readable = self._readable(maker, kept)
        count = 0
        found: Iterable[tuple[_Readable, tuple[RawMessage, ...] | None]] = ((one, None) for one in readable)
        for ((image, depth, _), pixels), recorded in _with_recorded(readable, kept) if self._kept else found:
            count += 1
            yield maker.make(
                image.message,
                pixels,
                None if depth is None else depth.message,
                index=image.index,
                stamp=image.time_ns / NS_PER_S if self.fps is None else image.index / self.fps,
                stamp_ns=image.time_ns,
                name=f"{self.name}:{topics.image.name}#{image.index}",
                recorded=recorded,
            )
            if self._closed:
                return
        if count and self.topics.info is not None and not maker.knows_camera:
            logger.warning(
                "%s: frames go without a camera: no message of %s came that can be read",
                self.name,
                self.topics.info.name,
            )
        if self.length is not None and count + self.skipped < self.length:
            self.skipped = self.length - count  # which the recording has said that it cannot be read to its end

    def _readable(self, maker: FrameMaker, kept: _Kept) -> Iterator[_Readable]:
        """Yield what has an image that can be read, and add the messages that were come by to those that are kept."""
        wanted = self.topics.mask
        without = 0
        for moment in self._with_camera(maker, kept):
            mask = None if moment.mask is None else moment.mask.message
            if mask is None and wanted is not None:
                without += 1
                continue
            try:
                yield moment, maker.pixels(moment.image.message, mask)
            except InputError as error:
                self._leave_out(moment.image.index, error)
        if without and wanted is not None:
            what = "image without a mask of its time" if without == 1 else "images without a mask of their time"
            logger.warning("%s: left out %d %s on %s", self.name, without, what, wanted.name)

    def _leave_out(self, index: int, error: InputError) -> None:
        """Skip an image, and say so where it is the first one for this reason."""
        if self._says(kind_of_reason(error)):
            what = f"message {index} of {self.topics.image.name}"
            self._skip(what, f"{error} (the first one; others for this reason are counted)")
        else:
            self.skipped += 1

    def _says(self, reason: str) -> bool:
        """Return True the first time that something is to be said."""
        is_new = reason not in self._said
        self._said.add(reason)
        return is_new

    def _with_camera(self, maker: FrameMaker, kept: _Kept) -> Iterator[_Moment]:
        """Yield images and what goes with them, the first ones only once the camera is known, if one is to come."""
        waiting: list[_Moment] = []
        waits = self.topics.info is not None
        for moment in self._moments(maker, kept):
            waits = waits and not maker.knows_camera and len(waiting) < WAITING
            waiting.append(moment)
            if not waits:
                yield from waiting
                waiting.clear()
        yield from waiting

    def _moments(self, maker: FrameMaker, kept: _Kept) -> Iterator[_Moment]:
        """Yield images with their depth and their mask, as far as these have topics."""
        depth, mask = self.topics.depth, self.topics.mask
        by_log = depth is not None and self._has_two_clocks()
        pairing: StampPairing[_Item, _Item] = StampPairing(
            max(self._tolerance_s, _LOG_TOLERANCE_S) if by_log else self._tolerance_s,
            waiting_s=RECORDED_S,
            most=MOST_RECORDED,
        )
        masking: StampPairing[Pair, _Item] | None = None
        if mask is not None:
            tolerance_s = MASK_TOLERANCE_S if self._are_masks_stamped else self._tolerance_s
            masking = StampPairing(tolerance_s, WAITING_FOR_MASKS)
        images = 0
        for name, log_ns, item in self._items(maker, kept):
            images += name == self.topics.image.name
            if masking is not None and mask is not None and name == mask.name:
                yield from _masked(masking.add_partner(item.mask_ns, item))
                continue
            moment_ns = log_ns if by_log else item.time_ns
            if depth is None:
                pairs: Iterable[Pair] = [(item, None)]
            elif name == depth.name:
                pairs = pairing.add_partner(moment_ns, item)
            else:
                pairs = pairing.add_image(moment_ns, item)
            yield from _with_mask(pairs, masking)
        yield from _with_mask(pairing.rest(), masking)
        if masking is not None:
            yield from _masked(masking.rest())
        for what, topic, pairs_of in (("without depth", depth, pairing), ("without a mask", mask, masking)):
            if topic is not None and pairs_of is not None and images:
                self._say_pairs(what, topic, pairs_of)

    def _items(self, maker: FrameMaker, kept: _Kept) -> Iterator[tuple[str, int, _Item]]:
        """Yield images, depths and masks as they come, with their topics and the times of the recording."""
        topics = self.topics
        offsets = (
            (topics.image, self._offset_ns),
            (topics.depth, self._depth_offset_ns),
            (topics.mask, self._mask_offset_ns),
        )
        clocks = {topic.name: TopicClock(offset_ns) for topic, offset_ns in offsets if topic is not None}
        types = {topic.name: topic.type_name for topic in topics.used}
        index = -1
        for raw in self._recording.messages(self._kept | types.keys()):
            is_image = raw.topic == topics.image.name
            index += is_image
            if raw.topic in self._kept and raw.channel is not None:
                kept.append((index, raw))
            if raw.topic not in types:
                continue
            try:
                message = self._types.read(raw.data, types[raw.topic])
                header_ns = stamp_ns_of(message)
            except InputError as error:
                if is_image:
                    self._leave_out(index, error)
                elif self._says(f"{raw.topic} {kind_of_reason(error)}"):
                    logger.warning("%s: a message of %s is left out: %s", self.name, raw.topic, error)
                continue
            if raw.topic in clocks:
                time_ns = self._time_ns(clocks[raw.topic], raw, header_ns)
                mask_ns = header_ns if self._are_masks_stamped and header_ns is not None else time_ns
                yield raw.topic, raw.stamp_ns, _Item(index, message, time_ns, mask_ns)
            else:
                maker.take_info(message)

    @property
    def _are_masks_stamped(self) -> bool:
        """Whether masks have the stamps of their images in their headers: these need no clock of their own."""
        return self._offset_ns is not None and self._mask_offset_ns is not None

    def _has_two_clocks(self) -> bool:
        """Return whether headers of images and of depth have times of two clocks, and say so."""
        apart_ns = abs((self._offset_ns or 0) - (self._depth_offset_ns or 0))
        if apart_ns > _SAME_CLOCK_NS:
            what = f"their headers are {apart_ns / NS_PER_S:.1f} s apart"
            logger.warning(
                "%s: images and depth have two clocks, %s; they are paired by the recording's", self.name, what
            )
        return apart_ns > _SAME_CLOCK_NS

    def _time_ns(self, clock: TopicClock, raw: RawMessage, header_ns: int | None) -> int:
        """Return the time of a message, and say the first time that its header has none that can be used."""
        time_ns = clock.time_ns(header_ns, raw.stamp_ns)
        if clock.deviates and self._says(f"{raw.topic} clock"):
            why = (
                "a header has no time" if header_ns is None else "the time of a header does not follow the previous one"
            )
            logger.warning("%s: %s: %s; it is replaced by the time of the recording", self.name, raw.topic, why)
        return time_ns

    def _say_pairs(self, what: str, topic: Topic, pairing: StampPairing[Any, Any]) -> None:
        """Say it where no image found its depth, or its mask, and where it came too late or too early for some."""
        gap_ns, most_ns = pairing.least_gap_ns, pairing.tolerance_ns
        if pairing.missed:
            missed = "1 image goes" if pairing.missed == 1 else f"{pairing.missed} images go"
            logger.warning(
                "%s: %s %s that %s has: it was recorded too long before or after, where about a second is waited for; "
                "write the recording again in the order of its stamps",
                self.name,
                missed,
                what,
                topic.name,
            )
        elif gap_ns is None:
            logger.warning("%s: frames go %s: no message of %s came that can be read", self.name, what, topic.name)
        elif gap_ns > most_ns:
            apart = f"{gap_ns / NS_PER_S:g} s away from every image, {most_ns / NS_PER_S:g} s at most"
            logger.warning("%s: frames go %s: %s is at least %s", self.name, what, topic.name, apart)


def _with_mask(pairs: Iterable[Pair], masking: StampPairing[Pair, _Item] | None) -> Iterator[_Moment]:
    """Yield what is known now of images and their depth, once they have their masks if there are any."""
    for image, depth in pairs:
        if masking is None:
            yield _Moment(image, depth)
        else:
            yield from _masked(masking.add_image(image.mask_ns, (image, depth)))


def _masked(found: Iterable[tuple[Pair, _Item | None]]) -> Iterator[_Moment]:
    for pair, mask in found:
        yield _Moment(*pair, mask)


def _with_recorded(found: Iterable[_Readable], kept: _Kept) -> Iterator[tuple[_Readable, tuple[RawMessage, ...]]]:
    """Yield what was found, each with its messages, which end before the next image however late it was found.

    Each comes after the next one was found, so that the last one takes what came after it.
    """
    waiting: _Readable | None = None
    recorded: list[RawMessage] = []
    for one in found:
        if waiting is not None:
            yield waiting, tuple(recorded)
        waiting, recorded = one, []
        while kept and kept[0][0] <= one[0].image.index:
            recorded.append(kept.popleft()[1])
    if waiting is not None:
        yield waiting, (*recorded, *(raw for _, raw in kept))
