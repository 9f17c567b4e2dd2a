"""Pieces are joined to as many cables as there are at a low cost, of joins and of pieces that are left out."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.linking.kernels.path_cover import cover


def paths(n: int, joined: np.ndarray) -> list[list[int]] | None:
    """Return the pieces of each path; None where a port is used twice or the pieces go round."""
    group = list(range(n))
    if len(set(joined.ravel().tolist())) < joined.size:
        return None
    for i, j in (joined // 2).tolist():
        if group[i] == group[j]:
            return None
        group = [group[i] if one == group[j] else one for one in group]
    return [[p for p in range(n) if group[p] == one] for one in sorted(set(group))]


def total(pairs: np.ndarray, costs: np.ndarray, drop_costs: np.ndarray, most: int, joins: list[int]) -> float:
    """Return the cost of joins, and of leaving out the paths that cost the least; infinite where they do not fit."""
    found = paths(len(drop_costs), pairs[joins])
    if found is None:
        return np.inf
    left = sorted(drop_costs[path].sum() for path in found)[: max(len(found) - most, 0)]
    return float(costs[joins].sum() + sum(left))


def instance(seed: int, n: int, share: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return a share of all pairs of ports, their costs, and the cost of leaving out each piece."""
    rng = np.random.default_rng(seed)
    pairs = np.column_stack(np.triu_indices(2 * n, 1))
    pairs = pairs[(pairs[:, 0] // 2 != pairs[:, 1] // 2) & (rng.random(len(pairs)) < share)]
    return pairs, rng.uniform(0, 5, len(pairs)), rng.uniform(0, 6, n)


@given(st.integers(0, 2**32 - 1), st.integers(1, 20), st.integers(1, 20))
def test_the_cover_of_pieces_is_one_and_costs_no_more_than_to_leave_out(seed: int, n: int, most: int) -> None:
    pairs, costs, drop_costs = instance(seed, n, 0.3)
    found = cover(pairs, costs, drop_costs, most).tolist()
    assert total(pairs, costs, drop_costs, most, found) <= np.sort(drop_costs)[: max(n - most, 0)].sum() + 1e-9
    assert len(found) <= max(n - most, 0)


@pytest.mark.parametrize("n", [4, 9, 30])
def test_a_row_of_pieces_becomes_one_cable_without_the_speck_beside_it(n: int) -> None:
    pairs = np.array([(2 * p + 1, 2 * p + 2) for p in range(n - 2)] + [(2 * n - 3, 2 * n - 2)])
    drop_costs = np.full(n, 2.0)
    drop_costs[-1] = 0.1
    assert sorted(cover(pairs, np.full(n - 1, 0.5), drop_costs, 1).tolist()) == list(range(n - 2))


@pytest.mark.parametrize("most", [3, 4])
def test_as_many_as_there_are_stay_as_they_are(most: int) -> None:
    pairs, costs, drop_costs = instance(0, 3, 1.0)
    assert cover(pairs, costs, drop_costs, most).size == 0
    assert cover(np.empty((0, 2), np.int64), np.empty(0), drop_costs, 1).size == 0
