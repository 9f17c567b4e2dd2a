"""Gate for the masks of a stream: a mask whose area jumps has failed, and is evidence of nothing for some frames."""

from __future__ import annotations

import math
from collections.abc import Iterable

from dloftbs.config import TrackingConfig
from dloftbs.data.tracks import EndKind, Track
from dloftbs.support.values import ROUNDING_S

_JUMP = 10.0
"""Ratio of the areas of two masks, one after the other, from which on no cable moved: the segmentation failed.

Source: measured; of 9,000 masks of generated sequences, at 30 and 7.5 frames a second, 24 are that far from what is
expected, all at the slower rate where a cable is covered or leaves. An empty, full or inverted one is farther.
"""
_HELD_S = 0.5
"""Time after which a jump is believed, s.

Source: by definition; in it the confidence of a curve that is not seen falls to one half.
"""


class MaskGate:
    """Refuses masks of a stream that suddenly have nearly nothing or nearly everything set, or cannot be read.

    A mask is expected to have an area between that of the last one and that to which it grows or shrinks at the same
    rate: a cable that is pulled out of the picture, or covered, shrinks before it is gone. It may also grow to all that
    is known of the objects, which come back at once when a hand is taken away. Ten times more, or a tenth, is a jump,
    and a jump that lasts is believed. Nothing is refused unless the last mask that was accepted showed a confirmed
    track: otherwise there is none to keep, and what appears is new.

    Parameters
    ----------
    config : TrackingConfig
        Tracks that are not kept are not held either: a jump is believed after `keep_lost_s`, if that is less.
    """

    def __init__(self, config: TrackingConfig) -> None:
        self._held_s = min(_HELD_S, config.keep_lost_s)
        self._frame_s = config.frame_s
        self.reset()

    def reset(self) -> None:
        """Forget the masks so far."""
        self._share: float | None = None  # that was set in the last mask that was accepted, if it showed a track
        self._next = 0.0  # to be set in the next one, if it goes on growing or shrinking
        self._known = 0.0  # to be set where all of the known objects is seen
        self._stamp: float | None = None
        self._refused = 0  # frames since then

    def refuse(self, share: float, stamp: float | None, *, readable: bool) -> str | None:
        """Return why a mask, of which a share is set, is taken for a failure of the segmentation; None if it is not.

        Parameters
        ----------
        share : float
        stamp : float, optional
            Of its frame, s.
        readable : bool
            Whether it can be read as cables at all.
        """
        if self._share is None or (readable and not self.is_jump(share)):
            return None
        self._refused += 1
        since = self._refused * self._frame_s if stamp is None or self._stamp is None else stamp - self._stamp
        if not 0.0 <= since <= self._held_s + ROUNDING_S:
            return None
        what = f"{100.0 * share:.3g} % of the mask is set" if share > 0.0 else "the mask is empty"
        return (
            f"{what}, after {100.0 * self._share:.3g} %: the segmentation has failed, or the scene changed, which is "
            f"believed after {self._held_s:.3g} s"
        )

    def accept(self, share: float, stamp: float | None, *, shows_tracks: bool, known: float = 0.0) -> None:
        """Take a mask that was not refused, whether it showed a confirmed track, and the `known_share` of all."""
        self._next = share if self._share is None else 2.0 * share - self._share
        self._share = share if shows_tracks else None
        self._stamp, self._refused, self._known = stamp, 0, known

    def is_jump(self, share: float) -> bool:
        """Return whether the share of a mask that is set is not what is expected."""
        if self._share is None:
            return False
        low, high = min(self._share, self._next), max(self._share, self._next, self._known)
        return 0.0 < low >= _JUMP * share or share >= _JUMP * high


def known_share(tracks: Iterable[Track], size: tuple[int, int]) -> float:
    """Return the share of an image of a size, ``(H, W)``, that is set where all of some objects is seen.

    It is infinite where an object goes on beyond the border: nobody knows how much of it comes in.
    """
    area = 0.0
    for track in tracks:
        if EndKind.BORDER in (track.ends or ()):
            return math.inf
        area += track.curve.length * (track.width_px or 0.0)
    return area / (size[0] * size[1]) if area > 0.0 else 0.0
