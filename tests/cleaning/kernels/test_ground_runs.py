"""Runs of ground against the ground pixel by pixel."""

from __future__ import annotations

import numpy as np
import pytest
from ground_examples import holed, in_runs
from scipy import ndimage
from skeletons import framed_bitmask

from dloftbs.cleaning.kernels.ground_runs import fill, find_ground
from dloftbs.kernels.bitmask import as_bytes

SEEDS = pytest.mark.parametrize("seed", range(10))


@SEEDS
def test_parts_are_what_hangs_together_by_sides(seed: int) -> None:
    mask = holed(seed)
    rows, columns = mask.shape
    *runs, pixels = find_ground(framed_bitmask(mask[1:-1, 1:-1]), rows, columns)
    parts = in_runs(*runs, columns)
    np.testing.assert_array_equal(parts < 0, mask != 0)
    labels, count = ndimage.label(mask == 0)
    assert len(pixels) == count
    for k in range(count):
        (label,) = np.unique(labels[parts == k])
        assert (labels == label).sum() == (parts == k).sum()
    assert pixels[1:].tolist() == [int((parts == k).sum()) for k in range(1, count)]


@SEEDS
def test_chosen_parts_are_filled(seed: int) -> None:
    mask = holed(seed)
    rows, columns = mask.shape
    framed = framed_bitmask(mask[1:-1, 1:-1])
    *runs, pixels = find_ground(framed, rows, columns)
    chosen = np.random.default_rng(seed).random(len(pixels)) < 0.5
    chosen[0] = False
    filled = as_bytes(fill(framed, *runs, chosen), rows - 2, columns - 2)[:, :columns]
    parts = in_runs(*runs, columns)
    np.testing.assert_array_equal(filled != 0, (mask != 0) | ((parts >= 0) & chosen[parts]))
