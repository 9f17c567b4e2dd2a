"""Runs of ground against the ground pixel by pixel."""

from __future__ import annotations

import numpy as np
import pytest
from ground_examples import holed, in_runs
from scipy import ndimage
from skeletons import framed_bitmask

from dloftbs.cleaning.kernels.ground_runs import fill, find_ground, thin_out
from dloftbs.kernels.bitmask import as_bytes

SEEDS = pytest.mark.parametrize("seed", range(10))


@SEEDS
def test_parts_are_what_hangs_together_by_sides(seed: int) -> None:
    mask = holed(seed)
    rows, columns = mask.shape
    *runs, pixels, _, outlines = find_ground(framed_bitmask(mask[1:-1, 1:-1]), rows, columns)
    parts = in_runs(*runs, columns)
    np.testing.assert_array_equal(parts < 0, mask != 0)
    labels, count = ndimage.label(mask == 0)
    assert len(pixels) == count
    for k in range(count):
        (label,) = np.unique(labels[parts == k])
        assert (labels == label).sum() == (parts == k).sum()
    assert pixels[1:].tolist() == [int((parts == k).sum()) for k in range(1, count)]
    assert outlines == ndimage.label(mask, np.ones((3, 3)))[1] + count - 1


@SEEDS
def test_sides_of_holes_are_counted(seed: int) -> None:
    mask = holed(seed)
    rows, columns = mask.shape
    *runs, _, sides, _ = find_ground(framed_bitmask(mask[1:-1, 1:-1]), rows, columns)
    parts = in_runs(*runs, columns)
    for k in range(1, len(sides)):
        ground = parts == k
        touching = sum((np.roll(mask, step, axis) & ground).sum() for step in (-1, 1) for axis in (0, 1))
        assert sides[k] == touching


@SEEDS
def test_chosen_parts_are_filled(seed: int) -> None:
    mask = holed(seed)
    rows, columns = mask.shape
    framed = framed_bitmask(mask[1:-1, 1:-1])
    *runs, pixels, _, _ = find_ground(framed, rows, columns)
    chosen = np.random.default_rng(seed).random(len(pixels)) < 0.5
    chosen[0] = False
    filled = as_bytes(fill(framed, *runs, chosen), rows - 2, columns - 2)[:, :columns]
    parts = in_runs(*runs, columns)
    np.testing.assert_array_equal(filled != 0, (mask != 0) | ((parts >= 0) & chosen[parts]))


@SEEDS
@pytest.mark.parametrize(("top", "left"), [(0, 0), (1, 0), (0, 1), (1, 1)])
def test_every_other_pixel_is_kept(seed: int, top: int, left: int) -> None:
    mask = holed(seed)
    expected = np.pad(mask[top::2, left::2], ((1, 1), (0, 0)))
    rows, columns = expected.shape
    found = thin_out(framed_bitmask(mask[1:-1, 1:-1]), len(mask), top, left)
    np.testing.assert_array_equal(as_bytes(found, rows - 2, columns - 2)[:, :columns], expected)
