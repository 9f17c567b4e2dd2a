"""What is known of those who publish: to subscribe as they offer, and to say what there is when nothing comes."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

from dloftbs.ros.topic_choice import IMAGE_TYPES, INFO_TYPE, base_name

_ALIGNED = "aligned_depth_to_"
"""Begin of the topic of a RealSense's depth in the pixels of another of its cameras."""
_ALIGN = "a RealSense's driver publishes it once started with align_depth.enable:=true"


@dataclass(frozen=True)
class Publisher:
    """A publisher of a topic, or who subscribes to it: the type of its messages, and whether they are reliable.

    With `latched`, messages of before the subscription come, too: durability TRANSIENT_LOCAL.
    """

    topic: str
    type_name: str
    reliable: bool
    latched: bool = False

    def __str__(self) -> str:
        return f"{self.topic} ({self.type_name}, {_word(self.reliable)})"


def choose(
    publishers: Sequence[Publisher], types: Iterable[str], reliability: str
) -> tuple[Publisher | None, str | None]:
    """Return what to subscribe as, or None and what is wrong, if anything.

    It is latched if all publishers are: such a reader gets nothing of another writer.

    Parameters
    ----------
    publishers : sequence of Publisher
        Of one topic.
    types : iterable of str
        Those that can be read.
    reliability : {"auto", "reliable", "best_effort"}
        "auto" takes the publisher's: a reliable reader gets nothing of a best-effort writer, and large images that are
        sent with best effort are mostly lost.
    """
    known = [publisher for publisher in publishers if publisher.type_name in types]
    if not known:
        if not publishers:
            return None, None
        return None, f"{publishers[0]} must be of type {' or '.join(types)}"
    reliable = all(publisher.reliable for publisher in known) if reliability == "auto" else reliability == "reliable"
    problem = None
    if reliable and not all(publisher.reliable for publisher in known):
        problem = f"{known[0].topic} is published with best effort: a reliable subscription gets nothing of it"
    latched = all(publisher.latched for publisher in known)
    return replace(known[0], reliable=reliable, latched=latched), problem


def silence_text(topic: str, seconds: float, present: Sequence[Publisher], problem: str | None = None) -> str:
    """Return what to say when no image has come.

    Parameters
    ----------
    topic : str
        Where images were awaited, after remaps.
    seconds : float
        How long.
    present : sequence of Publisher
        Of all topics.
    problem : str, optional
        What is known to be wrong.
    """
    said = f"no image on {topic} for {seconds:.0f} s"
    if problem is not None:
        return f"{said}: {problem}"
    if any(publisher.topic == topic and publisher.type_name in IMAGE_TYPES for publisher in present):
        return f"{said}, though it is published; is the camera running, and do large messages get through?"
    images = _of(present, lambda publisher: publisher.type_name in IMAGE_TYPES)
    if not images:
        return f"{said}: nobody publishes images; do ROS_DOMAIN_ID and the network agree?"
    colour = [publisher for publisher in images if not _is_depth(publisher)]
    return f"{said}, nobody publishes there; {_remap('image', topic, colour or images)}"


def missing_depth_text(topic: str, present: Sequence[Publisher], arrives: bool) -> str:
    """Return what to say when images come without depth.

    Parameters
    ----------
    topic : str
        Where depth was awaited, after remaps.
    present : sequence of Publisher
        Of all topics.
    arrives : bool
        Whether its messages arrive: then their times are not those of the images.
    """
    said = f"no depth on {topic}: curves are in pixels alone"
    if arrives:
        return f"images have no depth of their time, though {topic} arrives; do both drivers use one clock?"
    if any(publisher.topic == topic for publisher in present):
        return f"{said}; it is published, but no message comes"
    others = _of(present, lambda publisher: publisher.type_name in IMAGE_TYPES and _is_depth(publisher))
    aligned = f"; {_ALIGN}" if _ALIGNED in topic else ""
    return f"{said}, nobody publishes there{aligned}; {_remap('depth', topic, others)}"


def missing_mask_text(topic: str, present: Sequence[Publisher], arrives: bool) -> str:
    """Return what to say when images come without masks, as `missing_depth_text` does."""
    if arrives:
        return f"images have no mask of their time, though {topic} arrives; does the segmenter keep the images' stamps?"
    said = f"no mask on {topic}: images are left out"
    if any(publisher.topic == topic for publisher in present):
        return f"{said}; it is published, but no message comes"
    return f"{said}, nobody publishes there; is the segmenter running, and is mask_topic its topic?"


def missing_info_text(topic: str, present: Sequence[Publisher]) -> str:
    """Return what to say when no camera has come with images and depth."""
    said = f"no camera on {topic}: curves are in pixels alone"
    if any(publisher.topic == topic for publisher in present):
        return f"{said}; it is published, but no message comes"
    others = _of(present, lambda publisher: publisher.type_name == INFO_TYPE)
    return f"{said}, nobody publishes there; {_remap('camera_info', topic, others)}"


def _remap(name: str, topic: str, candidates: Sequence[Publisher]) -> str:
    """Return how to take one of some topics, or the same image in the transport in which it is published."""
    if not candidates:
        return "no other topic of the kind is published"
    same = [publisher for publisher in candidates if base_name(publisher.topic) == base_name(topic)]
    if same:
        return f"set {name}_transport to that of: {', '.join(map(str, same))}"
    listed = ", ".join(map(str, candidates))
    return f"set {name}:=TOPIC (ros2 launch) or -r {name}:=TOPIC (ros2 run) to one of: {listed}"


def _of(present: Iterable[Publisher], is_meant: Callable[[Publisher], bool]) -> list[Publisher]:
    """Return the publishers that are meant, one of each kind, in the order of their names."""
    kinds = {str(publisher): publisher for publisher in present if is_meant(publisher)}
    return [kinds[text] for text in sorted(kinds)]


def _is_depth(publisher: Publisher) -> bool:
    return "depth" in publisher.topic.lower()


def _word(reliable: bool) -> str:
    return "reliable" if reliable else "best effort"
