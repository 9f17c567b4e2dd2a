"""Wiring harnesses in motion, as perfect masks with the truth of each branch: a trunk that others leave."""

from __future__ import annotations

import math
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from dloftbs.errors import InputError
from dloftbs.support.arrays import FloatArray
from dloftbs_lab.known_sequence import KnownSequence
from dloftbs_lab.synthetic.degrade import NOISY, OCCLUDED, DegradedSequence
from dloftbs_lab.synthetic.generated import (
    GeneratedSequence,
    check_choice,
    count_at,
    proportion,
    visible_tubes,
    width_at,
)
from dloftbs_lab.synthetic.strand import Strand, integrate
from dloftbs_lab.truth import Truth

HARNESS_VIEWS = ("drawn", "in perspective")
"""How a harness is seen: from straight above, or by a pinhole camera from a side."""

_FRAMES, _FPS = 60, 30.0
_WIDEST_PX = 24.0  # in HD
_TRUNK_PX, _BRANCH_PX = (760.0, 980.0), (140.0, 330.0)
_APART_WIDTHS, _CLEAR_WIDTHS = 5.0, 2.0
_LEAVES_RAD = (0.5, 1.4)
_BEND_RAD, _SWAY_RAD = 0.4, 0.2  # amplitudes of each mode of a branch's direction, at rest and over time
_MODES = 3
_THICKER = (1.0, 1.5)
_TILT_RAD = (0.4, 0.9)
_FOCAL = 1.3  # of the longer side
_ATTEMPTS = 400


class _Bends(NamedTuple):
    """Direction of a branch along itself: a sum of cosines, whose amplitudes sway in time."""

    length_px: float
    rest: FloatArray
    sway: FloatArray
    phase: FloatArray

    def heading(self, seconds: float) -> FloatArray:
        """Return the directions (n,), from 0 on, rad."""
        along = np.linspace(0.0, 1.0, max(32, math.ceil(self.length_px)))
        amplitude = self.rest + self.sway * np.sin(2.0 * np.pi * 0.4 * seconds + self.phase)
        order = np.arange(1, _MODES + 1)
        found: FloatArray = amplitude @ (np.cos(np.pi * order[:, None] * along) - 1.0)
        return found


class _Plan(NamedTuple):
    """A harness: its trunk, where its other branches leave that, how, and to which side, and how thick the trunk is."""

    trunk: _Bends
    branches: list[_Bends]
    at: list[float]
    leaves_rad: list[float]
    lean_rad: float
    tilt_rad: float
    thicker: float


class HarnessSequence(GeneratedSequence):
    """Perfect masks of a harness in motion: a trunk that branches leave, all of it in the image.

    The true curves are the branches between two branch points or ends, those of the trunk first; those that meet have
    an end in common.

    Parameters
    ----------
    branches : int
        Number of branches that leave the trunk, from 1 to 6.
    view : str
        One of `HARNESS_VIEWS`.
    frames, size, seed
        As `GeneratedSequence` has them; another seed gives another harness.
    width_px : float, optional
        Width of the branches; 12 in an image of 1280 x 720 and in proportion in others, where it is left out. The trunk
        is as wide, or up to a half wider.

    Raises
    ------
    InputError
        If a value is out of range, or no such harness fits the image.
    """

    is_branched = True

    def __init__(
        self,
        branches: int = 2,
        view: str = "drawn",
        frames: int = _FRAMES,
        size: tuple[int, int] = (720, 1280),
        seed: int = 0,
        width_px: float | None = None,
    ) -> None:
        check_choice("view", view, HARNESS_VIEWS)
        if not 1 <= branches <= 6:
            raise InputError(f"branches must be in 1..6, got {branches}")
        super().__init__(f"{branches} branches {view}", frames, size, seed, _FPS)
        self.width_px = width_at(size, width_px, _WIDEST_PX)
        self.branches, self.view = branches, view
        _ = self._plan  # what cannot be is refused here, not at the first frame

    def _make_truth(self, index: int) -> Truth:
        strands = self._strands(self._plan, index)
        widths = [self.width_px * self._plan.thicker] * (self.branches + 1) + [self.width_px] * self.branches
        masks = visible_tubes(strands, widths, self.size)
        return Truth(tuple(one.curve() for one in strands), masks, tuple(range(len(strands))))

    @cached_property
    def _plan(self) -> _Plan:
        """The first harness of a row of random ones that lies in the image, with branch points that are clear."""
        for attempt in range(_ATTEMPTS):
            rng = np.random.default_rng([self.seed, self.branches, HARNESS_VIEWS.index(self.view), attempt])
            plan = self._draw(rng)
            if plan is not None and all(self._fits(plan, index) for index in {0, self._frames // 2, self._frames - 1}):
                return plan
        raise InputError(f"no harness of {self.branches} branches fits an image of {self.size}")

    def _draw(self, rng: np.random.Generator) -> _Plan | None:
        k, width, count = proportion(self.size), self.width_px, self.branches
        trunk = self._bends(rng, k * rng.uniform(*_TRUNK_PX))
        at = trunk.length_px * (np.arange(count) + rng.uniform(0.7, 1.3, count)) / (count + 1)
        if count > 1 and np.diff(at).min() < _APART_WIDTHS * width:
            return None
        others = [self._bends(rng, k * rng.uniform(*_BRANCH_PX) / (1.0 + 0.1 * count)) for _ in range(count)]
        leaves = rng.uniform(*_LEAVES_RAD, count) * rng.choice((-1.0, 1.0), count)
        tilt = rng.uniform(*_TILT_RAD) if self.view == "in perspective" else 0.0
        lean = rng.uniform(-0.5, 0.5) + math.pi * rng.integers(2)
        return _Plan(
            trunk, others, (at / trunk.length_px).tolist(), leaves.tolist(), lean, tilt, rng.uniform(*_THICKER)
        )

    def _bends(self, rng: np.random.Generator, length_px: float) -> _Bends:
        order = np.arange(1, _MODES + 1)
        rest, sway = rng.normal(size=_MODES) * _BEND_RAD / order, rng.normal(size=_MODES) * _SWAY_RAD / order
        return _Bends(length_px, rest, sway, rng.uniform(0.0, 2.0 * np.pi, _MODES))

    def _strands(self, plan: _Plan, index: int) -> tuple[Strand, ...]:
        seconds = index / _FPS
        trunk = integrate(plan.trunk.heading(seconds) + plan.lean_rad, plan.trunk.length_px)
        at = [round(share * (len(trunk.points) - 1)) for share in plan.at]
        lines = [trunk.points[low : high + 1] for low, high in pairwise([0, *at, len(trunk.points) - 1])]
        for place, bends, leaves in zip(at, plan.branches, plan.leaves_rad, strict=True):
            own = integrate(bends.heading(seconds) + trunk.heading[place] + leaves, bends.length_px)
            lines.append(own.points + trunk.points[place])
        everything = np.concatenate(lines)
        middle = 0.5 * (everything.min(axis=0) + everything.max(axis=0))
        return tuple(_strand_through(self._seen(line - middle, plan.tilt_rad)) for line in lines)

    def _seen(self, points: FloatArray, tilt_rad: float) -> FloatArray:
        """Return where points (n, 2) of the table are in the image, px."""
        focal = _FOCAL * max(self.size)
        depth = focal + points[:, 1] * math.sin(tilt_rad)
        flat = np.stack((points[:, 0], points[:, 1] * math.cos(tilt_rad)), axis=1)
        seen: FloatArray = flat * (focal / depth)[:, None] + 0.5 * np.array([self.size[1] - 1, self.size[0] - 1])
        return seen

    def _fits(self, plan: _Plan, index: int) -> bool:
        strands = self._strands(plan, index)
        margin = self.width_px * plan.thicker
        everything = np.concatenate([strand.points for strand in strands])
        if (everything < margin).any() or (everything > np.array(self.size[::-1]) - 1.0 - margin).any():
            return False
        for end in [strand.points[at] for strand in strands for at in (0, -1)]:
            others = [one.points for one in strands if min(np.hypot(*(one.points[[0, -1]] - end).T)) > 1.0]
            if others and np.hypot(*(np.concatenate(others) - end).T).min() < _CLEAR_WIDTHS * margin:
                return False
        return True


def _strand_through(points: FloatArray) -> Strand:
    """Return a strand through points (n, 2), evenly spaced."""
    along = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))))
    even = np.linspace(0.0, along[-1], max(32, math.ceil(2.0 * along[-1])))
    own = np.stack([np.interp(even, along, column) for column in points.T], axis=1)
    way = np.gradient(own, axis=0)
    return Strand(own, np.unwrap(np.arctan2(way[:, 1], way[:, 0])), float(even[1]))


_SUITE = ((2, "drawn"), (3, "drawn"), (4, "in perspective"), (6, "drawn"))


def harnesses(scale: float = 1.0, seed: int = 0, size: tuple[int, int] = (720, 1280)) -> list[KnownSequence]:
    """Return sequences of harnesses with 2 to 6 branches, drawn and in perspective; clean, noisy and occluded.

    Each has 60 frames by the scale, at least 3. Noise and occluders go in proportion with `size`.
    """
    found: list[KnownSequence] = []
    for branches, view in _SUITE:
        clean = HarnessSequence(branches, view, count_at(scale, _FRAMES, 3), size, seed)
        found += [clean, *(DegradedSequence(clean, one.scaled(proportion(size)), seed) for one in (NOISY, OCCLUDED))]
    return found
