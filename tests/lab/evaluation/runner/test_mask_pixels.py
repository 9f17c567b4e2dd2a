"""Distances between curves and masks, against trees of all pixels and all points."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from dloftbs_lab.evaluation.metrics import l1, l2
from dloftbs_lab.evaluation.runner.mask_pixels import MaskPixels, mean_width, nearest_distances

SIZE = (40, 64)


def drawn(seed):
    """Return a mask of some rectangles, a few of them at the border."""
    rng = np.random.default_rng(seed)
    mask = np.zeros(SIZE, np.bool_)
    for _ in range(int(rng.integers(1, 5))):
        row, column = int(rng.integers(-4, SIZE[0])), int(rng.integers(-4, SIZE[1]))
        height, width = rng.integers(1, 20, 2)
        mask[max(row, 0) : max(row + height, 1), max(column, 0) : max(column + width, 1)] = True
    return mask


def pixels_of(mask):
    return np.argwhere(mask)[:, ::-1].astype(np.float64)


@given(st.integers(0, 1000), st.sampled_from((0.5, 1.0, 1.0 / 3.0)))
def test_both_criteria_are_the_slow_ones_to_the_last_bit(seed, grid):
    mask, rng = drawn(seed), np.random.default_rng(seed)
    # Inside and outside of the image; on a grid, many are as far from two pixels.
    points = np.rint(rng.uniform((-30, -30), (SIZE[1] + 30, SIZE[0] + 30), (80, 2)) / grid) * grid
    pixels = MaskPixels(mask)
    assert (pixels.l1(points), pixels.l2(points)) == (l1(pixels_of(mask), points), l2(points, pixels_of(mask)))


@given(st.integers(0, 1000))
def test_points_beside_everything_are_counted(seed):
    mask = drawn(seed)
    points = np.random.default_rng(seed).integers((0, 0), SIZE[::-1], (80, 2)).astype(np.float64)
    distances, _ = cKDTree(pixels_of(mask)).query(points)
    assert MaskPixels(mask).count_beside(points) == int((distances > mean_width(mask)).sum())


def test_a_point_outside_of_the_image_is_as_far_as_the_way_to_it():
    mask = np.zeros(SIZE, np.bool_)
    mask[:, :6] = True
    places = [(-MaskPixels(mask).width_px + away, 5.0) for away in (0.1, -0.1)]
    assert MaskPixels(mask).count_beside(np.array([*places, (2.0, 5.0), (40.0, 60.0)])) == 2


def test_of_an_empty_mask_everything_is_beside():
    assert MaskPixels(np.zeros(SIZE, np.bool_)).count_beside(np.zeros((7, 2))) == 7


@pytest.mark.parametrize("reach", [20.0, 3000.0, 1e9])
def test_points_that_are_far_off_have_a_distance(reach):
    others = np.array([(0.0, 0.0), (reach, 0.3 * reach)])
    points = np.array([(1.0, 1.0), (reach, 0.0), (500.0, 2.0)])
    slow = np.linalg.norm(points[:, None] - others, axis=-1).min(axis=1)
    np.testing.assert_allclose(nearest_distances(points, others), slow, rtol=1e-15)
