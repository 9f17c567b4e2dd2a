"""Choice of the topics that frames are made of: named, or matched to each other."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from dloftbs.camera import DepthRegistration
from dloftbs.errors import SourceError
from dloftbs.ros.bag_file import Topic
from dloftbs.ros.camera_match import TRANSPORTS, CameraMatch, base_name, beside, is_depth, is_infrared, nearness
from dloftbs.ros.first_messages import FirstMessage

IMAGE_TYPE = "sensor_msgs/msg/Image"
COMPRESSED_TYPE = "sensor_msgs/msg/CompressedImage"
INFO_TYPE = "sensor_msgs/msg/CameraInfo"
IMAGE_TYPES = (IMAGE_TYPE, COMPRESSED_TYPE)

OWN_TOPICS = "/dloftbs/"
"""Begin of the topics of our results, which are no input even where they lie beside it."""
_RECTIFIED = re.compile(r"(^|_)rect(ified)?(_|$)")
_FOREIGN = re.compile(r"image_transport/|(?<!Disparity)(Image|Video|FFMPEGPacket)$")
"""Names of image types that are not supported."""
_REMEDY = (
    "convert them to sensor_msgs/Image or CompressedImage, as image_transport's republish does with ffmpeg and theora, "
    "or to a video or image files"
)
_MAX_LISTED = 30


@dataclass(frozen=True)
class Topics:
    """Topics that frames are made of.

    Parameters
    ----------
    image : Topic
    depth : Topic, optional
    info : Topic, optional
        Of the camera of the image.
    mask : Topic, optional
        Of the masks of the images.
    depth_is_meant, info_is_meant : bool
        Whether somebody named them, or they were guessed: these are left out where they turn out not to go with the
        image.
    depth_is_registered : bool
        Whether depth is in the pixels of the images, as its coordinate frame or its name says.
    remarks : tuple of str
        What is there and not used, with the options that take it.
    """

    image: Topic
    depth: Topic | None = None
    info: Topic | None = None
    mask: Topic | None = None
    depth_is_meant: bool = False
    info_is_meant: bool = False
    depth_is_registered: bool = False
    remarks: tuple[str, ...] = ()

    @property
    def used(self) -> list[Topic]:
        """All of them."""
        return [topic for topic in (self.image, self.depth, self.info, self.mask) if topic is not None]

    @property
    def is_rectified(self) -> bool:
        """True if the image's name says that it is rectified, as image_proc names its outputs."""
        return _is_rectified(self.image)


def choose_topics(
    where: str,
    topics: Sequence[Topic],
    topic: str | None = None,
    depth_topic: str | None = None,
    info_topic: str | None = None,
    *,
    mask_topic: str | None = None,
    guess_depth: bool = True,
    guess_info: bool = True,
    registration: DepthRegistration | None = None,
    first: Mapping[str, FirstMessage] | None = None,
) -> Topics:
    """Return the topics of the frames.

    Parameters
    ----------
    where : str
        The recording, for messages.
    topics : sequence of Topic
        All that it has.
    topic, depth_topic, info_topic, mask_topic : str, optional
        Names of those that are meant; the transport may be left out, and the first slash. Masks are not looked for.
    guess_depth, guess_info : bool
        Whether depth and the camera are looked for where none is named.
    registration : DepthRegistration, optional
        Brings the depth of another sensor into the images: that one is then looked for.
    first : mapping of str to FirstMessage, optional
        First messages by the names of their topics. Their coordinate frames decide, and names where they are unknown.

    Raises
    ------
    SourceError
        If a topic is not there or has no such type, or there are several images and none is named; they are listed. If
        images and masks are to come by one topic.
    """
    choice = _Choice(where, topics, first or {})
    mask = None
    if mask_topic is not None:
        mask = choice.named(mask_topic, IMAGE_TYPES, "--mask-topic")
        choice.leave_out(mask)
    image = choice.only_image() if topic is None else choice.named(topic, IMAGE_TYPES, "--topic")
    if mask is not None and base_name(mask.name) == base_name(image.name):
        raise SourceError(f"{where}: --mask-topic {mask_topic} is the topic of the images; --kind mask reads it alone")
    depth = info = None
    if depth_topic is not None:
        depth = choice.named(depth_topic, IMAGE_TYPES, "--depth-topic")
        if registration is None:
            choice.check_depth(depth, image)
    elif guess_depth and base_name(image.name) not in {base_name(depth.name) for depth in choice.depths}:
        depth = choice.depth_of(image, registration)
    if info_topic is not None:
        info = choice.named(info_topic, (INFO_TYPE,), "--info-topic")
    elif guess_info:
        info = choice.info_of(image)
    return Topics(
        image,
        depth,
        info,
        mask,
        depth_is_meant=depth_topic is not None,
        info_is_meant=info_topic is not None,
        depth_is_registered=depth is not None and choice.match.is_registered(depth, image),
        remarks=tuple(choice.remarks),
    )


class _Choice:
    """Chooses topics, and collects remarks about those that are not used."""

    def __init__(self, where: str, topics: Sequence[Topic], first: Mapping[str, FirstMessage]) -> None:
        self._where = where
        self._topics = topics
        self._foreign = [topic for topic in topics if _is_foreign(topic)]
        self._infos = self._readable((INFO_TYPE,))
        images = [topic for topic in self._readable(IMAGE_TYPES) if not topic.name.startswith(OWN_TOPICS)]
        present = [topic for topic in images if topic.count != 0]
        self._images = _one_each([topic for topic in present if not is_depth(topic)], first)
        self.depths = _one_each([topic for topic in present if is_depth(topic)], first)
        known = {base_name(topic.name) for topic in self.depths}
        empty = [topic for topic in images if is_depth(topic) and base_name(topic.name) not in known]
        self._empty_depths = _one_each(empty, first)
        self.match = CameraMatch(self._images, self._infos, first)
        if not self._images:  # a camera may be called depth as a whole
            self._images = [topic for topic in self.depths if self.match.is_colour(topic)]
            self.depths = [topic for topic in self.depths if topic not in self._images]
        self.remarks: list[str] = []

    def _readable(self, types: Sequence[str]) -> list[Topic]:
        return [topic for topic in self._topics if topic.type_name in types and not topic.encoding]

    def named(self, name: str, types: Sequence[str], option: str) -> Topic:
        """Return the topic of a name.

        Raises
        ------
        SourceError
            If it is not there, or has another type.
        """
        wanted = name if name.startswith("/") else f"/{name}"
        fitting = self._readable(types)
        for candidate in (*(f"{wanted}{transport}" for transport in ("", *TRANSPORTS)), name):
            for topic in fitting:
                if topic.name == candidate:
                    return topic
        foreign = [topic for topic in self._foreign if base_name(topic.name) in (base_name(wanted), base_name(name))]
        if foreign:
            raise SourceError(f"{self._where}: {option} {name} cannot be read: it is {_names(foreign)}; {_REMEDY}")
        kinds = " or ".join(kind.rpartition("/")[2] for kind in types)
        there = _listed(fitting if fitting else self._topics)
        raise SourceError(f"{self._where}: {option} {name} is no topic of {kinds}; there {there}")

    def leave_out(self, mask: Topic) -> None:
        """Take the topic of the masks, in each of its transports, for none of images and none of depth."""
        self._images = [topic for topic in self._images if base_name(topic.name) != base_name(mask.name)]
        self.depths = [topic for topic in self.depths if base_name(topic.name) != base_name(mask.name)]

    def only_image(self) -> Topic:
        """Return the only colour image, or else the only image, in the least compressed of its transports.

        Raises
        ------
        SourceError
            If there is none, or several.
        """
        if not self._images and self._foreign:
            raise SourceError(
                f"{self._where}: holds only images that cannot be read: {_names(self._foreign)}; {_REMEDY}"
            )
        if not self._images:
            there = _listed(self._readable(IMAGE_TYPES))
            raise SourceError(f"{self._where}: holds no topic of colour images or masks; there {there}")
        left = self._without_other_sensors()
        if len(left) > 1:
            raise SourceError(
                f"{self._where}: holds {len(left)} topics of images; name one with --topic (topic=): {_names(left)}"
            )
        image = left[0]
        others = [topic for topic in self._images if len(self._images) == 1 or not self.match.is_wide(topic)]
        others += [topic for topic in self._foreign if not is_depth(topic)]
        self._remark_unused("images are taken", image, others, "--topic (topic=)")
        return image

    def _without_other_sensors(self) -> list[Topic]:
        """Return the images except infrared ones, labels and those of grey cameras, unless there are no others."""
        left = [topic for topic in self._images if not is_infrared(topic)] or self._images
        if len(left) > 1:
            left = [topic for topic in left if not self.match.is_wide(topic)] or left
        colour = [topic for topic in left if self.match.is_colour(topic)] if len(left) > 1 else []
        if len(colour) != 1:
            return left
        # Grey in the frame of the colour image may be its mask.
        other = [topic for topic in left if self.match.is_grey(topic) and self.match.same(topic, colour[0]) is False]
        return [topic for topic in left if topic not in other]

    def check_depth(self, depth: Topic, image: Topic) -> None:
        """Add a remark if named depth does not belong to the image."""
        why = self.match.why_not_depth_in_frame(depth, image)
        if why is not None:
            self.remarks.append(f"depth is taken for registered to the images, as its topic was named, but {why}")

    def depth_of(self, image: Topic, registration: DepthRegistration | None) -> Topic | None:
        """Return the depth that is registered to an image, or that of the sensor that a registration is for."""
        why = {topic: self.match.why_not_depth(topic, image) for topic in self.depths}
        if registration is None:
            fitting = [topic for topic in self.depths if why[topic] is None]
            sure = [topic for topic in fitting if self.match.is_registered(topic, image)]
            fitting = sorted(sure, key=lambda topic: self._depth_rank(topic, image))[:1] or fitting
        else:
            fitting = [topic for topic in self.depths if why[topic] is not None] or self.depths
        foreign = [topic for topic in self._foreign if is_depth(topic)]
        raw = [topic for topic in self._images if topic.type_name == IMAGE_TYPE and topic != image]
        unnamed = [topic for topic in raw if self.match.is_wide(topic)]
        option = "--depth-topic (depth_topic=)"
        if len(fitting) == 1:
            self._remark_unused("depth is taken", fitting[0], [*self.depths, *unnamed, *foreign], option)
            return fitting[0]
        if fitting:
            self.remarks.append(
                f"frames go without depth: several topics fit; name one with {option}: {_names(fitting)}"
            )
        elif self.depths:
            reasons = "; ".join(f"{why[topic]} ({topic.name})" for topic in self.depths)
            reasons += "".join(f"; it has no messages ({topic.name})" for topic in self._empty_depths)
            self.remarks.append(
                f"frames go without depth, which is not registered to the images: {reasons}; {option} takes it all the "
                "same, --registration brings it into the images"
            )
        elif foreign:
            self.remarks.append(f"frames go without depth, which cannot be read: {_names(foreign)}; {_REMEDY}")
        elif self._empty_depths:
            self.remarks.append(f"frames go without depth, which has no messages: {_names(self._empty_depths)}")
        elif unnamed:
            described = ", ".join(f"{topic.name} ({self._described(topic)})" for topic in unnamed)
            self.remarks.append(f"frames go without depth: no topic is called so; {option} takes one of {described}")
        return None

    def _depth_rank(self, depth: Topic, image: Topic) -> tuple[bool, bool, bool, int]:
        """Return the sort key of an image's depths: no picture of depth, the same size and lens, the nearest name."""
        is_odd = not self.match.is_wide(depth), not self.match.has_size_of(depth, image)
        return *is_odd, _is_rectified(depth) != _is_rectified(image), -nearness(depth, image)

    def info_of(self, image: Topic) -> Topic | None:
        """Return the camera of an image."""
        why = {
            info: "it has no messages" if info.count == 0 else self.match.why_not_info(info, image)
            for info in self._infos
        }
        fitting = [info for info in self._infos if why[info] is None]
        fitting = [info for info in fitting if self.match.same(info, image)] or fitting
        fitting = [info for info in fitting if self.match.has_size_of(info, image)] or fitting
        own = beside(fitting, image)
        if own is not None or len(fitting) == 1:
            return own or fitting[0]
        option = "--info-topic (info_topic=)"
        if fitting:
            self.remarks.append(
                f"frames go without a camera: several topics fit; name one with {option}: {_names(fitting)}"
            )
        elif self._infos:
            reasons = "; ".join(f"{why[info]} ({info.name})" for info in self._infos)
            self.remarks.append(
                f"frames go without a camera: {reasons}; {option} takes it all the same, --camera (camera=) gives one"
            )
        return None

    def _remark_unused(self, what: str, used: Topic, others: Sequence[Topic], option: str) -> None:
        unused = [topic for topic in others if base_name(topic.name) != base_name(used.name)]
        if not unused:
            return
        described = ", ".join(f"{topic.name} ({self._described(topic)})" for topic in unused[:_MAX_LISTED])
        more = f" and {len(unused) - _MAX_LISTED} more" if len(unused) > _MAX_LISTED else ""
        remedy = _REMEDY if all(topic in self._foreign for topic in unused) else f"{option} takes another"
        self.remarks.append(f"{what} from {used.name}; not used: {described}{more}; {remedy}")

    def _described(self, topic: Topic) -> str:
        if topic in self._foreign:
            return f"{_kind_of(topic)}, which cannot be read"
        frame_id = self.match.frame_id(topic)
        return f"in the frame {frame_id!r}" if frame_id else _kind_of(topic)


def _one_each(topics: Sequence[Topic], first: Mapping[str, FirstMessage]) -> list[Topic]:
    """Return one topic of each image: that without a transport, unless it may have no messages."""
    chosen: dict[str, Topic] = {}

    def rank(topic: Topic) -> tuple[bool, bool, str]:
        return topic.count is None and topic.name not in first, topic.type_name != IMAGE_TYPE, topic.name

    for topic in sorted(topics, key=rank):
        chosen.setdefault(base_name(topic.name), topic)
    return list(chosen.values())


def _is_foreign(topic: Topic) -> bool:
    """Return True for images of a type, or serialized in a way, that is not read."""
    is_read = topic.type_name in IMAGE_TYPES and not topic.encoding
    return not is_read and topic.count != 0 and _FOREIGN.search(topic.type_name) is not None


def _is_rectified(image: Topic) -> bool:
    return _RECTIFIED.search(os.path.basename(base_name(image.name))) is not None


def _listed(topics: Sequence[Topic]) -> str:
    if not topics:
        return "is none"
    return f"{'is' if len(topics) == 1 else 'are'} {_names(topics)}"


def _names(topics: Sequence[Topic]) -> str:
    names = [
        f"{topic.name} ({_kind_of(topic)}{'' if topic.count is None else f', {topic.count} messages'})"
        for topic in topics
    ]
    more = f" and {len(names) - _MAX_LISTED} more" if len(names) > _MAX_LISTED else ""
    return ", ".join(names[:_MAX_LISTED]) + more


def _kind_of(topic: Topic) -> str:
    """Return a topic's type, and how it is serialized where that is not read."""
    return f"{topic.type_name} in {topic.encoding}" if topic.encoding else topic.type_name
