"""Runs of ground against the ground pixel by pixel."""

from __future__ import annotations

import numpy as np
import pytest
from ground_examples import holed, in_runs
from scipy import ndimage
from skeletons import framed_bitmask

from dloftbs.cleaning.kernels.ground_runs import find_ground, label_foreground, thin_out
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
def test_pieces_are_what_hangs_together_by_sides_and_corners(seed: int) -> None:
    mask = holed(seed)
    rows, columns = mask.shape
    first, start, end, *_ = find_ground(framed_bitmask(mask[1:-1, 1:-1]), rows, columns)
    piece, pieces = label_foreground(first, start, end)
    labels, count = ndimage.label(mask, np.ones((3, 3)))
    assert pieces == count
    found = np.zeros(mask.shape, int)
    for r in range(rows):
        for i in range(first[r], first[r + 1] - 1):
            found[r, end[i] : start[i + 1]] = piece[i] + 1
    np.testing.assert_array_equal(found != 0, mask != 0)
    assert len(np.unique(np.stack((found, labels)).reshape(2, -1), axis=1).T) == count + 1


@SEEDS
@pytest.mark.parametrize(("top", "left"), [(0, 0), (1, 0), (0, 1), (1, 1)])
def test_every_other_pixel_is_kept(seed: int, top: int, left: int) -> None:
    mask = holed(seed)
    expected = np.pad(mask[top::2, left::2], ((1, 1), (0, 0)))
    rows, columns = expected.shape
    found = thin_out(framed_bitmask(mask[1:-1, 1:-1]), len(mask), top, left)
    np.testing.assert_array_equal(as_bytes(found, rows - 2, columns - 2)[:, :columns], expected)
