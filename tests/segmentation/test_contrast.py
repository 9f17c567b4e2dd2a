"""Contrast of pixels to a mask."""

import numpy as np
import pytest

from dloftbs.segmentation.contrast import LEVEL, greatest_within, limits_of, mask_of, noise_of, pixels_of


def counts(seed=0, size=(300, 400)):
    return np.random.default_rng(seed).normal(0.0, 100.0, size).astype(np.int16)


@pytest.mark.parametrize("size", [(300, 400), (1, 4000), (4000, 3)])
def test_noise_is_that_of_most_pixels(size):
    noisy = counts(size=size)
    with_cable = noisy.copy()
    with_cable.ravel()[: noisy.size // 4] = 4000
    for values in (noisy, with_cable):
        median, noise = noise_of(values)
        assert abs(median) < 60.0
        assert 55.0 < noise < 110.0  # 67 is the median absolute deviation of 100
    assert noise_of(noisy, noisy) == (0.0, 0.0)


def test_limits_follow_the_noise_but_are_never_below_what_rounding_leaves():
    assert limits_of(0.0, 0.0, None) == (3.0 * LEVEL, 6.0 * LEVEL)
    least, strong = limits_of(10.0, 100.0, None)
    assert (least, strong) == (610.0, 1220.0)
    assert limits_of(10.0, 100.0, 5.0) == (5.0 * LEVEL, 5.0 * LEVEL)


def test_a_pixel_has_half_of_the_greatest_contrast_beside_it():
    contrast = np.zeros((5, 9), np.int16)
    contrast[2] = [0, 20, 49, 50, 100, 50, 49, 20, 30]
    pixels = pixels_of(contrast, greatest_within(contrast, 2), 15.0)
    assert np.unravel_index(pixels, contrast.shape)[1].tolist() == [3, 4, 5, 8]


def test_a_part_without_a_strong_pixel_is_none():
    contrast = np.zeros((5, 12), np.int16)
    contrast[1, 1:5] = contrast[3, 7:11] = 50
    contrast[1, 2] = 80
    mask = mask_of(np.flatnonzero(contrast), contrast, 80.0)
    assert mask.dtype == np.uint8
    assert np.array_equal(mask, contrast * (np.arange(5) == 1)[:, None] > 0)
    assert mask_of(np.flatnonzero(contrast), contrast, 81.0).sum() == 0
    assert mask_of(np.zeros(0, np.intp), contrast, 1.0).sum() == 0
