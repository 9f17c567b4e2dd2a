"""Where the runs of a skeleton meet."""

from __future__ import annotations

import numpy as np
import pytest
from drawings import mask_from_text, random_masks
from hypothesis import given
from hypothesis import strategies as st
from scipy import ndimage

from dloftbs.config import CleaningConfig
from dloftbs.kernels import tracing
from dloftbs.kernels.junctions import FREE, find_junctions, find_kinks, merge_junctions, prune_spurs, split_runs
from dloftbs.patch import Patch, Skeleton
from dloftbs.stages.cleaning import clean
from dloftbs.stages.skeleton import skeletonize

THIN = CleaningConfig(open_px=1, close_px=1, thin_px=0)
EIGHT = np.ones((3, 3))


def skeleton_of(mask: np.ndarray) -> tuple[Patch, Skeleton]:
    patch = clean(mask, THIN)
    assert patch is not None
    return patch, skeletonize(patch)


def found_in(mask: np.ndarray) -> tuple[Patch, Skeleton, np.ndarray, np.ndarray, int, tuple[np.ndarray, ...]]:
    patch, skeleton = skeleton_of(mask)
    points, offsets, n = tracing.trace(skeleton.grid, skeleton.pixels_rc, skeleton.degrees)
    posed = patch.posed(patch.pixels)
    result = find_junctions(skeleton.grid, skeleton.pixels_rc, skeleton.degrees, points, offsets, n, posed)
    return patch, skeleton, points, offsets, n, result


@given(random_masks)
def test_clusters_are_those_of_an_independent_labelling(mask: np.ndarray) -> None:
    if not mask.any():
        return
    _, skeleton, points, offsets, n, (nodes, centres, radii) = found_in(mask)
    branches = np.zeros(skeleton.grid.shape, dtype=bool)
    branches[tuple(skeleton.pixels_rc[skeleton.is_branch_point].T)] = True
    labels, count = ndimage.label(branches, EIGHT)
    assert len(centres) == len(radii) == count
    expected = [np.argwhere(labels == k + 1).mean(axis=0)[::-1] for k in range(count)]
    if count:
        np.testing.assert_allclose(sorted(map(tuple, centres)), sorted(map(tuple, np.array(expected))), atol=1e-9)
    for end in range(2 * n):
        x, y = points[offsets[end // 2] if end % 2 == 0 else offsets[end // 2 + 1] - 1].astype(int)
        around = set(labels[y - 1 : y + 2, x - 1 : x + 2].ravel().tolist()) - {0}
        if nodes[end] == FREE:
            assert not around or offsets[end // 2 + 1] - offsets[end // 2] == 1
        else:
            centre = tuple(np.round(centres[nodes[end]], 9))
            assert centre in {tuple(np.round(expected[k - 1], 9)) for k in around}


@given(random_masks)
def test_the_skeleton_is_as_it_was(mask: np.ndarray) -> None:
    if not mask.any():
        return
    patch, skeleton = skeleton_of(mask)
    before = skeleton.grid.copy()
    points, offsets, n = tracing.trace(skeleton.grid, skeleton.pixels_rc, skeleton.degrees)
    find_junctions(skeleton.grid, skeleton.pixels_rc, skeleton.degrees, points, offsets, n, patch.posed(patch.pixels))
    np.testing.assert_array_equal(skeleton.grid, before)


def test_a_junction_knows_how_far_the_mask_reaches() -> None:
    mask = np.zeros((101, 101), dtype=np.uint8)
    mask[45:56] = mask[:, 45:56] = 1  # a plus of 11 px: the nearest corners are 5.5 px away in x and y
    _, _, _, _, _, (_, centres, radii) = found_in(mask)
    assert len(radii) == 1
    np.testing.assert_allclose(centres[0], 51, atol=1.0)
    assert radii[0] == pytest.approx(5.5 * np.sqrt(2), abs=1.0)


def star(lengths: list[float], width: float = 4.0) -> tuple[np.ndarray, ...]:
    """Return a junction in the middle of straight runs that end freely, and a mask that is all foreground around it."""
    angles = np.linspace(0, 2 * np.pi, len(lengths), endpoint=False)
    runs = [
        100.0 + np.arange(1.0, length + 1)[:, None] * (np.cos(a), np.sin(a))
        for length, a in zip(lengths, angles, strict=True)
    ]
    yy, xx = np.indices((201, 201))
    mask = np.zeros((201, 201), dtype=np.uint8)
    for run in runs:
        for x, y in run:
            mask |= ((xx - x) ** 2 + (yy - y) ** 2 <= (width / 2) ** 2).astype(np.uint8)
    nodes = np.array([0, FREE] * len(lengths))
    offsets = np.cumsum([0, *map(len, runs)])
    return nodes, np.array([[100.0, 100.0]]), np.array([width / 2]), np.concatenate(runs), offsets, mask


def test_only_what_sticks_out_by_little_is_a_spur() -> None:
    nodes, *rest = star([30, 30, 3, 12])
    assert prune_spurs(nodes, *rest, 6.0).tolist() == [True, True, False, True]
    assert nodes.tolist() == [0, FREE] * 4


def test_the_shortest_spur_goes_first_and_one_run_stays() -> None:
    nodes, *rest = star([4, 3, 5])
    assert prune_spurs(nodes, *rest, 20.0).tolist() == [False, False, True]
    assert nodes[4:].tolist() == [FREE, FREE]


def test_without_runs_nothing_is_pruned() -> None:
    nothing = np.empty(0, dtype=np.int64)
    empty = np.empty((0, 2))
    mask = np.zeros((3, 3), dtype=np.uint8)
    assert len(prune_spurs(nothing, empty, np.empty(0), empty, np.zeros(1, dtype=np.int64), mask, 5.0)) == 0


@given(st.integers(0, 10**6))
def test_merged_junctions_are_the_connected_ones(seed: int) -> None:
    rng = np.random.default_rng(seed)
    count, runs = int(rng.integers(1, 9)), int(rng.integers(0, 12))
    nodes = rng.integers(-1, count, 2 * runs)
    clear, alive = rng.integers(0, 10, runs), rng.random(runs) < 0.8
    group = merge_junctions(nodes, clear, alive, count, 5.0)
    expected = list(range(count))
    for _ in range(count):
        for run in range(runs):
            a, b = nodes[2 * run : 2 * run + 2]
            if alive[run] and a >= 0 and b >= 0 and clear[run] < 5.0:
                expected[a] = expected[b] = min(expected[a], expected[b])
    assert group.tolist() == expected


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


def test_a_run_of_one_pixel_has_its_two_junctions() -> None:
    mask = mask_from_text(
        """
        #.....#
        .#...#.
        ..###..
        .#...#.
        #.....#
        """
    )
    _, _, _, offsets, n, (nodes, centres, _) = found_in(mask)
    bridge = [run for run in range(n) if min(nodes[2 * run : 2 * run + 2]) >= 0]
    assert len(centres) == 2
    assert len(bridge) == 1
    assert offsets[bridge[0] + 1] - offsets[bridge[0]] == 1
    assert set(nodes[2 * bridge[0] : 2 * bridge[0] + 2].tolist()) == {0, 1}
