"""Colours from strokes in a stream: near the tracks in most frames, and in the light of the moment."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from dloftbs.data.prompt import Prompt
from dloftbs.segmentation.colour_model import ColourModel
from dloftbs.segmentation.light_drift import LightDrift

_EVERY = 5
"""Number of frames from one look at the whole image to the next.

Source: bounds time; a new object is seen a sixth of a second late at most.
"""


class StrokeSegmenter:
    """A callable ``(image, prompt) -> mask`` by a colour model, for one stream.

    Where pixels are classified, and the prompt shows tracks, it looks near the last mask and near the prompt's points
    alone, and every few frames at the whole image. The light is followed where tracks confirm the colours.

    Parameters
    ----------
    model : ColourModel
    follows_light : bool
    """

    def __init__(self, model: ColourModel, *, follows_light: bool = True) -> None:
        self._model = model
        self._light = LightDrift(model) if follows_light else None
        self._since = 0

    @property
    def light(self) -> npt.NDArray[np.float64]:
        """Light of the moment as a multiple of that in the pictures with strokes, shape (3,): blue, green, red."""
        return np.ones(3) if self._light is None else self._light.factors

    def __call__(self, image: npt.NDArray[np.uint8], prompt: Prompt) -> npt.NDArray[np.bool_]:
        """Return the mask of an image (H, W, 3) BGR, shape (H, W)."""
        if self._light is not None:
            self._light.update(image, prompt)
            image = self._light.corrected(image)
        is_tracked = len(prompt.boxes) > 0 and prompt.mask is not None
        self._since = self._since + 1 if is_tracked else 0
        if self._model.by_colour_alone or self._since % _EVERY == 0:
            return self._model(image)
        return self._model._near(image, _places(prompt, (image.shape[0], image.shape[1])))

    def alone(self) -> StrokeSegmenter:
        """Return one for a frame by itself, in the light of the strokes."""
        return StrokeSegmenter(self._model, follows_light=self._light is not None)

    def reset(self) -> None:
        """Forget the frames before."""
        self._since = 0
        if self._light is not None:
            self._light.reset()


def _places(prompt: Prompt, size: tuple[int, int]) -> npt.NDArray[np.uint8]:
    """Return 1 on the last mask and along the points of each object, shape (H, W)."""
    places = np.zeros(size, np.uint8) if prompt.mask is None else prompt.mask.astype(np.uint8)
    for row in range(len(prompt.boxes)):
        points = prompt.points[prompt.owner == row]
        cv2.polylines(places, [np.rint(points).astype(np.int32)], False, 1)
    return places
