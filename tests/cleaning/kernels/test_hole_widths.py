"""Width of holes against the outlines that OpenCV finds."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from ground_examples import holed, in_runs
from scipy import ndimage
from skeletons import framed_bitmask

from dloftbs.cleaning.kernels.ground_runs import find_ground
from dloftbs.cleaning.kernels.hole_widths import find_narrow


def one_piece(seed: int) -> np.ndarray:
    """Return the largest blob of a mask, so that nothing lies within its holes; it touches no border."""
    pieces, _ = ndimage.label(holed(seed), np.ones((3, 3)))
    largest = pieces == np.argmax(np.bincount(pieces.ravel())[1:]) + 1
    mask = largest.astype(np.uint8)
    return mask[largest.any(axis=1)][:, largest.any(axis=0)]


@pytest.mark.parametrize("seed", range(20))
def test_narrow_holes_have_a_small_area_over_their_outline(seed: int) -> None:
    mask = np.pad(one_piece(seed), 1)
    rows, columns = mask.shape
    framed = framed_bitmask(mask[1:-1, 1:-1])
    *runs, pixels, sides, _ = find_ground(framed, rows, columns)
    narrow, width = find_narrow(framed, rows, *runs, pixels, sides)
    parts = in_runs(*runs, columns)
    outlines, hierarchy = cv2.findContours(mask, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    area, length = int(mask.sum()), sum(map(len, outlines))
    expected, filled, left = np.zeros(len(pixels), bool), area, length
    for outline in (outlines[k] for k in np.flatnonzero(hierarchy[0, :, 3] >= 0)):
        around = np.zeros(mask.shape, np.uint8)
        cv2.drawContours(around, [outline], -1, 1, cv2.FILLED)
        (k,) = np.unique(parts[(around != 0) & (mask == 0)])
        if pixels[k] * length < 2.0 * area * len(outline):
            expected[k], filled, left = True, filled + int(pixels[k]), left - len(outline)
    np.testing.assert_array_equal(narrow, expected)
    assert width == pytest.approx(2.0 * filled / left if expected.any() else 0.0)
