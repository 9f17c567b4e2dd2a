"""Ends between which a gap may lie."""

from __future__ import annotations

import numpy as np
import pytest
from numba import njit

from dloftbs.linking.kernels.near_ends import MAX_GAPS, near_ends

near_ends = njit(near_ends)


def states_at(positions: np.ndarray) -> np.ndarray:
    return np.hstack((positions, np.zeros((len(positions), 4))))


def listed(positions: np.ndarray, ends: np.ndarray, max_gap: float) -> list[tuple[int, int]]:
    first, near = near_ends(states_at(positions), ends, max_gap)
    return [(int(i), int(j)) for k, i in enumerate(ends) for j in near[first[k] : first[k + 1]]]


def apart(positions: np.ndarray, pairs: list[tuple[int, int]]) -> np.ndarray:
    i, j = np.array(pairs).T
    return np.abs(positions[i] - positions[j]).max(axis=1)


@pytest.mark.parametrize("max_gap", [0.0, 4.0, 30.0, 1e9])
@pytest.mark.parametrize("seed", range(5))
def test_all_pairs_within_the_longest_gap_are_listed_in_ascending_order(seed: int, max_gap: float) -> None:
    rng = np.random.default_rng(seed)
    positions = rng.integers(0, 100, (80, 2)).astype(np.float64)  # some in one place, some in one column
    ends = np.flatnonzero(rng.random(80) < 0.7)
    expected = [
        (int(i), int(j)) for i in ends for j in ends if i < j and np.abs(positions[i] - positions[j]).max() <= max_gap
    ]
    assert listed(positions, ends, max_gap) == expected


@pytest.mark.parametrize("max_gap", [40.0, 1e9])
def test_of_too_many_pairs_the_nearest_ones_are_listed(max_gap: float) -> None:
    positions = np.random.default_rng(3).uniform(0, 100, (1000, 2))
    pairs = listed(positions, np.arange(1000), max_gap)
    assert 0.5 * MAX_GAPS < len(pairs) <= MAX_GAPS
    every = [(i, j) for i in range(1000) for j in range(i + 1, 1000)]
    longest = apart(positions, pairs).max()
    assert len(pairs) == (apart(positions, every) <= longest).sum()


def test_without_gaps_ends_at_one_place_are_near_however_many_there_are() -> None:
    positions = 5.0 * np.arange(400)[:, None].repeat(2, axis=0).repeat(2, axis=1)[::-1]
    pairs = listed(positions, np.arange(800), 0.0)
    assert pairs == [(2 * k, 2 * k + 1) for k in range(400)]


def test_no_end_is_near_itself_or_none() -> None:
    positions = np.zeros((1, 2))
    assert listed(positions, np.array([0]), 10.0) == []
    assert listed(positions, np.empty(0, dtype=np.int64), 10.0) == []
