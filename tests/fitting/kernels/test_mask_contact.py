"""Contact with the mask, against the distances to all pixels."""

from __future__ import annotations

import numpy as np
from drawings import random_masks
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.fitting.kernels.mask_contact import leaves_mask, lie_on_mask


def slow_distances(points: np.ndarray, mask: np.ndarray, left: int, top: int) -> np.ndarray:
    """Return how far each point is from the nearest pixel's edge, px."""
    pixels = np.argwhere(mask)[:, ::-1] + (left, top)
    if not len(pixels):
        return np.full(len(points), np.inf)
    beside = np.maximum(np.abs(points[:, None] - pixels[None]) - 0.5, 0.0)
    return np.hypot(*np.moveaxis(beside, 2, 0)).min(axis=1)


@given(random_masks, st.integers(0, 2**31), st.floats(0.0, 6.0))
def test_points_are_on_the_mask_as_far_as_the_nearest_pixels_say(mask: np.ndarray, seed: int, reach: float) -> None:
    rng = np.random.default_rng(seed)
    left, top = (int(n) for n in rng.integers(-20, 20, 2))
    h, w = mask.shape
    points = rng.uniform((left - 4.0, top - 4.0), (left + w + 4.0, top + h + 4.0), (40, 2))
    near = slow_distances(points, mask, left, top) <= reach
    np.testing.assert_array_equal(lie_on_mask(points - (left, top), mask, reach), near)


@given(st.integers(0, 2**31))
def test_where_points_leave_the_mask_agrees_with_the_literal_twin(seed: int) -> None:
    rng = np.random.default_rng(seed)
    mask = (rng.random((12, 15)) < rng.random()).astype(np.uint8)
    points = rng.uniform(-3.0, 18.0, (int(rng.integers(1, 9)), 2))
    off = []
    for k, (x, y) in enumerate(points):
        column, row = int(np.floor(x - 2 + 0.5)), int(np.floor(y + 1 + 0.5))
        if not (0 <= row < 12 and 0 <= column < 15 and mask[row, column]):
            off.append(k)
    assert leaves_mask(points, mask, 2, -1) == ((off[0], off[-1]) if off else (len(points), -1))
