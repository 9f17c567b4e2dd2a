"""Distances around holes against the distances of all pixels."""

from __future__ import annotations

import numpy as np
import pytest
from ground_examples import holed, in_runs
from scipy import ndimage
from skeletons import framed_bitmask

from dloftbs.cleaning.kernels.ground_runs import find_ground
from dloftbs.cleaning.kernels.outer_edges import measure_edges


def boxes_of(parts: np.ndarray, count: int) -> np.ndarray:
    boxes = np.zeros((count, 4), dtype=np.int64)
    for k, (rows, columns) in enumerate(ndimage.find_objects(parts + 1)[1:count], start=1):
        boxes[k] = rows.start, rows.stop, columns.start, columns.stop
    return boxes


def test_holes_are_measured_as_by_all_distances() -> None:
    assert sum(measured(seed) for seed in range(20)) > 5


def measured(seed: int) -> int:
    """Compare the measures of the holes in a random mask, and return how many are not too thin to decide."""
    mask = holed(seed)
    rows, columns = mask.shape
    *runs, pixels = find_ground(framed_bitmask(mask[1:-1, 1:-1]), rows, columns)
    parts = in_runs(*runs, columns)
    chosen = np.random.default_rng(seed).random(len(pixels)) < 0.7
    chosen[0] = False
    boxes = boxes_of(parts, len(pixels))
    across, outer, solid = measure_edges(
        framed_bitmask(mask[1:-1, 1:-1]), rows, columns, *runs, chosen, boxes, (False, False, False, False)
    )
    solids, depth = (ndimage.distance_transform_edt(m) for m in (mask, (parts < 0) | chosen[parts]))
    count = 0
    for k in np.flatnonzero(chosen):
        width = 2.0 * ndimage.distance_transform_edt(parts == k).max() - 1.0
        to_hole = ndimage.distance_transform_edt(parts != k)
        touching = (mask != 0) & (to_hole <= solids + 1e-9)
        thickest = solids[touching].max() - 0.5
        if across[k] == 0.0:  # too thin to decide
            continue
        count += 1
        assert across[k] == pytest.approx(width)
        assert solid[k] == pytest.approx(thickest)
        beside = (parts == k) | (touching & (to_hole <= width + 1.0))
        assert outer[k] == pytest.approx(np.quantile(depth[beside] - 0.5, 0.9, method="inverted_cdf"), abs=0.5)
    return count
