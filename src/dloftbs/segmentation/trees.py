"""Trees over features of one byte, and the text that keeps them."""

from __future__ import annotations

import base64
import zlib
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from dloftbs.segmentation.kernels import forest as kernels

_TREES = 40
"""Number of trees that are grown.

Source: bounds time; 60 of scikit-learn are no more accurate.
"""
_TRIES = 6
"""Splits that are tried at a node.

Source: Geurts, Ernst and Wehenkel 2006: the square root of the number of features, and one more.
"""
_LEAST = 15
"""Least number of samples of a leaf.

Source: by hand; pixels beside each other are no samples of their own.
"""


@dataclass(frozen=True, eq=False)
class Trees:
    """Nodes of trees, one after the other, as `kernels.forest.grow` writes them."""

    feature: npt.NDArray[np.int16]
    threshold: npt.NDArray[np.uint8]
    other: npt.NDArray[np.int32]
    value: npt.NDArray[np.float32]
    roots: npt.NDArray[np.int32]

    @classmethod
    def grown(
        cls,
        features: npt.NDArray[np.uint8],
        is_cable: npt.NDArray[np.float64],
        weights: npt.NDArray[np.float64],
    ) -> Trees:
        """Grow trees whose sum is the probability of cable, from samples (n, f)."""
        most = _TREES * (2 * max(1, len(features) // _LEAST) + 1)
        feature, threshold = np.zeros(most, np.int16), np.zeros(most, np.uint8)
        other, value = np.zeros(most, np.int32), np.zeros(most, np.float32)
        roots = np.zeros(_TREES, np.int32)
        seed = np.zeros(1, np.uint64)
        features = np.ascontiguousarray(features)
        count = kernels.grow(features, is_cable, weights, seed, _TRIES, _LEAST, feature, threshold, other, value, roots)
        return cls(feature[:count].copy(), threshold[:count].copy(), other[:count].copy(), value[:count].copy(), roots)

    def split(self, count: int) -> tuple[Trees, Trees]:
        """Return the first trees and the others."""
        return replace(self, roots=self.roots[:count]), replace(self, roots=self.roots[count:])

    def sums(self, features: npt.NDArray[np.uint8], start: float = 0.0) -> npt.NDArray[np.float32]:
        """Return the sum of the leaves that each row of features (n, f) comes to, and of a start, shape (n,)."""
        sums = np.full(len(features), start, np.float32)
        kernels.add_up(
            np.ascontiguousarray(features), self.feature, self.threshold, self.other, self.value, self.roots, sums
        )
        return sums

    def to_text(self) -> str:
        """Return the trees as text that `from_text` reads."""
        head = np.array([len(self.feature), len(self.roots)], "<u4")
        kept = (
            head,
            self.feature.astype("<i2"),
            self.threshold,
            self.other.astype("<i4"),
            self.value.astype("<f4"),
            self.roots.astype("<i4"),
        )
        return base64.b64encode(zlib.compress(b"".join(part.tobytes() for part in kept), 9)).decode()

    @classmethod
    def from_text(cls, text: str) -> Trees:
        """Read what `to_text` wrote."""
        packed = zlib.decompress(base64.b64decode(text))
        nodes, trees = (int(number) for number in np.frombuffer(packed, "<u4", 2))
        at = 8
        parts: list[npt.NDArray[Any]] = []
        for kind, count in (("<i2", nodes), ("u1", nodes), ("<i4", nodes), ("<f4", nodes), ("<i4", trees)):
            part = np.frombuffer(packed, kind, count, at)
            parts.append(part.astype(part.dtype.newbyteorder("=")))
            at += part.nbytes
        return cls(*parts)
