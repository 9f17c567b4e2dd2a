"""Image to probabilities of cable, by colour, contrast, ridges and the lines that they make."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
import numpy.typing as npt

from dloftbs.segmentation import canonical, log_colours
from dloftbs.segmentation.line_prior import LinePrior, PixelMaps
from dloftbs.segmentation.pixel_samples import PixelSample
from dloftbs.segmentation.trees import Trees

_BESIDE = 0.3
"""Weight of the ground beside cables, and of strokes on ground, as a multiple of the cable's.

Source: by hand.
"""
_IS_CABLE = 1.0, 0.0, 0.0, 0.0
"""Whether each kind of samples is cable. The rest of a picture is unlabelled: a part of it is, which the line prior,
fitted on such probabilities, takes into account.

Source: by definition.
"""
_WEIGHTS = 1.0, _BESIDE, _BESIDE, 1.0
"""Weight of each kind of samples.

Source: derived: cables and the rest weigh alike.
"""


_FIRST = 8
"""Number of trees that are asked first.

Source: bounds time; a fifth of them.
"""
_UNLIKELY = 0.1
"""Probability below which the others are not asked: the pixel is ground.

Source: by hand; bounds time, and leaves IoU on 13 photographs as it is to 0.01.
"""
_REJECTED = 0.01
"""Share of the samples of cables that the colour alone may reject.

Source: bounds time; as many pixels of a cable are gaps of a pixel, which the neighbours close.
"""


class PixelClassifier:
    """A callable ``image -> probability`` that is fitted to samples, without the pictures.

    Parameters
    ----------
    samples : sequence of PixelSample
        At least one.
    log_ratio : numpy.ndarray, shape (64, 64, 64), float32
        How much likelier each cell of colours is cable than not, as a logarithm, where both are as frequent.
    """

    def __init__(self, samples: Sequence[PixelSample], log_ratio: npt.NDArray[np.float32]) -> None:
        self.width_px = float(np.exp(np.mean([np.log(sample.width_px) for sample in samples])))
        kinds = [np.concatenate(parts) for parts in zip(*(sample.kinds for sample in samples), strict=True)]
        counts = [len(kind) for kind in kinds]
        weights = [weight / max(count, 1) for weight, count in zip(_WEIGHTS, counts, strict=True)]
        self._trees = Trees.grown(np.concatenate(kinds), np.repeat(_IS_CABLE, counts), np.repeat(weights, counts))
        self._by_colour = np.rint(255.0 / (1.0 + np.exp(-log_ratio.ravel()))).astype(np.uint8)
        self._prior = LinePrior.fitted()
        drawn = np.concatenate([sample.cells_of_cables() for sample in samples])
        self._least = max(1, int(np.quantile(self._by_colour[drawn], _REJECTED)))

    def maps(self, image: npt.NDArray[np.uint8]) -> PixelMaps:
        """Return the probabilities of the pixels of a resized image; cables are `canonical.WIDTH_PX` wide there.

        Pixels whose colour, and that of whose neighbours, is no cable's have probability 0, as those that the first
        trees find unlikely: they cost little.
        """
        small = canonical.resized(image, self.width_px)
        colour = self._by_colour[log_colours.cells_of(small)]
        maybe = cv2.dilate((colour >= self._least).view(np.uint8), np.ones((3, 3), np.uint8))
        pixels = np.flatnonzero(maybe)
        features = canonical.features_of(small, pixels)
        first, rest = self._trees.split(_FIRST)
        share = first.sums(features)
        likely = share >= _UNLIKELY * _FIRST / len(self._trees.roots)
        pixels = pixels[likely]
        own = np.zeros(colour.shape, np.uint8)
        own.ravel()[pixels] = np.rint(255.0 * (share[likely] + rest.sums(features[likely])))
        return PixelMaps(own, colour, pixels)

    def __call__(self, image: npt.NDArray[np.uint8]) -> npt.NDArray[np.float32]:
        """Return the probability that each pixel of an image (H, W, 3) is cable, shape (H, W)."""
        whole = self._prior(self.maps(image))
        return np.asarray(cv2.resize(whole, image.shape[1::-1], interpolation=cv2.INTER_LINEAR), np.float32)
