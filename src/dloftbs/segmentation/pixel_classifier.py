"""Image to probabilities of cable, by colour, contrast, ridges and the lines that they make."""

from __future__ import annotations

import math
from collections.abc import Sequence

import cv2
import numpy as np
import numpy.typing as npt

from dloftbs.segmentation import canonical, log_colours
from dloftbs.segmentation.kernels.line_features import MARGIN_PX
from dloftbs.segmentation.line_prior import LinePrior, PixelMaps
from dloftbs.segmentation.local_colours import at_edges
from dloftbs.segmentation.pixel_samples import PixelSample
from dloftbs.segmentation.trees import Trees
from dloftbs.support.arrays import ByteArray

_IS_CABLE = 1.0, 0.0, 0.0, 0.0
"""Whether each kind of samples is cable. The rest of a picture is unlabelled: a part of it is, which the line prior,
fitted on such probabilities, takes into account.

Source: by definition.
"""
_WEIGHTS = 1.0, 0.3, 0.3, 1.0
"""Weight of each kind of samples, as a multiple of the cables'.

Source: by hand; cables and the rest weigh alike. At 1.0 and at 0.15 IoU differs by less than 0.01.
"""

_LEAST_AREA = 4.0
"""Least area of a part, squares of the width.

Source: measured on 27 photographs: of 130 smaller parts 120 are ground; of 44 larger ones 3 are.
"""
_TOGETHER = 0.4
"""Probability down to which pixels hang together in parts: fragments of a cable are no small parts.

Source: by hand; at 0.25, specks on busy prints hang together with cables.
"""
_UNLIKELY = 0.05
"""Probability of a pixel below which the line prior is not asked: the pixel is ground.

Source: bounds time.
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
        kinds = [np.concatenate(parts, axis=1) for parts in zip(*(sample.kinds for sample in samples), strict=True)]
        counts = [kind.shape[1] for kind in kinds]
        weights = [weight / max(count, 1) for weight, count in zip(_WEIGHTS, counts, strict=True)]
        self._trees = Trees.grown(
            np.concatenate(kinds, axis=1), np.repeat(_IS_CABLE, counts), np.repeat(weights, counts)
        )
        self._by_colour = np.rint(255.0 / (1.0 + np.exp(-log_ratio.ravel()))).astype(np.uint8)
        drawn = np.concatenate([sample.cells_of_cables() for sample in samples])
        self._least = max(1, int(np.quantile(self._by_colour[drawn], _REJECTED)))

    def maps(self, image: ByteArray) -> PixelMaps:
        """Return the probabilities of the pixels of a resized image; cables are `canonical.WIDTH_PX` wide there.

        Pixels whose colour, and that of whose neighbours, is no cable's have probability 0: they cost little.
        """
        return self._maps_of(self._resized(image)[0])

    def _resized(self, image: ByteArray) -> tuple[ByteArray, ByteArray]:
        """Return an image in which cables are `canonical.WIDTH_PX` wide, and the finer one that it is made of."""
        fine = canonical.resized(image, self.width_px, 2.0 * canonical.WIDTH_PX)
        return canonical.resized(fine, self._fine_px()), fine

    def _fine_px(self) -> float:
        """Return the width of cables in the finer image, px."""
        return self.width_px / canonical.shrinking(self.width_px, 2.0 * canonical.WIDTH_PX)

    def _maps_of(self, small: ByteArray, near: ByteArray | None = None) -> PixelMaps:
        colour = self._by_colour[log_colours.cells_of(small)]
        maybe = cv2.dilate((colour >= self._least).view(np.uint8), np.ones((3, 3), np.uint8))
        pixels = np.flatnonzero(maybe if near is None else maybe & near)
        by_all = np.rint(255.0 / len(self._trees.value) * self._trees.sums(canonical.features_of(small, pixels)))
        own = np.zeros(colour.shape, np.uint8)
        own.ravel()[pixels] = by_all
        return PixelMaps(own, colour, pixels[by_all >= 255.0 * _UNLIKELY])

    def __call__(self, image: ByteArray, places: ByteArray | None = None) -> npt.NDArray[np.float32]:
        """Return the probability that each pixel of an image (H, W, 3) is cable, shape (H, W).

        Where places are given, non-zero in (H, W), it is 0 farther from them than lines reach: four widths.
        """
        if places is None:
            return self._of(image)
        found = np.zeros(image.shape[:2], np.float32)
        reach = math.ceil(2 * MARGIN_PX * canonical.shrinking(self.width_px))
        left, top, width, height = cv2.boundingRect((places > 0).view(np.uint8))
        if width:
            part = slice(max(0, top - reach), top + height + reach), slice(max(0, left - reach), left + width + reach)
            found[part] = self._of(np.ascontiguousarray(image[part]), places[part])
        return found

    def _of(self, image: ByteArray, places: ByteArray | None = None) -> npt.NDArray[np.float32]:
        small, fine = self._resized(image)
        near = None
        if places is not None:
            reach = 2 * MARGIN_PX + 1
            plane = (places > 0).view(np.uint8) * np.uint8(255)
            plane = cv2.resize(plane, small.shape[1::-1], interpolation=cv2.INTER_AREA)
            near = cv2.dilate((plane > 0).view(np.uint8), np.ones((reach, reach), np.uint8))
        found = at_edges(small, LinePrior.fitted()(self._maps_of(small, near)), fine)
        is_cable = found >= 0.5
        count, parts = cv2.connectedComponents((found >= _TOGETHER).view(np.uint8))
        is_small = np.bincount(parts[is_cable], minlength=count) < _LEAST_AREA * self._fine_px() ** 2
        found[is_cable & is_small[parts]] = 0.0
        return np.asarray(cv2.resize(found, image.shape[1::-1], interpolation=cv2.INTER_LINEAR), np.float32)
