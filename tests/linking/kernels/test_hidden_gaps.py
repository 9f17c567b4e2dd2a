"""Gaps that are sure, and what they make of others."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numba import njit

from dloftbs.linking.kernels.end_matching import match_ends
from dloftbs.linking.kernels.hidden_gaps import match_with_hiding
from dloftbs.linking.kernels.joint_features import GAP_LENGTH
from dloftbs.linking.kernels.weights import JOINT

match_ends = njit(match_ends)

WIDTH = 5.0
MARGIN, STRETCH, SPARED = 0.8, 1.5, 2.0 / 3.0 * JOINT[GAP_LENGTH]


def slow_costs(
    rows: np.ndarray,
    columns: np.ndarray,
    costs: np.ndarray,
    bonus: np.ndarray,
    rest: tuple[np.ndarray, ...],
    counted: np.ndarray,
) -> np.ndarray:
    """Return the costs of the pairs after a first matching, with all sure gaps compared."""
    open_cost, end_id, nodes, states = rest
    own = costs - bonus - open_cost[rows] - open_cost[columns] < 0
    partner, _, margin, *_ = match_ends(rows[own], columns[own], costs[own], bonus[own], open_cost, end_id)

    def length(i: int, j: int) -> float:
        return 0.0 if nodes[i] == nodes[j] >= 0 else float(np.hypot(*(states[i, :2] - states[j, :2])))

    sure = [(i, j) for i, j in enumerate(partner.tolist()) if j > i and margin[i] >= MARGIN]
    result = costs.copy()
    for p, pair in enumerate(zip(rows.tolist(), columns.tolist(), strict=True)):
        others = [length(*other) for other in sure if not set(pair) & set(other)]
        if others and length(*pair) <= STRETCH * max(others):
            result[p] -= SPARED * counted[p]
    return result


@given(st.integers(0, 2**32 - 1))
def test_gaps_of_the_size_of_a_sure_one_cost_less(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n = 2 * int(rng.integers(1, 9))
    rows, columns = np.triu_indices(n, 1)
    taken = rng.random(len(rows)) < 0.5
    rows, columns = rows[taken], columns[taken]
    costs, bonus = rng.uniform(0, 2.5, len(rows)), 0.6 * (rng.random(len(rows)) < 0.2)
    nodes, states = rng.integers(-1, 2, n), np.zeros((n, 6))
    states[:, :2] = rng.uniform(0, 12 * WIDTH, (n, 2))
    rest = (rng.uniform(0.3, 1.4, n), np.arange(n), nodes, states)
    is_link = (nodes[rows] == nodes[columns]) & (nodes[rows] >= 0)
    counted = rng.uniform(0.0, 12.0, len(rows)) * ~is_link
    *joints, lacking = match_with_hiding(rows, columns, costs, bonus, *rest, counted)
    now, open_cost = slow_costs(rows, columns, costs, bonus, rest, counted), rest[0]
    np.testing.assert_allclose(lacking, now - bonus - open_cost[rows] - open_cost[columns], rtol=0, atol=1e-12)
    own = lacking < 0
    again = match_ends(rows[own], columns[own], now[own], bonus[own], open_cost, rest[1])
    for found, one in zip(joints, again, strict=True):
        np.testing.assert_allclose(found, one, rtol=0, atol=1e-12)


def test_a_gap_is_no_evidence_for_itself() -> None:
    """Two ends 8 widths apart are joined; one pair more, of the same size, changes both."""
    states = np.zeros((4, 6))
    states[:, 0], states[:, 1] = [0, 8 * WIDTH, 0, 8 * WIDTH], [0, 0, 90, 90]
    nodes, open_cost, ids = np.full(4, -1), np.full(4, 4.4), np.arange(4)
    pairs = np.array([0, 2]), np.array([1, 3]), np.array([2.8, 9.2]), np.zeros(2)
    counted = np.array([8.0, 8.0])
    alone = match_with_hiding(*(given[:1] for given in pairs), open_cost, ids, nodes, states, counted[:1])
    assert alone[0].tolist() == [1, 0, -1, -1]
    np.testing.assert_allclose(alone[4], [2.8 - 8.8])
    both = match_with_hiding(*pairs, open_cost, ids, nodes, states, counted)
    assert both[0].tolist() == [1, 0, 3, 2]
    np.testing.assert_allclose(both[4], [2.8 - 8.8, 9.2 - 8 * SPARED - 8.8])
    covered = match_with_hiding(*pairs, open_cost, ids, nodes, states, np.array([8.0, 0.0]))
    np.testing.assert_allclose(covered[4], [2.8 - 8.8, 9.2 - 8.8])  # its length costs nothing, so nothing is spared
