"""Runs that two cables might share."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.linking.kernels.branch_overlap import MAX_RUNS, _overlap_cost, changed_junctions, choose_paths, list_paths
from dloftbs.linking.kernels.end_matching import least_costs
from dloftbs.linking.kernels.joint_features import OPEN_JUNCTION
from dloftbs.linking.kernels.pair_costs import junction_costs
from dloftbs.linking.kernels.weights import OPEN

WIDTH = 6.0


def states_of(ends: list[tuple[float, float, float]]) -> np.ndarray:
    """Return end states from ``(x, y, outward direction in degrees)``."""
    return np.array([[x, y, np.cos(np.radians(a)), np.sin(np.radians(a)), 0.0, 1.0] for x, y, a in ends])


def two_ys() -> tuple[np.ndarray, np.ndarray]:
    """Two Y junctions joined by a branch of 60 px: the third of five branches is shared."""
    nodes = np.array([-1, 0, -1, 0, 0, 1, 1, -1, 1, -1])
    ends = [
        (50, 150, 200), (190, 198, 20), (50, 250, 160), (190, 202, -20),
        (206, 200, 180), (254, 200, 0),
        (270, 198, 160), (410, 150, -20), (270, 202, 200), (410, 250, 20),
    ]  # fmt: skip
    return nodes, states_of(ends)


def paths_of(
    nodes: np.ndarray, states: np.ndarray, wide: float = 2.0, spur: np.ndarray | None = None, **known: np.ndarray
) -> tuple[list[list[int]], np.ndarray, np.ndarray]:
    n = len(nodes) // 2
    spur = np.zeros(n, dtype=np.bool_) if spur is None else spur
    lengths = np.linalg.norm(states[::2, :2] - states[1::2, :2], axis=1).astype(np.int64)
    spans = np.stack((np.zeros(n, dtype=np.int64), lengths), axis=1)
    widths = np.full(n, WIDTH)
    widths[2] = wide * WIDTH
    reach = known.get("reach", np.zeros(2 * n, dtype=np.int64))
    costs = junction_costs(nodes, spur, np.full(2 * n, -1), states, WIDTH)
    open_costs = np.full(2 * n, OPEN[OPEN_JUNCTION])
    first, members = costs[:2]
    is_cable = ~spur[members // 2]
    sets = np.concatenate(([0], np.cumsum(is_cable)))[first]
    unresolved = least_costs(sets, members[is_cable], nodes, open_costs, *costs)
    paths, inside, open_cost = list_paths(
        nodes, spur, unresolved >= OPEN[OPEN_JUNCTION], reach, spans, widths, WIDTH, *costs
    )
    return [[end for end in path if end >= 0] for path in paths.tolist()], inside, open_cost


def test_the_run_between_two_ys_may_be_shared() -> None:
    paths, inside, open_cost = paths_of(*two_ys())
    assert sorted(paths) == [[4], [5]]
    assert not inside.any()
    assert (open_cost < 0).all()  # it is as wide as two
    assert (paths_of(*two_ys(), wide=1.0)[2] > 0.9).all()


def test_a_junction_of_four_ends_needs_no_explanation() -> None:
    nodes = np.array([0, -1, 0, -1, 0, -1, 0, -1])
    states = states_of([
        (206, 200, 180), (300, 200, 0), (200, 206, 270), (200, 300, 90),
        (194, 200, 0), (100, 200, 180), (200, 194, 90), (200, 100, 270),
    ])  # fmt: skip
    assert paths_of(nodes, states)[0] == []
    # A spur does not count: of the three others, one may be two.
    reach = np.array([40, 0, 0, 0, 0, 0, 0, 0])
    paths, inside, _ = paths_of(nodes, states, spur=np.array([False, True, False, False]), reach=reach)
    assert paths == [[0]]
    assert inside.tolist() == [True]


def test_a_shared_run_leads_straight_through_a_junction_on_its_way() -> None:
    """Another cable crosses the branch between the two Ys."""
    nodes = np.array([-1, 0, -1, 0, 0, 2, 1, -1, 1, -1, 2, 1, 2, -1, 2, -1])
    states = states_of([
        (50, 150, 200), (190, 198, 20), (50, 250, 160), (190, 202, -20),
        (206, 200, 180), (222, 200, 0),
        (270, 198, 160), (410, 150, -20), (270, 202, 200), (410, 250, 20),
        (238, 200, 180), (254, 200, 0),
        (230, 192, 90), (230, 100, 270), (230, 208, 270), (230, 300, 90),
    ])  # fmt: skip
    paths, _, _ = paths_of(nodes, states)
    assert [4, 10] in paths
    assert [11, 5] in paths
    assert all(end // 2 in (2, 5) for path in paths for end in path)


@given(st.floats(0, 200), st.floats(0.5, 3.0))
def test_sharing_costs_less_where_the_mask_is_wider(length: float, ratio: float) -> None:
    open_cost = _overlap_cost(length, ratio * WIDTH, WIDTH)
    assert _overlap_cost(length, (ratio + 0.1) * WIDTH, WIDTH) <= open_cost + 1e-12
    assert _overlap_cost(2 * length, ratio * WIDTH, WIDTH) == pytest.approx(2 * open_cost)


def test_the_sets_of_arms_before_and_after() -> None:
    nodes, states = two_ys()
    costs = junction_costs(nodes, np.zeros(5, dtype=np.bool_), np.full(10, -1), states, WIDTH)
    paths = np.full((2, MAX_RUNS), -1)
    paths[:, 0] = 4
    sets, slots, changes = changed_junctions(paths, np.array([False, True]), nodes, *costs[:2])
    groups = [sorted(slots[a:b].tolist()) for a, b in pairwise(sets)]
    assert changes[:, 2].tolist() == [0, 0, 1]
    # At each junction the ends as they are, and with the shared one twice; a cable that ends inside changes one only.
    assert [groups[k] for k in changes[:, 0]] == [[1, 3, 4], [5, 6, 8], [1, 3, 4]]
    assert [groups[k] for k in changes[:, 1]] == [[1, 3, 4, 4], [5, 5, 6, 8], [1, 3, 4, 4]]
    assert len(groups) == 4  # each once


def test_a_branch_may_be_shared_where_an_even_number_of_ends_meet() -> None:
    """Another cable ends at one of two Ys: of the four ends that meet there, two would stay open."""
    nodes, states = two_ys()
    nodes = np.append(nodes, (0, -1))
    states = np.concatenate((states, states_of([(190, 206, 270), (190, 300, 90)])))
    paths, _, _ = paths_of(nodes, states)
    assert sorted(paths) == [[4], [5]]


def choose_slowly(
    paths: np.ndarray,
    inside: np.ndarray,
    overlap_cost: np.ndarray,
    changes: np.ndarray,
    totals: np.ndarray,
    nodes: list,
) -> list[tuple[int, int, float]]:
    """Return the branches to duplicate, the end from which each is shared in part, and its gain."""
    gains = [
        sum(totals[before] - totals[after] for before, after, path in changes if path == p) - cost
        for p, cost in enumerate(overlap_cost)
    ]
    chosen: list[tuple[int, int, float]] = []
    touched: set[int] = set()
    for p in sorted(range(len(paths)), key=lambda p: -gains[p]):
        ends = [end for end in paths[p] if end >= 0]
        own = {nodes[e] for end in ends for e in (end, end ^ 1)} - {-1, -2}
        if gains[p] > 0 and not touched & own:
            touched |= own
            chosen += [(end // 2, -1, gains[p]) for end in ends]
            if inside[p]:
                chosen[-1] = (ends[-1] // 2, ends[-1], gains[p])
    return chosen


@given(st.integers(0, 2**32 - 1))
def test_paths_are_chosen_by_their_gain(seed: int) -> None:
    rng = np.random.default_rng(seed)
    branches, count, sets = rng.integers(1, 9), rng.integers(1, 9), 6
    nodes = rng.integers(-2, rng.integers(1, 9), 2 * branches)
    paths = np.full((count, MAX_RUNS), -1)
    for path in paths:
        steps = rng.integers(1, MAX_RUNS + 1)
        path[:steps] = rng.integers(0, 2 * branches, steps)
    inside = rng.random(count) < 0.3
    # Whole numbers: gains are often equal, and sums exact.
    totals, cost = rng.integers(0, 4, sets).astype(float), rng.integers(-1, 2, count).astype(float)
    changes = np.stack([rng.integers(0, k, 3 * count) for k in (sets, sets, count)], axis=1)
    found = choose_paths(paths, inside, cost, changes, totals, nodes)
    expected = choose_slowly(paths.tolist(), inside, cost, changes, totals, nodes.tolist())
    assert list(zip(*(values.tolist() for values in found), strict=True)) == expected
