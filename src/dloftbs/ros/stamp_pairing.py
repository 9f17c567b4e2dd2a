"""Depth to the image of the same moment, while both stream by."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from typing import Generic, TypeVar

from dloftbs.ros.message_fields import NS_PER_S

TOLERANCE_S = 0.02
"""Largest difference between the stamps of an image and its depth: two thirds of a frame at 30 per second, where the
shutters of two sensors run freely, and too little for a depth of the frame before."""
WAITING = 8
"""Images that wait for their depth at most, and depths for their image: a quarter of a second at 30 per second, and
50 MB of HD."""

T = TypeVar("T")


class StampPairing(Generic[T]):
    """Gives each image the depth whose stamp is nearest, in bounded memory.

    An image waits until a depth of its time or later has come, or until too many wait. Stamps of a topic are assumed to
    ascend; where they do not, an image may go without. Images come out in the order in which they went in.

    Parameters
    ----------
    tolerance_s : float
        Depth that is farther away than this is none of the image's.

    Attributes
    ----------
    tolerance_ns : int
    least_gap_ns : int or None
        Time between the image and the depth that were closest so far; None where no depth came.
    """

    def __init__(self, tolerance_s: float = TOLERANCE_S) -> None:
        self.tolerance_ns = round(tolerance_s * NS_PER_S)
        self.least_gap_ns: int | None = None
        self._images: deque[tuple[int, T]] = deque()
        self._depths: deque[tuple[int, T]] = deque(maxlen=2 * WAITING)

    def add_image(self, stamp_ns: int, image: T) -> Iterator[tuple[T, T | None]]:
        """Take an image, and yield the pairs that are known now."""
        self._images.append((stamp_ns, image))
        yield from self._decided()

    def add_depth(self, stamp_ns: int, depth: T) -> Iterator[tuple[T, T | None]]:
        """Take a depth, and yield the pairs that are known now."""
        self._depths.append((stamp_ns, depth))
        yield from self._decided()

    def rest(self) -> Iterator[tuple[T, T | None]]:
        """Yield the pairs of all images that wait: no more depth will come."""
        while self._images:
            yield self._next()

    def _decided(self) -> Iterator[tuple[T, T | None]]:
        while self._images and (len(self._images) > WAITING or self._has_later(self._images[0][0])):
            yield self._next()

    def _has_later(self, stamp_ns: int) -> bool:
        return any(stamp >= stamp_ns for stamp, _ in self._depths)

    def _next(self) -> tuple[T, T | None]:
        stamp_ns, image = self._images.popleft()
        nearest = min(self._depths, key=lambda depth: abs(depth[0] - stamp_ns), default=None)
        if nearest is None:
            return image, None
        gap_ns = abs(nearest[0] - stamp_ns)
        self.least_gap_ns = gap_ns if self.least_gap_ns is None else min(self.least_gap_ns, gap_ns)
        return image, nearest[1] if gap_ns <= self.tolerance_ns else None
