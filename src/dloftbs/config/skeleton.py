"""Section of the skeleton and its segments."""

from __future__ import annotations

from dloftbs.config.section import MAX, Section, keep_integer


class SegmentsConfig(Section, frozen=True, kw_only=True):
    """Skeleton to segments.

    Parameters
    ----------
    max_segments : int
        More than this many segments is no cable but noise: the frame is refused with a reason, which bounds its cost.
    """

    max_segments: int = 1000

    def __post_init__(self) -> None:
        keep_integer(self, "max_segments", 1, MAX)
