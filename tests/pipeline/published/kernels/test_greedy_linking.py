"""The greedy linking against its literal twin: all pairs, sorted."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.pipeline.published.kernels.greedy_linking import link_greedily


def literal_cost(a: np.ndarray, b: np.ndarray, da: np.ndarray, db: np.ndarray, weight: float) -> float:
    """J as the paper prints it: distance, and pi minus the wrapped difference of the two outward directions."""
    difference = abs(math.atan2(da[1], da[0]) - math.atan2(db[1], db[0]))
    wrapped = min(difference, 2 * math.pi - difference)
    return weight * math.dist(a, b) + (1 - weight) * (math.pi - wrapped)


def literal_links(
    ends: np.ndarray, directions: np.ndarray, weight: float, max_cost: float
) -> list[tuple[int, int, float]]:
    """Take the cheapest pair of all pairs of ends, as long as it joins two different chains."""
    n = len(ends)
    pairs = sorted(
        (literal_cost(ends[i], ends[j], directions[i], directions[j], weight), i, j)
        for i in range(n)
        for j in range(i + 1, n)
    )
    chain = [i // 2 for i in range(n)]
    joined: set[int] = set()
    links = []
    for cost, i, j in pairs:
        if cost < max_cost and not {i, j} & joined and chain[i] != chain[j]:
            links.append((i, j, cost))
            joined |= {i, j}
            chain = [chain[i] if c == chain[j] else c for c in chain]
    return links


def random_ends(seed: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    n = 2 * int(rng.integers(1, 12))
    # Odd fractions keep costs from being equal, where rounding alone would decide the order.
    return rng.uniform(0, 300, (n, 2)), rng.normal(size=(n, 2))


@given(st.integers(0, 2**31), st.sampled_from([0.0, 0.05, 0.5, 1.0]), st.sampled_from([0.5, 3.0, 8.0, 1e9]))
def test_links_agree_with_the_literal_twin(seed: int, weight: float, max_cost: float) -> None:
    ends, directions = random_ends(seed)
    pairs, costs, margins = link_greedily(ends, directions, weight, max_cost)
    expected = literal_links(ends, directions, weight, max_cost)
    assert [tuple(sorted(pair)) for pair in pairs.tolist()] == [(i, j) for i, j, _ in expected]
    np.testing.assert_allclose(costs, [cost for _, _, cost in expected], atol=1e-9)
    assert (margins >= 0).all()
    assert (costs + margins <= max_cost + 1e-9).all()


def test_ends_that_point_at_each_other_cost_their_distance_only() -> None:
    ends = np.array([[0.0, 0.0], [10.0, 0.0], [30.0, 0.0], [40.0, 0.0]])
    directions = np.array([[-1.0, 0.0], [1.0, 0.0], [-1.0, 0.0], [1.0, 0.0]])
    pairs, costs, margins = link_greedily(ends, directions, 0.05, 8.0)
    assert pairs.tolist() == [[1, 2]]
    assert costs[0] == pytest.approx(0.05 * 20)
    # Joining 1 to 3, which points the same way, would have been the next best choice.
    assert costs[0] + margins[0] == pytest.approx(0.05 * 30 + 0.95 * math.pi)


def test_ends_that_point_the_same_way_cost_pi() -> None:
    ends = np.array([[0.0, 0.0], [10.0, 0.0], [0.0, 5.0], [10.0, 5.0]])
    directions = np.array([[-1.0, 0.0], [1.0, 0.0], [-1.0, 0.0], [1.0, 0.0]])
    _, costs, _ = link_greedily(ends, directions, 0.5, 100.0)
    assert costs[0] == pytest.approx(0.5 * 5 + 0.5 * math.pi)


def test_two_ends_of_one_chain_are_never_joined() -> None:
    # A broken ring of two half circles: one joint closes a chain, a second one would close a cycle.
    ends = np.array([[0.0, 1.0], [0.0, 99.0], [3.0, 1.0], [3.0, 99.0]])
    directions = np.array([[1.0, 0.0], [1.0, 0.0], [-1.0, 0.0], [-1.0, 0.0]])
    pairs, _, _ = link_greedily(ends, directions, 0.05, 8.0)
    assert pairs.tolist() == [[0, 2]]


def test_the_lower_pair_wins_among_equals() -> None:
    ends = np.array([[0.0, 0.0], [0.0, 9.0], [5.0, 0.0], [5.0, 9.0]])
    pairs, _, margins = link_greedily(ends, np.ones((4, 2)), 1.0, 100.0)
    assert pairs.tolist() == [[0, 2]]
    assert margins[0] > 0


def test_one_segment_has_nothing_to_join() -> None:
    pairs, costs, margins = link_greedily(np.zeros((2, 2)), np.ones((2, 2)), 0.05, 8.0)
    assert (len(pairs), len(costs), len(margins)) == (0, 0, 0)
