"""Sight of a track: which of its samples frames have shown, and what hides the others."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from dataclasses import dataclass, field

import numpy as np

from dloftbs.data.curve_samples import SAMPLES, U
from dloftbs.evidence import HIDDEN, IN_SIGHT
from dloftbs.support.arrays import BoolArray, FloatArray, IntArray
from dloftbs.tracking.kernels.hidden_spans import find_runs
from dloftbs.tracking.partial_match import WHOLE

_MAX_SEEN_FRAMES = 8.0
"""Bound of the number of frames in which a span was seen, so that old spans can be given up.

Source: by hand.
"""

_HALF_LIFE_S = 0.5
"""Half-life of the confidence in a stretch that is not seen, s.

Source: by hand.
"""

_MIN_IN_SIGHT_WIDTHS = 2.0
"""Least length of a stretch that counts as in plain sight, widths.

Source: geometry; between two fingers, a prediction that is a width off lies beside the cable.
"""

_SORTED_U = U.tolist()
"""Parameters of the samples, as bisection takes them.

Source: by definition.
"""

Spans = tuple[tuple[float, float], ...]
Told = IntArray | None


@dataclass(slots=True, eq=False)
class Sight:
    """Record of the samples of a track that frames have shown.

    Parameters
    ----------
    seen_frames : numpy.ndarray, shape (SAMPLES,)
        Number of frames in which each sample was seen, bounded.
    unseen_s : numpy.ndarray, shape (SAMPLES,)
        Seconds since each sample was last seen.
    mean_unseen_s : float
        Their mean.
    hidden : tuple of (float, float)
        The intervals of ``u`` that the last frame did not show.
    inferred : tuple of (float, float)
        These, and those that the detector inferred.
    in_sight : numpy.ndarray, shape (SAMPLES,), bool
        The samples that the last frame did not show, although nothing hides their place.
    is_covered : bool
        True if the last frame showed nothing of the object, and something that hides most of its place.
    confidence : float
        In the whole curve, in 0..1: less the longer ago its samples were seen.
    """

    seen_frames: FloatArray
    inferred: Spans
    unseen_s: FloatArray = field(default_factory=lambda: np.zeros(SAMPLES))
    mean_unseen_s: float = 0.0
    hidden: Spans = ()
    in_sight: BoolArray = field(default_factory=lambda: np.zeros(SAMPLES, dtype=np.bool_))
    is_covered: bool = False
    confidence: float = 1.0

    @classmethod
    def of_whole(cls, gaps: Spans) -> Sight:
        """Return the sight of an object that one frame showed, but for gaps."""
        return cls((~samples_within(gaps)).astype(np.float64), gaps)

    @property
    def unseen_spans(self) -> Spans:
        """The intervals of ``u``, from one seen sample to another, that no frame has shown, or too few to be kept."""
        if self.seen_frames[self.seen_frames.argmin()] > 0.0:  # faster than any()
            return ()
        unseen = self.seen_frames <= 0.0
        return tuple(
            (float(U[max(low - 1, 0)]), float(U[min(high, SAMPLES - 1)])) for low, high in find_runs(unseen).tolist()
        )

    def see_whole(self, gaps: Spans, *, was_unseen: bool) -> None:
        """Count a frame that showed all but the detector's gaps."""
        self.inferred, self.confidence = gaps, 1.0
        shown = ~samples_within(gaps) if gaps else 1.0
        self.seen_frames = np.minimum(self.seen_frames + shown, _MAX_SEEN_FRAMES)
        if self.hidden or was_unseen:
            self._set_unseen(np.zeros(SAMPLES))
            self.in_sight = np.zeros(SAMPLES, dtype=np.bool_)
            self.hidden, self.is_covered = (), False

    def see_part(self, hidden: Spans, inferred: Spans, told: Told, widths: float, dt: float) -> None:
        """Count a frame that showed a part.

        `told` is what it tells of the places of all samples, None if nothing; `widths` is the length of the curve in
        widths.
        """
        is_hidden = samples_within(hidden)
        self.in_sight = is_hidden & _in_sight(told, widths)
        self.hidden, self.inferred, self.is_covered = hidden, inferred, False
        self._set_unseen((self.unseen_s + dt) * is_hidden)
        # Spans seen up to the bound are kept unless their place is in plain sight; others are forgotten within as many.
        fading = self.seen_frames - ((self.seen_frames < _MAX_SEEN_FRAMES) | self.in_sight)
        seen = np.minimum(self.seen_frames + ~samples_within(inferred), _MAX_SEEN_FRAMES)
        self.seen_frames = np.where(is_hidden, fading, seen)

    def see_nothing(self, told: Told, widths: float, dt: float) -> None:
        """Count a frame that showed nothing; `told` and `widths` as for `see_part`."""
        self.in_sight = _in_sight(told, widths)
        self.is_covered = told is not None and int(np.count_nonzero(told == HIDDEN)) > SAMPLES // 2
        self.hidden = self.inferred = (WHOLE,)
        self._set_unseen(self.unseen_s + dt)

    def _set_unseen(self, unseen_s: FloatArray) -> None:
        self.unseen_s, self.mean_unseen_s = unseen_s, float(unseen_s.mean())
        self.confidence = float(np.exp2(unseen_s / -_HALF_LIFE_S).sum()) / SAMPLES

    def confidence_after(self, seconds: float) -> float:
        """Return the confidence in the whole curve after so many more seconds in which nothing of it is seen."""
        return self.confidence * 2.0 ** (-seconds / _HALF_LIFE_S)

    def confidence_in(self, span: tuple[float, float]) -> float:
        """Return the confidence in a span of the curve."""
        unseen_s = self.unseen_s[samples_within((span,))]
        return float(np.exp2(unseen_s / -_HALF_LIFE_S).mean()) if len(unseen_s) else self.confidence

    def resample(self, u: FloatArray) -> None:
        """Take the counts at other parameters (SAMPLES,), new ones beyond 0 and 1."""
        new = (u < 0.0) | (u > 1.0)
        self.seen_frames = np.where(new, 0.0, np.interp(u, U, self.seen_frames))
        self.unseen_s = np.where(new, 0.0, np.interp(u, U, self.unseen_s))
        self.mean_unseen_s = float(self.unseen_s.mean())


def samples_within(spans: Spans) -> BoolArray:
    """Return a mask (SAMPLES,) of the samples that lie in spans of ``u``."""
    result = np.zeros(SAMPLES, dtype=np.bool_)
    for low, high in spans:
        result[bisect_left(_SORTED_U, low) : bisect_right(_SORTED_U, high)] = True
    return result


def _in_sight(told: Told, widths: float) -> BoolArray:
    """Return the samples in plain sight, but for stretches that are too short to decide."""
    result = np.zeros(SAMPLES, dtype=np.bool_)
    for first, end in () if told is None else find_runs(told == IN_SIGHT).tolist():
        result[first:end] = (end - first) * widths >= _MIN_IN_SIGHT_WIDTHS * SAMPLES
    return result
