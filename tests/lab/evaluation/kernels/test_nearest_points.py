"""Distances from the nearest point: every pair is the slow twin."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from dloftbs_lab.evaluation.kernels.nearest_points import measure_nearest

CELL = 8.0


def measured(points, others):
    left, top = others.min(axis=0)
    columns, rows = ((others - (left, top)) // CELL).astype(np.intp).T
    across, down = int(columns.max()) + 1, int(rows.max()) + 1
    cells = rows * across + columns
    order = np.argsort(cells, kind="stable")
    first = np.searchsorted(cells[order], np.arange(across * down + 1)).astype(np.intp)
    distances = np.full(len(points), np.nan)
    measure_nearest(points, others[order], first, left, top, CELL, across, distances)
    return distances


@given(st.integers(0, 1000), st.integers(1, 60), st.sampled_from((3.0, 40.0, 400.0)))
def test_what_is_within_two_cells_is_exact_and_all_else_is_far(seed, count, spread):
    rng = np.random.default_rng(seed)
    others, points = rng.uniform(-spread, spread, (count, 2)), rng.uniform(-1.2 * spread, 1.2 * spread, (50, 2))
    slow = np.sqrt(((points[:, None] - others) ** 2).sum(axis=-1)).min(axis=1)
    np.testing.assert_array_equal(measured(points, others), np.where(slow <= 2.0 * CELL, slow, np.inf))


def test_a_point_on_the_border_of_a_cell_sees_both_sides():
    others = np.array([(0.0, 0.0), (7.9, 0.0), (31.0, 31.0)])
    assert measured(np.array([(8.0, 0.0), (-16.0, 0.0), (-16.5, 0.0)]), others).tolist() == [8.0 - 7.9, 16.0, np.inf]
