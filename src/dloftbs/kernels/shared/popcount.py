"""Ones of a word of 64 bits: how many, and where the lowest is."""

from __future__ import annotations

import numpy as np

from dloftbs.kernels.compiler import inlined


@inlined
def count_ones(word: int) -> int:
    """Return the number of ones."""
    word -= (word >> np.uint64(1)) & np.uint64(0x5555555555555555)
    word = (word & np.uint64(0x3333333333333333)) + ((word >> np.uint64(2)) & np.uint64(0x3333333333333333))
    word = (word + (word >> np.uint64(4))) & np.uint64(0x0F0F0F0F0F0F0F0F)
    return (word * np.uint64(0x0101010101010101)) >> np.uint64(56)


@inlined
def lowest_one(word: int) -> int:
    """Return the place of the lowest one of a word that has any."""
    return np.int64(count_ones(~word & (word - np.uint64(1))))
