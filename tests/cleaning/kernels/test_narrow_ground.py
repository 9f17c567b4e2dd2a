"""Closing by octagons against OpenCV; which pieces are looked at is tested with what is filled."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from ground_examples import holed
from linking_examples import draw

from dloftbs.cleaning import clean
from dloftbs.cleaning.kernels.narrow_ground import close_round, find_narrow_ground
from dloftbs.config import CleaningConfig


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("radius", [0, 1, 2, 5, 9])
def test_closing_is_that_of_crosses_and_squares(seed: int, radius: int) -> None:
    mask = np.pad(holed(seed), 128)
    mask = mask[:, : mask.shape[1] // 64 * 64]
    expected = mask.copy()
    for grow in (cv2.dilate, cv2.erode):
        for step in range(radius):
            shape = cv2.MORPH_RECT if step % 2 else cv2.MORPH_CROSS
            expected = grow(expected, cv2.getStructuringElement(shape, (3, 3)))
    words = np.ascontiguousarray(np.packbits(mask, axis=1, bitorder="little").view(np.uint64).T)
    closed = np.ascontiguousarray(close_round(words, radius).T).view(np.uint8)
    np.testing.assert_array_equal(np.unpackbits(closed, axis=1, bitorder="little"), expected)


@pytest.mark.parametrize("angle", range(8, 60))
def test_the_tips_of_wedges_at_a_crossing_are_no_holes(angle: int) -> None:
    way = 150.0 * np.array([np.cos(np.deg2rad(angle)), np.sin(np.deg2rad(angle))])
    for width in (8, 12, 16):
        mask = draw([(20, 200), (380, 215)], [200 - way, 200 + way], width=width, size=(400, 400))
        crop = clean(mask, CleaningConfig(fill_holes=False))
        assert crop is not None
        assert not (find_narrow_ground(crop.bitmask, *crop.size, 0, 0)[:, 2] == 0).any()
