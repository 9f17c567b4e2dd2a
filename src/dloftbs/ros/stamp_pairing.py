"""Depth, or a mask, to the image of the same moment, while both stream by."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from typing import Generic, TypeVar

from dloftbs.ros.message_fields import NS_PER_S

TOLERANCE_S = 0.02
"""Largest difference between the stamps of an image and its depth: two thirds of a frame at 30 per second, where the
shutters of two sensors run freely, and too little for a depth of the frame before."""
MASK_TOLERANCE_S = 0.001
"""Largest difference between the stamps of an image and its mask.

Source: by definition; a mask has the stamp of its image, and stamps that are cut to milliseconds differ by less.
"""
WAITING = 8
"""Images that wait for their depth at most: a quarter of a second at 30 per second, and 50 MB of HD."""
WAITING_FOR_MASKS = 32
"""Images that wait for their mask at most: a second at 30 per second, which a large network takes on a small computer,
and 90 MB of HD."""
RESTART_S = 1.0
"""Time by which stamps go back where a stream begins anew: a recording in a loop, or a simulator that was reset.

Source: by definition; messages that only overtake each other are late by less.
"""

_RESTART_NS = round(RESTART_S * NS_PER_S)

T = TypeVar("T")
P = TypeVar("P")


class StampPairing(Generic[T, P]):
    """Gives each image the partner whose stamp is nearest, its depth or its mask, in bounded memory.

    An image waits until a partner of its time or later has come, or until too many wait. Stamps of a topic are assumed
    to ascend; where they do not, an image may go without. Where those of the images go back by more than `RESTART_S`,
    the stream begins anew. Images come out in the order in which they went in.

    Parameters
    ----------
    tolerance_s : float
        A partner that is farther away than this is none of the image's.
    waiting : int
        Images that wait at most.

    Attributes
    ----------
    tolerance_ns : int
    least_gap_ns : int or None
        Time between the image and the partner that were closest so far; None where no partner came.
    """

    def __init__(self, tolerance_s: float = TOLERANCE_S, waiting: int = WAITING) -> None:
        self.tolerance_ns = round(tolerance_s * NS_PER_S)
        self.least_gap_ns: int | None = None
        self._waiting = waiting
        self._images: deque[tuple[int, T]] = deque()
        self._partners: deque[tuple[int, P]] = deque(maxlen=2 * waiting)
        self._last_ns: int | None = None
        self._since_last = 0  # partners that came since the last image

    def begins_anew(self, stamp_ns: int) -> bool:
        """Return whether the stream begins anew with an image of this stamp."""
        return self._last_ns is not None and self._last_ns - stamp_ns > _RESTART_NS

    def add_image(self, stamp_ns: int, image: T) -> Iterator[tuple[T, P | None]]:
        """Take an image, and yield the pairs that are known now."""
        if self.begins_anew(stamp_ns):
            yield from self.rest()
            latest = list(self._partners)[max(len(self._partners) - self._since_last, 0) :]
            self._partners.clear()
            # Those of the new time that came before the image; others may have its very stamp.
            self._partners.extend(partner for partner in latest if partner[0] - stamp_ns <= _RESTART_NS)
        self._last_ns, self._since_last = stamp_ns, 0
        self._images.append((stamp_ns, image))
        yield from self._decided()

    def add_partner(self, stamp_ns: int, partner: P) -> Iterator[tuple[T, P | None]]:
        """Take a partner, and yield the pairs that are known now."""
        self._partners.append((stamp_ns, partner))
        self._since_last += 1
        yield from self._decided()

    def rest(self) -> Iterator[tuple[T, P | None]]:
        """Yield the pairs of all images that wait: no more partners will come."""
        while self._images:
            yield self._next()

    def _decided(self) -> Iterator[tuple[T, P | None]]:
        while self._images and (len(self._images) > self._waiting or self._has_later(self._images[0][0])):
            yield self._next()

    def _has_later(self, stamp_ns: int) -> bool:
        return any(stamp >= stamp_ns for stamp, _ in self._partners)

    def _next(self) -> tuple[T, P | None]:
        stamp_ns, image = self._images.popleft()
        nearest = min(self._partners, key=lambda partner: abs(partner[0] - stamp_ns), default=None)
        if nearest is None:
            return image, None
        gap_ns = abs(nearest[0] - stamp_ns)
        self.least_gap_ns = gap_ns if self.least_gap_ns is None else min(self.least_gap_ns, gap_ns)
        return image, nearest[1] if gap_ns <= self.tolerance_ns else None
