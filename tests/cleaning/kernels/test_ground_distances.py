"""Distances to the ground against the distances of all pixels."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from ground_examples import holed, in_runs
from scipy import ndimage
from skeletons import framed_bitmask

from dloftbs.cleaning.kernels.ground_distances import measure_depths, measure_widths, single_width
from dloftbs.cleaning.kernels.ground_runs import find_ground

AROUND = np.ones((3, 3), np.uint8)
SEEDS = pytest.mark.parametrize("seed", range(10))


@SEEDS
def test_depths_are_those_of_the_deepest_pixels(seed: int) -> None:
    mask, deepest = holed(seed), 6.0
    rows, columns = mask.shape
    *runs, pixels, _, _ = find_ground(framed_bitmask(mask[1:-1, 1:-1]), rows, columns)
    narrow = np.random.default_rng(seed).random(len(pixels)) < 0.7
    narrow[0] = False
    parts = in_runs(*runs, columns)
    away = ndimage.distance_transform_edt((parts < 0) | narrow[parts]) - 0.5
    depths = measure_depths(*runs, narrow, deepest)
    for k in range(1, len(pixels)):
        expected = away[parts == k].max() if narrow[k] else 0.0
        if expected > deepest:
            assert depths[k] > deepest
        else:
            assert depths[k] == pytest.approx(expected, abs=1e-5)


@SEEDS
def test_holes_are_as_wide_as_their_largest_circles(seed: int) -> None:
    mask = holed(seed)
    rows, columns = mask.shape
    *runs, pixels, _, _ = find_ground(framed_bitmask(mask[1:-1, 1:-1]), rows, columns)
    chosen = np.random.default_rng(seed).random(len(pixels)) < 0.7
    chosen[0] = False
    parts = in_runs(*runs, columns)
    away = ndimage.distance_transform_edt((parts >= 0) & chosen[parts])
    widths = measure_widths(rows, columns, *runs, chosen)
    expected = [2.0 * away[parts == k].max() - 1.0 if chosen[k] else 0.0 for k in range(len(pixels))]
    np.testing.assert_allclose(widths, expected, rtol=1e-5)


@SEEDS
def test_one_cable_is_as_wide_as_the_narrow_part_of_the_ridge(seed: int) -> None:
    mask = holed(seed)
    rows, columns = mask.shape
    away = ndimage.distance_transform_edt(mask)
    ridge = away[(mask != 0) & (away >= cv2.dilate(away, AROUND))] - 0.5
    found = single_width(framed_bitmask(mask[1:-1, 1:-1]), rows, columns)
    assert found == pytest.approx(2.0 * float(np.quantile(ridge, 0.15)), rel=1e-5)
