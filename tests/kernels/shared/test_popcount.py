"""Ones of a word, against Python's own count."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numba import njit

from dloftbs.kernels.shared.popcount import count_ones, lowest_one

count_ones = njit(count_ones)
lowest_one = njit(lowest_one)


@given(st.integers(0, 2**64 - 1))
def test_the_ones_of_a_word_are_counted(word):
    assert count_ones(np.uint64(word)) == word.bit_count()


@given(st.integers(1, 2**64 - 1))
def test_the_lowest_one_is_found(word):
    assert lowest_one(np.uint64(word)) == (word & -word).bit_length() - 1
