"""State of one track between frames."""

from __future__ import annotations

import math
from copy import copy
from dataclasses import dataclass, field, replace

import numpy as np

from dloftbs.camera import PinholeCamera
from dloftbs.data.curve import BSplineCurve
from dloftbs.data.curve_samples import U, sample_curve
from dloftbs.data.detection import Detection
from dloftbs.data.tracks import EndKind, TrackState
from dloftbs.evidence import Appearance
from dloftbs.support.arrays import FloatArray
from dloftbs.tracking.belief import MISSED_NATS, Belief
from dloftbs.tracking.frame_view import View
from dloftbs.tracking.kernels.interpolation import interpolate
from dloftbs.tracking.length_record import LengthRecord
from dloftbs.tracking.observation import Observation
from dloftbs.tracking.partial_match import WHOLE, VisibleCurve
from dloftbs.tracking.separation import Separation
from dloftbs.tracking.sight import Sight, Spans
from dloftbs.tracking.stream_clock import Step
from dloftbs.tracking.track_motion import JUMP_SHARE, Motion, extrapolated_time, move_curve

_LENGTH_SHARE, _LENGTH_WIDTHS = 0.004, 0.3
"""Tolerance of a length: its share of the length, and in widths.

Source: by hand.
"""
_POSITION_SHARE, _POSITION_WIDTHS = 0.015, 1.5
"""Tolerance of a part's position along the object: its share of the length, and in widths.

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
    points : numpy.ndarray, shape (SAMPLES, 2)
        Samples of the curve, px.
    shape : numpy.ndarray, shape (SAMPLES, 2)
        The samples when the whole object was last seen.
    predicted : numpy.ndarray, shape (SAMPLES, 2)
        The samples where this frame is expected to show them.
    frameless_s : float
        Seconds before this frame in which frames were due, and none came.
    width : float
        px; NaN while it is unknown.
    lengths : LengthRecord
    sight : Sight
    motion : Motion
    separation : Separation
    apart : frozenset of int
        Ids of the tracks that were found to be other objects than this one when the two were one.
    appearance : Appearance or None
        As last seen as a whole.
    state : TrackState
    hits, misses : int
        Number of frames in which the object was seen, and since it was last seen.
    missing_s : float
        Seconds since anything of the object was last seen.
    visible : VisibleCurve or None
        Curve published instead of the track's own while only a part of it is visible.
    detection : Detection or None
        The last frame's, in the track's direction.
    shape_3d : BSplineCurve or None
        The curve in space when the whole object was last seen, or was as long as it is: it says what is hidden.
    camera : PinholeCamera or None
        The last one that `curve_3d` is in the frame of.
    belief : Belief
        In its shape, by the frames' own readings for it and against it.
    existence : Belief
        In there being such an object, by the frames that showed it.
    """

    id: int
    curve: BSplineCurve
    curve_3d: BSplineCurve | None
    points: FloatArray
    shape: FloatArray
    predicted: FloatArray
    width: float
    lengths: LengthRecord
    sight: Sight
    frameless_s: float = 0.0
    motion: Motion = field(default_factory=Motion)
    separation: Separation = field(default_factory=Separation)
    apart: frozenset[int] = frozenset()
    appearance: Appearance | None = None
    state: TrackState = TrackState.TENTATIVE
    hits: int = 0
    misses: int = 0
    missing_s: float = 0.0
    visible: VisibleCurve | None = None
    detection: Detection | None = None
    shape_3d: BSplineCurve | None = None
    camera: PinholeCamera | None = None
    belief: Belief = field(default_factory=Belief)
    existence: Belief = field(default_factory=Belief)

    @classmethod
    def from_observation(cls, track_id: int, observation: Observation) -> TrackModel:
        """Start a track; the frame that starts it is yet to be counted."""
        return cls(
            track_id,
            observation.curve,
            observation.curve_3d,
            observation.points,
            observation.points,
            observation.points,
            observation.width,
            LengthRecord(observation.length, px_per_m=observation.px_per_m),
            Sight.of_whole(observation.gaps),
            appearance=observation.appearance,
            detection=observation.detection,
            shape_3d=observation.curve_3d,
        )

    @property
    def length(self) -> float:
        """Filtered length, px."""
        return self.lengths.px

    @property
    def width_or_0(self) -> float:
        """Width, px; 0 while it is unknown."""
        return 0.0 if math.isnan(self.width) else self.width

    @property
    def length_widths(self) -> float:
        """Length, widths; infinite while the width is unknown."""
        return self.length / self.width if self.width > 0.0 else math.inf

    @property
    def length_tolerance_px(self) -> float:
        """Largest difference from the usual length at which nothing counts as hidden or new."""
        return _LENGTH_SHARE * self.length + _LENGTH_WIDTHS * self.width_or_0

    @property
    def position_tolerance_px(self) -> float:
        """Uncertainty of a part's position along the object."""
        return _POSITION_SHARE * self.length + _POSITION_WIDTHS * self.width_or_0

    def usual_length(self, observation: Observation) -> float:
        """Return the length, px, in most full views, at the scale of an observation where it is known in metres."""
        usual, in_view = self.lengths.usual_px, self.length_in_view(observation)
        if not math.isnan(in_view):
            return in_view
        return self.length if math.isnan(usual) else usual

    def predict(self, step: Step) -> None:
        """Predict the samples in the next frame."""
        self.predicted = self.points + extrapolated_time(step.seconds) * self.motion.velocity
        self.frameless_s = step.frameless_s

    def length_in_view(self, observation: Observation) -> float:
        """Return the length, px, of the object at the scale of an observation, by metres; NaN if they are unknown."""
        return self.lengths.metres * observation.px_per_m

    def length_as_seen(self, observation: Observation) -> float:
        """Return the same; the usual length, px, where metres are unknown."""
        length = self.length_in_view(observation)
        return self.length if math.isnan(length) else length

    def is_short(self, observation: Observation) -> bool:
        """Return True if an observation is shorter than the object: in space, if it is known there."""
        return self.length_as_seen(observation) - observation.length > self.length_tolerance_px

    def update_whole(self, observation: Observation) -> None:
        """Adopt an observation of the whole object, in the track's direction."""
        self.curve, self.curve_3d, self.detection = observation.curve, observation.curve_3d, observation.detection
        self.points = self.shape = observation.points
        self.shape_3d = observation.curve_3d
        self.belief.add(observation.log_odds)
        if observation.contiguous:
            self.lengths.rescale(observation.px_per_m, observation.width)
        self.lengths.px = observation.length
        self.width = self.width if math.isnan(observation.width) else observation.width
        self.appearance = self.appearance if observation.appearance is None else observation.appearance
        if observation.contiguous:
            self.lengths.record_full(observation.length, observation.width, self.position_tolerance_px)
        self.sight.see_whole(observation.gaps, was_unseen=self.misses > 0)
        self.visible = None

    def update_partly(
        self, curve: BSplineCurve, points: FloatArray, hidden: Spans, inferred: Spans, view: View, dt: float
    ) -> None:
        """Adopt a reconstructed curve, some spans of which are inferred: hidden ones, or bridged by the detector."""
        is_known = not self.misses and bool(np.abs(points - self.points).max() <= JUMP_SHARE * self.length)
        self.motion.step(self.points, points, dt, is_known=is_known)
        self.curve, self.points = curve, points
        told = view.look(points, self.width, self.shape_3d) if hidden else None
        self.sight.see_part(hidden, inferred, told, self.length_widths, dt)
        self.visible = None

    def update_unseen(self, view: View, dt: float) -> None:
        """Extrapolate by a frame in which nothing of the object was seen."""
        if not self.misses:  # from now on it moves rigidly: the shape is kept
            self.motion.make_rigid()
        duration, motion = extrapolated_time(dt), self.motion
        if motion.velocity.any():
            self.curve = move_curve(self.curve, motion.velocity, duration)
            self.points = self.points + duration * motion.velocity
        self._move_in_space(duration)
        motion.decay(dt)
        # Of one that was seen too little, nothing is said to be hidden.
        told = None if self.state is TrackState.TENTATIVE else view.look(self.points, self.width, self.shape_3d)
        self.sight.see_nothing(told, self.length_widths, dt)
        self.state = self.state if self.state is TrackState.TENTATIVE else TrackState.HIDDEN
        self.existence.add(MISSED_NATS)
        self.lengths.record(math.nan, math.nan, math.nan)
        self.misses += 1
        self.missing_s += dt
        self.visible = self.detection = None

    def _move_in_space(self, seconds: float) -> None:
        """Move the curve in space rigidly, by its velocity; where that is unknown, along with the one in the image."""
        if self.curve_3d is None:
            return
        velocity = self.motion.velocity_3d
        if velocity is None and self.camera is not None:
            near = float(np.median(sample_curve(self.curve_3d)[0][:, 2]))
            lateral = near * self.motion.velocity[0] / (self.camera.fx, self.camera.fy)
            velocity = np.array([[*lateral, 0.0]])
        if velocity is not None and velocity.any():
            before, shift = self.curve_3d, seconds * velocity[0]
            self.curve_3d = before.transformed(np.eye(3), shift)
            if self.shape_3d is before:
                self.shape_3d = self.curve_3d
            elif self.shape_3d is not None:
                self.shape_3d = self.shape_3d.transformed(np.eye(3), shift)

    def count_hit(self, log_odds: float) -> None:
        """Count a frame in which a part of the object was seen, with its log-odds, nats, that there is one."""
        self.hits += 1
        self.misses = 0
        self.missing_s = 0.0
        self.existence.add(log_odds)
        if self.state is not TrackState.TENTATIVE or self.existence.is_confirmed:
            self.state = TrackState.CONFIRMED

    def measure_in_space(self, dt: float) -> None:
        """Measure the motion in space in a frame that showed a part of the object, with the frame's camera."""
        if self.detection is not None and self.detection.camera is not None:
            self.camera = self.detection.camera
        if self.curve_3d is not None or self.motion.points_3d is not None:
            self.motion.measure_in_space(self.curve_3d, self.lengths.metres, dt)

    def record(self, kinds: tuple[EndKind, EndKind] | None) -> None:
        """Record the length and the ends of the object in the last frame: those that nothing cuts there."""
        first, last = (False, False) if kinds is None else (kinds[0] is EndKind.FREE, kinds[1] is EndKind.FREE)
        self.lengths.record(self.points[0] if first else np.nan, self.points[-1] if last else np.nan, self.length)
        if first and last and self.lengths.full_px and self.visible is None and not self.sight.inferred:
            self.separation.see_whole(self.lengths.full_px[-1])

    def copied(self) -> TrackModel:
        """Return a copy that goes on by itself."""
        parts = {name: copy(getattr(self, name)) for name in ("sight", "motion", "separation", "belief", "existence")}
        return replace(self, lengths=self.lengths.copied(), **parts)

    def split_off(self, track_id: int) -> TrackModel:
        """Return the same track with another id, from now on another object."""
        self.separation.forget()
        self.lengths.forget_full()
        other = self.copied()
        other.id = track_id
        self.apart, other.apart = self.apart | {track_id}, self.apart | {self.id}
        return other

    def cut_to(self, scope: tuple[float, float]) -> None:
        """Give up what lies beyond a span of ``u``."""
        if scope != WHOLE:
            self.resample(scope)
            self.lengths.cut(scope[1] - scope[0])

    def resample(self, span: tuple[float, float]) -> None:
        """Make a span the track's ``u`` of 0 to 1; what lies outside of the former is new."""
        u = span[0] + U * (span[1] - span[0])
        self.points, self.shape = interpolate(self.points, u), interpolate(self.shape, u)
        self.motion.resample(u)
        self.sight.resample(u)
