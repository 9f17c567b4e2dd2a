"""The five scenes of the artificial suite."""

from __future__ import annotations

import math

import numpy as np

from dloftbs_lab.synthetic.scene_parts import MakeScene, near, over, sway, swell, under, wander
from dloftbs_lab.synthetic.signals import keyed, steady
from dloftbs_lab.synthetic.space_axis import Bend, SpaceMotion, Term, Wave
from dloftbs_lab.synthetic.space_scene import SpaceScene, View

_FRAMES = 280
_SLACK_M = 0.001  # air between a resting cable and the table


def _high_curvature(rng: np.random.Generator) -> SpaceScene:
    radius = near(rng, 0.0045, 0.08)
    heading: tuple[Term, ...] = (
        Wave(0.0, wander(rng, 0.0, 0.35, 1.2)),
        Bend(0.10, 0.25, wander(rng, 2.75, 0.35, 2.0)),
        Bend(0.36, 0.51, wander(rng, -2.75, 0.35, 2.0)),
        Bend(0.62, 0.77, wander(rng, 2.75, 0.35, 2.0)),
        *sway(rng, 2, 0.1, 0.12, 2.0),
    )
    place = (wander(rng, 0.0, 0.10, 2.0), wander(rng, 0.0, 0.05, 2.0), steady(0.0))
    motion = SpaceMotion(near(rng, 0.92, 0.03), heading, swell(wander(rng, 0.014, 0.010, 2.0), 3.0), place)
    return SpaceScene("0 high curvature", _FRAMES, radius, motion, View(0.72, 0.30, radius + _SLACK_M))


def _high_curvature_crossing(rng: np.random.Generator) -> SpaceScene:
    radius = near(rng, 0.0045, 0.08)
    heading: tuple[Term, ...] = (
        Wave(0.0, wander(rng, 2.0, 0.25, 1.2)),
        Bend(0.22, 0.45, wander(rng, 5.0, 0.5, 2.0), ease=0.06),
        Bend(0.62, 0.77, wander(rng, -2.6, 0.4, 2.0)),
        *sway(rng, 2, 0.06, 0.08, 2.0),
    )
    place = (wander(rng, 0.0, 0.12, 2.0), wander(rng, 0.0, 0.05, 2.0), steady(0.0))
    motion = SpaceMotion(near(rng, 0.92, 0.03), heading, (over(0.25, 0.41, radius),), place)
    return SpaceScene(
        "1 high curvature, self-intersection", _FRAMES, radius, motion, View(0.70, 0.25, radius + _SLACK_M)
    )


def _untying(rng: np.random.Generator) -> SpaceScene:
    radius = near(rng, 0.0045, 0.08)
    turn = keyed((0.06, near(rng, 5.5, 0.04)), (0.88, near(rng, 1.0, 0.2)))
    heading: tuple[Term, ...] = (
        Wave(0.0, wander(rng, 0.0, 0.25, 1.0)),
        Bend(0.24, 0.74, turn, ease=0.1, balance=0.5),
        *sway(rng, 3, 0.10, 0.12, 2.0),
    )
    place = (wander(rng, 0.0, 0.08, 2.0), wander(rng, 0.0, 0.04, 2.0), steady(0.0))
    motion = SpaceMotion(near(rng, 0.88, 0.03), heading, under(0.30, 0.68, radius), place)
    return SpaceScene("2 self-intersection that unties", _FRAMES, radius, motion, View(0.75, 0.30, radius + _SLACK_M))


def _shaken(rng: np.random.Generator) -> SpaceScene:
    start = rng.uniform(0.0, 2.0 * math.pi, 8).tolist()
    heading: tuple[Term, ...] = (
        Wave(1.0, steady(0.1).swinging(0.42, near(rng, 1.1), start[0])),
        Wave(2.0, steady(0.2).swinging(0.40, near(rng, 1.5), start[1])),
        Wave(3.0, steady(-0.2).swinging(0.24, near(rng, 1.9), start[2])),
    )
    place = (
        steady(0.0).swinging(0.10, 0.3, start[3]).swinging(0.10, near(rng, 0.9), start[4]),
        steady(0.0).swinging(0.05, near(rng, 1.2), start[5]),
        steady(0.0).swinging(0.05, near(rng, 0.8), start[6]),
    )
    height = (Wave(1.0, steady(0.0).swinging(0.03, near(rng, 0.9), start[7])),)
    motion = SpaceMotion(near(rng, 0.80, 0.05), heading, height, place)
    return SpaceScene("3 rapid moves", _FRAMES, near(rng, 0.005, 0.08), motion, View(0.85, 0.0, 0.35))


def _whipped(rng: np.random.Generator) -> SpaceScene:
    start = rng.uniform(0.0, 2.0 * math.pi, 4).tolist()
    whip, quarter = near(rng, 1.1), 0.5 * math.pi
    heading: tuple[Term, ...] = (
        Wave(0.0, steady(quarter).swinging(0.28, near(rng, 0.8), start[0])),
        # Two standing waves a quarter of a period apart in time and in place are one that runs down the cable.
        Wave(2.5, steady(0.0).swinging(0.55, whip, start[1] + quarter)),
        Wave(2.5, steady(0.0).swinging(0.55, whip, start[1]), lag=quarter),
        Wave(1.0, steady(0.0).swinging(0.25, near(rng, 0.25), start[3])),
    )
    place = (
        steady(0.0).swinging(0.20, near(rng, 0.22), start[2]).swinging(0.06, near(rng, 0.9), start[3]),
        steady(0.0).swinging(0.02, near(rng, 1.3), start[0]),
        steady(0.0).swinging(0.06, near(rng, 0.6), start[1]),
    )
    height = (Wave(1.0, steady(0.0).swinging(0.05, near(rng, 0.7), start[2])),)
    motion = SpaceMotion(near(rng, 0.62, 0.05), heading, height, place, anchor=0.0)
    return SpaceScene("4 rapid moves, whipped", _FRAMES, near(rng, 0.005, 0.08), motion, View(0.80, 0.0, 0.45))


ARTIFICIAL: tuple[MakeScene, ...] = (_high_curvature, _high_curvature_crossing, _untying, _shaken, _whipped)
