"""Trees over features of one byte: grown with splits at random, and added up."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import float32, float64, int16, int32, int64, uint8, uint64

from dloftbs.kernels.compiler import inlined, kernel, read, write

LEAF = -1
"""Feature of a node that is a leaf.

Source: by definition.
"""
_NEXT = 0x9E3779B97F4A7C15, 0xBF58476D1CE4E5B9, 0x94D049BB133111EB
"""Increment and multipliers of the generator of random numbers.

Source: Steele, Lea and Flood 2014, SplitMix64.
"""


@inlined
def _draw(state: npt.NDArray[np.uint64], below: np.int64) -> np.int64:
    """Return a random integer in 0..below - 1."""
    state[0] += np.uint64(_NEXT[0])
    mixed = state[0]
    mixed = (mixed ^ (mixed >> np.uint64(30))) * np.uint64(_NEXT[1])
    mixed = (mixed ^ (mixed >> np.uint64(27))) * np.uint64(_NEXT[2])
    mixed ^= mixed >> np.uint64(31)
    return np.int64((mixed >> np.uint64(33)) % np.uint64(below))


@inlined
def _gain(cable: float, total: float) -> float:
    return cable * cable / total + (total - cable) * (total - cable) / total if total > 0.0 else 0.0


@kernel(
    read(uint8, 2, "C"),
    read(float64, 1),
    read(float64, 1),
    read(uint64, 1),
    int64,
    int64,
    write(int16, 1),
    write(uint8, 1),
    write(int32, 1),
    write(float32, 1),
    write(int32, 1),
)
def grow(
    features: npt.NDArray[np.uint8],
    is_cable: npt.NDArray[np.float64],
    weights: npt.NDArray[np.float64],
    seed: npt.NDArray[np.uint64],
    tries: int,
    least: int,
    feature: npt.NDArray[np.int16],
    threshold: npt.NDArray[np.uint8],
    other: npt.NDArray[np.int32],
    value: npt.NDArray[np.float32],
    roots: npt.NDArray[np.int32],
) -> int:
    """Grow extremely randomised trees (Geurts, Ernst and Wehenkel 2006); return the number of nodes.

    Parameters
    ----------
    features : (n, f) uint8
    is_cable, weights : (n,) float64
        Share of each sample that is cable, and its weight.
    seed : (1,) uint64
    tries, least : int
        Splits that are tried at a node, and least number of samples of a leaf.
    feature, threshold, other, value : (m,)
        Written, a node each: the feature, or `LEAF`; the greatest byte that goes on to the next node; the node of the
        others; a leaf's probability as a share of the number of trees.
    roots : (trees,) int32
        Written: the first node of each tree.
    """
    count, kinds = features.shape
    state = seed.copy()
    order = np.arange(count)
    first, last, parent = np.empty(count + 1, np.int64), np.empty(count + 1, np.int64), np.empty(count + 1, np.int64)
    node = 0
    for tree in range(len(roots)):
        roots[tree] = node
        first[0], last[0], parent[0] = 0, count, -1
        waiting = 1
        while waiting:
            waiting -= 1
            begin, end = first[waiting], last[waiting]
            if parent[waiting] >= 0:
                other[parent[waiting]] = node
            cable, total = 0.0, 0.0
            for k in range(begin, end):
                total += weights[order[k]]
                cable += weights[order[k]] * is_cable[order[k]]
            best, chosen, at = _gain(cable, total) * (1.0 + 1e-9), np.int64(LEAF), np.int64(0)
            if end - begin >= 2 * least:
                for _ in range(tries):
                    kind = _draw(state, np.int64(kinds))
                    low, high = np.int64(255), np.int64(0)
                    for k in range(begin, end):
                        byte = np.int64(features[order[k], kind])
                        low, high = min(low, byte), max(high, byte)
                    if low >= high:
                        continue
                    limit = low + _draw(state, high - low)
                    number, own, share = 0, 0.0, 0.0
                    for k in range(begin, end):
                        if features[order[k], kind] <= limit:
                            number += 1
                            own += weights[order[k]]
                            share += weights[order[k]] * is_cable[order[k]]
                    if min(number, end - begin - number) < least:
                        continue
                    gain = _gain(share, own) + _gain(cable - share, total - own)
                    if gain > best:
                        best, chosen, at = gain, kind, limit
            feature[node], threshold[node], other[node] = chosen, at, node
            value[node] = cable / total / len(roots) if total > 0.0 else 0.0
            if chosen != LEAF:
                middle = begin
                for k in range(begin, end):
                    if features[order[k], chosen] <= at:
                        order[k], order[middle] = order[middle], order[k]
                        middle += 1
                first[waiting], last[waiting], parent[waiting] = middle, end, node
                first[waiting + 1], last[waiting + 1], parent[waiting + 1] = begin, middle, -1
                waiting += 2
            node += 1
    return node


@kernel(
    read(uint8, 2, "C"),
    read(int16, 1),
    read(uint8, 1),
    read(int32, 1),
    read(float32, 1),
    read(int32, 1),
    write(float32, 1),
)
def add_up(
    features: npt.NDArray[np.uint8],
    feature: npt.NDArray[np.int16],
    threshold: npt.NDArray[np.uint8],
    other: npt.NDArray[np.int32],
    value: npt.NDArray[np.float32],
    roots: npt.NDArray[np.int32],
    sums: npt.NDArray[np.float32],
) -> None:
    """Add to each sum the leaves that a row of features comes to; the nodes as `grow` writes them."""
    for i in range(len(features)):
        total = np.float32(0.0)
        for tree in range(len(roots)):
            node = roots[tree]
            while feature[node] != LEAF:
                node = node + 1 if features[i, feature[node]] <= threshold[node] else other[node]
            total += value[node]
        sums[i] += total
