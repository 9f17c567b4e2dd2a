"""Bending of the cables in the sequences with known curves: more kinds of `Heading`."""

from __future__ import annotations

import math

import numpy as np

from dloftbs.support.arrays import FloatArray
from dloftbs_lab.synthetic.motion import Heading, Sway, smoothstep, window

_EASE = 0.15
# Radius over length of the tightest loop: a little over two widths of 12 px at a length of 1000 px.
_TIGHT = 0.0255


def high_curvature(rng: np.random.Generator) -> Heading:
    """Return a cable in tight meanders that travel along it and deepen and flatten."""
    sway = Sway.draw(rng, 3, 0.25, 0.2)
    waves = rng.uniform(2.9, 3.8)
    depth, start, drift = rng.uniform(1.15, 1.3), rng.uniform(0.0, 2.0 * math.pi), rng.choice((-1.0, 1.0))

    def heading(along: FloatArray, phase: float) -> FloatArray:
        amplitude = depth + 0.3 * math.sin(4.0 * math.pi * phase + start)
        travelling = 2.0 * math.pi * (waves * along + drift * phase) + start
        return amplitude * np.cos(travelling) + sway(along, phase)

    return heading


def one_loop(rng: np.random.Generator) -> Heading:
    """Return a cable with one loop that closes from a hairpin to beyond a full turn, and narrows and widens."""
    sway = Sway.draw(rng, 3, 0.16, 0.14)
    side, centre, start = rng.choice((-1.0, 1.0)), rng.uniform(0.42, 0.58), rng.uniform(0.0, 2.0 * math.pi)
    least, most, tight = rng.uniform(0.54, 0.62), rng.uniform(1.0, 1.1), _TIGHT * rng.uniform(1.0, 1.08)

    def heading(along: FloatArray, phase: float) -> FloatArray:
        turn = least + (most - least) * window(phase, (0.02, 0.48), (0.56, 0.99))
        radius = tight * (1.6 - 0.6 * math.cos(4.0 * math.pi * phase + start))
        share = 2.0 * math.pi * turn * radius / (1.0 - _EASE)
        loop = 2.0 * math.pi * turn * (_turned(along, centre, share) - 0.5)
        return side * loop + sway(along, phase)

    return heading


def untying(rng: np.random.Generator) -> Heading:
    """Return a cable whose loop runs towards one end until that end slips out, and the cable lies straight."""
    sway = Sway.draw(rng, 3, 0.12, 0.12)
    side, tilt, back = rng.choice((-1.0, 1.0)), rng.uniform(-0.15, 0.15), bool(rng.random() < 0.5)
    share, first = rng.uniform(0.26, 0.34), rng.uniform(0.52, 0.58)
    last = 1.02 + share / 2.0

    def heading(along: FloatArray, phase: float) -> FloatArray:
        centre = first + (last - first) * float(smoothstep(np.array((phase - 0.02) / 0.96)))
        # Short of a full turn both arms leave at an angle, as those of a loop on a table do.
        turn = 1.9 * math.pi * _turned(along, centre, share)
        bent = turn[::-1] if back else turn
        return tilt + side * bent + sway(along, phase)

    return heading


def calm(rng: np.random.Generator) -> Heading:
    """Return a cable in a gentle wave that hardly changes: what moves is where it lies."""
    sway = Sway.draw(rng, 3, 0.3, 0.05)
    lean, start = rng.uniform(0.3, 0.6), rng.uniform(0.0, 2.0 * math.pi)

    def heading(along: FloatArray, phase: float) -> FloatArray:
        return lean * np.cos(2.0 * math.pi * along + start) + sway(along, phase)

    return heading


def whipping(rng: np.random.Generator) -> Heading:
    """Return a cable that swings as a whole and has a wave run along it, five times in the sequence."""
    swing, wave, start = rng.uniform(0.35, 0.45), rng.uniform(0.6, 0.8), rng.uniform(0.0, 2.0 * math.pi)

    def heading(along: FloatArray, phase: float) -> FloatArray:
        beat = 10.0 * math.pi * phase + start
        return swing * math.sin(beat) + wave * np.cos(2.0 * math.pi * 1.2 * along - beat)

    return heading


def drifting(rng: np.random.Generator) -> Heading:
    """Return a cable that slowly turns and bends."""
    sway = Sway.draw(rng, 4, 0.7, 0.4)
    turning, start = rng.uniform(0.15, 0.35), rng.uniform(0.0, 2.0 * math.pi)

    def heading(along: FloatArray, phase: float) -> FloatArray:
        return turning * math.sin(2.0 * math.pi * phase + start) + sway(along, phase)

    return heading


def tilted(heading: Heading, angle: float) -> Heading:
    """Return a cable turned by an angle, radians."""
    return lambda along, phase: heading(along, phase) + angle


def _turned(along: FloatArray, centre: float, share: float) -> FloatArray:
    """Rise from 0 to 1 over `share` of the length around `centre`, evenly but for soft ends."""
    ease = _EASE * share
    bend = smoothstep((along - centre + share / 2.0) / ease) * smoothstep((centre + share / 2.0 - along) / ease)
    steps = 0.5 * (bend[1:] + bend[:-1]) * (along[1] - along[0]) / (share - ease)
    return np.concatenate(([0.0], np.cumsum(steps)))
