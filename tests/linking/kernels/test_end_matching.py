"""EndMatching ends at the least total cost, against all pairings tried one by one."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numba import njit

from dloftbs.linking.kernels.end_matching import EXACT, least_costs, match_ends
from dloftbs.linking.kernels.pair_costs import junction_costs
from dloftbs.linking.kernels.pairings import list_pairs_of, match_by_exchange, match_exactly

list_pairs_of, match_by_exchange = njit(list_pairs_of), njit(match_by_exchange)
match_ends = njit(match_ends)
match_exactly = njit(match_exactly)

Pairs = list[tuple[int, int]]


def all_pairings(ends: list[int]) -> Iterator[Pairs]:
    """Yield every way to pair some of the ends and leave the others open."""
    if not ends:
        yield []
        return
    first, rest = ends[0], ends[1:]
    yield from all_pairings(rest)
    for other in rest:
        for pairs in all_pairings([end for end in rest if end != other]):
            yield [(first, other), *pairs]


def total(pairs: Pairs, cost: np.ndarray, open_cost: np.ndarray) -> float:
    joined = {end for pair in pairs for end in pair}
    return sum(cost[pair] for pair in pairs) + sum(open_cost[i] for i in range(len(open_cost)) if i not in joined)


def problem(seed: int, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Return random costs (n, n), some of them forbidding, and prices (n,)."""
    rng = np.random.default_rng(seed)
    cost = rng.uniform(0.0, 3.0, (n, n))
    cost[rng.random((n, n)) < 0.2] = 1e6
    cost = np.triu(cost, 1)
    return cost + cost.T, rng.uniform(0.2, 1.5, n)


def pairs_of(partner: np.ndarray) -> Pairs:
    return [(i, int(j)) for i, j in enumerate(partner) if j > i]


@given(st.integers(0, 10**6), st.integers(1, 8))
def test_the_exact_matching_is_the_best_of_all(seed: int, n: int) -> None:
    cost, open_cost = problem(seed, n)
    partner = np.full(n, -7)
    value = match_exactly(cost, open_cost, partner)
    assert value == pytest.approx(min(total(pairs, cost, open_cost) for pairs in all_pairings(list(range(n)))))
    assert total(pairs_of(partner), cost, open_cost) == pytest.approx(value)
    assert all(j == -1 or partner[j] == i for i, j in enumerate(partner))


def test_exchanges_are_never_better_than_exact_and_on_most_as_good() -> None:
    as_good = 0
    for seed in range(200):
        n = 3 + seed % 10
        cost, open_cost = problem(seed, n)
        partner, best = np.full(n, -7), np.full(n, -7)
        rows, columns, costs = dense_pairs(cost)
        own = np.arange(len(rows))
        partner[:] = -1  # as it stays where an end has no pair
        match_by_exchange(rows, columns, costs, open_cost, *list_pairs_of(rows, columns, n), own, partner)
        value, least = total(pairs_of(partner), cost, open_cost), match_exactly(cost, open_cost, best)
        assert all(j == -1 or partner[j] == i for i, j in enumerate(partner))
        assert value >= least - 1e-9
        as_good += value <= least + 1e-9
    assert as_good > 120


def dense_pairs(cost: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rows, columns = np.nonzero(np.triu(cost < 1e6, 1))
    return rows, columns, cost[rows, columns]


def paired(
    rows: np.ndarray,
    columns: np.ndarray,
    costs: np.ndarray,
    open_cost: np.ndarray,
    *,
    bonus: np.ndarray | None = None,
    end_id: np.ndarray | None = None,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    bonus = np.zeros(len(rows)) if bonus is None else bonus
    return match_ends(rows, columns, costs, bonus, open_cost, np.arange(len(open_cost)) if end_id is None else end_id)


@given(st.integers(0, 10**6), st.integers(2, 6))
def test_margins_say_how_much_dearer_it_is_without_a_joint(seed: int, n: int) -> None:
    cost, open_cost = problem(seed, n)
    partner, cost_of, margin, other = paired(*dense_pairs(cost), open_cost)
    totals = [(pairs, total(pairs, cost, open_cost)) for pairs in all_pairings(list(range(n)))]
    least = min(one for _, one in totals)
    assert total(pairs_of(partner), cost, open_cost) == pytest.approx(least)
    for i, j in enumerate(partner):
        if j < 0:
            assert cost_of[i] == 0.0
            assert margin[i] == np.inf
            assert other[i] == -1
            continue
        assert cost_of[i] == cost[i, j]
        assert margin[i] == margin[j]
        assert other[i] not in (i, j)
        without = min(one for pairs, one in totals if (min(i, j), max(i, j)) not in pairs)
        # Only what changes one more pair is looked at: the true next best may be nearer, never farther.
        assert 0.0 <= without - least <= margin[i] + 1e-9


def test_margins_of_four_joined_ends_are_exact() -> None:
    joined = 0
    for seed in range(100):
        cost, open_cost = problem(seed, 4)
        partner, _, margin, *_ = paired(*dense_pairs(cost), open_cost)
        if partner.min() < 0:
            continue
        joined += 1
        least = total(pairs_of(partner), cost, open_cost)
        for i, j in pairs_of(partner):
            rest = [pairs for pairs in all_pairings([0, 1, 2, 3]) if (i, j) not in pairs]
            assert margin[i] == pytest.approx(min(total(pairs, cost, open_cost) for pairs in rest) - least)
    assert joined > 10


def test_the_next_best_choice_is_named() -> None:
    #  0 and 1 are joined; 2 would be the next best for 0.
    rows, columns, costs = np.array([0, 0]), np.array([1, 2]), np.array([0.1, 0.3])
    partner, cost, margin, other = paired(rows, columns, costs, np.ones(3))
    assert partner.tolist() == [1, 0, -1]
    assert cost[:2].tolist() == [0.1, 0.1]
    np.testing.assert_allclose(margin[:2], 0.2)
    assert other.tolist() == [2, -1, -1]


def test_another_copy_of_the_same_end_is_no_other_choice() -> None:
    rows, columns, costs = np.array([0, 0]), np.array([1, 2]), np.array([0.1, 0.3])
    _, _, margin, other = paired(rows, columns, costs, np.ones(3), end_id=np.array([0, 1, 1]))
    np.testing.assert_allclose(margin[:2], 1.9)  # what it costs to leave both open
    assert other.tolist() == [-1, -1, -1]


def test_pieces_that_have_nothing_to_do_with_each_other_are_matched_by_themselves() -> None:
    """Many small problems in one, in a shuffled order, give what each of them gives."""
    rng = np.random.default_rng(5)
    sizes = [2, 5, 1, 7, 3, 6, 4, EXACT]
    n = sum(sizes)
    name = rng.permutation(n)
    rows, columns, costs = [], [], []
    open_cost = np.empty(n)
    expected = 0.0
    start = 0
    for k, size in enumerate(sizes):
        cost, own = problem(k, size)
        open_cost[name[start : start + size]] = own
        expected += match_exactly(cost, own, np.empty(size, dtype=np.int64))
        for i, j, c in zip(*dense_pairs(cost), strict=True):
            rows.append(name[start + i])
            columns.append(name[start + j])
            costs.append(c)
        start += size
    order = rng.permutation(len(rows))
    pairs = np.array(rows)[order], np.array(columns)[order], np.array(costs)[order]
    partner, cost_of, *_ = paired(*pairs, open_cost)
    joined = partner >= 0
    assert 0.5 * cost_of.sum() + open_cost[~joined].sum() == pytest.approx(expected)


def test_nothing_to_pair() -> None:
    nothing = np.empty(0, dtype=np.int64)
    partner, cost, margin, other = paired(nothing, nothing, np.empty(0), np.ones(3))
    assert partner.tolist() == [-1, -1, -1]
    assert cost.tolist() == [0.0, 0.0, 0.0]
    assert np.isinf(margin).all()
    assert other.tolist() == [-1, -1, -1]
    assert len(paired(nothing, nothing, np.empty(0), np.empty(0))[0]) == 0


def test_sets_of_arms_cost_what_their_best_pairing_costs() -> None:
    rng = np.random.default_rng(2)
    nodes = np.array([0, 1, 0, -1, 0, 1, 1, 0, -1, 1])
    angle = rng.uniform(0, 2 * np.pi, 10)
    states = np.column_stack((rng.uniform(20, 40, (10, 2)), np.cos(angle), np.sin(angle), np.zeros(10), np.ones(10)))
    first, members, starts, costs = junction_costs(nodes, np.zeros(5, dtype=np.bool_), np.full(10, -1), states, 5.0)
    open_cost = rng.uniform(0.5, 1.5, 10)
    groups = [[0, 2, 4, 7], [1, 5, 6], [0, 2, 2, 7], [9], [1, 5, 5, 9, 9]]
    sets = np.cumsum([0, *map(len, groups)])
    totals = least_costs(sets, np.concatenate(groups), nodes, open_cost, first, members, starts, costs)
    for ends, found in zip(groups, totals, strict=True):
        node = nodes[ends[0]]
        here = members[first[node] : first[node + 1]].tolist()
        matrix = costs[starts[node] : starts[node + 1]].reshape(len(here), len(here))
        cost = np.array([[matrix[here.index(a), here.index(b)] for b in ends] for a in ends])
        everything = all_pairings(list(range(len(ends))))
        assert found == pytest.approx(min(total(pairs, cost, open_cost[ends]) for pairs in everything))


@given(st.integers(0, 10**6), st.integers(2, 14))
def test_a_bonus_is_counted_in_the_choice_and_neither_in_the_cost_nor_in_the_margin(seed: int, n: int) -> None:
    cost, open_cost = problem(seed, n)
    rows, columns, costs = dense_pairs(cost)
    rng = np.random.default_rng(seed)
    bonus = rng.uniform(0.0, 0.6, len(rows)) * (rng.random(len(rows)) < 0.3)
    partner, cost_of, margin, other = paired(rows, columns, costs, open_cost, bonus=bonus)
    np.testing.assert_array_equal(partner, paired(rows, columns, costs - bonus, open_cost)[0])
    joined = partner >= 0
    np.testing.assert_array_equal(cost_of[joined], cost[np.flatnonzero(joined), partner[joined]])
    expected = open_margins(partner, cost, open_cost)
    assert other.tolist() == [end for _, end in expected]
    for i, j in pairs_of(partner):
        here = min(expected[i][0], expected[j][0])
        assert margin[i] == margin[j]
        assert margin[i] == pytest.approx(here) or margin[i] == max(here, 0.0)  # no bonus in its group


def test_a_joint_for_which_only_its_bonus_speaks_has_a_negative_margin() -> None:
    rows, columns, costs = np.array([0, 0]), np.array([1, 2]), np.array([0.1, 0.3])
    partner, cost, margin, other = paired(rows, columns, costs, np.ones(3), bonus=np.array([0.0, 0.5]))
    assert partner.tolist() == [2, -1, 0]
    assert cost[0] == 0.3
    np.testing.assert_allclose(margin[[0, 2]], -0.2)
    assert other.tolist() == [1, -1, -1]


def open_margins(partner: np.ndarray, cost: np.ndarray, open_cost: np.ndarray) -> list[tuple[float, int]]:
    """Return for each joined end how much dearer the next best change of one more pair is, and the end it leads to."""
    found = []
    for a, b in enumerate(partner.tolist()):
        best = (open_cost[a] + open_cost[b] - cost[a, b], -1) if b >= 0 else (np.inf, -1)
        for c in range(len(open_cost)) if b >= 0 else ():
            if c in (a, b) or cost[a, c] >= 1e6:
                continue
            d = int(partner[c])
            now = cost[a, b] + (cost[c, d] if d >= 0 else open_cost[c])
            then = cost[a, c] + (min(cost[b, d], open_cost[b] + open_cost[d]) if d >= 0 else open_cost[b])
            best = min(best, (then - now, c), key=lambda option: option[0])
        found.append(best)
    return found


@given(st.integers(0, 10**6), st.integers(2, 16))
def test_the_next_best_choice_is_the_best_of_all_others(seed: int, n: int) -> None:
    cost, open_cost = problem(seed, n)
    partner, _, margin, other = paired(*dense_pairs(cost), open_cost)
    expected = open_margins(partner, cost, open_cost)
    assert other.tolist() == [end for _, end in expected]
    for i, j in pairs_of(partner):
        assert margin[i] == margin[j] == pytest.approx(max(min(expected[i][0], expected[j][0]), 0.0))
