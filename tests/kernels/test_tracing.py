"""Walks along the skeleton, widths and lines over the mask."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from drawings import draw_cable, mask_from_text, random_mask, wave
from scipy import ndimage
from skeletons import fast_skeleton, listed, padded, slow_degrees

from dloftbs.kernels.tracing import are_covered, measure_radius, trace


@pytest.mark.parametrize("first", range(0, 2000, 500))
def test_walks_cover_every_pixel_once_in_unbroken_steps(first: int) -> None:
    for seed in range(first, first + 500):
        check_walks(fast_skeleton(random_mask(seed)))


def check_walks(skeleton: np.ndarray) -> None:
    grid = np.where(slow_degrees(skeleton) > 2, 0, skeleton)
    degrees = slow_degrees(grid)
    pieces, n_pieces = ndimage.label(grid, np.ones((3, 3), int))
    before = skeleton.copy()
    points, offsets, n_open = trace(skeleton, *listed(skeleton))
    np.testing.assert_array_equal(skeleton, before)
    assert len(offsets) - 1 == n_pieces
    assert sorted(map(tuple, points[:, ::-1].tolist())) == sorted(map(tuple, np.argwhere(grid).tolist()))
    for run in range(len(offsets) - 1):
        walk = points[offsets[run] : offsets[run + 1]]
        columns, rows = walk.astype(int).T
        assert len(set(pieces[rows, columns].tolist())) == 1
        assert (np.abs(np.diff(walk, axis=0)).max(axis=1) == 1).all()
        if run < n_open:
            assert degrees[rows[0], columns[0]] <= 1
            assert degrees[rows[-1], columns[-1]] <= 1
        else:
            assert (degrees[rows, columns] == 2).all()
            assert np.abs(walk[0] - walk[-1]).max() == 1


def test_a_walk_starts_at_the_first_endpoint_listed() -> None:
    grid = padded(mask_from_text("####..\n....##"))
    points, offsets, n_open = trace(grid, *listed(grid))
    assert (offsets.tolist(), n_open) == ([0, 6], 1)
    assert points[:, 0].tolist() == [1, 2, 3, 4, 5, 6]
    assert grid.sum() == 6


def test_a_loop_is_walked_around_once() -> None:
    grid = padded(mask_from_text(".##.\n#..#\n#..#\n.##."))
    points, offsets, n_open = trace(grid, *listed(grid))
    assert (offsets.tolist(), n_open) == ([0, 8], 0)
    assert points[0].tolist() == [2, 1]
    assert (np.abs(np.diff(points, axis=0, append=points[:1])).max(axis=1) == 1).all()


def test_nothing_to_walk() -> None:
    points, offsets, n_open = trace(
        np.zeros((3, 8), dtype=np.uint8), np.empty((0, 2), dtype=np.int32), np.empty(0, dtype=np.uint8)
    )
    assert (points.shape, offsets.tolist(), n_open) == ((0, 2), [0], 0)


@pytest.mark.parametrize("width", [3, 7, 12, 25, 40])
def test_radius_is_half_the_width(width: int) -> None:
    frame = padded(draw_cable(wave((300, 500), 1.0), width, (300, 500)))
    skeleton = fast_skeleton(frame[1:301, 1:501])
    points, offsets, _ = trace(skeleton, *listed(skeleton))
    radius = measure_radius(frame, points, offsets)
    exact = cv2.distanceTransform(frame, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)[
        points[:, 1].astype(int), points[:, 0].astype(int)
    ]
    inner = slice(width, -width)
    assert abs(2 * np.median(radius) - 2 * np.median(exact)) <= 1.5
    # The distance transform measures to the nearest pixel outside, the radius to the edge on both sides.
    assert np.abs(radius[inner] - exact[inner]).mean() < 1.0


def test_radius_of_a_single_pixel_and_of_no_run() -> None:
    frame = padded(np.ones((1, 1), dtype=np.uint8))
    assert measure_radius(frame, np.array([[1.0, 1.0]]), np.array([0, 1])).tolist() == [0.5]
    assert measure_radius(frame, np.empty((0, 2)), np.array([0])).shape == (0,)


def slow_is_covered(mask: np.ndarray, start: np.ndarray, end: np.ndarray) -> bool:
    steps = int(2 * np.linalg.norm(end - start)) + 1
    columns, rows = np.floor(start[:, None] + np.outer(end - start, np.arange(steps + 1) / steps) + 0.5).astype(int)
    return bool(mask[rows, columns].all())


def test_lines_over_the_mask_agree_with_their_slow_twin() -> None:
    rng = np.random.default_rng(0)
    seen = []
    for seed in range(300):
        frame = padded(random_mask(seed, largest=30))
        last = np.array(frame.shape[::-1]) - 1
        starts, ends = (rng.integers(0, last + 1, (6, 2)).astype(float) for _ in range(2))
        expected = [slow_is_covered(frame, a, b) for a, b in zip(starts, ends, strict=True)]
        assert are_covered(frame, starts, ends).tolist() == expected
        seen += expected
    assert 0.02 < np.mean(seen) < 0.98  # the comparison saw both answers
