"""Motion of the demo's cables: headings as smooth, periodic functions of time, fitted into the image once."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from dloftbs.errors import InputError
from dloftbs.support.arrays import FloatArray
from dloftbs_lab.synthetic.strand import Strand, integrate

Heading = Callable[[FloatArray, float], FloatArray]
"""Heading in radians at the normalised arc lengths (n,) and a phase in 0..1."""

_SAMPLE_PX = 0.5
_FIT_PHASES = np.linspace(0.0, 1.0, 97)
_FIT_SAMPLES = 401


def smoothstep(x: FloatArray) -> FloatArray:
    """Rise from 0 at 0 to 1 at 1 with two continuous derivatives, flat outside."""
    x = np.clip(x, 0.0, 1.0)
    return x * x * x * (x * (6.0 * x - 15.0) + 10.0)


def window(phase: float, rise: tuple[float, float], fall: tuple[float, float]) -> float:
    """Rise from 0 to 1 between the phases of `rise`, and back between those of `fall`."""
    edges = np.array([(phase - rise[0]) / (rise[1] - rise[0]), (phase - fall[0]) / (fall[1] - fall[0])])
    up, down = smoothstep(edges)
    return float(up - down)


@dataclass(frozen=True, eq=False)
class Sway:
    """A sum of cosines along the arc, each swinging with time; what makes a cable look alive.

    Parameters
    ----------
    rest, swing, start : numpy.ndarray, shape (modes,)
        Amplitude at rest and of the swing, radians, and where in its swing each mode is at phase 0.
    """

    rest: FloatArray
    swing: FloatArray
    start: FloatArray

    @classmethod
    def draw(cls, rng: np.random.Generator, modes: int, rest: float, swing: float) -> Sway:
        """Draw amplitudes that fall with the order of the mode."""
        order = np.arange(1, modes + 1)
        return cls(
            rng.uniform(-rest, rest, modes) / order,
            rng.uniform(0.5 * swing, swing, modes) / order,
            rng.uniform(0.0, 2.0 * np.pi, modes),
        )

    def __call__(self, along: FloatArray, phase: float) -> FloatArray:
        """Return the heading's share, shape of `along`."""
        gain = self.rest + self.swing * np.sin(2.0 * np.pi * phase + self.start)
        order = np.arange(1, len(gain) + 1)
        return gain @ np.cos(np.pi * order[:, None] * along)


def looping(rng: np.random.Generator) -> Heading:
    """Return a cable whose second half swings round until it lies across the first half, and back."""
    sway = Sway.draw(rng, 3, 0.12, 0.16)
    start, end = rng.uniform(0.30, 0.33), rng.uniform(0.81, 0.84)

    def heading(along: FloatArray, phase: float) -> FloatArray:
        turn = 0.48 + 0.42 * window(phase, (0.02, 0.48), (0.56, 0.99))
        # Curvature that rises, stays and falls makes a rounder loop than a plain step of the heading does.
        ease = 0.1
        bend = smoothstep((along - start) / ease) * smoothstep((end - along) / ease)
        ramp = np.concatenate(([0.0], np.cumsum(0.5 * (bend[1:] + bend[:-1]))))
        return -2.0 * np.pi * turn * ramp / ramp[-1] + sway(along, phase)

    return heading


def waving(rng: np.random.Generator) -> Heading:
    """Return a cable that lies in gentle waves."""
    sway = Sway.draw(rng, 4, 0.35, 0.22)
    tilt = rng.uniform(-0.2, 0.2)
    lean = rng.uniform(0.45, 0.65)

    def heading(along: FloatArray, phase: float) -> FloatArray:
        return tilt + lean * np.cos(2.0 * np.pi * along) + sway(along, phase)

    return heading


@dataclass(frozen=True, eq=False)
class Motion:
    """A heading fitted into a part of the image: what `strand` gives at any phase stays inside.

    Parameters
    ----------
    heading : Heading
    length_px : float
    offset : numpy.ndarray, shape (2,)
        Place of the anchor, the mean of the first 60 % of the cable.
    travel : numpy.ndarray, shape (2,)
        Its displacement, px, where `progress` is 1.
    progress : callable
        Phase to a number in 0..1.
    """

    heading: Heading
    length_px: float
    offset: FloatArray
    travel: FloatArray
    progress: Callable[[float], float]

    def strand(self, phase: float) -> Strand:
        """Return the cable at a phase."""
        along = np.linspace(0.0, 1.0, math.ceil(self.length_px / _SAMPLE_PX) + 1)
        return _anchored(integrate(self.heading(along, phase), self.length_px)).moved(
            self.offset + self.progress(phase) * self.travel
        )


def fit_motion(
    heading: Heading,
    box: tuple[float, float, float, float],
    max_length_px: float,
    width_px: float,
    travel: tuple[float, float] = (0.0, 0.0),
    progress: Callable[[float], float] = lambda _: 0.0,
) -> Motion:
    """Choose length and place so that the cable stays within `box`, ``(left, top, right, bottom)`` px, at all times.

    Raises
    ------
    InputError
        If it would have to bend more tightly than two widths.
    """
    along = np.linspace(0.0, 1.0, _FIT_SAMPLES)
    shapes = [_anchored(integrate(heading(along, phase), 1.0)) for phase in _FIT_PHASES]
    shift = np.array([progress(phase) for phase in _FIT_PHASES])[:, None] * np.asarray(travel)
    low = np.array([shape.points.min(axis=0) for shape in shapes])
    high = np.array([shape.points.max(axis=0) for shape in shapes])
    room = np.array([box[2] - box[0], box[3] - box[1]])
    length = max_length_px
    while ((high * length + shift).max(axis=0) - (low * length + shift).min(axis=0) > room).any():
        length *= 0.98
    sharpest = max(np.abs(shape.bending).max() for shape in shapes) / length
    if sharpest * 2.0 * width_px > 1.0:
        raise InputError(
            f"a cable of {width_px} px would bend more tightly than two widths in this image; "
            f"take width_px of at most {0.5 / sharpest:.1f} or a larger size"
        )
    lowest, highest = (low * length + shift).min(axis=0), (high * length + shift).max(axis=0)
    centre = np.array([box[0] + box[2], box[1] + box[3]]) / 2.0
    return Motion(heading, length, centre - (lowest + highest) / 2.0, np.asarray(travel, dtype=np.float64), progress)


def _anchored(strand: Strand) -> Strand:
    part = strand.points[: int(0.6 * len(strand.points))]
    return strand.moved(-part.mean(axis=0))
