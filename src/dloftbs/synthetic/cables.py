"""Images of several cables, as masks of a network with exact truth."""

from __future__ import annotations

import numpy as np

from dloftbs.errors import InputError
from dloftbs.synthetic.degrade import NETWORK, DegradedSequence
from dloftbs.synthetic.generated import MaskSequence, count_at, proportion, width_at
from dloftbs.synthetic.strand import Strand
from dloftbs.synthetic.tangle import draw_tangle

_GROUPS = {2: 9, 3: 9, 4: 9, 5: 9, 6: 9, 7: 9, 8: 8}
_WIDEST_PX = 48.0  # in HD; four times `HD_WIDTH_PX`


class TangleSequence(MaskSequence):
    """Perfect masks of several cables that lie on one another, each image on its own.

    Parameters
    ----------
    cables : int
        From 2 to 20.
    frames : int
        Number of images.
    size : (int, int)
        ``(H, W)`` px.
    seed : int
        Another seed gives other images.
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

    def _strands(self, index: int) -> tuple[Strand, ...]:
        return draw_tangle(
            np.random.default_rng([self.seed, self.cables, index]), self.cables, self.size, self.width_px
        )


def several_cables(scale: float = 1.0, seed: int = 0, size: tuple[int, int] = (720, 1280)) -> list[DegradedSequence]:
    """Return images of 2 to 8 cables, a sequence for each number, with masks as a network leaves them.

    The cables cross, run side by side for a stretch, and end under each other. The masks have ragged edges, specks,
    pinholes, missing stretches and false positives.

    Parameters
    ----------
    scale : float
        Share of the 62 images; at least one for each number of cables.
    seed : int
    size : (int, int)
        ``(H, W)`` px.

    Raises
    ------
    InputError
        If a value is out of range.
    """
    degradation = NETWORK.scaled(proportion(size))
    tangles = [TangleSequence(cables, count_at(scale, full, 1), size, seed) for cables, full in _GROUPS.items()]
    return [DegradedSequence(tangle, degradation, 100 * seed + tangle.cables, tangle.name) for tangle in tangles]
