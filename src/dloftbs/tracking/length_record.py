"""Length of a track, and what lengths it had."""

from __future__ import annotations

import math
import statistics
from dataclasses import dataclass, field, replace

import numpy as np

from dloftbs.support.arrays import FloatArray
from dloftbs.tracking.kernels.routing import MAX_BRIDGE

MIN_SEEN_FRAMES = 3
"""Number of frames in which a span must have been seen to be assumed hidden, not absent, once it is missing.

Source: by hand; one or two frames may be a detector's error.
"""

HISTORY_FRAMES = 32
"""Number of frames for which the ends and the lengths are recorded.

Source: bounds memory; a second at 30 per second.
"""

_WIDTH_GAIN = 0.5
"""Share of a change of width that the length of a partly hidden object follows per frame.

Source: by hand; widths are known to a percent or two.
"""


@dataclass(slots=True, eq=False)
class LengthRecord:
    """Length of a track, filtered, and those of the last frames.

    Parameters
    ----------
    px : float
    recent_px : numpy.ndarray, shape (HISTORY_FRAMES,)
        In the last frames, by their number; NaN where empty, and in frames that did not show the object.
    recent_ends : numpy.ndarray, shape (HISTORY_FRAMES, 2, 2)
        Both ends of the curve in these; NaN where one was not seen.
    frames : int
        Number of frames since the first that is recorded.
    full_px : list of float
        In the last frames, `HISTORY_FRAMES` at most, that showed the whole object without long gaps.
    full_m : list of float
        The same in space, metres, as far as it is known.
    full_width : float
        Width of the object in the last of these, px; NaN if it is not known.
    px_per_m : float
        Scale of the last view, in px a metre of the object; NaN if it is not known. All lengths are as it shows them.
    """

    px: float
    recent_px: FloatArray = field(default_factory=lambda: np.full(HISTORY_FRAMES, np.nan))
    recent_ends: FloatArray = field(default_factory=lambda: np.full((HISTORY_FRAMES, 2, 2), np.nan))
    frames: int = 0
    full_px: list[float] = field(default_factory=list)
    full_m: list[float] = field(default_factory=list)
    full_width: float = math.nan
    px_per_m: float = math.nan

    @property
    def usual_px(self) -> float:
        """Length in most frames that showed the whole object, px; NaN if they are too few."""
        return statistics.median(self.full_px) if len(self.full_px) >= MIN_SEEN_FRAMES else math.nan

    @property
    def metres(self) -> float:
        """Length in space, in most frames that showed the whole object if any did; NaN if it is not known."""
        return statistics.median(self.full_m) if self.full_m else self.px / self.px_per_m

    def copied(self) -> LengthRecord:
        """Return a copy that goes on by itself."""
        return replace(self, recent_px=self.recent_px.copy(), recent_ends=self.recent_ends.copy())

    def cut(self, share: float) -> None:
        """Give up all but a share of the length."""
        self.px, self.full_m = share * self.px, [share * one for one in self.full_m]

    def forget_full(self) -> None:
        """Forget the lengths, px, of the views that showed the whole object: it is another one."""
        self.full_px = []

    def rescale(self, px_per_m: float, width: float) -> None:
        """Take all lengths to the scale of another view, which shows the object this wide; NaN is an unknown scale."""
        ratio, self.px_per_m = px_per_m / self.px_per_m, px_per_m
        if not math.isnan(ratio):
            self._multiply(ratio)
            self.full_width = width

    def follow_width(self, width: float) -> None:
        """Take all lengths to the scale of a view that shows the object this wide: it came nearer or went away."""
        ratio = 1.0 + _WIDTH_GAIN * (width / self.full_width - 1.0)
        if not math.isnan(ratio):
            self._multiply(ratio)
            self.full_width *= ratio

    def _multiply(self, ratio: float) -> None:
        self.px, self.recent_px = ratio * self.px, ratio * self.recent_px
        self.full_px = [ratio * one for one in self.full_px]

    def follow_tilt(self, length: float) -> None:
        """Adopt a length between ends that are both seen: it tilts, but is no longer than it was as a whole."""
        self.px = min(length, max(self.px, *self.full_px, 0.0))

    def record_full(self, length: float, width: float, tolerance: float) -> None:
        """Record the length of the whole object without long gaps, and its width; its scale is that of the view."""
        self.full_width = width
        # Without a scale both are NaN, and nothing is known in space.
        if abs(length - self.metres * self.px_per_m) > tolerance:  # what was known there was wrong
            self.full_m = []
        self.full_px = [*self.full_px[1 - HISTORY_FRAMES :], length]
        if not math.isnan(self.px_per_m):
            self.full_m = [*self.full_m[1 - HISTORY_FRAMES :], length / self.px_per_m]

    def record(self, start: FloatArray | float, end: FloatArray | float, length: float) -> None:
        """Record the ends of the curve, and the length, in a frame; all are NaN where it did not show the object."""
        self.frames += 1
        at = self.frames % HISTORY_FRAMES
        self.recent_ends[at, 0], self.recent_ends[at, 1], self.recent_px[at] = start, end, length

    def is_usual(self, length: float, tolerance: float) -> bool:
        """Return True if a length agrees with most frames that showed the whole object."""
        return abs(length - self.usual_px) <= tolerance

    def is_torn(self, visible: float, hidden: float, width: float, tolerance: float) -> bool:
        """Return True if visible parts lie farther apart, by `hidden` px in all, than the object's length allows.

        An object that came nearer is wider, and longer by as much.
        """
        nearer = width / self.full_width
        usual = self.usual_px
        length = (self.px if math.isnan(usual) else usual) * (nearer if nearer > 1.0 else 1.0)
        return hidden > MAX_BRIDGE * max(length - visible, 0.0) + tolerance
