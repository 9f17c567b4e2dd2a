"""State of one track between frames."""

from __future__ import annotations

import math
import statistics
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from dloftbs._arrays import FloatArray, frozen
from dloftbs.curve import BSplineCurve
from dloftbs.detection import Detection
from dloftbs.evidence import HIDDEN, IN_SIGHT
from dloftbs.observation import SAMPLES, Observation, U, sample_curve
from dloftbs.tracking.frame_view import View
from dloftbs.tracking.kernels.curve_motion import move_control_points
from dloftbs.tracking.partial_match import WHOLE, VisibleCurve
from dloftbs.tracks import EndKind, Track, TrackState

MIN_SEEN_FRAMES = 3
"""Number of frames in which a span must have been seen to be assumed hidden, not absent, once it is missing.

Source: by hand; one or two frames may be a detector's error.
"""

HISTORY_FRAMES = 32
"""Number of frames for which the ends and the lengths are recorded.

Source: bounds memory; a second at 30 per second.
"""

JUMP_SHARE = 0.1
"""Share of the length: a sample that moved farther, or a length that changed by more, says nothing about the motion.

Source: by hand.
"""

_MAX_SEEN_FRAMES = 8.0
"""Bound of the number of frames in which a span was seen, so that old spans can be given up.

Source: by hand.
"""

WIDENING_PER_S = 4.0
"""Growth of the gate and of the reach of an unseen track, multiples per second.

Source: by hand; it doubles in a quarter of a second.
"""

MAX_WIDENING = 3.0
"""Largest multiple to which they grow.

Source: by hand.
"""

_LENGTH_GAIN = 0.05
"""Share of a small change of length that is taken over per frame.

Source: by hand; a stretch that disappears little by little would never be missed at a larger one.
"""

_VELOCITY_GAIN = 0.8
"""Share of the last step in a velocity.

Source: by hand; little smoothing, as lag costs more than noise.
"""

_MOTION_S = 0.1
"""Time for which a motion goes on by itself, s.

Source: by hand; three frames at 30 per second.
"""

_HALF_LIFE_S = 0.5
"""Half-life of the confidence in a stretch that is not seen, s.

Source: by hand.
"""


@dataclass(slots=True, eq=False)
class TrackModel:
    """A track, with everything needed to follow it; samples are `SAMPLES` points at even ``u``.

    Parameters
    ----------
    id : int
    curve : BSplineCurve
        The whole object as last reconstructed, before any smoothing.
    curve_3d : BSplineCurve or None
    points, velocity : numpy.ndarray, shape (SAMPLES, 2)
        Samples of the curve, px, and their velocities, px/s.
    velocity_is_known : bool
        False in an object's first frame, and where it jumped or is another one: the velocity is 0 then.
    points_3d, velocity_3d : numpy.ndarray or None, shape (SAMPLES, 3)
        Samples of the curve in space in the last frame, m, and their velocities, m/s, as far as they are known.
    length, width : float
        px; the length is filtered, the width NaN while it is unknown.
    seen_frames : numpy.ndarray, shape (SAMPLES,)
        Number of frames in which each sample was seen, bounded.
    unseen_s : numpy.ndarray, shape (SAMPLES,)
        Seconds since each sample was last seen.
    colour : numpy.ndarray, shape (3,), or None
        BGR, as last seen.
    state : TrackState
    hits, misses : int
        Number of frames in which the object was seen, and since it was last seen.
    missing_s : float
        Seconds since anything of the object was last seen.
    hidden : tuple of (float, float)
        The intervals of ``u`` that the last frame did not show.
    in_sight : numpy.ndarray, shape (SAMPLES,), bool
        The samples that the last frame did not show, although nothing hides their place.
    is_covered : bool
        True if the last frame showed nothing of the object, and something that hides most of its place.
    shape : numpy.ndarray, shape (SAMPLES, 2)
        The samples when the whole object was last seen.
    conflict_length_px, conflict_visible_px : float
        Length of the detection that seems to be the whole object but contradicts the model, and of all detections that
        showed parts of the object then.
    conflict_frames : int
        Number of frames with that contradiction, less those without it.
    merged_frames : int
        Number of consecutive frames in which the track was part of a detection that may be one object.
    known_separate : bool
        True if the track is a part of a detection, and known to be another object than the rest of it.
    recent_ends, recent_lengths : numpy.ndarray, shapes (HISTORY_FRAMES, 2, 2) and (HISTORY_FRAMES,)
        Positions of the two ends, and the length, in the last frames, px; ring buffers, NaN where empty.
    full_lengths : numpy.ndarray, shape (HISTORY_FRAMES,)
        Length in the last frames that showed the whole object without long gaps, px; a ring buffer, NaN where empty.
    usual_length_px : float or None
        Median of these, NaN if they are too few; None until it is computed.
    visible : VisibleCurve or None
        Curve published instead of the track's own while only a part of it is visible.
    detection : Detection or None
        The last frame's, in the track's direction.
    inferred : tuple of (float, float)
        The intervals of ``u`` that are published as inferred.
    confidence : float
        In 0..1.
    """

    id: int
    curve: BSplineCurve
    curve_3d: BSplineCurve | None
    points: FloatArray
    length: float
    width: float
    velocity: FloatArray = field(default_factory=lambda: np.zeros((SAMPLES, 2)))
    velocity_is_known: bool = False
    points_3d: FloatArray | None = None
    velocity_3d: FloatArray | None = None
    seen_frames: FloatArray = field(default_factory=lambda: np.ones(SAMPLES))
    unseen_s: FloatArray = field(default_factory=lambda: np.zeros(SAMPLES))
    colour: FloatArray | None = None
    state: TrackState = TrackState.TENTATIVE
    hits: int = 0
    misses: int = 0
    missing_s: float = 0.0
    hidden: tuple[tuple[float, float], ...] = ()
    in_sight: npt.NDArray[np.bool_] = field(default_factory=lambda: np.zeros(SAMPLES, dtype=np.bool_))
    is_covered: bool = False
    shape: FloatArray = field(default_factory=lambda: np.zeros((SAMPLES, 2)))
    conflict_length_px: float = 0.0
    conflict_visible_px: float = 0.0
    conflict_frames: int = 0
    merged_frames: int = 0
    known_separate: bool = False
    recent_ends: FloatArray = field(default_factory=lambda: np.full((HISTORY_FRAMES, 2, 2), np.nan))
    recent_lengths: FloatArray = field(default_factory=lambda: np.full(HISTORY_FRAMES, np.nan))
    full_lengths: FloatArray = field(default_factory=lambda: np.full(HISTORY_FRAMES, np.nan))
    usual_length_px: float | None = None
    visible: VisibleCurve | None = None
    detection: Detection | None = None
    inferred: tuple[tuple[float, float], ...] = ()
    confidence: float = 1.0

    @classmethod
    def from_observation(cls, track_id: int, observation: Observation) -> TrackModel:
        """Start a track; the frame that starts it is yet to be counted."""
        model = cls(
            track_id,
            observation.curve,
            observation.curve_3d,
            observation.points,
            observation.length,
            observation.width,
        )
        model.detection, model.colour = observation.detection, observation.colour
        model.inferred = observation.gaps
        model.seen_frames = (~samples_within(observation.gaps)).astype(np.float64)
        model.shape = observation.points
        return model

    @property
    def length_tolerance_px(self) -> float:
        """Largest difference from the usual length at which nothing counts as hidden or new."""
        return 0.004 * self.length + 0.3 * self._width_or_0

    @property
    def position_tolerance_px(self) -> float:
        """Uncertainty of a part's position along the object."""
        return 0.015 * self.length + 1.5 * self._width_or_0

    @property
    def unseen_spans(self) -> tuple[tuple[float, float], ...]:
        """The intervals of ``u``, from one seen sample to another, that no frame has shown, or too few to be kept."""
        if self.seen_frames[self.seen_frames.argmin()] > 0.0:  # faster than any()
            return ()
        unseen = self.seen_frames <= 0.0
        edges = np.flatnonzero(np.diff(np.concatenate(([False], unseen, [False])).astype(np.int8)))
        return tuple(
            (float(U[max(low - 1, 0)]), float(U[min(high, SAMPLES - 1)]))
            for low, high in zip(edges[::2], edges[1::2], strict=True)
        )

    @property
    def _width_or_0(self) -> float:
        return 0.0 if math.isnan(self.width) else self.width

    def update_whole(self, observation: Observation, points: FloatArray, velocity: FloatArray | None) -> None:
        """Adopt an observation of the whole object, in the track's direction; None is an unknown velocity."""
        self.curve, self.curve_3d, self.detection = observation.curve, observation.curve_3d, observation.detection
        self.points, self.velocity_is_known = points, velocity is not None
        self.velocity = np.zeros((SAMPLES, 2)) if velocity is None else velocity
        self.shape = points
        # Small changes are filtered, or an end that disappears gradually would never count as missing.
        change = observation.length - self.length
        if self.hits < MIN_SEEN_FRAMES or abs(change) > self.length_tolerance_px:
            self.length = observation.length
        else:
            self.length += _LENGTH_GAIN * change
        if not math.isnan(observation.width):
            self.width = observation.width
        self.colour = self.colour if observation.colour is None else observation.colour
        if observation.contiguous:
            self.full_lengths[self.hits % HISTORY_FRAMES] = observation.length
            self.usual_length_px = None
        self.inferred, self.confidence = observation.gaps, 1.0
        self.seen_frames = np.minimum(self.seen_frames + ~samples_within(observation.gaps), _MAX_SEEN_FRAMES)
        if self.hidden or self.misses:
            self.unseen_s, self.in_sight = np.zeros(SAMPLES), np.zeros(SAMPLES, dtype=np.bool_)
            self.hidden, self.is_covered = (), False
        self.conflict_frames = self.merged_frames = 0
        self.visible = None

    def update_partly(
        self,
        curve: BSplineCurve,
        points: FloatArray,
        hidden: tuple[tuple[float, float], ...],
        inferred: tuple[tuple[float, float], ...],
        view: View,
        dt: float,
    ) -> None:
        """Adopt a reconstructed curve, some spans of which are inferred: hidden ones, or bridged by the detector."""
        is_hidden = samples_within(hidden)
        told = view.look(points, self.width, self.curve_3d) if hidden else None
        self.in_sight = np.zeros(SAMPLES, dtype=np.bool_) if told is None else is_hidden & (told == IN_SIGHT)
        self.is_covered = False
        self.velocity = filter_velocity(self.velocity, points - self.points, dt)
        jumped = np.abs(points - self.points).max(axis=1) > JUMP_SHARE * self.length
        self.velocity_is_known = not (self.misses or jumped.any())
        if not self.velocity_is_known:
            self.velocity[:] = 0.0
        self.curve, self.points = curve, points
        self.hidden, self.inferred = hidden, inferred
        self.unseen_s = np.where(is_hidden, self.unseen_s + dt, 0.0)
        # Spans seen up to the bound are kept unless their place is in plain sight; others are forgotten within as many.
        kept = (self.seen_frames >= _MAX_SEEN_FRAMES) & ~self.in_sight
        fading = np.where(kept, self.seen_frames, self.seen_frames - 1.0)
        seen = np.minimum(self.seen_frames + ~samples_within(inferred), _MAX_SEEN_FRAMES)
        self.seen_frames = np.where(is_hidden, fading, seen)
        self.confidence = self._compute_confidence()
        self.visible = None

    def update_conflict(self, observation: Observation, visible_px: float) -> None:
        """Count a frame in which an observation, part of the object or more than it, contradicts the model.

        It counts only if the total visible length of the object stays the same: an occluder may move.
        """
        same = (
            self._matches_conflict(observation)
            and abs(visible_px - self.conflict_visible_px) < 0.01 * visible_px + 0.75 * self._width_or_0
        )
        if observation.contiguous and (same or self.conflict_frames == 0):
            if self.conflict_frames == 0:
                self.conflict_length_px, self.conflict_visible_px = observation.object_length, visible_px
            # Hardly another length: a wrong end was probably adopted before, and is corrected in half the time.
            small = abs(observation.object_length - self.length) < self.position_tolerance_px
            self.conflict_frames += 2 if small else 1
        else:
            self.conflict_frames = max(self.conflict_frames - 1, 0)

    def is_overridden_by(self, observation: Observation, override_frames: int) -> bool:
        """Return True if an observation has contradicted the model for long enough to replace it."""
        long_enough = self.conflict_frames >= override_frames
        return long_enough and observation.curve_span == WHOLE and self._matches_conflict(observation)

    def has_usual_length(self, length: float) -> bool:
        """Return True if a length agrees with most frames that showed the whole object."""
        if self.usual_length_px is None:
            known = [total for total in self.full_lengths.tolist() if not math.isnan(total)]
            self.usual_length_px = statistics.median(known) if len(known) >= MIN_SEEN_FRAMES else math.nan
        return abs(length - self.usual_length_px) <= self.length_tolerance_px

    def _matches_conflict(self, observation: Observation) -> bool:
        length = observation.object_length
        return abs(length - self.conflict_length_px) < 0.01 * length + 0.75 * self._width_or_0

    def count_hit(self, min_hits: int) -> None:
        """Count a frame in which a part of the object was seen, and record its ends and its length."""
        self.hits += 1
        self.misses = 0
        self.missing_s = 0.0
        if self.state is not TrackState.TENTATIVE or self.hits >= min_hits:
            self.state = TrackState.CONFIRMED
        self.recent_ends[self.hits % HISTORY_FRAMES] = self.points[:: SAMPLES - 1]
        self.recent_lengths[self.hits % HISTORY_FRAMES] = self.length

    def advance_unseen(self, view: View, dt: float) -> None:
        """Extrapolate by a frame in which nothing of the object was seen."""
        if not self.misses:  # from now on it moves rigidly: the shape is kept
            self.velocity = np.broadcast_to(self.velocity.mean(axis=0), self.velocity.shape)
            if self.velocity_3d is not None:
                self.velocity_3d = np.broadcast_to(self.velocity_3d.mean(axis=0), self.velocity_3d.shape)
        self._extrapolate(dt)
        self.velocity = self.velocity * math.exp(-dt / _MOTION_S)
        told = view.look(self.points, self.width, self.curve_3d)
        if told is not None:
            self.in_sight = told == IN_SIGHT
            self.is_covered = int(np.count_nonzero(told == HIDDEN)) > SAMPLES // 2
        else:
            self.in_sight, self.is_covered = np.zeros(SAMPLES, dtype=np.bool_), False
        self.state = TrackState.HIDDEN
        self.misses += 1
        self.missing_s += dt
        self.unseen_s = self.unseen_s + dt
        self.hidden = self.inferred = (WHOLE,)
        self.conflict_frames = self.merged_frames = 0
        self.visible = self.detection = self.points_3d = None
        self.confidence = self._compute_confidence()

    def measure_velocity_in_space(self, dt: float) -> None:
        """Take the step of the curve in space since the last frame into its velocity."""
        before, self.points_3d = self.points_3d, None if self.curve_3d is None else sample_curve(self.curve_3d)[0]
        if before is None or self.points_3d is None or not self.velocity_is_known:
            self.velocity_3d = None
        elif self.velocity_3d is None:
            self.velocity_3d = (self.points_3d - before) / dt
        else:
            self.velocity_3d = filter_velocity(self.velocity_3d, self.points_3d - before, dt)

    def _extrapolate(self, dt: float) -> None:
        if self.velocity.any():
            duration = extrapolated_time(dt)
            self.curve = move_curve(self.curve, self.velocity, duration)
            self.points = self.points + duration * self.velocity
        if self.velocity_3d is not None and self.curve_3d is not None:
            self.curve_3d = self.curve_3d.transformed(np.eye(3), extrapolated_time(dt) * self.velocity_3d[0])
            self.velocity_3d = self.velocity_3d * math.exp(-dt / _MOTION_S)

    def cut_to(self, scope: tuple[float, float]) -> None:
        """Give up what lies beyond a span of ``u``."""
        if scope != WHOLE:
            self.resample(scope)
            self.length *= scope[1] - scope[0]

    def resample(self, span: tuple[float, float]) -> None:
        """Make a span the track's ``u`` of 0 to 1; what lies outside of the former is new."""
        u = span[0] + U * (span[1] - span[0])
        new = (u < 0.0) | (u > 1.0)
        inner = np.clip(u, 0.0, 1.0)
        self.points = interpolate_samples(self.points, inner)
        self.velocity = interpolate_samples(self.velocity, inner)
        self.shape = interpolate_samples(self.shape, inner)
        self.seen_frames = np.where(new, 0.0, np.interp(inner, U, self.seen_frames))
        self.unseen_s = np.where(new, 0.0, np.interp(inner, U, self.unseen_s))

    def to_track(self, view: View) -> Track:
        """Return the track as published."""
        width = None if math.isnan(self.width) else self.width
        visible = self.visible or VisibleCurve(self.curve, self.curve_3d, self.inferred, self.confidence)
        return Track._unchecked(
            self.id,
            self.state,
            visible.curve,
            visible.curve_3d,
            self.hits,
            self.misses,
            self.detection,
            tuple((float(low), float(high)) for low, high in visible.inferred),
            visible.confidence,
            width,
            self._ends(visible, view),
            _between(self.velocity, visible.track_span) if self.velocity_is_known else None,
            None if self.velocity_3d is None else _between(self.velocity_3d, visible.track_span),
        )

    def _ends(self, visible: VisibleCurve, view: View) -> tuple[EndKind, EndKind] | None:
        if visible.curve.closed:
            return None
        points = self.points if visible.curve is self.curve else visible.curve(U[[0, 1, -2, -1]])
        hidden = view.hidden_beyond(points, self.width, visible.curve_3d)
        first, last = (
            EndKind.BORDER if view.is_at_border(point, self.width) else EndKind.HIDDEN if under else EndKind.FREE
            for point, under in zip(points[[0, -1]], hidden, strict=True)
        )
        if visible.inferred:
            first = EndKind.HIDDEN if visible.inferred[0][0] <= 0.0 else first
            last = EndKind.HIDDEN if visible.inferred[-1][1] >= 1.0 else last
        return first, last

    def _compute_confidence(self) -> float:
        return float(np.exp2(self.unseen_s / -_HALF_LIFE_S).mean())


def extrapolated_time(dt: float) -> float:
    """Return the part of a time, in seconds, for which a motion is extrapolated."""
    return min(dt, _MOTION_S)


def filter_velocity(velocity: FloatArray, step: FloatArray, dt: float) -> FloatArray:
    """Return velocities (..., 2), px/s, updated by a step, px, of `dt` seconds; the step has most of the weight."""
    result: FloatArray = (1.0 - _VELOCITY_GAIN) * velocity + (_VELOCITY_GAIN / dt) * step
    return result


def samples_within(spans: tuple[tuple[float, float], ...]) -> np.ndarray:
    """Return a mask (SAMPLES,) of the samples that lie in spans of ``u``."""
    result = np.zeros(SAMPLES, dtype=np.bool_)
    for low, high in spans:
        result |= (low <= U) & (high >= U)
    return result


def interpolate_samples(samples: FloatArray, u: FloatArray) -> FloatArray:
    """Interpolate samples (SAMPLES, d) at parameters (n,), as (n, d)."""
    return np.stack([np.interp(u, U, column) for column in samples.T], axis=1)


def _between(samples: FloatArray, span: tuple[float, float]) -> FloatArray:
    """Return samples (SAMPLES, d) of a part of a track, read-only."""
    if span == WHOLE:
        return frozen(samples.view())
    low, high = span
    return frozen(interpolate_samples(samples, np.clip(low + U * (high - low), 0.0, 1.0)))


def move_curve(curve: BSplineCurve, velocity: FloatArray, seconds: float) -> BSplineCurve:
    """Return a curve moved by its samples' velocities (SAMPLES, 2): each control point at its Greville parameter."""
    control = move_control_points(curve.knots, curve.control_points, velocity, seconds, curve.degree, curve.closed)
    return BSplineCurve._unchecked(curve.knots, control, curve.degree, curve.closed)
