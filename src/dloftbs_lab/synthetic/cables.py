"""Images of several cables, as masks of a network with exact truth."""

from __future__ import annotations

import numpy as np

from dloftbs.errors import InputError
from dloftbs_lab.synthetic.degrade import DegradedSequence
from dloftbs_lab.synthetic.generated import MaskSequence, count_at, proportion, width_at
from dloftbs_lab.synthetic.network_masks import NETWORK
from dloftbs_lab.synthetic.strand import Strand
from dloftbs_lab.synthetic.strewn import draw_strewn
from dloftbs_lab.synthetic.tangle import draw_tangle

_GROUPS = {2: 9, 3: 9, 4: 9, 5: 9, 6: 9, 7: 9, 8: 8}
_WIDEST_PX = 48.0  # in HD; four times `HD_WIDTH_PX`


class _ImagesOfCables(MaskSequence):
    """Perfect masks of several cables, each image on its own.

    Parameters
    ----------
    cables : int
        From 2 to 20.
    frames : int
        Number of images.
    size, seed
        As `GeneratedSequence` has them; another seed gives other images.
    width_px : float, optional
        Width of the cables; 12 in an image of 1280 x 720 and in proportion in others, where it is left out.

    Raises
    ------
    InputError
        If a value is out of range.
    """

    def __init__(
        self,
        cables: int,
        frames: int = 9,
        size: tuple[int, int] = (720, 1280),
        seed: int = 0,
        width_px: float | None = None,
    ) -> None:
        if not 2 <= cables <= 20:
            raise InputError(f"cables must be in 2..20, got {cables}")
        super().__init__(f"{cables} cables", frames, size, seed, None)
        self.width_px = width_at(size, width_px, _WIDEST_PX)
        self.cables = cables

    def _rng(self, index: int) -> np.random.Generator:
        return np.random.default_rng([self.seed, self.cables, index])


class TangleSequence(_ImagesOfCables):
    """Perfect masks of several cables that lie on one another, run side by side and end under others.

    Parameters and errors are those of all images of cables: ``cables``, ``frames``, ``size``, ``seed``, ``width_px``.
    """

    def _strands(self, index: int) -> tuple[Strand, ...]:
        return draw_tangle(self._rng(index), self.cables, self.size, self.width_px)


class StrewnSequence(_ImagesOfCables):
    """Perfect masks of several cables strewn over a table, most of them apart, some cut by the image's border.

    Parameters and errors are those of all images of cables: ``cables``, ``frames``, ``size``, ``seed``, ``width_px``.
    """

    def _strands(self, index: int) -> tuple[Strand, ...]:
        return draw_strewn(self._rng(index), self.cables, self.size, self.width_px)


def several_cables(scale: float = 1.0, seed: int = 0, size: tuple[int, int] = (720, 1280)) -> list[DegradedSequence]:
    """Return 62 images of 2 to 8 cables by the scale, a sequence for each number, with masks as a network leaves them.

    The cables lie as in the photographs of the paper's Table II: smooth arcs over a table, some of which cross, are cut
    by the border, or run side by side. The masks have the `NETWORK` faults: soft edges that wander, neighbours that
    merge, lost ends and gaps, blobs at connectors; a stray stroke in one image of four.
    """
    degradation = NETWORK.scaled(proportion(size))
    images = [StrewnSequence(cables, count_at(scale, full, 1), size, seed) for cables, full in _GROUPS.items()]
    return [DegradedSequence(one, degradation, 100 * seed + one.cables, one.name) for one in images]
