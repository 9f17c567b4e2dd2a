"""By how much a mask was enlarged."""

from __future__ import annotations

import math

import numpy as np
import pytest
from drawings import random_masks
from hypothesis import given
from hypothesis import strategies as st
from skeletons import as_words

from dloftbs.cleaning.kernels.enlargement import enlargement
from dloftbs.kernels.bitmask import cut


def fast(mask: np.ndarray) -> int:
    return enlargement(cut(as_words(mask), mask.shape[1], 2)[0])


def slow(mask: np.ndarray) -> int:
    padded = np.pad(mask != 0, 1)
    steps = []
    for axis in (0, 1):
        places = np.flatnonzero(np.diff(padded, axis=axis).any(axis=1 - axis))
        steps.append(math.gcd(*np.diff(places).tolist()) if len(places) >= 16 else 1)
    return math.gcd(*steps)


@given(random_masks, st.integers(1, 5), st.integers(0, 3))
def test_it_is_the_common_divisor_of_the_distances_between_changes(mask: np.ndarray, step: int, aside: int) -> None:
    enlarged = np.pad(np.kron(mask, np.ones((step, step), mask.dtype)), ((aside, 3), (3, aside)))
    assert fast(enlarged) == slow(enlarged)


@pytest.mark.parametrize("step", [2, 3, 7])
def test_what_is_drawn_at_its_size_has_no_steps_and_what_is_enlarged_has(step: int) -> None:
    rows, columns = np.mgrid[:90, :130]
    disc = np.hypot(rows - 45, columns - 65) < 40
    assert fast(disc) == 1
    assert fast(np.kron(disc, np.ones((step, step), bool))) == step


def test_bars_along_the_axes_say_nothing() -> None:
    bars = np.zeros((60, 90), bool)
    bars[10:20, 10:80] = bars[10:50, 20:26] = True
    assert fast(bars) == 1
    assert fast(np.zeros((60, 90), bool)) == 1
