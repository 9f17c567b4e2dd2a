"""The scenarios of colour images: a cable between two grippers, and what else moves over it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dloftbs.support.arrays import FloatArray
from dloftbs_lab.synthetic.actors import Placed, draw_arm, draw_gripper, draw_hand, hold_ends, pair, place_arm
from dloftbs_lab.synthetic.generated import HD_WIDTH_PX, proportion
from dloftbs_lab.synthetic.motion import Heading, Motion, Sway, fit_motion, looping
from dloftbs_lab.synthetic.sketch import Sprite
from dloftbs_lab.synthetic.strand import Strand

_ARM_OVERLAP = 46.0
_HAND_OVERLAP = 34.0


@dataclass(frozen=True)
class Reach:
    """An arm or a hand that lies across the cable and moves along it.

    Parameters
    ----------
    along : float
        Place on the cable, as a share of its length.
    roam : float
        Distance that it moves to both sides of there.
    direction : float
        From the cable to where it comes from, radians; negative is up in the image.
    hand : bool
        A gloved hand rather than an arm.
    """

    along: float
    roam: float
    direction: float
    hand: bool = False


@dataclass(frozen=True)
class Scenario:
    """Content of a sequence, for 1280 x 720 px.

    Parameters
    ----------
    heading : callable
        Draws how the cable bends.
    width_px, length_px : float
    box : (float, float, float, float)
        Left, top, right and bottom of where the cable moves, as shares of the image.
    travel : (float, float)
        Distance that it is carried to and fro, as shares of the image.
    reaches : tuple of Reach
        The lowest first.
    straight : bool
        Whether the second arm runs on in the direction of the cable's end, which keeps a loop free.
    """

    heading: Callable[[np.random.Generator], Heading]
    width_px: float = HD_WIDTH_PX
    length_px: float = 980.0
    box: tuple[float, float, float, float] = (0.14, 0.14, 0.86, 0.86)
    travel: tuple[float, float] = (0.04, 0.14)
    reaches: tuple[Reach, ...] = ()
    straight: bool = False


def led(rng: np.random.Generator) -> Heading:
    """Return a cable between two grippers that come closer and part, so that it sags and stretches."""
    sway = Sway.draw(rng, 4, 0.25, 0.22)
    lean, swing, start = rng.uniform(0.55, 0.75), rng.uniform(0.3, 0.45), rng.uniform(0.0, 2.0 * math.pi)

    def heading(along: FloatArray, phase: float) -> FloatArray:
        depth = lean + swing * math.sin(2.0 * math.pi * phase + start)
        return depth * np.cos(2.0 * math.pi * along) + sway(along, phase)

    return heading


SCENARIOS = {
    "plain": Scenario(led),
    "thick": Scenario(led, width_px=26.0),
    "thin, occluded": Scenario(led, width_px=5.0, reaches=(Reach(0.42, 0.16, -1.5),)),
    "partly out of the image, occluded": Scenario(
        led, length_px=1050.0, box=(-0.45, 0.0, 0.95, 1.45), travel=(0.28, 0.42), reaches=(Reach(0.6, 0.08, -1.2),)
    ),
    "occluded by an arm": Scenario(led, reaches=(Reach(0.5, 0.22, -1.4),)),
    "several occlusions": Scenario(
        led,
        length_px=1050.0,
        reaches=(Reach(0.52, 0.06, 1.25, hand=True), Reach(0.27, 0.07, -1.75), Reach(0.76, 0.06, -1.3)),
    ),
    "self-intersection, occluded": Scenario(
        looping,
        length_px=1300.0,
        box=(0.13, 0.10, 0.87, 0.84),
        travel=(0.0, 0.0),
        reaches=(Reach(0.16, 0.05, -1.6),),
        straight=True,
    ),
}
"""By name, in the order of the paper's scenarios 0 to 6: out of view in 3, occlusions in 2 to 6, a crossing in 6."""


@dataclass(frozen=True, eq=False)
class HeldScene:
    """A cable between two grippers, as a function of a phase in 0..1; the end of the sequence meets its beginning.

    Parameters
    ----------
    scenario : Scenario
    seed : int
    size : (int, int)
        ``(H, W)`` px.
    width_px : float
        Width of the cable.
    """

    scenario: Scenario
    seed: int
    size: tuple[int, int]
    width_px: float

    @cached_property
    def motion(self) -> Motion:
        """Motion of the cable."""
        height, width = self.size
        left, top, right, bottom = self.scenario.box
        box = (left * width, top * height, right * width, bottom * height)
        travel = (self.scenario.travel[0] * width, self.scenario.travel[1] * height)
        rng = np.random.default_rng([self.seed, 1])
        heading = self.scenario.heading(rng)
        start = rng.uniform(0.0, 2.0 * math.pi)
        return fit_motion(
            heading,
            box,
            self.scenario.length_px * proportion(self.size),
            self.width_px,
            travel,
            lambda phase: 0.5 - 0.5 * math.cos(2.0 * math.pi * phase + start),
        )

    def actors(self, strand: Strand, phase: float) -> list[Placed]:
        """Return what lies over the cable, the lowest first; `strand` is that of the same phase."""
        tools = (self._gripper, self._arm)
        grippers, arms = hold_ends(strand, tools, self._bases(strand), proportion(self.size))
        reaching = [self._reach(number, strand, phase) for number in range(len(self.scenario.reaches))]
        return [*grippers, *arms, *reaching]

    def _reach(self, number: int, strand: Strand, phase: float) -> Placed:
        reach = self.scenario.reaches[number]
        share = reach.along + reach.roam * math.sin(2.0 * math.pi * phase + 2.0 * number)
        away = np.array([math.cos(reach.direction), math.sin(reach.direction)])
        overlap = proportion(self.size) * (_HAND_OVERLAP if reach.hand else _ARM_OVERLAP)
        tip = strand.points[round(share * (len(strand.points) - 1))] - overlap * away
        if reach.hand:
            return self._hands[number], pair(tip), reach.direction
        return place_arm(self._arm, tip, tip + 2.0 * max(self.size) * away)

    def _bases(self, strand: Strand) -> tuple[FloatArray, FloatArray]:
        """Return where the arms that hold the ends come from, outside of the image."""
        height, width = self.size
        first, last = strand.points[0], strand.points[-1]
        left = np.array([-0.3 * width, 0.5 * (first[1] + 0.5 * height)])
        if self.scenario.straight:
            return left, last + 2.0 * width * strand.tangents[-1]
        return left, np.array([1.3 * width, 0.5 * (last[1] + 0.5 * height)])

    @cached_property
    def _gripper(self) -> Sprite:
        scale = proportion(self.size)
        return draw_gripper(scale, self.width_px / scale)

    @cached_property
    def _arm(self) -> Sprite:
        scale = proportion(self.size)
        return draw_arm(scale, 1.1 * math.hypot(*self.size) / scale)

    @cached_property
    def _hands(self) -> dict[int, Sprite]:
        rng = np.random.default_rng([self.seed, 3])
        reaches = enumerate(self.scenario.reaches)
        return {i: draw_hand(proportion(self.size), rng, reach.direction) for i, reach in reaches if reach.hand}
