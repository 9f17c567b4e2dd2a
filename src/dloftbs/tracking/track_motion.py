"""Motion of a track: the velocities of its samples in the image and in space."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from dloftbs.data.curve import BSplineCurve
from dloftbs.data.curve_samples import SAMPLES, sample_curve
from dloftbs.support.arrays import FloatArray
from dloftbs.tracking.kernels.interpolation import filter_velocity, interpolate, move_control_points

JUMP_SHARE = 0.1
"""Share of the length: a sample that moved farther, or a length that changed by more, says nothing about the motion.

In space it is the depth that jumps, where it goes over to another thing.

Source: by hand.
"""

_VELOCITY_GAIN = 0.8
"""Share of the last step in a velocity.

Source: by hand; little smoothing, as lag costs more than noise.
"""

_MIN_STEP_S = 2e-4
"""Time between two frames below which their difference shows errors, and no motion, s.

Source: by definition; a fifth of a frame at a thousand a second. Stamps come in bursts.
"""

_MOTION_S = 0.1
"""Time for which a motion goes on by itself, s.

Source: by hand; three frames at 30 per second.
"""


@dataclass(slots=True, eq=False)
class Motion:
    """Velocities of a track's samples.

    Parameters
    ----------
    velocity : numpy.ndarray, shape (SAMPLES, 2)
        px/s.
    is_known : bool
        False in an object's first frame, and where it jumped or is another one: the velocity is 0 then.
    acceleration : numpy.ndarray or None, shape (SAMPLES, 2)
        px/s²; None where fewer than two steps in a row are known.
    age_s : float
        Time from the moment that the velocity is of to the frame, s.
    velocity_3d, points_3d : numpy.ndarray or None, shape (SAMPLES, 3)
        Velocities in space, m/s, and the samples of the curve there in the last frame, m, as far as they are known.
    """

    velocity: FloatArray = field(default_factory=lambda: np.zeros((SAMPLES, 2)))
    is_known: bool = False
    acceleration: FloatArray | None = None
    age_s: float = 0.0
    velocity_3d: FloatArray | None = None
    points_3d: FloatArray | None = None

    def step(self, before: FloatArray, now: FloatArray, dt: float, *, is_known: bool) -> None:
        """Take a step of the samples, px, into their velocities, if it is known that it shows them."""
        was_known, self.is_known = self.is_known, is_known
        if not is_known:
            self.velocity, self.acceleration = np.zeros((SAMPLES, 2)), None
        elif dt >= _MIN_STEP_S:
            former = self.velocity
            self.velocity = filter_velocity(former, before, now, dt, _VELOCITY_GAIN)
            self.acceleration = (self.velocity - former) / dt if was_known else None
            # Half of the last step, and the lag of the filter.
            self.age_s = (0.5 + (1.0 - _VELOCITY_GAIN) / _VELOCITY_GAIN) * dt

    def measure_in_space(self, curve_3d: BSplineCurve | None, metres: float, dt: float) -> None:
        """Take the step of the curve in space, so many metres long, since the last frame into its velocity."""
        before, self.points_3d = self.points_3d, None if curve_3d is None else sample_curve(curve_3d)[0]
        if before is None or self.points_3d is None or not self.is_known:
            self.velocity_3d = None
            return
        step = self.points_3d - before
        if np.abs(step[:, 2]).max() > JUMP_SHARE * metres:
            self.velocity_3d = None
        elif dt < _MIN_STEP_S:
            return
        elif self.velocity_3d is None:
            self.velocity_3d = step / dt
        else:
            self.velocity_3d = filter_velocity(self.velocity_3d, before, self.points_3d, dt, _VELOCITY_GAIN)

    def make_rigid(self) -> None:
        """Let all samples move alike: the shape is kept."""
        self.velocity, self.acceleration = np.broadcast_to(self.velocity.mean(axis=0), self.velocity.shape), None
        if self.velocity_3d is not None:
            self.velocity_3d = np.broadcast_to(self.velocity_3d.mean(axis=0), self.velocity_3d.shape)

    def decay(self, dt: float) -> None:
        """Slow down, as nothing of the object is seen."""
        self.velocity = self.velocity * math.exp(-dt / _MOTION_S)
        self.velocity_3d = None if self.velocity_3d is None else self.velocity_3d * math.exp(-dt / _MOTION_S)
        self.points_3d = None

    def resample(self, u: FloatArray) -> None:
        """Take the velocities at other parameters (SAMPLES,); in space, two frames have to show these first."""
        self.velocity = interpolate(self.velocity, u)
        self.acceleration = self.velocity_3d = self.points_3d = None


def extrapolated_time(dt: float) -> float:
    """Return the part of a time, in seconds, for which a motion is extrapolated."""
    return min(dt, _MOTION_S)


def move_curve(curve: BSplineCurve, velocity: FloatArray, seconds: float) -> BSplineCurve:
    """Return a curve moved by its samples' velocities (SAMPLES, d): each control point at its Greville parameter."""
    control = move_control_points(curve.knots, curve.control_points, velocity, seconds, curve.degree, curve.closed)
    return BSplineCurve._unchecked(curve.knots, control, curve.degree, curve.closed)
