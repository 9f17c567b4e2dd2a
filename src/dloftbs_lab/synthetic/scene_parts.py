"""Small parts that the scenes in space are put together from, drawn at random within bounds."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from dloftbs_lab.synthetic.signals import Signal, steady
from dloftbs_lab.synthetic.space_axis import Step, Wave
from dloftbs_lab.synthetic.space_scene import SpaceScene

MakeScene = Callable[[np.random.Generator], SpaceScene]

# Radii between the axes of two passes: two would touch, the rest is air and leaves room for the camera's tilt.
_PASS_RADII = 2.8


def near(rng: np.random.Generator, value: float, by: float = 0.1) -> float:
    """Draw a number within the share `by` of a value."""
    return float(value * rng.uniform(1.0 - by, 1.0 + by))


def wander(rng: np.random.Generator, value: float, amplitude: float, periods: float) -> Signal:
    """Return a signal that wanders about a value, with two unrelated periods in a sequence."""
    first, second = rng.uniform(0.0, 2.0 * math.pi, 2).tolist()
    return steady(value).swaying(0.65 * amplitude, periods, first).swaying(0.35 * amplitude, 1.7 * periods, second)


def sway(rng: np.random.Generator, modes: int, rest: float, swing: float, periods: float = 2.0) -> tuple[Wave, ...]:
    """Return headings that give a cable gentle waves which wander; higher modes are smaller."""
    waves = []
    for order in range(1, modes + 1):
        gain = wander(rng, float(rng.uniform(-rest, rest)) / order, swing / order, periods)
        waves.append(Wave(order, gain))
    return tuple(waves)


def swell(amplitude: Signal, count: float, lag: float = 0.0) -> tuple[Wave, Wave]:
    """Return heights from 0 to twice the amplitude, in a number of half waves along the cable."""
    return Wave(0.0, amplitude), Wave(count, amplitude, lag)


def over(start: float, end: float, radius_m: float) -> Step:
    """Return a height by which the cable beyond `end` clears the cable before `start`."""
    return Step(start, end, steady(_PASS_RADII * radius_m))


def under(start: float, end: float, radius_m: float) -> tuple[Wave, Step]:
    """Return heights by which the cable before `start` clears the cable beyond `end`."""
    rise = _PASS_RADII * radius_m
    return Wave(0.0, steady(rise)), Step(start, end, steady(-rise))
