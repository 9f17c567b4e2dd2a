"""Sequences that tracking is measured on: cables that cross, hide, touch and leave, each the same from end to end."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Literal

import numpy as np

from dloftbs.data.frame import Frame
from dloftbs.errors import InputError
from dloftbs.support.arrays import AnyArray
from dloftbs_lab.synthetic import tracking_scenes as scenes
from dloftbs_lab.synthetic.depth_noise import TYPICAL_NOISE
from dloftbs_lab.synthetic.generated import MaskSequence, NumberedSequence, numbers_at, width_at
from dloftbs_lab.synthetic.sketch import Image
from dloftbs_lab.synthetic.space_scene import hd_camera
from dloftbs_lab.synthetic.strand import Strand
from dloftbs_lab.synthetic.studio import DYES, Studio
from dloftbs_lab.synthetic.tracking_scenes import FRAMES, Mask, Play, Stage
from dloftbs_lab.truth import Truth

Evidence = Literal["occluders", "depth", "image"]
"""Fields of a frame that show what hides cables."""

_FPS = 30.0
_GROUND_M, _CABLES_M, _COVERS_M = 1.0, 0.9, 0.7  # distances along the optical axis
_ABOVE_M = 0.02  # from a cable to the next one over it
_COVER_COLOURS = np.array(
    [(136.0, 164.0, 214.0), (92.0, 138.0, 70.0), (52.0, 50.0, 54.0), (230.0, 232.0, 228.0), (96.0, 140.0, 186.0)]
)  # skin, green plastic, a dark glove, paper, cardboard
_WIDEST_PX = 20.0  # in HD: the tightest loops allow no more

_SCENES: Mapping[str, Callable[[np.random.Generator, Stage, int], Play]] = {
    "crossing": scenes.crossing,
    "occluded": scenes.occluded,
    "touching": scenes.touching,
    "leaving": scenes.leaving,
    "ends pass": scenes.ends_pass,
    "loop opens": scenes.loop_opens,
    "hidden": scenes.hidden,
    "hands": scenes.hands,
}

TRACKING_FAMILIES: Mapping[str, tuple[int, ...]] = {
    "crossing": (1, 3, 5),
    "occluded": (1, 3, 5),
    "touching": (2,),
    "leaving": (1, 3),
    "ends pass": (1,),
    "loop opens": (1,),
    "hidden": (1, 3),
    "hands": (1, 3),
}
"""Families of sequences, and the numbers of cables that each comes with."""

_WITH_OCCLUDERS = ("occluded", "hidden", "hands")


class TrackingSequence(NumberedSequence, MaskSequence):
    """Perfect masks of cables that move over each other and behind occluders, out of the image and back.

    The truth has every cable in every frame, hidden or outside or not; `Truth.shown_spans` says how much of it shows.

    Parameters
    ----------
    family : str
        One of `TRACKING_FAMILIES`.
    cables : int
        One of the numbers that the family comes with.
    number : int
        Number within the family: another one shows other motions.
    frames : int
        Number of frames in the 2 s that the motion takes: with fewer than 60 the steps are larger.
    size, seed
        As `GeneratedSequence` has them; another seed gives other motions.
    width_px : float, optional
        Width of the cables; 12 in an image of 1280 x 720 and in proportion in others, where it is left out.
    evidence : collection of {"occluders", "depth", "image"}
        What a frame has besides its mask: a mask of what covers cables; depth with the errors of a camera, with the
        covers 20 cm above the cables and the ground 10 cm below; an image of blue cables on a workbench, on which tools
        lie, and of covers of one colour, another one in each sequence.

    Raises
    ------
    InputError
        If a value is out of range.
    """

    def __init__(
        self,
        family: str,
        cables: int,
        number: int = 0,
        frames: int = FRAMES,
        size: tuple[int, int] = (720, 1280),
        seed: int = 0,
        width_px: float | None = None,
        evidence: Collection[Evidence] = (),
    ) -> None:
        if cables not in TRACKING_FAMILIES.get(family, ()):
            known = "; ".join(f"{name!r} with {counts}" for name, counts in TRACKING_FAMILIES.items())
            raise InputError(f"families come with so many cables: {known}; got {family!r} with {cables}")
        name = f"{family}, {cables} cable{'' if cables == 1 else 's'}"
        key = (list(_SCENES).index(family), cables)
        super().__init__(name, family, key, number, frames, size, seed, max(1, frames) * _FPS / FRAMES)
        self.cables = cables
        self.width_px = width_at(size, width_px, _WIDEST_PX)
        self._evidence = frozenset(evidence)

    def _make_frame(self, index: int) -> Frame:
        """Return one frame with the mask of all cables, shape (H, W) bool, and the evidence asked for."""
        frame = super()._make_frame(index)
        if "occluders" in self._evidence:
            frame = replace(frame, occluders=self.covered(index))
        if "depth" in self._evidence:
            frame = replace(frame, depth=self._depth(index), camera=hd_camera(self.size))
        if "image" in self._evidence:
            frame = replace(frame, image=self._image(index))
        return frame

    def _image(self, index: int) -> Image:
        """Return an image (H, W, 3), BGR."""
        dyes = [DYES[0]] * self.cables
        colour = _COVER_COLOURS[np.random.default_rng([self.seed, self.number]).integers(len(_COVER_COLOURS))]
        return self._studio.shoot(self._strands(index), dyes, (), index, [(self.covered(index), colour)])

    def _depth(self, index: int) -> AnyArray:
        """Return the depth (H, W), m, as a camera measures it."""
        depth = np.full(self.size, _GROUND_M, np.float32)
        masks = self.truth(index).visible_masks
        for number, mask in enumerate(masks):
            depth[mask] = _CABLES_M - number * _ABOVE_M
        depth[self.covered(index)] = _COVERS_M
        return TYPICAL_NOISE.apply(depth, np.any(masks, axis=0), np.random.default_rng([self.seed, self.number, index]))

    def covered(self, index: int) -> Mask:
        """Return the pixels, shape (H, W), that are behind an occluder.

        Raises
        ------
        InputError
            If there is no such frame.
        """
        self._check(index)
        return self._play.covered(index / self._frames, self._strands(index), self.size)

    def _make_truth(self, index: int) -> Truth:
        truth = super()._make_truth(index)
        if not self._play.covers:
            return truth
        in_sight = ~self.covered(index)
        return replace(truth, visible_masks=tuple(mask & in_sight for mask in truth.visible_masks))

    def _strands(self, index: int) -> tuple[Strand, ...]:
        return self._play.strands(index / self._frames)

    @cached_property
    def _studio(self) -> Studio:
        return Studio(self.seed + self.number, self.size, self.width_px)

    @cached_property
    def _play(self) -> Play:
        return _SCENES[self.family](self._rng(), Stage(self.size, self.width_px), self.cables)


def tracking(scale: float = 1.0, seed: int = 0, size: tuple[int, int] = (720, 1280)) -> list[TrackingSequence]:
    """Return sequences of all `TRACKING_FAMILIES`, 20 for each number of cables by the scale, 60 frames each."""
    return _sequences(tuple(TRACKING_FAMILIES), scale, seed, size)


def known_occluders(
    scale: float = 1.0,
    seed: int = 0,
    size: tuple[int, int] = (720, 1280),
    evidence: Collection[Evidence] = ("occluders", "depth"),
) -> list[TrackingSequence]:
    """Return the sequences of `tracking` with one and three cables and occluders, whose frames show them.

    Their `evidence` is as for `TrackingSequence`.
    """
    return _sequences(_WITH_OCCLUDERS, scale, seed, size, evidence, most_cables=3)


def _sequences(
    families: Sequence[str],
    scale: float,
    seed: int,
    size: tuple[int, int],
    evidence: Collection[Evidence] = (),
    most_cables: int = 5,
) -> list[TrackingSequence]:
    return [
        TrackingSequence(family, cables, number, FRAMES, size, seed, evidence=evidence)
        for family in families
        for cables in TRACKING_FAMILIES[family]
        if cables <= most_cables
        for number in numbers_at(scale)
    ]
