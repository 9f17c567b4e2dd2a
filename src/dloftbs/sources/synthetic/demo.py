"""The demo sequence as a source of frames, with the truth beside it."""

from __future__ import annotations

import math
from typing import Any

from dloftbs.config import HsvRange
from dloftbs.errors import InputError
from dloftbs.frame import Frame
from dloftbs.sources.base import KnownSequence
from dloftbs.sources.synthetic.scene import Scene
from dloftbs.sources.synthetic.studio import DYES, HSV, Studio
from dloftbs.truth import Truth


class DemoSequence(KnownSequence):
    """A rendered sequence: cables on a workbench, one led by two grippers into a loop that crosses itself.

    Every frame is a function of the arguments and its index alone, bit for bit. The last frame runs into the first.

    Parameters
    ----------
    frames : int
    size : (int, int)
        ``(H, W)`` px.
    seed : int
        Not negative; another seed gives another bench and another motion.
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
        if frames < 1 or seed < 0 or cables not in (1, 2):
            raise InputError(f"expected frames >= 1, seed >= 0 and cables 1 or 2, got {frames}, {seed} and {cables}")
        if min(size) < 64 or not 1.0 <= width_px < math.inf or not 0.0 < fps < math.inf:
            raise InputError(
                f"expected a size of at least 64 x 64, width_px >= 1 and fps > 0, got {size}, {width_px} and {fps}"
            )
        self.name = f"demo (seed {seed})"
        self.length = self._frames = frames
        self.fps = self._rate = fps
        self.size = size
        self.width_px = width_px
        self._scene = Scene(seed, size, cables, width_px, occluder)
        self._studio = Studio(seed, size, width_px)
        # This fits the motions: what cannot be is refused here, not at the first frame.
        self._ids = tuple(range(len(self._scene.motions)))

    def __reduce__(self) -> tuple[Any, ...]:
        scene = self._scene
        arguments = (self._frames, self.size, scene.seed, scene.cables, self.width_px, scene.occluder, self._rate)
        return type(self), arguments

    @property
    def hsv(self) -> tuple[HsvRange, ...]:
        """The colour of each cable: what `SegmentationConfig.hsv` takes."""
        return HSV[: len(self._ids)]

    def frame(self, index: int) -> Frame:
        """Render one frame, shape (H, W, 3) BGR.

        Raises
        ------
        InputError
            If there is no such frame.
        """
        phase = self._phase(index)
        strands = self._scene.strands(phase)
        image = self._studio.shoot(strands, DYES[: len(strands)], self._scene.actors(strands, phase), index)
        return Frame(image=image, **self._labels(index))

    def truth(self, index: int) -> Truth:
        """Return the truth of a frame.

        Raises
        ------
        InputError
            If there is no such frame.
        """
        phase = self._phase(index)
        strands = self._scene.strands(phase)
        masks = self._studio.visible(strands, self._scene.actors(strands, phase))
        return Truth(tuple(strand.curve() for strand in strands), masks, self._ids)

    def _phase(self, index: int) -> float:
        if not 0 <= index < self._frames:
            raise InputError(f"index must be in 0..{self._frames - 1}, got {index}")
        return index / self._frames

    def _labels(self, index: int) -> dict[str, Any]:
        return {"index": index, "stamp": index / self._rate, "name": f"demo#{index:04d}"}
