"""Probabilities of single pixels to those of cables: what is as wide as a cable, goes on, and has ground beside it."""

from __future__ import annotations

import functools

import cv2
import numpy as np
import numpy.typing as npt

from dloftbs.segmentation.kernels import line_features as kernels
from dloftbs.segmentation.line_prior_trees import START, TREES
from dloftbs.segmentation.trees import Trees

_SIDES = 5, 13, 33
"""Sides of the squares over which a map of half the size is averaged, px: one, three and eight widths.

Source: by definition; cables fill most, a third and an eighth of them.
"""


class LinePrior:
    """A callable that reads two maps together, by trees that were fitted to photographs of others with labels.

    Parameters
    ----------
    trees : Trees
        Their sum is a log-odds.
    start : float
        Added to it.
    """

    def __init__(self, trees: Trees, start: float) -> None:
        self._trees, self._start = trees, start

    @classmethod
    @functools.cache
    def fitted(cls) -> LinePrior:
        """Return the one that `python -m benchmarks.fit_strokes` made."""
        return cls(Trees.from_text(TREES), START)

    def __call__(
        self, probability: npt.NDArray[np.uint8], colour: npt.NDArray[np.uint8]
    ) -> npt.NDArray[np.float32]:
        """Return the probability of cable at each pixel of the maps, as `line_features` takes them, shape (H, W)."""
        pixels = np.arange(probability.size)
        log_odds = self._trees.sums(line_features(probability, colour, pixels), self._start)
        return np.asarray(1.0 / (1.0 + np.exp(-log_odds)), np.float32).reshape(probability.shape)


def line_features(
    probability: npt.NDArray[np.uint8], colour: npt.NDArray[np.uint8], pixels: npt.NDArray[np.int64]
) -> npt.NDArray[np.uint8]:
    """Return what two maps show at listed pixels and around them, shape (n, f).

    Parameters
    ----------
    probability, colour : numpy.ndarray, shape (H, W), uint8
        Of cable by all features, and by the colour alone, of 255; cables are 8 px wide.
    pixels : numpy.ndarray, shape (n,), int64
        Flat numbers.
    """
    height, width = probability.shape
    half = (width + 1) // 2, (height + 1) // 2
    low = (pixels // width // 2) * half[0] + pixels % width // 2
    some, which = np.unique(low, return_inverse=True)
    columns = []
    for plane in (probability, colour):
        small = cv2.resize(plane, half, interpolation=cv2.INTER_AREA)
        lines = np.empty((len(some), kernels.COUNT), np.uint8)
        kernels.lines_at(small, some, lines)
        boxes = [cv2.blur(small, (side, side)).ravel()[low] for side in _SIDES]
        own = [plane.ravel()[pixels], cv2.blur(plane, (3, 3)).ravel()[pixels]]
        columns += [np.stack([*own, *boxes], axis=1), lines[which]]
    return np.concatenate(columns, axis=1)
