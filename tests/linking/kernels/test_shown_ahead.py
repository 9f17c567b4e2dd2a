"""How far a cable shows beyond an end at a junction."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial import cKDTree

from dloftbs.linking.kernels.shown_ahead import shown_ahead


def slowly(mask: np.ndarray, ray: np.ndarray, others: np.ndarray, width: float) -> float:
    """The same by a tree of points and arrays."""

    def is_on(points: np.ndarray) -> np.ndarray:
        columns, rows = np.rint(points).astype(np.int64).T
        inside = (rows >= 0) & (rows < mask.shape[0]) & (columns >= 0) & (columns < mask.shape[1])
        return (mask[rows * inside, columns * inside] != 0) & inside

    position, direction = ray[:2], ray[2:]
    along = np.arange(0.0, 3.5 * width)
    axis = position + along[:, None] * direction
    on_mask = is_on(axis)
    count = len(along) if on_mask.all() else int(np.argmin(on_mask))
    farthest = 0.0
    for aside in (-0.35, 0.0, 0.35):
        asked = axis[:count] + aside * width * np.array((-direction[1], direction[0]))
        away = cKDTree(others).query(asked)[0] if len(others) else np.full(count, np.inf)
        (shown,) = np.nonzero(is_on(asked) & (away > 0.6 * width + 0.5))
        if len(shown):
            cap = math.sqrt(0.25 - aside * aside) * width if width > 4.5 else 0.0
            farthest = max(farthest, float(along[shown[-1]]) - cap)
    return farthest


@pytest.mark.parametrize("seed", range(60))
def test_it_is_the_last_mask_beside_the_axis_that_no_other_cable_explains(seed: int) -> None:
    rng = np.random.default_rng(seed)
    mask = (rng.random((60, 70)) < rng.choice([0.7, 0.97, 1.0])).astype(np.uint8)
    width, angle = rng.uniform(2.0, 12.0), rng.uniform(0.0, 2.0 * np.pi)
    ray = np.array((*rng.uniform(-2.0, 62.0, 2), np.cos(angle), np.sin(angle)))
    others = rng.uniform(0.0, 70.0, (int(rng.integers(0, 12)), 2))
    assert shown_ahead(mask, ray, others, width) == pytest.approx(slowly(mask, ray, others, width), abs=1e-9)


def test_a_tip_beyond_the_cable_that_it_crosses_is_found() -> None:
    mask = np.zeros((60, 80), np.uint8)
    mask[26:34, 10:60] = 1
    mask[:, 36:44] = 1
    crossing = np.column_stack((np.full(60, 39.5), np.arange(60.0)))
    ahead = shown_ahead(mask, np.array((32.0, 29.5, 1.0, 0.0)), crossing, 8.0)
    assert 32.0 + ahead == pytest.approx(59.5 - 4.0, abs=1.6)  # its axis ends half a width before its tip
