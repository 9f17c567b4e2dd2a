"""Depth, or a mask, to the image of the same moment, while both stream by."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from typing import Any, Generic, TypeVar

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
RECORDED_S = 1.0
"""Time by the stamps for which images of a recording wait for their depth, and depth for its image.

Source: by hand; as images wait for masks. Drivers and recorders under load are late by some tenths of a second.
"""
MOST_RECORDED = 96
"""Images of a recording that wait for their depth at most, and depths that are kept: a second at 90 per second.

Source: by hand; 260 MB of HD, of which a camera at 30 per second takes a third.
"""
WAITING_FOR_MASKS = 32
"""Images that wait for their mask at most: a second at 30 per second, which a large network takes on a small computer,
and 90 MB of HD."""
RESTART_S = 1.0
"""Time by which stamps go back where a stream begins anew: a recording in a loop, or a simulator that was reset.

Source: by definition; messages that only overtake each other are late by less.
"""

_RESTART_NS = round(RESTART_S * NS_PER_S)
_REMEMBERED = 4096
"""Images without a partner, and partners that are not kept any longer, of which the stamps are remembered.

Source: by hand; two minutes at 30 per second, and some 200 kB.
"""

T = TypeVar("T")
P = TypeVar("P")


class StampPairing(Generic[T, P]):
    """Gives each image the partner whose stamp is nearest, its depth or its mask, in bounded memory.

    An image waits until a partner of its time or later has come, or until too many wait, for as long as is asked for.
    Twice as many partners are kept. Stamps of a topic are assumed to ascend; where they do not, an image may go
    without. Where those of the images go back by more than `RESTART_S`, the stream begins anew. Images come out in the
    order in which they went in.

    Parameters
    ----------
    tolerance_s : float
        A partner that is farther away than this is none of the image's.
    waiting : int
        Images that wait at most, unless more are to wait for a time.
    waiting_s : float
        Time by the stamps for which more images wait, and more partners are kept.
    most : int
        Images that wait at most in such a time, and partners that are kept at most.

    Attributes
    ----------
    tolerance_ns : int
    least_gap_ns : int or None
        Time between the image and the partner that were closest so far; None where no partner came.
    missed : int
        Images that went without a partner so far although one of their time came: too late, or too early.
    """

    def __init__(
        self, tolerance_s: float = TOLERANCE_S, waiting: int = WAITING, *, waiting_s: float = 0.0, most: int = 0
    ) -> None:
        self.tolerance_ns = round(tolerance_s * NS_PER_S)
        self.least_gap_ns: int | None = None
        self.missed = 0
        self._waiting, self._waiting_ns, self._most = waiting, round(waiting_s * NS_PER_S), most
        self._images: deque[tuple[int, T]] = deque()
        self._partners: deque[tuple[int, P]] = deque()
        self._alone_ns: deque[int] = deque(maxlen=_REMEMBERED)  # of images that went without
        self._gone_ns: deque[int] = deque(maxlen=_REMEMBERED)  # of partners that are not kept any longer
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
            self._alone_ns.clear()
            self._gone_ns.clear()
            # Those of the new time that came before the image; others may have its very stamp.
            self._partners.extend(partner for partner in latest if partner[0] - stamp_ns <= _RESTART_NS)
        self._last_ns, self._since_last = stamp_ns, 0
        self._images.append((stamp_ns, image))
        yield from self._decided()

    def add_partner(self, stamp_ns: int, partner: P) -> Iterator[tuple[T, P | None]]:
        """Take a partner, and yield the pairs that are known now."""
        self._partners.append((stamp_ns, partner))
        self._since_last += 1
        while self._has_too_many(self._partners, 2 * self._waiting):
            self._gone_ns.append(self._partners.popleft()[0])
        while self._alone_ns and self._alone_ns[0] <= stamp_ns + self.tolerance_ns:
            self.missed += self._alone_ns.popleft() >= stamp_ns - self.tolerance_ns
        yield from self._decided()

    def rest(self) -> Iterator[tuple[T, P | None]]:
        """Yield the pairs of all images that wait: no more partners will come."""
        while self._images:
            yield self._next()

    def _decided(self) -> Iterator[tuple[T, P | None]]:
        while self._images and (self._has_too_many(self._images, self._waiting) or self._has_later(self._images[0][0])):
            yield self._next()

    def _has_too_many(self, kept: deque[tuple[int, Any]], count: int) -> bool:
        """Return whether more are kept than a count, and the first is too old, or more than are kept of any time."""
        if len(kept) <= count:
            return False
        return len(kept) > self._most or kept[-1][0] - kept[0][0] > self._waiting_ns

    def _has_later(self, stamp_ns: int) -> bool:
        return any(stamp >= stamp_ns for stamp, _ in self._partners)

    def _next(self) -> tuple[T, P | None]:
        stamp_ns, image = self._images.popleft()
        nearest = min(self._partners, key=lambda partner: abs(partner[0] - stamp_ns), default=None)
        if nearest is not None:
            gap_ns = abs(nearest[0] - stamp_ns)
            self.least_gap_ns = gap_ns if self.least_gap_ns is None else min(self.least_gap_ns, gap_ns)
            if gap_ns <= self.tolerance_ns:
                return image, nearest[1]
        self._remember(stamp_ns)
        return image, None

    def _remember(self, stamp_ns: int) -> None:
        """Count an image that goes without if a partner of its time has gone, and remember it if one may yet come."""
        while self._gone_ns and self._gone_ns[0] < stamp_ns - self.tolerance_ns:
            self._gone_ns.popleft()
        if self._gone_ns and self._gone_ns[0] <= stamp_ns + self.tolerance_ns:
            self.missed += 1
        else:
            self._alone_ns.append(stamp_ns)
