"""Light that drifts in a stream, by the colours where tracks confirm cables and ground."""

from __future__ import annotations

import logging

import cv2
import numpy as np

from dloftbs.data.prompt import Prompt
from dloftbs.segmentation import log_colours
from dloftbs.segmentation.colour_model import ColourModel
from dloftbs.support.arrays import ByteArray, FloatArray, IntArray

_STEP = np.array([0.04, 0.01, 0.01])
"""Change of the logarithm of the light from a frame to the next, in lightness and the two tints.

Source: derived; a fifth of the finest smoothing of a cable's colours.
"""
_MOST_STEPS = 25, 10, 10
"""Most steps of lightness and of the two tints.

Source: by hand; 1.8 times as light or dark, and 7 % of tint: beyond, the ground takes the cables' colours.
"""
_GAIN = 0.003
"""Least gain of a step, in nats a place.

Source: by hand; noise gives less.
"""
_COST = 0.01
"""Cost of each axis along which the light is another than that of the strokes, in nats a place.

Source: measured on 12 drawn streams of cables hardly lighter or darker than their ground. In still light, the mean IoU
is .84, without a cost .80, and .85 where no light is followed; in light that falls to .7 times, it is .80 and .79.
"""
_log = logging.getLogger(__name__)


class LightDrift:
    """Follows the light along lightness and two tints, a step a frame at most, within bounds.

    A step is made where the colours at the points of tracks, and beside them, are likelier cable and ground with it.
    Since they are a little likelier in some wrong light, too, leaving the light of the strokes has a cost on each axis.
    Without tracks nothing confirms the light, and it goes back to that of the strokes, a step a frame along each axis:
    a wrong light would hide the cables, and so itself, for ever.

    Parameters
    ----------
    model : ColourModel
        Of the light that strokes were drawn in.
    """

    def __init__(self, model: ColourModel) -> None:
        self._model = model
        self._moves = np.concatenate((np.eye(3), -np.eye(3))).astype(np.int64)
        self.reset()

    def reset(self) -> None:
        """Begin with the light that strokes were drawn in."""
        self._steps = np.zeros(3, np.int64)
        self._has_warned = False

    @property
    def factors(self) -> FloatArray:
        """Light as a multiple of that in the pictures with strokes, shape (3,): blue, green, red."""
        return np.asarray(np.exp((_STEP * self._steps) @ log_colours.AXES)[::-1])

    def update(self, image: ByteArray, prompt: Prompt) -> None:
        """Take a step where the colours at a prompt's points ask for one; without points, a step back."""
        if not len(prompt.points):
            self._steps -= np.sign(self._steps)
        if not len(prompt.points) or not len(prompt.negative):
            return
        places = np.rint(np.concatenate((prompt.points, prompt.negative))).astype(np.intp)
        colours = image[places[:, 1], places[:, 0]]
        sign = np.where(np.arange(len(places)) < len(prompt.points), 1.0, -1.0)
        weights = np.where(sign > 0.0, 0.5 / len(prompt.points), 0.5 / len(prompt.negative))
        most = np.array(_MOST_STEPS)
        candidates = [self._steps, *(self._steps + move for move in self._moves)]
        candidates = [steps for steps in candidates if (np.abs(steps) <= most).all()]
        losses = [weights @ np.logaddexp(0.0, -sign * self._log_odds(colours, steps)) for steps in candidates]
        worth = -np.array(losses) - _COST * np.count_nonzero(candidates, axis=1)
        best = int(np.argmax(worth))
        if worth[best] > worth[0] + _GAIN:
            self._steps = candidates[best]
        if (np.abs(self._steps) == most).any() and not self._has_warned:
            self._has_warned = True
            _log.warning(
                "the light has drifted to %s times that of the strokes (blue, green, red), and is followed no farther: "
                "draw strokes on a frame in this light",
                np.round(self.factors, 2).tolist(),
            )

    def _log_odds(self, colours: ByteArray, steps: IntArray) -> FloatArray:
        corrected = _corrected(colours[:, None], steps)
        return np.asarray(self._model.colour_log_odds(corrected)[:, 0], np.float64)

    def corrected(self, image: ByteArray) -> ByteArray:
        """Return an image as it would be in the light that strokes were drawn in."""
        return _corrected(image, self._steps) if self._steps.any() else image


def _corrected(image: ByteArray, steps: IntArray) -> ByteArray:
    factors = np.exp(-(_STEP * steps) @ log_colours.AXES)[::-1]
    levels = np.arange(256.0)[:, None] + log_colours.OFFSET
    table = np.clip(np.rint(levels * factors - log_colours.OFFSET), 0.0, 255.0).astype(np.uint8)
    return np.asarray(cv2.LUT(image, table[None]), np.uint8)
