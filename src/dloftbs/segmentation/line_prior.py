"""Probabilities of single pixels to those of cables: what is as wide as a cable, goes on, and has ground beside it."""

from __future__ import annotations

import functools
from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from dloftbs.segmentation.kernels import line_features as kernels
from dloftbs.segmentation.line_prior_trees import START, TREES
from dloftbs.segmentation.trees import Trees

_SIDES = 3, 5, 13, 33
"""Sides of the squares over which a map is averaged, px: from half a width to seven.

Source: by definition; cables fill all to a seventh of them.
"""


class PixelMaps(NamedTuple):
    """Probabilities of cable, of 255, by all features and by the colour alone, shape (H, W), uint8.

    Cables are `canonical.WIDTH_PX` wide. `pixels` are the flat numbers (n,) of those that may be cable.
    """

    own: npt.NDArray[np.uint8]
    colour: npt.NDArray[np.uint8]
    pixels: npt.NDArray[np.int64]


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

    def __call__(self, maps: PixelMaps) -> npt.NDArray[np.float32]:
        """Return the probability of cable at each pixel of the maps, shape (H, W); 0 where they list none."""
        log_odds = self._trees.sums(line_features(maps, maps.pixels)) + np.float32(self._start)
        found = np.zeros(maps.own.shape, np.float32)
        found.ravel()[maps.pixels] = 1.0 / (1.0 + np.exp(-log_odds))
        return found


def line_features(maps: PixelMaps, pixels: npt.NDArray[np.int64]) -> npt.NDArray[np.uint8]:
    """Return what maps show at some pixels, as flat numbers (n,), and around them, shape (f, n)."""
    planes = []
    for plane in (maps.own, maps.colour):
        lines = np.empty((kernels.COUNT, *plane.shape), np.uint8)
        bordered = cv2.copyMakeBorder(plane, *(kernels.MARGIN_PX,) * 4, cv2.BORDER_REPLICATE)
        kernels.lines_of(bordered, lines)
        planes += [plane, *(cv2.blur(plane, (side, side)) for side in _SIDES), *lines]
    return np.stack([plane.ravel()[pixels] for plane in planes])
