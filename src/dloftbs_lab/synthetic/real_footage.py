"""Sequences with the faults of real footage: codecs, gloss, pin-holes, dashes, specks, ragged edges and lumps."""

from __future__ import annotations

from functools import cached_property

from dloftbs.data.frame import Frame
from dloftbs_lab.synthetic.footage_faults import visible_masks
from dloftbs_lab.synthetic.footage_scenes import FOOTAGE_SCENES, Scene, Shot
from dloftbs_lab.synthetic.generated import NumberedSequence, check_choice, numbers_at
from dloftbs_lab.truth import Truth

_FPS = 30.0
_FRAMES = 12
_TOLERANCE_PX = 5.0

FOOTAGE_FAMILIES = tuple(FOOTAGE_SCENES)
"""Faults: the edge of a thick cable in a coded video, alone and at a crossing; highlights wholly inside, open at the
border of the image, open to a side; pin-holes, salt and junk far from a highlight; thin lines in dashes; specks near a
worm; edges that are ragged by a third of the width; a worm that coils to a lump; rings that cross; wires of two colours
along one line, with a picture."""


class RealFootageSequence(NumberedSequence):
    """Masks of a slowly moving scene with one kind of fault, and the exact centre lines.

    Specks, salt and junk are no objects of the truth, but may well be found as short ones: their figure is the share of
    right objects.

    Parameters
    ----------
    family : str
        One of `FOOTAGE_FAMILIES`.
    number : int
        Number within the family: another one shows another scene.
    frames : int
        The motion is that of 12 frames: with fewer the steps are larger.
    size : (int, int)
        ``(H, W)`` px. Worms, dashes and edges are as many pixels in every size.
    seed : int
        Another seed gives other scenes.

    Attributes
    ----------
    family : str
    cables : int
        Number of cables in the sequence.

    Raises
    ------
    InputError
        If a value is out of range.
    """

    tolerance_px = _TOLERANCE_PX

    def __init__(
        self, family: str, number: int = 0, frames: int = _FRAMES, size: tuple[int, int] = (480, 640), seed: int = 0
    ) -> None:
        check_choice("family", family, FOOTAGE_FAMILIES)
        super().__init__(family, family, (FOOTAGE_FAMILIES.index(family),), number, frames, size, seed, _FPS)
        self._shot_of: tuple[int, Shot] | None = None

    @property
    def cables(self) -> int:
        """Number of cables in the sequence."""
        return len(self._shot(0).cables)

    def _make_frame(self, index: int) -> Frame:
        """Return one frame with the faulty mask, shape (H, W) bool, and an image, shape (H, W, 3), if there is one."""
        shot = self._shot(index)
        return Frame(image=shot.image, mask=shot.mask, **self._labels(index))

    def _make_truth(self, index: int) -> Truth:
        cables = self._shot(index).cables
        masks = visible_masks(cables, self.size)
        return Truth(tuple(cable.curve() for cable in cables), masks, tuple(range(len(cables))))

    def _shot(self, index: int) -> Shot:
        # A frame and its truth are asked for one after the other, and each needs the same drawing.
        latest = self._shot_of
        if latest is None or latest[0] != index:
            self._shot_of = latest = (index, self._scene(index / self._frames, self._rng(1, index)))
        return latest[1]

    @cached_property
    def _scene(self) -> Scene:
        return FOOTAGE_SCENES[self.family](self._rng(0), self.size, self.number)

    def __getstate__(self) -> dict[str, object]:
        return {**super().__getstate__(), "_shot_of": None}


def real_footage(scale: float = 1.0, seed: int = 0, size: tuple[int, int] = (720, 1280)) -> list[RealFootageSequence]:
    """Return 20 sequences of each of the `FOOTAGE_FAMILIES`, by the scale, 12 frames each."""
    return [
        RealFootageSequence(family, number, _FRAMES, size, seed)
        for family in FOOTAGE_FAMILIES
        for number in numbers_at(scale)
    ]
