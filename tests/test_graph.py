"""How the ends of a graph are joined."""

from __future__ import annotations

from dataclasses import fields
from itertools import pairwise

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.graph import FREE, UNAVAILABLE, Graph, Pairing


def pairing(nodes: list[int], partner: list[int], spurs: list[bool] | None = None) -> Pairing:
    """Return a pairing of runs that have two points each."""
    n = len(nodes) // 2
    points = np.zeros((2 * n, 2))
    return Pairing(
        points=points,
        radius=np.ones(2 * n),
        original=list(range(n)),
        nodes=nodes,
        price=[1.0] * 2 * n,
        spans=[(2 * i, 2 * i + 2) for i in range(n)],
        spurs=[False] * n if spurs is None else spurs,
        arms=np.zeros((2 * n, 6)),
        partner=partner,
        cost=[0.0] * 2 * n,
        margin=[np.inf] * 2 * n,
        other=[-1] * 2 * n,
        twin={},
    )


def graph(offsets: np.ndarray, spans: np.ndarray) -> Graph:
    """Return a graph of which only the runs are known."""
    known = {"offsets": offsets, "spans": spans}
    return Graph(**{field.name: known.get(field.name, np.empty(0)) for field in fields(Graph)})


def test_a_graph_counts_its_runs_and_lists_its_loops() -> None:
    two = graph(np.array([0, 4, 9, 15, 20]), np.array([[0, 4], [4, 9]]))
    assert two.runs == 2
    assert two.loops == [(9, 15), (15, 20)]
    loop = graph(np.array([0, 7]), np.empty((0, 2), dtype=np.int64))
    assert (loop.runs, loop.loops) == (0, [(0, 7)])


def test_a_cable_is_followed_from_end_to_end() -> None:
    # Run 1, backwards, then 0, then 2 backwards.
    joined = pairing([FREE] * 6, [2, 5, 0, -1, -1, 1])
    assert joined.chain(3) == [3, 0, 5]
    assert joined.chain(4) == [4, 1, 2]
    assert joined.chains() == [([3, 0, 5], False)]


def test_a_ring_is_listed_once_and_after_what_has_ends() -> None:
    ring_and_line = pairing([FREE] * 6, [3, 2, 1, 0, -1, -1])
    assert ring_and_line.chains() == [([4], False), ([0, 2], True)]
    alone = pairing([FREE, FREE], [1, 0])
    assert alone.chains() == [([0], True)]


def test_what_is_no_cable_is_left_out() -> None:
    runs = pairing([UNAVAILABLE] * 2 + [0, UNAVAILABLE] + [FREE, 0], [-1] * 6, [False, True, False])
    assert runs.chains() == [([4], False)]
    runs.join(2, 5)
    assert runs.chains() == [([3, 5], False)]  # a spur may be the tip of a cable


def test_only_what_runs_through_one_junction_is_a_crossing() -> None:
    runs = pairing([FREE, 0, 0, 1, 2, FREE], [-1, 2, 1, 4, 3, -1])
    assert [runs.is_crossing(end) for end in (1, 2, 3, 4)] == [True, True, False, False]
    gap = pairing([FREE, FREE, FREE, FREE], [-1, 2, 1, -1])
    assert not gap.is_crossing(1)


def check(partner: list[int]) -> None:
    for i, j in enumerate(partner):
        assert j == -1 or (partner[j] == i and i != j)


@given(st.integers(0, 10**6))
def test_partners_stay_mutual_and_every_run_is_in_one_chain(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 7))
    runs = pairing([FREE] * 2 * n, [-1] * 2 * n)
    for _ in range(12):
        i, j = rng.integers(0, 2 * n, 2).tolist()
        if rng.random() < 0.3:
            runs.open(i)
            assert runs.partner[i] == -1
        elif i != j and runs.partner[i] == runs.partner[j] == -1:
            runs.join(i, j)
        elif i != j and runs.partner[i] != j:
            before = runs.partner[i], runs.partner[j]
            runs.exchange(i, j)
            assert (runs.partner[j], runs.partner[i]) == before
        check(runs.partner)
        chains = runs.chains()
        assert sorted(end // 2 for chain, _ in chains for end in chain) == list(range(n))
        for chain, is_ring in chains:
            assert is_ring == (runs.partner[chain[0]] >= 0)
            for here, there in pairwise(chain):
                assert runs.partner[here ^ 1] == there
