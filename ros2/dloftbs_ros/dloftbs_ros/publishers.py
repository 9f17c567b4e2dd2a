"""What is known of those who publish: to subscribe as they offer, and to say what there is when nothing comes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from dloftbs.ros.topic_choice import IMAGE_TYPES

RELIABILITIES = ("auto", "reliable", "best_effort")


@dataclass(frozen=True)
class Publisher:
    """A publisher of a topic: the type of its messages, and whether they are reliable."""

    topic: str
    type_name: str
    reliable: bool

    def __str__(self) -> str:
        return f"{self.topic} ({self.type_name}, {_word(self.reliable)})"


def choose(
    publishers: Sequence[Publisher], types: Iterable[str], reliability: str
) -> tuple[tuple[str, bool] | None, str | None]:
    """Return the type to subscribe with and whether reliably, or None and what is wrong, if anything.

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
    return (known[0].type_name, reliable), problem


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
    images = sorted({str(publisher) for publisher in present if publisher.type_name in IMAGE_TYPES})
    if not images:
        return f"{said}: nobody publishes images; do ROS_DOMAIN_ID and the network agree?"
    return f"{said}, nobody publishes there; remap with -r image:=TOPIC to one of: {', '.join(images)}"


def _word(reliable: bool) -> str:
    return "reliable" if reliable else "best effort"
