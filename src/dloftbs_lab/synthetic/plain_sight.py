"""Sequences in perspective with nothing hidden: a track may say nothing beyond the frame."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property
from typing import Any

import numpy as np

from dloftbs.errors import InputError
from dloftbs.support.arrays import FloatArray
from dloftbs_lab.synthetic import plain_sight_scenes as scenes
from dloftbs_lab.synthetic.free_ends import FreeEnd, draw_cable_mask
from dloftbs_lab.synthetic.generated import NumberedSequence, check_choice, numbers_at, proportion
from dloftbs_lab.synthetic.plain_sight_scenes import FRAMES, Camera, Part, Stage
from dloftbs_lab.synthetic.space_axis import curve_through_samples
from dloftbs_lab.truth import Truth

_FPS = 30.0
_TOLERANCE_PX = 5.0
_WIDTHS_PX = (6.0, 16.0)  # HD, in the plane

_SCENES: Mapping[str, Callable[[np.random.Generator, Stage], list[Part]]] = {
    "bends": scenes.bends,
    "tilts": scenes.tilts,
    "approaches": scenes.approaches,
    "swings": scenes.swings,
    "exchange": scenes.exchange,
    "three cross": scenes.three_cross,
    "darts": scenes.darts,
    "drops": scenes.bends,
    "ends meet": scenes.ends_meet,
    "cut in two": scenes.cut_in_two,
}

PLAIN_SIGHT_KINDS = tuple(_SCENES)
"""Motions: cables bend and drift; tilt, rigid, by 65 degrees; come nearer by a half; swing by up to 80 px a frame;
one of two is taken away and a third one comes; three cross; a cable swings by a fifth to a third of its length a frame;
bends, in frames 17 to 100 ms apart; the ends of two come together at an angle and part again; one is cut, and
the shorter part, another one from then on, moves away."""

_CABLES = {"exchange": 3, "three cross": 3, "ends meet": 2, "cut in two": 2}
_DROPPED_S = (1.0 / 60.0, 0.1)
"""Shortest and longest time between the frames of "drops"."""


class PlainSightSequence(NumberedSequence):
    """Perfect masks of cables that move in front of a pinhole camera, with the projected centre lines.

    Nothing hides a cable but, in "three cross", another one. Free ends are flat, round, frayed or tapered. A cable that
    is not there has no id in the truth.

    Parameters
    ----------
    kind : str
        One of `PLAIN_SIGHT_KINDS`.
    number : int
        Number within the kind: another one shows other motions.
    frames : int
        The motion is that of 80 frames: with fewer the steps are larger.
    size, seed
        As `GeneratedSequence` has them; another seed gives other motions.
    width_px : float, optional
        Width of the cables in the plane from which they start; drawn from 6 to 16 in an image of 1280 x 720 and in
        proportion in others, where it is left out.

    Attributes
    ----------
    family : str
        The kind.
    cables : int
        Number of cables in the sequence.

    Raises
    ------
    InputError
        If a value is out of range.
    """

    tolerance_px = _TOLERANCE_PX

    def __init__(
        self,
        kind: str,
        number: int = 0,
        frames: int = FRAMES,
        size: tuple[int, int] = (720, 1280),
        seed: int = 0,
        width_px: float | None = None,
    ) -> None:
        check_choice("kind", kind, PLAIN_SIGHT_KINDS)
        key = (PLAIN_SIGHT_KINDS.index(kind),)
        super().__init__(kind, kind, key, number, frames, size, seed, max(1, frames) * _FPS / FRAMES)
        self.cables = _CABLES.get(kind, 1)
        widest = 2.0 * _WIDTHS_PX[1] * proportion(size)
        if width_px is not None and not 1.0 <= width_px <= widest:
            raise InputError(f"width_px must be in 1..{widest:g} here, got {width_px}")
        drawn = float(self._rng(0).uniform(*_WIDTHS_PX)) * proportion(size)
        self.width_px = max(1.0, drawn) if width_px is None else width_px

    def _make_truth(self, index: int) -> Truth:
        phase, camera = float(self._phases[index]), Camera(self.size)
        present = [(number, part) for number, part in enumerate(self._parts) if part.there(phase)]
        owner = np.full(self.size, -1, np.int16)
        curves = []
        for number, part in present:
            points = part.body(phase)
            seen = camera.project(points)
            widths = self.width_px * camera.magnification(points)
            owner[draw_cable_mask(seen, widths, self.size, self._ends[number])] = number
            curves.append(curve_through_samples(seen))
        masks = tuple(owner == number for number, _ in present)
        return Truth(tuple(curves), masks, tuple(number for number, _ in present))

    def _labels(self, index: int) -> dict[str, Any]:
        """Return the labels of a frame; dropped frames leave stamps that are not even."""
        labels = super()._labels(index)
        if self.family == "drops":
            labels["stamp"] = float(self._phases[index]) * sum(_DROPPED_S) / 2.0 * self._frames
        return labels

    @cached_property
    def _phases(self) -> FloatArray:
        """Phases of the frames, from 0 to below 1."""
        if self.family != "drops":
            return np.arange(self._frames) / self._frames
        times = np.cumsum(self._rng(3).uniform(*_DROPPED_S, self._frames))
        return (times - times[0]) / times[-1]

    @cached_property
    def _parts(self) -> list[Part]:
        return _SCENES[self.family](self._rng(1), Stage(Camera(self.size), self.width_px))

    @cached_property
    def _ends(self) -> list[tuple[FreeEnd, FreeEnd]]:
        rng = self._rng(2)
        return [(FreeEnd.draw(rng), FreeEnd.draw(rng)) for _ in self._parts]


def plain_sight(scale: float = 1.0, seed: int = 0, size: tuple[int, int] = (720, 1280)) -> list[PlainSightSequence]:
    """Return 20 sequences of each of the `PLAIN_SIGHT_KINDS`, by the scale, 80 frames each."""
    return [
        PlainSightSequence(kind, number, FRAMES, size, seed)
        for kind in PLAIN_SIGHT_KINDS
        for number in numbers_at(scale)
    ]
