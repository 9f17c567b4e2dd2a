"""The demo sequence as a source of frames, with the truth beside it."""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any

from dloftbs.config import HsvRange
from dloftbs.data.frame import Frame
from dloftbs.errors import InputError
from dloftbs_lab.synthetic.demo_scene import Scene
from dloftbs_lab.synthetic.generated import GeneratedSequence
from dloftbs_lab.synthetic.studio import DYES, HSV, Studio
from dloftbs_lab.truth import Truth


class DemoSequence(GeneratedSequence):
    """A rendered sequence: cables on a workbench, one led by two grippers into a loop that crosses itself.

    Every frame is a function of the arguments and its index alone, bit for bit. The last frame runs into the first.

    Parameters
    ----------
    frames, size, seed
        As `GeneratedSequence` has them; another seed gives another bench and another motion.
    cables : int
        1, or 2: the second, of another colour, is pushed across the first for a part of the sequence.
    width_px : float
        Width of the cables.
    occluder : bool
        Whether grippers hold the first cable and a gloved hand reaches in.
    fps : float
        Gives the stamps ``index / fps``.

    Raises
    ------
    InputError
        If a value is out of range, or the cables too wide to bend in an image of this size.
    """

    def __init__(
        self,
        frames: int = 90,
        size: tuple[int, int] = (720, 1280),
        seed: int = 0,
        cables: int = 2,
        width_px: float = 12.0,
        occluder: bool = True,
        fps: float = 30.0,
    ) -> None:
        super().__init__(f"demo (seed {seed})", frames, size, seed, fps)
        if cables not in (1, 2) or not 1.0 <= width_px < math.inf:
            raise InputError(f"expected cables 1 or 2 and width_px >= 1, got {cables} and {width_px}")
        self.cables = cables
        self.width_px = width_px
        self._occluder = occluder
        # What cannot be is refused here, not at the first frame.
        _ = self._scene.motions

    @property
    def hsv(self) -> tuple[HsvRange, ...]:
        """The colour of each cable: what `SegmentationConfig.hsv` takes."""
        return HSV[: self.cables]

    def _make_frame(self, index: int) -> Frame:
        """Render one frame, shape (H, W, 3) BGR."""
        phase = index / self._frames
        strands = self._scene.strands(phase)
        image = self._studio.shoot(strands, DYES[: len(strands)], self._scene.actors(strands, phase), index)
        return Frame(image=image, **self._labels(index))

    def _make_truth(self, index: int) -> Truth:
        phase = index / self._frames
        strands = self._scene.strands(phase)
        masks = self._studio.visible(strands, self._scene.actors(strands, phase))
        return Truth(tuple(strand.curve() for strand in strands), masks, tuple(range(self.cables)))

    def _labels(self, index: int) -> dict[str, Any]:
        return {**super()._labels(index), "name": f"demo#{index:04d}"}

    @cached_property
    def _scene(self) -> Scene:
        return Scene(self.seed, self.size, self.cables, self.width_px, self._occluder)

    @cached_property
    def _studio(self) -> Studio:
        return Studio(self.seed, self.size, self.width_px)
