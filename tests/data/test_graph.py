"""How the ends of a graph are joined."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.data.graph import (
    FREE,
    UNAVAILABLE,
    Graph,
    branch_of,
    ends_of,
    inward,
    is_start,
    other_end,
    same_side,
    start_of,
    stop_of,
)
from dloftbs.linking.matched_ends import Branches, EndMatching


def matching(nodes: list[int], partner: list[int], spurs: list[bool] | None = None) -> EndMatching:
    """Return a matching of branches that have two points each."""
    n = len(nodes) // 2
    points = np.zeros((2 * n, 2))
    branches = Branches(
        points=points,
        radius=np.ones(2 * n),
        branch_id=list(range(n)),
        nodes=nodes,
        open_cost=[1.0] * 2 * n,
        spans=[(2 * i, 2 * i + 2) for i in range(n)],
        spurs=[False] * n if spurs is None else spurs,
        end_states=np.zeros((2 * n, 6)),
        duplicate_of={},
    )
    return EndMatching(branches, partner, [0.0] * 2 * n, [np.inf] * 2 * n, [-1] * 2 * n)


def graph(offsets: np.ndarray, spans: np.ndarray) -> Graph:
    """Return a graph of which only the branches are known."""
    known = {"offsets": offsets, "spans": spans}
    return Graph(**{name: known.get(name, np.empty(0)) for name in Graph._fields})


def test_a_graph_counts_its_branches_and_lists_its_loops() -> None:
    two = graph(np.array([0, 4, 9, 15, 20]), np.array([[0, 4], [4, 9]]))
    assert two.branch_count == 2
    assert two.loops == [(9, 15), (15, 20)]
    loop = graph(np.array([0, 7]), np.empty((0, 2), dtype=np.int64))
    assert (loop.branch_count, loop.loops) == (0, [(0, 7)])


def test_a_cable_is_followed_from_end_to_end() -> None:
    # Run 1, backwards, then 0, then 2 backwards.
    joined = matching([FREE] * 6, [2, 5, 0, -1, -1, 1])
    assert joined.chain(3) == [3, 0, 5]
    assert joined.chain(4) == [4, 1, 2]
    assert joined.chains() == [([3, 0, 5], False)]


def test_a_loop_is_listed_once_and_after_what_has_ends() -> None:
    loop_and_line = matching([FREE] * 6, [3, 2, 1, 0, -1, -1])
    assert loop_and_line.chains() == [([4], False), ([0, 2], True)]
    alone = matching([FREE, FREE], [1, 0])
    assert alone.chains() == [([0], True)]


def test_what_is_no_cable_is_left_out() -> None:
    joined = matching([UNAVAILABLE] * 2 + [0, UNAVAILABLE] + [FREE, 0], [-1] * 6, [False, True, False])
    assert joined.chains() == [([4], False)]
    joined.join(2, 5, 1.0, 2.0)
    assert [joined.cost[end] for end in (2, 5)] == [1.0, 1.0]
    assert [joined.margin[end] for end in (2, 5)] == [2.0, 2.0]
    assert joined.chains() == [([3, 5], False)]  # a spur may be the tip of a cable


def test_only_what_runs_through_one_junction_is_a_crossing() -> None:
    joined = matching([FREE, 0, 0, 1, 2, FREE], [-1, 2, 1, 4, 3, -1])
    assert [joined.is_crossing(end) for end in (1, 2, 3, 4)] == [True, True, False, False]
    gap = matching([FREE, FREE, FREE, FREE], [-1, 2, 1, -1])
    assert not gap.is_crossing(1)


def check(partner: list[int]) -> None:
    for i, j in enumerate(partner):
        assert j == -1 or (partner[j] == i and i != j)


@given(st.integers(0, 10**6))
def test_partners_stay_mutual_and_every_run_is_in_one_chain(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 7))
    joined = matching([FREE] * 2 * n, [-1] * 2 * n)
    for _ in range(12):
        i, j = rng.integers(0, 2 * n, 2).tolist()
        if rng.random() < 0.3:
            joined.open(i)
            assert joined.partner[i] == -1
        elif i != j and joined.partner[i] == joined.partner[j] == -1:
            joined.join(i, j, 0.5, 1.0)
        elif i != j and joined.partner[i] != j:
            before = joined.partner[i], joined.partner[j]
            joined.exchange(i, j)
            assert (joined.partner[j], joined.partner[i]) == before
        check(joined.partner)
        chains = joined.chains()
        assert sorted(branch_of(end) for chain, _ in chains for end in chain) == list(range(n))
        for chain, is_loop in chains:
            assert is_loop == (joined.partner[chain[0]] >= 0)
            for here, there in pairwise(chain):
                assert joined.partner[other_end(here)] == there


def test_the_margin_of_a_joint_is_lowered_at_both_ends_and_never_raised() -> None:
    joined = matching([FREE] * 6, [2, 5, 0, -1, -1, 1])
    joined.limit_margin(2, 0.5)
    joined.limit_margin(0, 0.7)
    joined.limit_margin(3, 0.1)
    assert list(joined.margin) == [0.5, np.inf, 0.5, np.inf, np.inf, np.inf]


def test_an_exchange_with_a_margin_gives_it_to_both_joints() -> None:
    joined = matching([FREE] * 6, [2, 5, 0, -1, -1, 1])
    joined.exchange(0, 5, margin=0.25)
    assert list(joined.partner) == [1, 0, 5, -1, -1, 2]
    assert list(joined.margin) == [0.25, 0.25, 0.25, np.inf, np.inf, 0.25]
    joined.exchange(0, 3, margin=0.5)  # an open end
    assert list(joined.partner) == [-1, 3, 5, 1, -1, 2]
    assert list(joined.margin) == [0.25, 0.5, 0.25, 0.5, np.inf, 0.25]


def test_ends_that_trade_places_take_their_joints_with_them() -> None:
    joined = matching([FREE] * 6, [-1] * 6)
    joined.join(0, 2, 0.5, 1.0)
    joined.join(1, 5, 0.25, 2.0)
    joined.trade_places(0, 1)
    assert list(joined.partner) == [5, 2, 1, -1, -1, 0]
    assert [joined.cost[end] for end in (0, 5, 1, 2)] == [0.25, 0.25, 0.5, 0.5]
    assert [joined.margin[end] for end in (0, 5, 1, 2)] == [2.0, 2.0, 1.0, 1.0]


@pytest.mark.parametrize("partner", [[1, -1], [0, -1], [1, 2, 1, -1]])
def test_partners_that_are_not_mutual_are_refused(partner: list[int]) -> None:
    with pytest.raises(AssertionError):
        matching([FREE] * len(partner), partner)


def test_an_end_that_is_joined_is_not_joined_again() -> None:
    joined = matching([FREE] * 6, [2, 5, 0, -1, -1, 1])
    with pytest.raises(AssertionError):
        joined.join(3, 0, 0.0, 0.0)


def test_ends_are_numbered_by_branch_and_side() -> None:
    for branch in range(4):
        start, stop = start_of(branch), stop_of(branch)
        assert (start, stop) == (2 * branch, 2 * branch + 1)
        assert branch_of(start) == branch_of(stop) == branch
        assert (other_end(start), other_end(stop)) == (stop, start)
        assert (is_start(start), is_start(stop)) == (True, False)
        assert (inward(start), inward(stop)) == (1, -1)
        assert (same_side(7, start), same_side(7, stop)) == (14, 15)


def test_arrays_of_ends_are_read_at_once() -> None:
    ends = ends_of(np.array([3, 0]))
    np.testing.assert_array_equal(ends, [6, 7, 0, 1])
    np.testing.assert_array_equal(branch_of(ends), [3, 3, 0, 0])
    np.testing.assert_array_equal(other_end(ends), [7, 6, 1, 0])
    np.testing.assert_array_equal(same_side(np.array([1, 1, 2, 2]), ends), [2, 3, 4, 5])
