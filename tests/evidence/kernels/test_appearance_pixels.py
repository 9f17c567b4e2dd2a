"""Colours of cables against a slow twin."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.evidence.kernels.appearance_pixels import sample_appearance

SIZE = (90, 160)


def block(image: np.ndarray, x: float, y: float, half: int) -> np.ndarray | None:
    row, column = int(np.floor(y + 0.5)), int(np.floor(x + 0.5))
    if row < half or column < half or row + half >= image.shape[0] or column + half >= image.shape[1]:
        return None
    square = image[row - half : row + half + 1, column - half : column + half + 1]
    return square.reshape(-1, 3).astype(np.float64).mean(axis=0)


@given(st.integers(0, 10_000))
def test_samples_are_means_of_squares_on_the_cable_where_it_is_seen(seed: int) -> None:
    rng = np.random.default_rng(seed)
    image = rng.integers(0, 256, (*SIZE, 3), dtype=np.uint8)
    points = 20.0 + np.cumsum(rng.normal(1.0, 2.0, (64, 2)), axis=0)
    seen, width = rng.random(64) < 0.8, float(rng.choice([rng.uniform(3.0, 14.0), np.nan]))
    cable, median = sample_appearance(image, points, seen, width)
    half = 0 if np.isnan(width) else int(0.2 * width)
    squares = [block(image, *points[k], half) for k in range(1, 64, 3) if seen[k]]
    cables = [one for one in squares if one is not None]
    np.testing.assert_allclose(cable, np.array(cables).reshape(-1, 3))
    np.testing.assert_allclose(median, np.median(cables, axis=0) if cables else np.full(3, np.nan))
