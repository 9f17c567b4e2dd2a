"""Moving cables by kind of difficulty, as perfect masks with exact truth: what accuracy is measured on."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dloftbs_lab.known_sequence import KnownSequence
from dloftbs_lab.synthetic.degrade import NOISY, OCCLUDED, Degradation, DegradedSequence
from dloftbs_lab.synthetic.generated import HD_WIDTH_PX, MaskSequence, check_choice, count_at, proportion
from dloftbs_lab.synthetic.headings import calm, drifting, high_curvature, one_loop, tilted, untying, whipping
from dloftbs_lab.synthetic.motion import Heading, Motion, fit_motion
from dloftbs_lab.synthetic.strand import Strand

_FRAMES = 120
_FPS = 30.0
_MARGIN = 0.04


@dataclass(frozen=True)
class _Kind:
    """Cables and their motion, for 1280 x 720 px and the 120 frames of a whole sequence.

    Parameters
    ----------
    heading : callable
        Draws how a cable bends.
    length_px : float
    cables : int
    travel : (float, float)
        Distance that a cable is carried to and fro, as shares of width and height.
    round_trips : int
        Number of times that it is.
    rapid : bool
        Whether a shorter sequence shows a part of the motion at its speed, rather than all of it in larger steps.
    """

    heading: Callable[[np.random.Generator], Heading]
    length_px: float
    cables: int = 1
    travel: tuple[float, float] = (0.0, 0.0)
    round_trips: int = 1
    rapid: bool = False


_KINDS = {
    "high curvature": _Kind(high_curvature, 1150.0, travel=(0.03, 0.06)),
    "one loop": _Kind(one_loop, 1000.0),
    "a loop that unties": _Kind(untying, 1000.0),
    "rapid moves 1": _Kind(calm, 700.0, travel=(0.40, 0.30), round_trips=4, rapid=True),
    "rapid moves 2": _Kind(whipping, 850.0, travel=(0.10, 0.10), round_trips=2, rapid=True),
    "three cables": _Kind(drifting, 700.0, 3, travel=(0.22, 0.18), round_trips=2),
    "five cables": _Kind(drifting, 650.0, 5, travel=(0.22, 0.18), round_trips=2),
}

KINDS = tuple(_KINDS)
"""The kinds of motion."""


_ONE_CABLE = ("high curvature", "one loop", "a loop that unties", "rapid moves 1", "rapid moves 2")
_SUITE: tuple[tuple[str, Degradation | None], ...] = (
    *((kind, None) for kind in _ONE_CABLE),
    *((kind, NOISY) for kind in _ONE_CABLE),
    ("high curvature", OCCLUDED),
    ("one loop", OCCLUDED),
    ("three cables", None),
    ("three cables", OCCLUDED),
    ("five cables", None),
    ("five cables", NOISY),
)


class KindSequence(MaskSequence):
    """Perfect masks of cables that move in a way of a given kind; the later cable lies over the earlier one.

    Parameters
    ----------
    kind : str
        One of `KINDS`.
    frames : int
        The whole motion takes 4 s: with fewer than 120 frames the steps are larger. Rapid moves keep their speed, and
        of them a part is seen.
    size, seed
        As `GeneratedSequence` has them; another seed gives another motion.
    width_px : float, optional
        Width of the cables; 12 in an image of 1280 x 720 and in proportion in others, where it is left out.

    Raises
    ------
    InputError
        If a value is out of range, or the cables too wide to bend so.
    """

    def __init__(
        self,
        kind: str,
        frames: int = _FRAMES,
        size: tuple[int, int] = (720, 1280),
        seed: int = 0,
        width_px: float | None = None,
    ) -> None:
        check_choice("kind", kind, KINDS)
        self._kind = kind
        self._steps = _FRAMES if _KINDS[kind].rapid else frames
        super().__init__(kind, frames, size, seed, max(1, self._steps) * _FPS / _FRAMES)
        self.width_px = HD_WIDTH_PX * proportion(size) if width_px is None else width_px
        # What cannot be is refused here, not at the first frame.
        _ = self._motions

    def _strands(self, index: int) -> tuple[Strand, ...]:
        return tuple(motion.strand(index / self._steps) for motion in self._motions)

    @cached_property
    def _motions(self) -> tuple[Motion, ...]:
        kind, k = _KINDS[self._kind], proportion(self.size)
        return tuple(self._motion(kind, k, number) for number in range(kind.cables))

    def _motion(self, kind: _Kind, k: float, number: int) -> Motion:
        rng = np.random.default_rng([self.seed, KINDS.index(self._kind), number])
        heading = kind.heading(rng)
        if kind.cables > 1:
            # Evenly spread directions, so that cables cross rather than cover each other.
            heading = tilted(heading, math.pi * (number + rng.uniform(-0.2, 0.2)) / kind.cables + self._lean)
        travel = np.multiply(kind.travel, self.size[::-1]) * rng.choice((-1.0, 1.0), 2)
        start = 0.0 if kind.cables == 1 else rng.uniform(0.0, 2.0 * math.pi)
        return fit_motion(
            heading,
            self._box(),
            kind.length_px * k,
            self.width_px,
            (float(travel[0]), float(travel[1])),
            lambda phase: 0.5 - 0.5 * math.cos(2.0 * math.pi * kind.round_trips * phase + start),
        )

    @property
    def _lean(self) -> float:
        """Return the direction of the first of several cables."""
        return float(np.random.default_rng([self.seed, 100]).uniform(0.0, 2.0 * math.pi))

    def _box(self) -> tuple[float, float, float, float]:
        height, width = self.size
        # The same for widths up to 40 px at 1280 x 720, so that they do not change the motion.
        margin = _MARGIN * height + max(20.0 * proportion(self.size), self.width_px / 2.0)
        return margin, margin, width - margin, height - margin


def kinds(scale: float = 1.0, seed: int = 0, size: tuple[int, int] = (720, 1280)) -> list[KnownSequence]:
    """Return a sequence of each of the `KINDS`, clean and, of some, noisy or occluded; masks only.

    Each has 120 frames by the scale, at least 3. Noise and occluders are those of an image of 1280 x 720 and go in
    proportion with `size`.
    """
    clean = {kind: KindSequence(kind, count_at(scale, _FRAMES, 3), size, seed) for kind in KINDS}
    return [
        clean[kind]
        if degradation is None
        else DegradedSequence(clean[kind], degradation.scaled(proportion(size)), seed)
        for kind, degradation in _SUITE
    ]
