"""Length of a track, and what lengths it had."""

from __future__ import annotations

import math
import statistics
from dataclasses import dataclass, field

import numpy as np

from dloftbs._arrays import FloatArray
from dloftbs.tracking.kernels.routing import MAX_BRIDGE

MIN_SEEN_FRAMES = 3
"""Number of frames in which a span must have been seen to be assumed hidden, not absent, once it is missing.

Source: by hand; one or two frames may be a detector's error.
"""

HISTORY_FRAMES = 32
"""Number of frames for which the ends and the lengths are recorded.

Source: bounds memory; a second at 30 per second.
"""

_GAIN = 0.05
"""Share of a small change of length that is taken over per frame.

Source: by hand; a stretch that disappears little by little would never be missed at a larger one.
"""


@dataclass(slots=True, eq=False)
class LengthRecord:
    """Length of a track, filtered, and those of the last frames.

    Parameters
    ----------
    px : float
    recent_px : numpy.ndarray, shape (HISTORY_FRAMES,)
        In the last frames, by the number of hits; NaN where empty.
    recent_ends : numpy.ndarray, shape (HISTORY_FRAMES, 2, 2)
        Both ends of the curve in these.
    full_px : numpy.ndarray, shape (HISTORY_FRAMES,)
        In the last frames that showed the whole object without long gaps.
    usual_px : float or None
        Median of these, NaN if they are too few; None until it is computed.
    full_width : float
        Width of the object in the last of these, px; NaN if it is not known.
    """

    px: float
    recent_px: FloatArray = field(default_factory=lambda: np.full(HISTORY_FRAMES, np.nan))
    recent_ends: FloatArray = field(default_factory=lambda: np.full((HISTORY_FRAMES, 2, 2), np.nan))
    full_px: FloatArray = field(default_factory=lambda: np.full(HISTORY_FRAMES, np.nan))
    usual_px: float | None = None
    full_width: float = math.nan

    def adopt(self, length: float, hits: int, tolerance: float) -> None:
        """Adopt the length of the whole object; small changes are filtered.

        Or an end that disappears gradually would never count as missing.
        """
        change = length - self.px
        self.px = length if hits < MIN_SEEN_FRAMES or abs(change) > tolerance else self.px + _GAIN * change

    def record_full(self, length: float, width: float, hits: int) -> None:
        """Record the length of the whole object without long gaps, and its width."""
        self.full_width = width
        self.full_px[hits % HISTORY_FRAMES] = length
        self.usual_px = None

    def record(self, ends: FloatArray, hits: int) -> None:
        """Record the length, and the ends of the curve, in a frame that showed the object."""
        self.recent_ends[hits % HISTORY_FRAMES] = ends
        self.recent_px[hits % HISTORY_FRAMES] = self.px

    def is_usual(self, length: float, tolerance: float) -> bool:
        """Return True if a length agrees with most frames that showed the whole object."""
        return abs(length - self.usual()) <= tolerance

    def usual(self) -> float:
        """Return the length in most frames that showed the whole object, px; NaN if they are too few."""
        if self.usual_px is None:
            known = [one for one in self.full_px.tolist() if not math.isnan(one)]
            self.usual_px = statistics.median(known) if len(known) >= MIN_SEEN_FRAMES else math.nan
        return self.usual_px

    def is_torn(self, visible: float, hidden: float, width: float, tolerance: float) -> bool:
        """Return True if visible parts lie farther apart, by `hidden` px in all, than the object's length allows.

        An object that came nearer is wider, and longer by as much.
        """
        nearer = width / self.full_width
        usual = self.usual()
        length = (self.px if math.isnan(usual) else usual) * (nearer if nearer > 1.0 else 1.0)
        return hidden > MAX_BRIDGE * max(length - visible, 0.0) + tolerance
