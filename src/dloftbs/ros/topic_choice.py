"""Topics of a recording that frames come from: those that are named, or guessed where there is one choice."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from dataclasses import dataclass

from dloftbs.errors import SourceError
from dloftbs.ros.bag_file import Topic

IMAGE_TYPE = "sensor_msgs/msg/Image"
COMPRESSED_TYPE = "sensor_msgs/msg/CompressedImage"
INFO_TYPE = "sensor_msgs/msg/CameraInfo"
IMAGE_TYPES = (IMAGE_TYPE, COMPRESSED_TYPE)

OWN_TOPICS = "/dloftbs/"
"""Begin of the topics of our results, which are no input even where they lie beside it."""
_TRANSPORTS = ("/compressed", "/compressedDepth")
_REGISTERED = ("aligned", "registered")
"""Parts of the names by which drivers tell depth in the pixels of the colour image."""
_RECTIFIED = re.compile(r"(^|_)rect(ified)?(_|$)")
_MOST_LISTED = 30


@dataclass(frozen=True)
class Topics:
    """Topics that frames are made of.

    Parameters
    ----------
    image : Topic
    depth : Topic, optional
    info : Topic, optional
        Of the camera of the image.
    depth_is_meant, info_is_meant : bool
        Whether somebody named them, or they were guessed: these are left out where they turn out not to go with the
        image.
    """

    image: Topic
    depth: Topic | None = None
    info: Topic | None = None
    depth_is_meant: bool = False
    info_is_meant: bool = False

    @property
    def names(self) -> list[str]:
        """Names of all of them."""
        return [topic.name for topic in (self.image, self.depth, self.info) if topic is not None]

    @property
    def is_rectified(self) -> bool:
        """True if the image's name says that it is rectified, as image_proc names its outputs."""
        return _RECTIFIED.search(os.path.basename(base_name(self.image.name))) is not None

    @property
    def depth_is_registered(self) -> bool:
        """True if the name of the depth says that it is in the pixels of the images."""
        return self.depth is not None and _is_registered(self.depth)


def base_name(topic: str) -> str:
    """Return the name of an image's topic without that of its transport."""
    for transport in _TRANSPORTS:
        if topic.endswith(transport):
            return topic.removesuffix(transport)
    return topic


def choose_topics(
    where: str,
    topics: Sequence[Topic],
    topic: str | None = None,
    depth_topic: str | None = None,
    info_topic: str | None = None,
    *,
    guess_depth: bool = True,
) -> Topics:
    """Return the topics of the frames.

    Parameters
    ----------
    where : str
        The recording, for messages.
    topics : sequence of Topic
        All that it has.
    topic, depth_topic, info_topic : str, optional
        Names of those that are meant; the transport may be left out, and the first slash.
    guess_depth : bool
        Whether depth is looked for where none is named.

    Raises
    ------
    SourceError
        If a topic is not there or has no such type, or there are several images and none is named; they are listed.
    """
    image = (
        _named(where, topics, topic, IMAGE_TYPES, "--topic")
        if topic is not None
        else _only_image(where, [found for found in topics if found.type_name in IMAGE_TYPES])
    )
    depth: Topic | None = None
    if depth_topic is not None:
        depth = _named(where, topics, depth_topic, IMAGE_TYPES, "--depth-topic")
    elif guess_depth and not _is_depth(image):
        depth = _guess_depth(topics, image)
    if info_topic is not None:
        info: Topic | None = _named(where, topics, info_topic, (INFO_TYPE,), "--info-topic")
    else:
        info = _guess_info(topics, image)
    return Topics(image, depth, info, depth_topic is not None, info_topic is not None)


def _named(where: str, topics: Sequence[Topic], name: str, types: Sequence[str], option: str) -> Topic:
    wanted = name if name.startswith("/") else f"/{name}"
    names = [wanted, *(f"{wanted}{transport}" for transport in _TRANSPORTS)]
    for candidate in (*names, name):
        for topic in topics:
            if topic.name == candidate and topic.type_name in types:
                return topic
    kinds = " or ".join(kind.rpartition("/")[2] for kind in types)
    fitting = [topic for topic in topics if topic.type_name in types]
    raise SourceError(
        f"{where}: {option} {name} is no topic of {kinds}; there {_listed(fitting) if fitting else _listed(topics)}"
    )


def _only_image(where: str, images: Sequence[Topic]) -> Topic:
    """Return the only colour image, in the least compressed of its transports."""
    colour = _one_each([topic for topic in images if not _is_depth(topic) and not topic.name.startswith(OWN_TOPICS)])
    if len(colour) == 1:
        return colour[0]
    if not colour:
        raise SourceError(f"{where}: holds no topic of colour images or masks; there {_listed(images)}")
    raise SourceError(
        f"{where}: holds {len(colour)} topics of images; name one with --topic (topic=): {_names(colour)}"
    )


def _one_each(topics: Sequence[Topic]) -> list[Topic]:
    """Return one topic of each image: that without a transport first."""
    chosen: dict[str, Topic] = {}
    for topic in sorted(topics, key=lambda topic: (topic.type_name != IMAGE_TYPE, topic.name)):
        if topic.count != 0:
            chosen.setdefault(base_name(topic.name), topic)
    return list(chosen.values())


def _is_depth(topic: Topic) -> bool:
    return "depth" in topic.name.lower()


def _is_registered(topic: Topic) -> bool:
    return any(word in topic.name.lower() for word in _REGISTERED)


def _guess_depth(topics: Sequence[Topic], image: Topic) -> Topic | None:
    """Return the only depth that its name calls registered to the image, or else the only one."""
    depth = _one_each([topic for topic in topics if topic.type_name in IMAGE_TYPES and _is_depth(topic)])
    depth = [topic for topic in depth if topic.name != image.name and not topic.name.startswith(OWN_TOPICS)]
    registered = [topic for topic in depth if _is_registered(topic)]
    for choice in (registered, depth):
        if len(choice) == 1:
            return choice[0]
    return None


def _guess_info(topics: Sequence[Topic], image: Topic) -> Topic | None:
    """Return the camera beside the image, by its name, or the only one there is."""
    infos = {topic.name: topic for topic in topics if topic.type_name == INFO_TYPE and topic.count != 0}
    folder = os.path.dirname(base_name(image.name))
    # RealSense's recorder: .../Color_0/image/data and .../Color_0/info/camera_info.
    for name in (f"{folder}/camera_info", f"{os.path.dirname(folder)}/info/camera_info"):
        if name in infos:
            return infos[name]
    return next(iter(infos.values())) if len(infos) == 1 else None


def _listed(topics: Sequence[Topic]) -> str:
    if not topics:
        return "is none"
    return f"{'is' if len(topics) == 1 else 'are'} {_names(topics)}"


def _names(topics: Sequence[Topic]) -> str:
    names = [
        f"{topic.name} ({topic.type_name}{'' if topic.count is None else f', {topic.count} messages'})"
        for topic in topics
    ]
    more = f" and {len(names) - _MOST_LISTED} more" if len(names) > _MOST_LISTED else ""
    return ", ".join(names[:_MOST_LISTED]) + more
