"""State of one track between frames."""

from __future__ import annotations

import math
import statistics
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from dloftbs._arrays import FloatArray
from dloftbs.curve import BSplineCurve
from dloftbs.frame import Detection, Track, TrackState
from dloftbs.observation import SAMPLES, Seen, U
from dloftbs.tracking.kernels.curve_motion import move_control_points
from dloftbs.tracking.partial_match import Sight

TRUSTED = 3
"""Number of frames in which a stretch must have been seen to be believed once it is gone."""

REMEMBERED = 32
"""Frames for which the places of the ends are kept."""

LEAP = 0.1
"""Of the length: a sample that has gone farther, or a length that changed by more, tells of no motion."""

_MOST_TRUST = 8.0
_LENGTH_GAIN = 0.05
_VELOCITY_GAIN = 0.8
_MOTION_S = 0.1  # for so long a motion goes on by itself
_HALF_LIFE_S = 0.5  # of the confidence in what is not seen


class Prediction(NamedTuple):
    """Predicted place of a track.

    Parameters
    ----------
    id : int
    curve : BSplineCurve
        In the image, px, in the track's direction.
    width : float or None
        Of the object, px; None where no detection told it.
    confidence : float
        As the track's was, in 0..1.
    """

    id: int
    curve: BSplineCurve
    width: float | None
    confidence: float


@dataclass(slots=True, eq=False)
class Memory:
    """A track, with all that following it needs; samples are `SAMPLES` points at even ``u``.

    Parameters
    ----------
    id : int
    curve : BSplineCurve
        The whole object as it was last put together, before any smoothing.
    curve_3d : BSplineCurve or None
    points, velocity : numpy.ndarray, shape (SAMPLES, 2)
        Along the curve, px, and how they move, px a second.
    length, width : float
        px; the length is the usual one, the width NaN where it is not known.
    trust : numpy.ndarray, shape (SAMPLES,)
        In how many frames each sample was seen, up to a bound.
    unseen_s : numpy.ndarray, shape (SAMPLES,)
        Seconds since each sample was last seen.
    since_s : float
        Seconds since any was.
    hidden : tuple of (float, float)
        The intervals of ``u`` that the last frame did not show.
    shape : numpy.ndarray, shape (SAMPLES, 2)
        The samples when all of the object was last seen.
    shape_s : float
        Seconds since then.
    contested_px, shown_px : float
        Length of the detection that seems to be all of the object, but is not what it is taken for, and of all
        detections that showed parts of it then.
    contested, joined, shadowed : int
        Frames in which there was such a one, less those in which it was another; frames in a row in which the track
        was a part of a detection that may be one object, and in which it lay on one that another track had taken.
    apart : bool
        Whether it is a part of a detection, and known to be another object than the rest of it.
    ends, lengths : numpy.ndarray, shapes (REMEMBERED, 2, 2) and (REMEMBERED,)
        Places of the two ends, and the length, in the last frames, px; NaN before there were any.
    totals : numpy.ndarray, shape (REMEMBERED,)
        Its length in the last frames that showed all of it, px; NaN before there were any.
    usual_px : float or None
        The median of these, NaN where they are too few; None until it is asked for.
    sight : Sight or None
        Curve published in place of the track's own, where only a part of it is seen.
    """

    id: int
    curve: BSplineCurve
    curve_3d: BSplineCurve | None
    points: FloatArray
    length: float
    width: float
    velocity: FloatArray = field(default_factory=lambda: np.zeros((SAMPLES, 2)))
    trust: FloatArray = field(default_factory=lambda: np.ones(SAMPLES))
    unseen_s: FloatArray = field(default_factory=lambda: np.zeros(SAMPLES))
    state: TrackState = TrackState.TENTATIVE
    hits: int = 1
    misses: int = 0
    since_s: float = 0.0
    hidden: tuple[tuple[float, float], ...] = ()
    shape: FloatArray = field(default_factory=lambda: np.zeros((SAMPLES, 2)))
    shape_s: float = 0.0
    contested_px: float = 0.0
    shown_px: float = 0.0
    contested: int = 0
    joined: int = 0
    shadowed: int = 0
    apart: bool = False
    ends: FloatArray = field(default_factory=lambda: np.full((REMEMBERED, 2, 2), np.nan))
    lengths: FloatArray = field(default_factory=lambda: np.full(REMEMBERED, np.nan))
    totals: FloatArray = field(default_factory=lambda: np.full(REMEMBERED, np.nan))
    usual_px: float | None = None
    sight: Sight | None = None
    detection: Detection | None = None
    inferred: tuple[tuple[float, float], ...] = ()
    confidence: float = 1.0

    @classmethod
    def of(cls, number: int, seen: Seen) -> Memory:
        """Start a track."""
        memory = cls(number, seen.curve, seen.curve_3d, seen.points, seen.length, seen.width)
        memory.detection = seen.detection
        memory.inferred = seen.gaps
        memory.shape = seen.points
        return memory

    @property
    def tolerance_px(self) -> float:
        """Largest difference from the usual length at which nothing counts as hidden or new."""
        return 0.004 * self.length + 0.3 * self._width_or_0

    @property
    def slack_px(self) -> float:
        """Uncertainty of a part's place along the object."""
        return 0.015 * self.length + 1.5 * self._width_or_0

    @property
    def _width_or_0(self) -> float:
        return 0.0 if math.isnan(self.width) else self.width

    def see_whole(self, seen: Seen, points: FloatArray, velocity: FloatArray) -> None:
        """Take a detection, run in the track's direction, as it is."""
        self.curve, self.curve_3d, self.detection = seen.curve, seen.curve_3d, seen.detection
        self.points, self.velocity = points, velocity
        self.shape, self.shape_s = points, 0.0
        # Small changes count slowly, or what disappears little by little would never be missed.
        change = seen.length - self.length
        if self.hits < TRUSTED or abs(change) > self.tolerance_px:
            self.length = seen.length
        else:
            self.length += _LENGTH_GAIN * change
        if seen.width == seen.width:  # not NaN
            self.width = seen.width
        if seen.clear:
            self.totals[self.hits % REMEMBERED] = seen.length
            self.usual_px = None
        self.inferred, self.confidence = seen.gaps, 1.0
        self.trust = np.minimum(self.trust + 1.0, _MOST_TRUST)
        if self.hidden or self.misses:
            self.unseen_s = np.zeros(SAMPLES)
            self.hidden = ()
        self.contested = self.joined = 0
        self.sight = None

    def see_parts(
        self, curve: BSplineCurve, points: FloatArray, length: float, hidden: tuple[tuple[float, float], ...], dt: float
    ) -> None:
        """Take a curve of which some stretches are remembered rather than seen."""
        dark = inside(hidden)
        self.velocity = blend(self, points, dt)
        far = np.abs(points - self.points).max(axis=1) > LEAP * length
        if self.misses or far.any():
            self.velocity[:] = 0.0
        self.curve, self.points, self.length, self.hidden = curve, points, length, hidden
        self.shape_s += dt
        self.unseen_s = np.where(dark, self.unseen_s + dt, 0.0)
        # What was seen for a while stays, and what was seen in some frames only is forgotten within as many.
        fading = np.where(self.trust < _MOST_TRUST, self.trust - 1.0, self.trust)
        self.trust = np.where(dark, fading, np.minimum(self.trust + 1.0, _MOST_TRUST))
        self.confidence = self._confidence()
        self.sight = None

    def contest(self, seen: Seen, shown_px: float) -> None:
        """Count a frame in which a detection, a part of the object or more than that, is not what it is taken for.

        Only where all that is shown of the object, so many px, is as long as it was: an occluder may move.
        """
        same = self._is_as_contested(seen) and abs(shown_px - self.shown_px) < 0.01 * shown_px + 0.75 * self._width_or_0
        if seen.clear and (same or self.contested == 0):
            if self.contested == 0:
                self.contested_px, self.shown_px = seen.total, shown_px
            little = abs(seen.total - self.length) < self.slack_px  # more likely a false end that was seen before
            self.contested += 2 if little else 1
        else:
            self.contested = max(self.contested - 1, 0)

    def is_overruled_by(self, seen: Seen, settle_frames: int) -> bool:
        """Tell whether a detection contradicted what was believed for so long that it is right."""
        return self.contested >= settle_frames and seen.of == (0.0, 1.0) and self._is_as_contested(seen)

    def is_as_usual(self, length: float) -> bool:
        """Tell whether a length is what it was in most frames that showed all of the object."""
        if self.usual_px is None:
            known = [total for total in self.totals.tolist() if not math.isnan(total)]
            self.usual_px = statistics.median(known) if len(known) >= TRUSTED else math.nan
        return abs(length - self.usual_px) <= self.tolerance_px

    def _is_as_contested(self, seen: Seen) -> bool:
        return abs(seen.total - self.contested_px) < 0.01 * seen.total + 0.75 * self._width_or_0

    def hit(self, min_hits: int) -> None:
        """Count a frame in which something of the object was seen."""
        self.hits += 1
        self.misses = self.shadowed = 0
        self.since_s = 0.0
        if self.state is not TrackState.TENTATIVE or self.hits >= min_hits:
            self.state = TrackState.CONFIRMED
        self.ends[self.hits % REMEMBERED] = self.points[:: SAMPLES - 1]
        self.lengths[self.hits % REMEMBERED] = self.length

    def miss(self, dt: float) -> None:
        """Go on unseen."""
        if not self.misses:  # it goes on as a whole: the shape is kept
            self.velocity = np.broadcast_to(self.velocity.mean(axis=0), self.velocity.shape)
        self._move(dt)
        self.velocity = self.velocity * math.exp(-dt / _MOTION_S)
        self.state = TrackState.HIDDEN
        self.misses += 1
        self.since_s += dt
        self.shape_s += dt
        self.unseen_s = self.unseen_s + dt
        self.hidden = self.inferred = ((0.0, 1.0),)
        self.contested = self.joined = 0
        self.sight = self.detection = None
        self.confidence = self._confidence()

    def _move(self, dt: float) -> None:
        if self.velocity.any():
            ahead = horizon(dt)
            self.curve = moved(self.curve, self.velocity, ahead)
            self.points = self.points + ahead * self.velocity

    def remap(self, u: FloatArray) -> None:
        """Let the samples be those that lie at these parameters (`SAMPLES`,); what is outside of 0..1 is new."""
        new = (u < 0.0) | (u > 1.0)
        at = np.clip(u, 0.0, 1.0)
        self.points = lookup(self.points, at)
        self.velocity = lookup(self.velocity, at)
        self.shape = lookup(self.shape, at)
        self.trust = np.where(new, 0.0, np.interp(at, U, self.trust))
        self.unseen_s = np.where(new, 0.0, np.interp(at, U, self.unseen_s))

    def published(self) -> Track:
        """Return the track as it stands."""
        width = self.width if self.width == self.width else None
        sight = self.sight or Sight(self.curve, self.curve_3d, self.inferred, self.confidence)
        return Track._unchecked(
            self.id,
            self.state,
            sight.curve,
            sight.curve_3d,
            self.hits,
            self.misses,
            self.detection,
            tuple((float(low), float(high)) for low, high in sight.inferred),
            sight.confidence,
            width,
        )

    def _confidence(self) -> float:
        return float(np.exp2(self.unseen_s / -_HALF_LIFE_S).mean())


def horizon(dt: float) -> float:
    """Return the part of a time, in seconds, for which a motion is thought to go on."""
    return min(dt, _MOTION_S)


def blend(memory: Memory, points: FloatArray, dt: float) -> FloatArray:
    """Return the velocity after samples came to lie at `points`, most of it that of the last step."""
    return blended(memory.velocity, points - memory.points, dt)


def blended(velocity: FloatArray, step: FloatArray, dt: float) -> FloatArray:
    """Return velocities (..., 2) after a step, px, of a time in seconds."""
    result: FloatArray = (1.0 - _VELOCITY_GAIN) * velocity + (_VELOCITY_GAIN / dt) * step
    return result


def inside(intervals: tuple[tuple[float, float], ...]) -> np.ndarray:
    """Return which samples lie in intervals of ``u``, shape (SAMPLES,)."""
    result = np.zeros(SAMPLES, dtype=np.bool_)
    for low, high in intervals:
        result |= (low <= U) & (high >= U)
    return result


def lookup(samples: FloatArray, u: FloatArray) -> FloatArray:
    """Return samples (SAMPLES, d) at other parameters (n,), as (n, d)."""
    return np.stack([np.interp(u, U, column) for column in samples.T], axis=1)


def moved(curve: BSplineCurve, velocity: FloatArray, seconds: float) -> BSplineCurve:
    """Return a curve moved by the velocities (SAMPLES, 2) of its samples: each control point where it weighs most."""
    control = move_control_points(curve.knots, curve.control_points, velocity, seconds, curve.degree, curve.closed)
    return BSplineCurve._unchecked(curve.knots, control, curve.degree, curve.closed)
