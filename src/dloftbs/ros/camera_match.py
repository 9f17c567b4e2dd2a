"""Rules that assign depth and cameras to images: by coordinate frame, then by intrinsics and name."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from itertools import takewhile

import numpy as np

from dloftbs.ros.bag_file import Topic
from dloftbs.ros.first_messages import FirstMessage
from dloftbs.ros.message_fields import is_same_sensor

TRANSPORTS = ("/compressed", "/compressedDepth")
"""Ends of the names of an image's transports that are read."""
_OTHER_TRANSPORTS = ("/ffmpeg", "/theora", "/foxglove", "/zstd")
_INFRARED = re.compile(r"(^|[/_])(ir|infra(red)?)(?![a-z])", re.IGNORECASE)
_ALIGNED_TO = re.compile(r"depth_to_([a-z0-9]+)")
_COLOUR = ("color", "colour", "rgb")
_REGISTERED = ("aligned", "registered")
"""Parts of the names by which drivers show depth in the pixels of the colour image."""
_SAME_INTRINSICS = 0.01
"""Largest difference between intrinsics of one camera, as a share of the focal length; two sensors differ by more."""


def base_name(topic: str) -> str:
    """Return the name of an image's topic without that of its transport."""
    for transport in (*TRANSPORTS, *_OTHER_TRANSPORTS):
        if topic.endswith(transport):
            return topic.removesuffix(transport)
    return topic


def is_depth(topic: Topic) -> bool:
    """Return True for a topic that its name calls depth."""
    return "depth" in topic.name.lower()


def is_infrared(topic: Topic) -> bool:
    """Return True for a topic that its name calls infrared."""
    return _INFRARED.search(topic.name) is not None


def is_registered(depth: Topic, image: Topic) -> bool:
    """Return True for depth that its name calls registered, and not to another image."""
    target = _target_of(depth)
    if target is not None:
        return target in image.name.lower() or (target in _COLOUR and not is_infrared(image))
    return any(word in depth.name.lower() for word in _REGISTERED)


def nearness(a: Topic, b: Topic) -> int:
    """Return how many parts of their names two topics share, from the first on."""
    return sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], zip(_parts(a), _parts(b), strict=False)))


def beside(infos: Sequence[Topic], image: Topic) -> Topic | None:
    """Return the camera that its name puts beside an image."""
    folder = os.path.dirname(base_name(image.name))
    # RealSense's recorder of ROS 1: .../Color_0/image/data and .../Color_0/info/camera_info.
    for name in (f"{folder}/camera_info", f"{os.path.dirname(folder)}/info/camera_info"):
        for info in infos:
            if info.name == name:
                return info
    return None


class CameraMatch:
    """Decides whether depth and cameras belong to an image: first by coordinate frames, then by intrinsics and names.

    Parameters
    ----------
    images, infos : sequence of Topic
        Images other than depth, and cameras.
    first : mapping of str to FirstMessage
        First messages by the names of their topics, as far as they are known.
    """

    def __init__(self, images: Sequence[Topic], infos: Sequence[Topic], first: Mapping[str, FirstMessage]) -> None:
        self._images = images
        self._infos = infos
        self._first = first

    def frame_id(self, topic: Topic) -> str:
        """Return the name of a topic's coordinate frame; empty where it is not known."""
        return self._first[topic.name].frame_id if topic.name in self._first else ""

    def same(self, a: Topic, b: Topic) -> bool | None:
        """Return whether two topics are in the frame of the same sensor; None where it is not known."""
        return is_same_sensor(self.frame_id(a), self.frame_id(b))

    def is_registered(self, depth: Topic, image: Topic) -> bool:
        """Return True for depth that its coordinate frame, or else its name, calls registered to an image."""
        same = self.same(depth, image)
        return is_registered(depth, image) if same is None else same

    def has_size_of(self, topic: Topic, image: Topic) -> bool:
        """Return True where two topics are known to have the same size in pixels."""
        size = self._size(topic)
        return size is not None and size == self._size(image)

    def is_grey(self, image: Topic) -> bool:
        """Return True for an image that is known to have one channel."""
        return self._channels(image) == (2, True)

    def is_colour(self, image: Topic) -> bool:
        """Return True for an image that is known to have three channels."""
        return self._channels(image) == (3, True)

    def is_wide(self, image: Topic) -> bool:
        """Return True for an image that is known to have one channel of more than 8 bits: heat, labels, confidence."""
        return self._channels(image) == (2, False)

    def why_not_depth(self, depth: Topic, image: Topic) -> str | None:
        """Return why depth is not registered to an image; None where nothing speaks against it."""
        by_target = _why_not_by_target(depth, image)
        if self.same(depth, image) is None and by_target is not None:
            return by_target
        frames = self.frame_id(depth), self.frame_id(image)
        if depth.name in self._first and any(frames) and not self.is_registered(depth, image):
            return _in_frames(*frames)
        return self.why_not_depth_in_frame(depth, image)

    def why_not_depth_in_frame(self, depth: Topic, image: Topic) -> str | None:
        """Return what speaks against depth even where it is in the coordinate frame of the images."""
        by_target = _why_not_by_target(depth, image)
        if self.same(depth, image) and by_target is not None:
            return by_target
        own, theirs = (beside(self._infos, topic) for topic in (depth, image))
        if own is not None and theirs is not None and self.same(own, depth) is not False and self._differ(own, theirs):
            return f"its camera ({own.name}) has other intrinsics than that of the images ({theirs.name})"
        return self._why_not_by_name(depth, image)

    def why_not_info(self, info: Topic, image: Topic) -> str | None:
        """Return why a camera is not that of an image; None where nothing speaks against it."""
        same = self.same(info, image)
        if same is False:
            return _in_frames(self.frame_id(info), self.frame_id(image))
        if same is None and _sensors(info, image) != _sensors(image, info) and not is_registered(info, image):
            return "by its name it is that of another sensor"
        return self._why_not_by_name(info, image)

    def _why_not_by_name(self, topic: Topic, image: Topic) -> str | None:
        """Return why a topic in the images' coordinate frame is another camera's: of a pair, or of another robot."""
        if {*_sides(topic, image), *_sides(image, topic)} == {"left", "right"}:
            return "by its name it is that of the other side"
        others = [other for other in self._images if self.same(topic, other) is not False]
        nearest = max(others, key=lambda other: nearness(topic, other), default=image)
        if nearness(topic, nearest) > nearness(topic, image):
            return f"by its name it is that of {nearest.name}"
        return None

    def _differ(self, a: Topic, b: Topic) -> bool:
        """Return True where two cameras of the same size are known to have other intrinsics."""
        known = [self._first[info.name].intrinsics for info in (a, b) if info.name in self._first]
        if len(known) < 2 or known[0] is None or known[1] is None or not self.has_size_of(a, b):
            return False
        return max(abs(x - y) for x, y in zip(*known, strict=True)) > _SAME_INTRINSICS * max(known[1][:2])

    def _size(self, topic: Topic) -> tuple[int, int] | None:
        return self._first[topic.name].size if topic.name in self._first else None

    def _channels(self, image: Topic) -> tuple[int, bool] | None:
        """Return the number of dimensions of an image, and whether it has 8 bits a channel."""
        pixels = self._first[image.name].pixels if image.name in self._first else None
        return None if pixels is None else (pixels.ndim, pixels.dtype == np.uint8)


def _why_not_by_target(depth: Topic, image: Topic) -> str | None:
    target = _target_of(depth)
    if target is None or is_registered(depth, image):
        return None
    return f"its name says that it is aligned to {target}"


def _target_of(depth: Topic) -> str | None:
    """Return the sensor to which depth is aligned by its name."""
    found = _ALIGNED_TO.search(depth.name.lower())
    return None if found is None else found[1]


def _in_frames(own: str, images: str) -> str:
    return f"it is in the frame {own!r}, the images are in {images!r}"


def _parts(topic: Topic) -> list[str]:
    return base_name(topic.name).strip("/").split("/")


def _words(topic: Topic, other: Topic) -> set[str]:
    """Return the words of the part of a topic's name in which another topic's differs."""
    return set(re.split(r"[/_0-9]+", "/".join(_parts(topic)[nearness(topic, other) :]).lower()))


def _sides(topic: Topic, other: Topic) -> set[str]:
    return _words(topic, other) & {"left", "right"}


def _sensors(topic: Topic, other: Topic) -> set[str]:
    """Return the sensors of depth cameras, other than colour, that a name says."""
    words = _words(topic, other)
    return (words & {"depth"}) | ({"ir"} if words & {"ir", "infra", "infrared"} else set())
