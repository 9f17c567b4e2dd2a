"""Junctions of a skeleton, and the branches that meet there."""

from __future__ import annotations

import numpy as np
import pytest
from bounded import run_bounded
from drawings import mask_from_text, random_masks
from hypothesis import given
from hypothesis import strategies as st
from scipy import ndimage

from dloftbs.cleaning import clean
from dloftbs.config import CleaningConfig
from dloftbs.data.mask_crop import MaskCrop, Skeleton
from dloftbs.kernels import tracing
from dloftbs.skeleton import skeletonize
from dloftbs.skeleton.kernels.junctions import (
    FREE,
    UNAVAILABLE,
    assign_junctions,
    find_bordering,
    find_junctions,
    prune_spurs,
)

THIN = CleaningConfig(open_px=1, close_px=1, thin_px=0, fill_holes=False)
EIGHT = np.ones((3, 3))


def skeleton_of(mask: np.ndarray) -> tuple[MaskCrop, Skeleton]:
    crop = clean(mask, THIN)
    assert crop is not None
    return crop, skeletonize(crop)


def found_in(mask: np.ndarray) -> tuple[MaskCrop, Skeleton, np.ndarray, np.ndarray, int, tuple[np.ndarray, ...]]:
    crop, skeleton = skeleton_of(mask)
    points, offsets, n = tracing.trace(skeleton.grid, skeleton.pixels_rc, skeleton.degrees)
    oriented = crop.oriented(crop.pixels)
    result = find_junctions(skeleton.grid, skeleton.pixels_rc, skeleton.degrees, points, offsets, n, oriented)
    return crop, skeleton, points, offsets, n, result


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
    crop, skeleton = skeleton_of(mask)
    before = skeleton.grid.copy()
    points, offsets, n = tracing.trace(skeleton.grid, skeleton.pixels_rc, skeleton.degrees)
    find_junctions(skeleton.grid, skeleton.pixels_rc, skeleton.degrees, points, offsets, n, crop.oriented(crop.pixels))
    np.testing.assert_array_equal(skeleton.grid, before)


def test_a_junction_knows_how_far_the_mask_reaches() -> None:
    mask = np.zeros((101, 101), dtype=np.uint8)
    mask[45:56] = mask[:, 45:56] = 1  # a plus of 11 px: the nearest corners are 5.5 px away in x and y
    _, _, _, _, _, (_, centres, radii) = found_in(mask)
    assert len(radii) == 1
    np.testing.assert_allclose(centres[0], 51, atol=1.0)
    assert radii[0] == pytest.approx(5.5 * np.sqrt(2), abs=1.0)


def star(lengths: list[float], radii: list[float] | None = None) -> tuple[np.ndarray, ...]:
    """Return a junction in the middle of straight branches with free ends, and their mask; 4 px wide by themselves."""
    radii = [2.0] * len(lengths) if radii is None else radii
    angles = np.linspace(0, 2 * np.pi, len(lengths), endpoint=False)
    branches = [
        100.0 + np.arange(1.0, length + 1)[:, None] * (np.cos(a), np.sin(a))
        for length, a in zip(lengths, angles, strict=True)
    ]
    yy, xx = np.indices((201, 201))
    mask = np.zeros((201, 201), dtype=np.uint8)
    for branch, own in zip(branches, radii, strict=True):
        for x, y in branch:
            mask |= ((xx - x) ** 2 + (yy - y) ** 2 <= own**2).astype(np.uint8)
    nodes = np.array([0, FREE] * len(lengths))
    offsets = np.cumsum([0, *map(len, branches)])
    points = np.concatenate(branches)
    radius = np.repeat(np.array(radii, float), np.diff(offsets))
    return nodes, np.array([[100.0, 100.0]]), np.array([2.0]), points, radius, offsets, mask


def test_only_what_sticks_out_by_little_is_a_spur() -> None:
    nodes, *rest = star([30, 30, 3, 12])
    assert prune_spurs(nodes, *rest, 6.0).tolist() == [True, True, False, True]
    assert nodes.tolist() == [0, FREE] * 4


def test_the_shortest_spur_goes_first_and_one_run_stays() -> None:
    nodes, *rest = star([4, 3, 5])
    assert prune_spurs(nodes, *rest, 20.0).tolist() == [False, False, True]
    assert nodes[4:].tolist() == [FREE, FREE]


@pytest.mark.parametrize(
    ("third", "radii_of", "expected"),
    [
        (24, [10.0, 2.0, 2.0, 2.0], [True, False, False, False]),  # strands of a frayed end
        (24, [10.0, 5.0, 5.0, 5.0], [True] * 4),  # as wide as cables that part
        (90, [10.0, 2.0, 10.0, 2.0], [True] * 4),  # a thin cable over a wide one
        (24, [3.0, 3.0, 3.0, 3.0], [True] * 4),  # a disc over a crossing: only the junction is wide
    ],
)
def test_a_strand_may_stick_out_by_the_width_of_the_cable(
    third: int, radii_of: list[float], expected: list[bool]
) -> None:
    nodes, centres, _, points, radius, offsets, mask = star([90, 24, third, 24], radii_of)
    found = prune_spurs(nodes, centres, np.array([10.0]), points, radius, offsets, mask, 6.0)
    assert found.tolist() == expected


def fray(apart: float, radii_of: list[float]) -> tuple[np.ndarray, ...]:
    """Return a branch that leads to two junctions, joined by one of a length in px, and a pair of branches at each."""
    first, second = np.array([150.0, 100.0]), np.array([150.0, 100.0 + apart])
    ways = [(-1.0, 0.0, 140), (0.8, -0.6, 40), (1.0, 0.0, 40), (1.0, 0.1, 40), (0.7, 0.7, 40)]
    starts = [first, first, first, second, second]
    branches = [
        start + np.arange(1.0, length + 1)[:, None] * (x, y) for start, (x, y, length) in zip(starts, ways, strict=True)
    ]
    branches.append(first + np.arange(1.0, apart)[:, None] * (0.0, 1.0))
    yy, xx = np.indices((301, 301))
    mask = np.zeros((301, 301), dtype=np.uint8)
    for branch, own in zip(branches, radii_of, strict=True):
        for x, y in branch:
            mask |= ((xx - x) ** 2 + (yy - y) ** 2 <= own**2).astype(np.uint8)
    nodes = np.array([0, FREE, 0, FREE, 0, FREE, 1, FREE, 1, FREE, 0, 1])
    offsets = np.cumsum([0, *map(len, branches)])
    radius = np.repeat(np.array(radii_of), np.diff(offsets))
    return nodes, np.array([first, second]), np.full(2, radii_of[0]), np.concatenate(branches), radius, offsets, mask


@pytest.mark.parametrize(
    ("apart", "radii_of", "expected"),
    [
        (12.0, [15.0, 3.0, 3.0, 3.0, 3.0, 3.0], [True, False, False, False, False, False]),  # of one frayed end
        (60.0, [15.0, 3.0, 3.0, 3.0, 3.0, 3.0], [True, False, False, True, True, True]),  # the second is of thin ones
        (12.0, [15.0, 3.0, 3.0, 3.0, 15.0, 3.0], [True] * 5),  # two cables, and thinner ones
        (12.0, [5.0, 3.0, 3.0, 3.0, 3.0, 3.0], [True] * 5),  # as wide as cables that part
    ],
)
def test_strands_may_part_at_junctions_near_each_other(
    apart: float, radii_of: list[float], expected: list[bool]
) -> None:
    found = prune_spurs(*fray(apart, radii_of), 10.0)
    assert found.tolist()[: len(expected)] == expected


def test_the_width_of_a_cable_is_the_masks_where_that_of_recentring_is_limited() -> None:
    nodes, centres, radii, points, radius, offsets, mask = fray(12.0, [15.0, 3.0, 3.0, 3.0, 3.0, 3.0])
    radius[: offsets[1]] = 6.0  # that of a cable which is thinner elsewhere
    assert prune_spurs(nodes, centres, radii, points, radius, offsets, mask, 10.0).tolist() == [True] + [False] * 5


def test_without_runs_nothing_is_pruned() -> None:
    nothing = np.empty(0, dtype=np.int64)
    empty = np.empty((0, 2))
    mask = np.zeros((3, 3), dtype=np.uint8)
    assert (
        len(prune_spurs(nothing, empty, np.empty(0), empty, np.empty(0), np.zeros(1, dtype=np.int64), mask, 5.0)) == 0
    )


@given(st.integers(0, 10**6))
def test_ends_are_settled_as_by_hand(seed: int) -> None:
    rng = np.random.default_rng(seed)
    count, branches = int(rng.integers(0, 9)), int(rng.integers(0, 12))
    nodes = rng.integers(-1, count, 2 * branches)
    alive = rng.random(branches) < 0.7
    spurs = ~alive & (rng.random(branches) < 0.5)
    spans = np.cumsum(rng.integers(0, 10, (branches, 2)), axis=1)
    clear = spans[:, 1] - spans[:, 0]
    group = list(range(count))
    for _ in range(count):
        for branch in range(branches):
            a, b = nodes[2 * branch : 2 * branch + 2]
            if alive[branch] and min(a, b) >= 0 and clear[branch] < 5.0:
                group[a] = group[b] = min(group[a], group[b])
    expected = [group[node] if node >= 0 else FREE for node in nodes]
    for branch in range(branches):
        ends = (2 * branch, 2 * branch + 1)
        if alive[branch]:
            is_inner = clear[branch] < 5.0 and min(nodes[end] for end in ends) >= 0
        for end in ends:
            if (
                (alive[branch] and is_inner)
                or not (alive[branch] or spurs[branch])
                or (spurs[branch] and nodes[end] == FREE)
            ):
                expected[end] = UNAVAILABLE
    assert assign_junctions(nodes, spans, alive, spurs, count, 5.0).tolist() == expected


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
    bridge = [branch for branch in range(n) if min(nodes[2 * branch : 2 * branch + 2]) >= 0]
    assert len(centres) == 2
    assert len(bridge) == 1
    assert offsets[bridge[0] + 1] - offsets[bridge[0]] == 1
    assert set(nodes[2 * bridge[0] : 2 * bridge[0] + 2].tolist()) == {0, 1}


PRUNE = """
import sys
import numpy as np
from dloftbs.skeleton.kernels.junctions import prune_spurs

points = np.array([[2.0, 2.0], [3.0, 2.0]])
nodes, offsets = np.array([0, -1]), np.array([0, 2])
mask = np.zeros((8, 8), dtype=np.uint8)
mask[2:4, 2:5] = 1
print(len(prune_spurs(nodes, points[:1], np.ones(1), points, np.ones(2), offsets, mask, float(sys.argv[1]))))
"""


@pytest.mark.parametrize("least", ["nan", "inf"])
def test_pruning_ends_whatever_the_limit(least: str) -> None:
    assert run_bounded(PRUNE, least) == "1\n"


@given(st.integers(0, 2**32 - 1))
def test_free_ends_near_a_border_are_told_wherever_they_lie(seed: int) -> None:
    rng = np.random.default_rng(seed)
    points, offsets = rng.uniform(0.0, 40.0, (12, 2)), np.array([0, 3, 7, 12])
    matrix, offset = np.array([[0.0, -1.0], [1.0, 0.0]]), np.array([45.0, 3.0])
    nodes = rng.integers(FREE, 2, 6)
    tips = (points @ matrix.T + offset)[[0, 2, 3, 6, 7, 11]]
    inside = np.minimum(tips, (49.0, 44.0) - tips).min(axis=1)
    found = find_bordering(nodes, points, offsets, matrix, offset, 45, 50, 6.0)
    np.testing.assert_array_equal(found, (nodes == FREE) & (inside <= 6.0))
