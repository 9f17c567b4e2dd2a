"""Contact with the mask, against the distances to all pixels."""

from __future__ import annotations

import numpy as np
from drawings import random_masks
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.fitting.kernels.mask_contact import are_on_mask


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
    for point, expected in zip(points, near, strict=True):
        assert are_on_mask(point[None], mask, left, top, reach) == expected
    assert are_on_mask(points, mask, left, top, reach) == near.all()
    assert are_on_mask(points[near], mask, left, top, reach)
