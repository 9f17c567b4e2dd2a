"""Sharp turns of branches, and the cuts there."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.data.graph import FREE
from dloftbs.skeleton.kernels.kinks import find_kinks, split_branches


def bent(turn_deg: float, length: int = 40) -> np.ndarray:
    """Return points a pixel apart that go straight, turn at once, and go straight again."""
    a = np.radians(turn_deg)
    start = np.column_stack((np.arange(-length, 0.0), np.zeros(length)))
    return np.concatenate((start, np.arange(0.0, length)[:, None] * (np.cos(a), np.sin(a))))


@pytest.mark.parametrize(("turn_deg", "count"), [(0, 0), (40, 0), (60, 0), (75, 1), (-90, 1), (120, 1)])
def test_only_a_sharp_turn_is_a_kink(turn_deg: float, count: int) -> None:
    points = bent(turn_deg)
    kinks = find_kinks(points, np.array([0, len(points)]), np.array([FREE, FREE]), np.ones(1, np.bool_), 5.0, 1.2, 0.6)
    assert len(kinks) == count
    if count:
        assert abs(int(kinks[0]) - 40) <= 1


def test_kinks_are_found_in_their_own_run_and_not_in_loops() -> None:
    points = np.concatenate((bent(0), bent(90), bent(90)))
    kinks = find_kinks(points, np.array([0, 80, 160, 240]), np.full(4, FREE), np.ones(2, np.bool_), 5.0, 1.2, 0.6)
    assert len(kinks) == 1
    assert abs(int(kinks[0]) - 120) <= 1


@pytest.mark.parametrize(
    ("turn_deg", "far", "aside", "alive", "count"),
    [(50, 8, 0, True, 1), (25, 8, 0, True, 0), (50, 45, 0, True, 0), (50, 8, 10, True, 0), (50, 8, 0, False, 0)],
)
def test_a_milder_turn_is_a_kink_where_another_cable_ends_and_points_at_it(
    turn_deg: float, far: float, aside: float, alive: bool, count: int
) -> None:
    """An occluder over three quarters of a crossing leaves two arms that meet, and the end of a third one."""
    facing = np.column_stack((np.full(30, aside), -far - np.arange(30.0)))
    points = np.concatenate((bent(turn_deg), facing))
    ends = np.array([0, 80, 110])
    kinks = find_kinks(points, ends, np.full(4, FREE), np.array([True, alive]), 5.0, 1.2, 0.6)
    assert len(kinks) == count


@given(st.integers(0, 10**6))
def test_cut_runs_are_those_cut_one_by_one(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n_open, loops = int(rng.integers(1, 6)), int(rng.integers(0, 3))
    lengths = rng.integers(3, 20, n_open + loops)
    offsets = np.cumsum([0, *lengths])
    nodes = rng.integers(-1, 4, 2 * n_open)
    alive = rng.random(n_open) < 0.7
    inside = [i for i in range(offsets[n_open]) if i not in offsets and rng.random() < 0.2]
    cuts = np.array(inside, dtype=np.int64)
    new_offsets, new_nodes, new_alive = split_branches(cuts, offsets, nodes, alive, 4)
    branches = []
    for branch in range(n_open):
        at, left = int(offsets[branch]), int(nodes[2 * branch])
        for k, cut in enumerate(inside):
            if alive[branch] and offsets[branch] < cut < offsets[branch + 1]:
                branches.append((at, left, 4 + k, True))
                at, left = cut, 4 + k
        branches.append((at, left, int(nodes[2 * branch + 1]), bool(alive[branch])))
    assert new_offsets.tolist() == [branch[0] for branch in branches] + offsets[n_open:].tolist()
    assert new_nodes.tolist() == [node for branch in branches for node in branch[1:3]]
    assert new_alive.tolist() == [branch[3] for branch in branches]


@given(st.integers(0, 10**6))
def test_kinks_are_the_same_from_either_end(seed: int) -> None:
    rng = np.random.default_rng(seed)
    way = np.repeat(rng.uniform(-2.0, 2.0, 20).cumsum(), 5)
    points = np.column_stack((np.cos(way), np.sin(way))).cumsum(axis=0)
    args = np.array([0, len(points)]), np.array([FREE, FREE]), np.ones(1, np.bool_), 4.0, 1.2, 0.6
    forth, back = find_kinks(points, *args), find_kinks(np.ascontiguousarray(points[::-1]), *args)
    assert forth.tolist() == sorted(len(points) - 1 - back)
