"""Symmetric trees over features of one byte, and the text that keeps them."""

from __future__ import annotations

import base64
import zlib
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from dloftbs.segmentation.kernels import forest as kernels

DEPTH = 8
"""Number of questions that a tree asks.

Source: bounds time; a leaf's number is a byte.
"""
_TREES = 60
"""Number of trees that are grown.

Source: bounds time; 120 are no more accurate.
"""
_TRIES = 30
"""Splits that are tried at a level.

Source: bounds time; 60 gain IoU on busy grounds what they lose among tools.
"""
_LEAST = 5.0
"""Mean weights of samples by which a leaf is drawn to the mean of those beside it.

Source: by hand; pixels beside each other are no samples of their own.
"""


@dataclass(frozen=True, eq=False)
class Trees:
    """Splits and leaves as `kernels.forest.grow` writes them: all nodes of a level share a split.

    Such trees (Kohavi 1994, oblivious decision trees) are looked up for many pixels at once.
    """

    feature: npt.NDArray[np.uint8]
    threshold: npt.NDArray[np.uint8]
    value: npt.NDArray[np.float32]

    @classmethod
    def grown(
        cls,
        features: npt.NDArray[np.uint8],
        target: npt.NDArray[np.float64],
        weights: npt.NDArray[np.float64],
        count: int = _TREES,
        tries: int = _TRIES,
        depth: int = DEPTH,
        least: float = _LEAST,
        seed: int = 0,
    ) -> Trees:
        """Grow trees whose mean is that of the targets of samples with such features (f, n)."""
        feature, threshold = np.zeros((2, count, depth), np.uint8)
        value = np.zeros((count, 1 << depth), np.float32)
        state = np.array([seed], np.uint64)
        kernels.grow(
            np.ascontiguousarray(features),
            target,
            weights,
            state,
            tries,
            least * float(np.mean(weights)),
            feature,
            threshold,
            value,
        )
        return cls(feature, threshold, value)

    def sums(self, features: npt.NDArray[np.uint8]) -> npt.NDArray[np.float32]:
        """Return the sum of the leaves that each column of features (f, n) comes to, shape (n,)."""
        sums = np.zeros(features.shape[1], np.float32)
        kernels.add_up(np.ascontiguousarray(features), self.feature, self.threshold, self.value, sums)
        return sums

    def to_text(self) -> str:
        """Return the trees as text that `from_text` reads."""
        head = np.array(self.feature.shape, "<u4")
        kept = (head, self.feature, self.threshold, self.value.astype("<f2"))
        return base64.b64encode(zlib.compress(b"".join(part.tobytes() for part in kept), 9)).decode()

    @classmethod
    def from_text(cls, text: str) -> Trees:
        """Read what `to_text` wrote."""
        packed = zlib.decompress(base64.b64decode(text))
        trees, depth = (int(number) for number in np.frombuffer(packed, "<u4", 2))
        splits = np.frombuffer(packed, np.uint8, 2 * trees * depth, 8).reshape(2, trees, depth)
        value = np.frombuffer(packed, "<f2", offset=8 + splits.nbytes).reshape(trees, 1 << depth)
        return cls(splits[0], splits[1], value.astype(np.float32))
