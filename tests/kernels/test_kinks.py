"""Where runs turn sharply, and how they are cut."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.kernels.junctions import FREE
from dloftbs.kernels.kinks import find_kinks, split_runs


def bent(turn_deg: float, length: int = 40) -> np.ndarray:
    """Return points a pixel apart that go straight, turn at once, and go straight again."""
    a = np.radians(turn_deg)
    start = np.column_stack((np.arange(-length, 0.0), np.zeros(length)))
    return np.concatenate((start, np.arange(0.0, length)[:, None] * (np.cos(a), np.sin(a))))


@pytest.mark.parametrize(("turn_deg", "count"), [(0, 0), (40, 0), (60, 0), (75, 1), (-90, 1), (120, 1)])
def test_only_a_sharp_turn_is_a_kink(turn_deg: float, count: int) -> None:
    points = bent(turn_deg)
    kinks = find_kinks(points, np.array([0, len(points)]), np.array([FREE, FREE]), 1, 5.0, 1.2)
    assert len(kinks) == count
    if count:
        assert abs(int(kinks[0]) - 40) <= 1


def test_kinks_are_found_in_their_own_run_and_not_in_loops() -> None:
    points = np.concatenate((bent(0), bent(90), bent(90)))
    kinks = find_kinks(points, np.array([0, 80, 160, 240]), np.full(4, FREE), 2, 5.0, 1.2)
    assert len(kinks) == 1
    assert abs(int(kinks[0]) - 120) <= 1


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
    new_offsets, new_nodes, new_alive = split_runs(cuts, offsets, nodes, alive, 4)
    runs = []
    for run in range(n_open):
        at, left = int(offsets[run]), int(nodes[2 * run])
        for k, cut in enumerate(inside):
            if alive[run] and offsets[run] < cut < offsets[run + 1]:
                runs.append((at, left, 4 + k, True))
                at, left = cut, 4 + k
        runs.append((at, left, int(nodes[2 * run + 1]), bool(alive[run])))
    assert new_offsets.tolist() == [run[0] for run in runs] + offsets[n_open:].tolist()
    assert new_nodes.tolist() == [node for run in runs for node in run[1:3]]
    assert new_alive.tolist() == [run[3] for run in runs]
