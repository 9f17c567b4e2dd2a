"""Distances of whole curves: the slow twin is criterion L3, pair by pair."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dloftbs_lab.evaluation.curves import even_l3
from dloftbs_lab.evaluation.kernels.side_distances import measure_pairs
from dloftbs_lab.evaluation.metrics import l3


def measured(found, true):
    """Return the L3 of each true curve from each found one, run both ways, shape (t, f, 2)."""
    both_ways = np.array([[x, x[::-1]] for x in found])
    distances = np.full((len(true), len(found), 2, 2, len(true[0])), np.nan)
    measure_pairs(both_ways, np.array(true), distances)
    return distances.mean(axis=-1).sum(axis=-1) / 2.0


@given(st.integers(0, 1000), st.integers(2, 40), st.sampled_from((2, 3)), st.sampled_from((1e-3, 1.0, 300.0)))
def test_it_is_the_slow_criterion_to_the_last_bit(seed, points, ndim, step):
    rng = np.random.default_rng(seed)
    curves = np.cumsum(rng.normal(scale=step, size=(5, points, ndim)), axis=1)
    made = measured(curves[:2], curves[2:])
    for i, true in enumerate(curves[2:]):
        for j, found in enumerate(curves[:2]):
            assert made[i, j].tolist() == [even_l3(found, true), even_l3(found[::-1], true)]


def test_points_at_even_distances_give_the_paper_s_criterion():
    straight = np.column_stack((np.linspace(0.0, 90.0, 10), np.zeros(10)))
    shifted = straight + np.array((3.0, 4.0))
    assert measured([shifted], [straight])[0, 0, 0] == pytest.approx(l3(shifted, straight), rel=1e-12)


def test_points_that_are_all_one_have_a_distance():
    assert measured([np.full((4, 2), 3.0)], [np.zeros((4, 2))])[0, 0].tolist() == [pytest.approx(18.0**0.5)] * 2
