"""The choreography of the demo: what lies and moves where at any phase of the sequence."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dloftbs.support.arrays import FloatArray
from dloftbs_lab.synthetic.actors import Placed, draw_arm, draw_gripper, draw_hand, hold_ends, pair
from dloftbs_lab.synthetic.motion import Heading, Motion, fit_motion, looping, waving, window
from dloftbs_lab.synthetic.sketch import Sprite
from dloftbs_lab.synthetic.strand import Strand

_HAND_ANGLE = 1.12


@dataclass(frozen=True)
class Scene:
    """Cables and what moves over them, as functions of a phase in 0..1; the end of the sequence meets its beginning.

    Parameters
    ----------
    seed : int
    size : (int, int)
        ``(H, W)`` px.
    cables : int
        1 or 2.
    width_px : float
    occluder : bool
        Whether grippers hold the first cable and a hand reaches in.
    """

    seed: int
    size: tuple[int, int]
    cables: int
    width_px: float
    occluder: bool

    @property
    def scale(self) -> float:
        """Pixels per pixel of a 1280 x 720 image."""
        return min(self.size[0] / 720.0, self.size[1] / 1280.0)

    def rng(self, purpose: int) -> np.random.Generator:
        """Return a stream of random numbers of its own for each purpose, so that one does not disturb another."""
        return np.random.default_rng([self.seed, purpose])

    @cached_property
    def up(self) -> float:
        """1 where the loop opens upwards in the image, -1 downwards."""
        return 1.0 if self.rng(0).random() < 0.65 else -1.0

    @cached_property
    def motions(self) -> tuple[Motion, ...]:
        """Motion of each cable."""
        height, width = self.size
        k = self.scale
        first = fit_motion(
            self._mirrored(looping(self.rng(1))), self._box(0.12, 0.09, 0.88, 0.80), 1300.0 * k, self.width_px
        )
        if self.cables == 1:
            return (first,)
        second = fit_motion(
            self._mirrored(waving(self.rng(2))),
            self._box(0.08, 0.34, 0.93, 0.95),
            820.0 * k,
            self.width_px,
            (0.04 * width, -self.up * 0.27 * height),
            _push,
        )
        return first, second

    def strands(self, phase: float) -> tuple[Strand, ...]:
        """Return the cables, the lowest first."""
        return tuple(motion.strand(phase) for motion in self.motions)

    def actors(self, strands: tuple[Strand, ...], phase: float) -> list[Placed]:
        """Return what lies over the cables, the lowest first; `strands` are those of the same phase."""
        if not self.occluder:
            return []
        held = strands[0]
        grippers, arms = hold_ends(held, (self._gripper, self._arm), self._bases(held), self.scale)
        return [*grippers, self._reaching_hand(strands[-1], phase), *arms]

    def _reaching_hand(self, target: Strand, phase: float) -> Placed:
        """Place the hand: it comes in, pushes the last cable with its finger, and leaves."""
        index = int(0.27 * (len(target.points) - 1))
        angle = self.up * _HAND_ANGLE
        away = np.array([math.cos(angle), math.sin(angle)])
        retreat = 1.0 - window(phase, (0.22, 0.40), (0.80, 0.96))
        tip = target.points[index] + (540.0 * retreat - 16.0) * self.scale * away
        return self._hand, pair(tip), angle

    def _mirrored(self, heading: Heading) -> Heading:
        return heading if self.up > 0 else lambda along, phase: -heading(along, phase)

    def _row(self, share: float) -> float:
        """Return the row at a share of the height, counted from the side to which the loop opens."""
        return self.size[0] * (share if self.up > 0 else 1.0 - share)

    def _box(self, left: float, top: float, right: float, bottom: float) -> tuple[float, float, float, float]:
        first, last = sorted((self._row(top), self._row(bottom)))
        return left * self.size[1], first, right * self.size[1], last

    def _bases(self, held: Strand) -> tuple[FloatArray, FloatArray]:
        """Return where the two arms come from, outside of the image; the second slides along a rail."""
        width = self.size[1]
        slider = 1.45 * held.points[-1, 0] - 0.04 * width
        return np.array([-0.25 * width, self._row(0.52)]), np.array([slider, self._row(-0.5)])

    @cached_property
    def _gripper(self) -> Sprite:
        return draw_gripper(self.scale, self.width_px / self.scale)

    @cached_property
    def _arm(self) -> Sprite:
        return draw_arm(self.scale, 1.1 * math.hypot(*self.size) / self.scale)

    @cached_property
    def _hand(self) -> Sprite:
        return draw_hand(self.scale, self.rng(3), self.up * _HAND_ANGLE)


def _push(phase: float) -> float:
    return window(phase, (0.36, 0.58), (0.66, 0.88))
