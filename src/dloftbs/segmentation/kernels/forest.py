"""Symmetric trees over features of one byte: all nodes of a level ask the same question."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import float32, float64, int64, uint8, uint64

from dloftbs.kernels.compiler import Bytes, Floats, Words, inlined, kernel, read, write

_NEXT = 0x9E3779B97F4A7C15, 0xBF58476D1CE4E5B9, 0x94D049BB133111EB
"""Increment and multipliers of the generator of random numbers.

Source: Steele, Lea and Flood 2014, SplitMix64.
"""
_BLOCK = 512
"""Number of rows of features that go through a tree together.

Source: bounds time; their leaves stay in the fastest cache.
"""


@inlined
def _draw(state: Words, below: np.int64) -> np.int64:
    """Return a random integer in 0..below - 1."""
    state[0] += np.uint64(_NEXT[0])
    mixed = state[0]
    mixed = (mixed ^ (mixed >> np.uint64(30))) * np.uint64(_NEXT[1])
    mixed = (mixed ^ (mixed >> np.uint64(27))) * np.uint64(_NEXT[2])
    mixed ^= mixed >> np.uint64(31)
    return np.int64((mixed >> np.uint64(33)) % np.uint64(below))


@kernel(
    read(uint8, 2, "C"),
    read(float64, 1),
    read(float64, 1),
    write(uint64, 1),
    int64,
    float64,
    write(uint8, 2),
    write(uint8, 2),
    write(float32, 2),
)
def grow(
    features: Bytes,
    target: Floats,
    weights: Floats,
    state: Words,
    tries: int,
    least: float,
    feature: Bytes,
    threshold: Bytes,
    value: npt.NDArray[np.float32],
) -> None:
    """Grow symmetric trees, each level with the best of some splits that are drawn at random.

    A split is a feature and a byte that a sample has. The gain is that of a regression: the weighted squares that it
    takes away.

    Parameters
    ----------
    features : (f, n) uint8
    target, weights : (n,) float64
        Value of each sample, and its weight, above 0.
    state : (1,) uint64
        Of the generator of random numbers; changed.
    tries : int
        Splits that are tried at a level.
    least : float
        Weight by which a leaf is drawn to the mean of the node above it.
    feature, threshold : (trees, depth) uint8
        Written: the split of each level, and the greatest byte that goes to the lower half of the nodes.
    value : (trees, 2 ** depth) float32
        Written: the leaves.
    """
    kinds, count = features.shape
    trees, depth = feature.shape
    at = np.empty(count, np.int64)
    own, share = np.empty(1 << depth, np.float64), np.empty(1 << depth, np.float64)
    mean, above = np.empty(1 << depth, np.float64), np.empty(1 << depth, np.float64)
    total = 0.0
    for i in range(count):
        total += weights[i] * target[i]
    for tree in range(trees):
        at[:] = 0
        above[0] = total / weights.sum()
        for level in range(depth):
            nodes = 2 << level
            best = -1.0
            for _ in range(tries):
                kind = _draw(state, np.int64(kinds))
                limit = features[kind, _draw(state, np.int64(count))]
                own[:nodes], share[:nodes] = 0.0, 0.0
                for i in range(tree % 2, count, 2):  # trees that see different samples differ more
                    node = 2 * at[i] + (1 if features[kind, i] > limit else 0)
                    own[node] += weights[i]
                    share[node] += weights[i] * target[i]
                gain = 0.0
                for node in range(nodes):
                    gain += share[node] * share[node] / (own[node] + least)
                if gain > best:
                    best = gain
                    feature[tree, level], threshold[tree, level] = kind, limit
            own[:nodes], share[:nodes] = 0.0, 0.0
            for i in range(count):
                at[i] = 2 * at[i] + (1 if features[feature[tree, level], i] > threshold[tree, level] else 0)
                own[at[i]] += weights[i]
                share[at[i]] += weights[i] * target[i]
            for node in range(nodes):
                mean[node] = (share[node] + least * above[node >> 1]) / (own[node] + least)
            above[:nodes] = mean[:nodes]
        for node in range(1 << depth):
            value[tree, node] = above[node]


@kernel(read(uint8, 2, "C"), read(uint8, 2), read(uint8, 2), read(float32, 2, "C"), write(float32, 1, "C"))
def add_up(
    features: Bytes, feature: Bytes, threshold: Bytes, value: npt.NDArray[np.float32], sums: npt.NDArray[np.float32]
) -> None:
    """Add to each sum (n,) the leaves that a column of features (f, n) comes to; the trees as `grow` writes them."""
    count = features.shape[1]
    at = np.empty(_BLOCK, np.uint8)
    for begin in range(0, count, _BLOCK):
        size = min(_BLOCK, count - begin)
        block = sums[begin : begin + size]
        for tree in range(len(feature)):
            at[:] = 0
            for level in range(feature.shape[1]):
                row = features[feature[tree, level], begin : begin + size]
                limit = threshold[tree, level]
                for i in range(size):
                    at[i] = np.uint8((at[i] << np.uint8(1)) | np.uint8(row[i] > limit))
            leaves = value[tree]
            for i in range(size):
                block[i] += leaves[at[i]]
