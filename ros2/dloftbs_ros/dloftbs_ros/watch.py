"""When each input last came, and what to say about those that do not come."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from dloftbs_ros.publishers import Publisher, missing_depth_text, missing_info_text, missing_mask_text, silence_text

SILENT_S = 5.0
"""Time without an input after which that is said: longer than drivers take between their first topic and their last."""


class Watch:
    """Notices what is silent: images again and again; masks, depth and the camera once in each silence.

    Parameters
    ----------
    topics : mapping of str to str
        Topic of each input, "image", "depth", "camera_info" and, where there is one, "mask", after remaps.
    now : float
        Time in seconds, as everywhere in this class.
    """

    def __init__(self, topics: Mapping[str, str], now: float) -> None:
        self._topics = topics
        self._heard = {**dict.fromkeys(topics, now), "pair": now, "masked": now}
        self._since = self._said = now
        self._has_camera = False
        self._known: set[str] = set()

    def hear(self, name: str, now: float) -> None:
        """Take note that a message of an input has come, a "pair" of image and depth, or one "masked"."""
        if name == "image" and now - self._heard[name] >= SILENT_S:
            self._since = now  # what goes with it may come as late as it does
        self._heard[name] = now
        self._has_camera |= name == "camera_info"
        if name == "pair":
            self._known.discard("depth")
        if name == "masked":
            self._known.discard("mask")

    def words(
        self, now: float, present: Callable[[], Sequence[Publisher]], problems: Mapping[str, str], wants_metres: bool
    ) -> list[str]:
        """Return what is to be said now.

        Parameters
        ----------
        now : float
        present : callable
            Returns the publishers of all topics.
        problems : mapping of str to str
            What is known to be wrong with an input; empty where nothing is.
        wants_metres : bool
            Whether depth and a camera are expected.
        """
        silent_s = now - self._heard["image"]
        if silent_s >= SILENT_S:
            if now - self._said < SILENT_S:
                return []
            self._said = now
            return [silence_text(self._topics["image"], silent_s, present(), problems.get("image") or None)]
        words = []
        if "mask" in self._topics and self._is_news("mask", now - max(self._heard["masked"], self._since)):
            arrives = now - self._heard["mask"] < SILENT_S
            words.append(problems.get("mask") or missing_mask_text(self._topics["mask"], present(), arrives))
        if wants_metres and self._is_news("depth", now - max(self._heard["pair"], self._since)):
            arrives = now - self._heard["depth"] < SILENT_S
            text = missing_depth_text(self._topics["depth"], present(), arrives)
            words.append(problems.get("depth") or text)
        if wants_metres and not self._has_camera and self._is_news("camera_info", now - self._since):
            words.append(problems.get("camera_info") or missing_info_text(self._topics["camera_info"], present()))
        return words

    def _is_news(self, name: str, silent_s: float) -> bool:
        """Return whether a silence is long enough to be said, and is said for the first time."""
        if silent_s < SILENT_S or name in self._known:
            return False
        self._known.add(name)
        return True
