"""The ten scenes of the manipulation suite."""

from __future__ import annotations

import math

import numpy as np

from dloftbs_lab.synthetic.hand import Hand
from dloftbs_lab.synthetic.scene_parts import MakeScene, near, over, sway, swell, under, wander
from dloftbs_lab.synthetic.signals import Signal, keyed, steady
from dloftbs_lab.synthetic.space_axis import Bend, SpaceMotion, Step, Term, Wave
from dloftbs_lab.synthetic.space_scene import SpaceScene, View

_FRAMES = 250
_SLACK_M = 0.001
# Where an arm comes from, as seen on the screen.
_FRONT, _BACK = 0.5 * math.pi, -0.5 * math.pi
_HOLDS = steady(1.0)


def _held(grip: float, turned: float, presence: Signal = _HOLDS) -> Hand:
    """Return a hand at an end, its arm nearly in line with the cable."""
    return Hand(grip, turned, presence, follows=True)


def _drift(rng: np.random.Generator, x: float, y: float) -> tuple[Signal, Signal, Signal]:
    return wander(rng, 0.0, x, 2.0), wander(rng, 0.0, y, 2.0), steady(0.0)


def _ends_moved(rng: np.random.Generator) -> SpaceScene:
    radius = near(rng, 0.005)
    heading: tuple[Term, ...] = (
        Wave(2.0, wander(rng, 0.75, 0.35, 2.0)),
        Wave(1.0, wander(rng, 0.0, 0.35, 2.0)),
        *sway(rng, 3, 0.1, 0.15),
    )
    motion = SpaceMotion(near(rng, 0.8), heading, swell(wander(rng, 0.030, 0.025, 2.0), 2.0), _drift(rng, 0.06, 0.04))
    hands = (_held(0.01, -0.3), _held(0.97, 0.3))
    return SpaceScene("0 ends moved", _FRAMES, radius, motion, View(0.85, 0.35, radius + _SLACK_M), hands)


def _lifted(rng: np.random.Generator) -> SpaceScene:
    radius = near(rng, 0.004)
    high, lower = near(rng, 0.12), near(rng, 0.09)
    up = keyed((0.15, 0.0), (0.45, high), (0.60, lower), (0.85, 0.0))
    down = keyed((0.15, 0.0), (0.45, -high), (0.60, -lower), (0.85, 0.0))
    heading: tuple[Term, ...] = (Bend(0.1, 0.9, wander(rng, -1.4, 0.3, 1.5), ease=0.3), *sway(rng, 3, 0.3, 0.15))
    motion = SpaceMotion(
        near(rng, 0.85), heading, (Step(0.18, 0.5, up), Step(0.5, 0.82, down)), _drift(rng, 0.06, 0.03)
    )
    presence = keyed((0.03, 0.0), (0.13, 1.0), (0.87, 1.0), (0.97, 0.0))
    hands = (Hand(0.5, _FRONT - 0.3, presence),)
    return SpaceScene("1 lifted", _FRAMES, radius, motion, View(0.9, 0.40, radius + _SLACK_M), hands)


def _loop_laid(rng: np.random.Generator) -> SpaceScene:
    radius = near(rng, 0.005)
    turn = keyed((0.02, 2.6), (0.48, near(rng, 5.3, 0.03)), (0.62, near(rng, 5.0, 0.03)), (0.98, 2.9))
    heading: tuple[Term, ...] = (
        Wave(0.0, wander(rng, 0.2, 0.15, 1.0)),
        Bend(0.28, 0.72, turn, ease=0.1, balance=0.5),
        *sway(rng, 3, 0.08, 0.10),
    )
    motion = SpaceMotion(near(rng, 0.9, 0.05), heading, (over(0.34, 0.66, radius),), _drift(rng, 0.05, 0.03), 0.15)
    presence = keyed((0.0, 1.0), (0.70, 1.0), (0.82, 0.3))
    hands = (_held(0.985, 0.2, presence), _held(0.01, 0.2))
    return SpaceScene("2 loop laid", _FRAMES, radius, motion, View(0.85, 0.30, radius + _SLACK_M), hands)


def _u_turn(rng: np.random.Generator) -> SpaceScene:
    radius = near(rng, 0.0045)
    # The bend runs along the cable while the hand pulls one end back.
    heading: tuple[Term, ...] = (
        Wave(0.0, wander(rng, 0.9, 0.2, 1.0)),
        Bend(0.34, 0.66, keyed((0.02, 0.9), (0.46, 3.1), (0.56, 2.9), (0.98, 1.2)), ease=0.1, balance=0.5),
        *sway(rng, 2, 0.08, 0.10),
    )
    height = (Step(0.6, 1.0, keyed((0.05, 0.0), (0.3, near(rng, 0.05)), (0.7, near(rng, 0.04)), (0.95, 0.0))),)
    motion = SpaceMotion(near(rng, 0.85), heading, height, _drift(rng, 0.04, 0.03))
    hands = (_held(0.96, 0.5),)
    return SpaceScene("3 U-turn", _FRAMES, radius, motion, View(0.8, 0.25, radius + _SLACK_M), hands)


def _dragged(rng: np.random.Generator) -> SpaceScene:
    radius = near(rng, 0.0045)
    heading: tuple[Term, ...] = (
        Wave(2.2, steady(near(rng, 0.8)), lag=0.4),
        Wave(5.1, steady(near(rng, 0.5)), lag=float(rng.uniform(0.0, 6.0))),
        Wave(0.0, wander(rng, 0.0, 0.05, 2.0)),
    )
    height = (Wave(0.0, steady(0.005)), Wave(3.3, steady(0.005)))
    travel = keyed((0.04, 0.0), (0.48, 0.85), (0.55, 0.85), (0.97, 0.05))
    motion = SpaceMotion(near(rng, 0.55, 0.05), heading, height, travel=travel)
    hands = (_held(0.985, 0.2),)
    return SpaceScene("4 dragged", _FRAMES, radius, motion, View(0.85, 0.35, radius + _SLACK_M), hands)


def _hanging(rng: np.random.Generator) -> SpaceScene:
    start = rng.uniform(0.0, 2.0 * math.pi, 5).tolist()
    heading: tuple[Term, ...] = (
        Wave(0.0, steady(0.5 * math.pi).swinging(0.13, near(rng, 0.55), start[0])),
        Wave(1.0, steady(0.0).swinging(0.20, near(rng, 0.55), start[1])),
        Wave(2.0, steady(0.1).swinging(0.16, near(rng, 0.9), start[2])),
    )
    height = (Wave(1.0, steady(0.02).swinging(0.05, near(rng, 0.5), start[3])),)
    place = (wander(rng, 0.0, 0.15, 2.0), steady(0.0), wander(rng, 0.0, 0.06, 2.0))
    motion = SpaceMotion(near(rng, 0.6, 0.05), heading, height, place, 0.0)
    hands = (_held(0.015, 0.4),)
    return SpaceScene("5 swinging", _FRAMES, near(rng, 0.005), motion, View(0.95, 0.0, 0.5), hands)


def _thin(rng: np.random.Generator) -> SpaceScene:
    radius = 0.002
    heading: tuple[Term, ...] = (
        Wave(0.0, wander(rng, 1.2, 0.2, 1.0)),
        Bend(0.18, 0.38, wander(rng, 4.9, 0.4, 2.0), ease=0.06),
        Bend(0.55, 0.75, wander(rng, -1.3, 0.4, 2.0), ease=0.06),
        *sway(rng, 3, 0.1, 0.12),
    )
    motion = SpaceMotion(near(rng, 0.75), heading, (over(0.21, 0.35, radius),), _drift(rng, 0.05, 0.03))
    hands = (_held(0.98, -0.3), _held(0.02, 0.3))
    return SpaceScene("6 thin cable", _FRAMES, radius, motion, View(0.7, 0.25, radius + _SLACK_M), hands)


def _thick(rng: np.random.Generator) -> SpaceScene:
    radius = 0.010
    turn = keyed((0.05, near(rng, 4.9, 0.03)), (0.45, near(rng, 5.4, 0.03)), (0.95, near(rng, 4.6, 0.03)))
    heading: tuple[Term, ...] = (
        Wave(0.0, wander(rng, 0.4, 0.15, 1.5)),
        Bend(0.22, 0.76, turn, ease=0.1),
        *sway(rng, 2, 0.06, 0.08),
    )
    motion = SpaceMotion(near(rng, 1.0, 0.05), heading, under(0.28, 0.70, radius), _drift(rng, 0.06, 0.03))
    hands = (_held(0.05, 0.3), _held(0.96, -0.3, keyed((0.3, 1.0), (0.45, 0.2), (0.8, 1.0))))
    return SpaceScene("7 thick hose", _FRAMES, radius, motion, View(0.8, 0.30, radius + _SLACK_M), hands)


def _tight_loop(rng: np.random.Generator) -> SpaceScene:
    radius = near(rng, 0.004)
    turn = keyed((0.05, near(rng, 5.6, 0.02)), (0.75, 1.2), (0.95, 0.8))
    heading: tuple[Term, ...] = (
        Wave(0.0, wander(rng, 0.0, 0.15, 1.0)),
        Bend(0.34, 0.68, turn, ease=0.08, balance=0.5),
        *sway(rng, 2, 0.08, 0.1),
    )
    motion = SpaceMotion(near(rng, 0.55, 0.04), heading, (over(0.41, 0.61, radius),), _drift(rng, 0.02, 0.02))
    hands = (_held(0.03, 0.3), _held(0.97, -0.3))
    return SpaceScene("8 loop pulled open", _FRAMES, radius, motion, View(0.52, 0.20, radius + _SLACK_M), hands)


def _far(rng: np.random.Generator) -> SpaceScene:
    radius = near(rng, 0.006)
    heading: tuple[Term, ...] = (
        Wave(3.0, wander(rng, 1.2, 0.35, 2.0)),
        Wave(1.0, wander(rng, 0.3, 0.3, 2.0)),
        *sway(rng, 3, 0.2, 0.2),
    )
    motion = SpaceMotion(near(rng, 1.0), heading, swell(wander(rng, 0.02, 0.015, 2.0), 3.0), _drift(rng, 0.1, 0.06))
    passing = keyed((0.08, 0.0), (0.30, 1.0), (0.42, 0.4), (0.60, 0.95), (0.80, 0.0))
    hands = (Hand(0.30, _FRONT + 0.3, passing, hover=0.06), Hand(0.75, _BACK - 0.2, _HOLDS))
    return SpaceScene("9 far, hands in the way", _FRAMES, radius, motion, View(1.35, 0.40, radius + _SLACK_M), hands)


MANIPULATION: tuple[MakeScene, ...] = (
    _ends_moved,
    _lifted,
    _loop_laid,
    _u_turn,
    _dragged,
    _hanging,
    _thin,
    _thick,
    _tight_loop,
    _far,
)
