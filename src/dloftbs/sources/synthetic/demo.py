"""The demo sequence as a source of frames, with the truth beside it."""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from dloftbs.config import HsvRange
from dloftbs.errors import InputError
from dloftbs.frame import Frame
from dloftbs.sources.base import KnownSequence
from dloftbs.sources.synthetic.layers import cast_shadow, paint_layers, stack_layers, visible_cables
from dloftbs.sources.synthetic.scene import Scene
from dloftbs.sources.synthetic.sketch import Image
from dloftbs.sources.synthetic.workbench import draw_workbench
from dloftbs.truth import Truth

_DYES = (np.array([214.0, 108.0, 10.0]), np.array([92.0, 16.0, 222.0]))
_HSV = (
    HsvRange(hue=(99, 113), saturation=(120, 255), value=(45, 255)),
    HsvRange(hue=(163, 175), saturation=(120, 255), value=(45, 255)),
)
_NOISE_SIGMA = 2.6
_NOISE_MARGIN = 64
_BLUR_SIGMA = 0.55


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
        # This fits the motions: what cannot be is refused here, not at the first frame.
        self._ids = tuple(range(len(self._scene.motions)))

    @property
    def hsv(self) -> tuple[HsvRange, ...]:
        """The colour of each cable: what `SegmentationConfig.hsv` takes."""
        return _HSV[: len(self._ids)]

    def frame(self, index: int) -> Frame:
        """Render one frame, shape (H, W, 3) BGR.

        Raises
        ------
        InputError
            If there is no such frame.
        """
        phase = self._phase(index)
        strands = self._scene.strands(phase)
        canvas = self._background.copy()
        cast_shadow(canvas, strands, self.width_px)
        layers = stack_layers(strands, self.width_px, self.size)
        paint_layers(canvas, layers, strands, _DYES[: len(strands)], self.width_px)
        for sprite, position, angle in self._scene.actors(strands, phase):
            sprite.paste(canvas, position, angle)
        return Frame(image=self._expose(canvas, index), **self._labels(index))

    def mask_frame(self, index: int) -> Frame:
        """Return one frame with the perfect mask of all cables, shape (H, W) bool, in place of the image.

        Raises
        ------
        InputError
            If there is no such frame.
        """
        return Frame(mask=np.logical_or.reduce(self.truth(index).visible_masks), **self._labels(index))

    def truth(self, index: int) -> Truth:
        """Return what is to be found in a frame.

        Raises
        ------
        InputError
            If there is no such frame.
        """
        phase = self._phase(index)
        strands = self._scene.strands(phase)
        owner = visible_cables(stack_layers(strands, self.width_px, self.size), self.width_px, self.size)
        owner[self._scene.hidden(strands, phase)] = -1
        masks = tuple(owner == number for number in self._ids)
        return Truth(tuple(strand.curve() for strand in strands), masks, self._ids)

    def _phase(self, index: int) -> float:
        if not 0 <= index < self._frames:
            raise InputError(f"index must be in 0..{self._frames - 1}, got {index}")
        return index / self._frames

    def _labels(self, index: int) -> dict[str, Any]:
        return {"index": index, "stamp": index / self._rate, "name": f"demo#{index:04d}"}

    def _expose(self, canvas: Image, index: int) -> Image:
        """Add what a camera does: a little blur, darker corners, noise."""
        height, width = self.size
        image = cv2.GaussianBlur(canvas, (0, 0), _BLUR_SIGMA)
        cv2.multiply(image, self._vignette, dst=image, scale=1.0 / 255.0)
        # Drawing new noise for every pixel would take longer than all the rest: a window on a larger field moves.
        rng = np.random.default_rng([self._scene.seed, 5, index])
        top, left = rng.integers(0, _NOISE_MARGIN, 2)
        noise = self._noise[top : top + height, left : left + width]
        return np.asarray(cv2.add(image, noise, dtype=cv2.CV_8U), dtype=np.uint8)

    @cached_property
    def _background(self) -> Image:
        return draw_workbench(self._scene.rng(4), self.size, self._scene.scale)

    @cached_property
    def _vignette(self) -> Image:
        y, x = np.linspace(-1.0, 1.0, self.size[0])[:, None], np.linspace(-1.0, 1.0, self.size[1])
        gain = 255.0 * (1.0 - 0.11 * (x * x + y * y))
        return np.repeat(gain.round().astype(np.uint8)[..., None], 3, axis=2)

    @cached_property
    def _noise(self) -> npt.NDArray[np.int16]:
        height, width = self.size[0] + _NOISE_MARGIN, self.size[1] + _NOISE_MARGIN
        grain = self._scene.rng(6).standard_normal((height, width, 3), dtype=np.float32)
        return (_NOISE_SIGMA * grain).round().astype(np.int16)
