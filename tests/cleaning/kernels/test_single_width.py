"""Distances to the ground against scipy's, and the width of one cable in a bundle of several."""

from __future__ import annotations

import numpy as np
import pytest
from linking_examples import draw
from numba import njit
from scipy import ndimage

from dloftbs.cleaning import clean
from dloftbs.cleaning.kernels import single_width
from dloftbs.cleaning.kernels.narrow_ground import find_narrow_ground
from dloftbs.config import CleaningConfig

squared_distances, single_widths = njit(single_width.squared_distances), njit(single_width.single_widths)


@pytest.mark.parametrize("seed", range(20))
def test_distances_are_those_of_scipy(seed: int) -> None:
    rng = np.random.default_rng(seed)
    solid = np.zeros(rng.integers(3, 60, 2), np.bool_)
    solid[:, 1:-1] = rng.random((solid.shape[0], solid.shape[1] - 2)) < rng.uniform(0.3, 1.0)
    around = np.pad(solid, 1)  # beyond the first and the last row there is ground
    expected = np.round(ndimage.distance_transform_edt(around)[1:-1, 1:-1] ** 2)
    np.testing.assert_array_equal(squared_distances(solid), expected)


@pytest.mark.parametrize("width", [3, 8, 13, 40])
def test_the_width_of_one_cable_is_that_of_its_single_part(width: int) -> None:
    one = draw([(60, 100), (540, 100)], width=width, size=(400, 600))
    bundle = draw([(60, 100), (540, 100)], [(60, 100 + width), (300, 100 + width)], width=width, size=(400, 600))
    for mask in (one, bundle):
        squares = squared_distances(mask != 0)
        found = single_widths(squares, np.zeros(squares.shape, np.int32), 1)
        assert found[0] == pytest.approx(width, abs=2.0)


@pytest.mark.parametrize("gap", [4, 8])
def test_the_ground_between_two_cables_that_others_cross_is_not_looked_at(gap: int) -> None:
    lines = [[(60, 300 + side), (740, 300 + side)] for side in (0, 12 + gap)]
    lines += [[(x, 150), (x + 300, 500)] for x in (200, 300)]
    crop = clean(draw(*lines, width=12, size=(600, 800)), CleaningConfig(fill_holes=False))
    assert crop is not None
    assert len(find_narrow_ground(crop.bitmask, *crop.size, 0, 0)) == 0
