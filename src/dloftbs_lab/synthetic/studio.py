"""The studio: puts cables and actors on the workbench, and takes the picture and its truth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
import numpy.typing as npt

from dloftbs.config import HsvRange
from dloftbs.support.arrays import FloatArray
from dloftbs_lab.synthetic.actors import Placed, hidden_by
from dloftbs_lab.synthetic.layers import cast_shadow, paint_layers, stack_layers, visible_cables
from dloftbs_lab.synthetic.sketch import Image
from dloftbs_lab.synthetic.strand import Strand
from dloftbs_lab.synthetic.workbench import draw_workbench

DYES = (np.array([214.0, 108.0, 10.0]), np.array([92.0, 16.0, 222.0]))
"""Colours of cables, BGR: blue and pink."""
HSV = (
    HsvRange(hue=(99, 113), saturation=(120, 255), value=(45, 255)),
    HsvRange(hue=(163, 175), saturation=(120, 255), value=(45, 255)),
)
"""Colour ranges that find each of the `DYES`, and nothing on the workbench."""
_NOISE_SIGMA = 2.6
_NOISE_MARGIN = 64
_BLUR_SIGMA = 0.55


@dataclass(frozen=True, eq=False)
class Studio:
    """A workbench, its lamp and a camera.

    Parameters
    ----------
    seed : int
    size : (int, int)
        ``(H, W)`` px.
    width_px : float
        Width of the cables.
    """

    seed: int
    size: tuple[int, int]
    width_px: float

    def shoot(
        self,
        strands: Sequence[Strand],
        dyes: Sequence[FloatArray],
        actors: Sequence[Placed],
        index: int,
        covers: Sequence[tuple[npt.NDArray[np.bool_], FloatArray]] = (),
    ) -> Image:
        """Take picture `index`, shape (H, W, 3) BGR; `strands`, `actors` and `covers` come the lowest first.

        A cover is its pixels (H, W) and its colour (3,) BGR.
        """
        canvas = self._background.copy()
        cast_shadow(canvas, strands, self.width_px)
        layers = stack_layers(strands, self.width_px, self.size)
        paint_layers(canvas, layers, strands, dyes, self.width_px)
        for sprite, position, angle in actors:
            sprite.paste(canvas, position, angle)
        for pixels, colour in covers:
            canvas[pixels] = colour.round().astype(np.uint8)
        return self._expose(canvas, index)

    def visible(self, strands: Sequence[Strand], actors: Sequence[Placed]) -> tuple[npt.NDArray[np.bool_], ...]:
        """Return the visible part of each cable, shapes (H, W)."""
        owner = visible_cables(stack_layers(strands, self.width_px, self.size), self.width_px, self.size)
        owner[hidden_by(actors, self.size)] = -1
        return tuple(owner == number for number in range(len(strands)))

    def _expose(self, canvas: Image, index: int) -> Image:
        """Add what a camera does: a little blur, darker corners, noise."""
        height, width = self.size
        image = cv2.GaussianBlur(canvas, (0, 0), _BLUR_SIGMA)
        cv2.multiply(image, self._vignette, dst=image, scale=1.0 / 255.0)
        # Drawing new noise for every pixel would take longer than all the rest: a window on a larger field moves.
        rng = np.random.default_rng([self.seed, 5, index])
        top, left = rng.integers(0, _NOISE_MARGIN, 2)
        noise = self._noise[top : top + height, left : left + width]
        return np.asarray(cv2.add(image, noise, dtype=cv2.CV_8U), dtype=np.uint8)

    @cached_property
    def _background(self) -> Image:
        scale = min(self.size[0] / 720.0, self.size[1] / 1280.0)
        return draw_workbench(np.random.default_rng([self.seed, 4]), self.size, scale)

    @cached_property
    def _vignette(self) -> Image:
        y, x = np.linspace(-1.0, 1.0, self.size[0])[:, None], np.linspace(-1.0, 1.0, self.size[1])
        gain = 255.0 * (1.0 - 0.11 * (x * x + y * y))
        return np.repeat(gain.round().astype(np.uint8)[..., None], 3, axis=2)

    @cached_property
    def _noise(self) -> npt.NDArray[np.int16]:
        height, width = self.size[0] + _NOISE_MARGIN, self.size[1] + _NOISE_MARGIN
        grain = np.random.default_rng([self.seed, 6]).standard_normal((height, width, 3), dtype=np.float32)
        return (_NOISE_SIGMA * grain).round().astype(np.int16)
