"""Spans of points, put one after the other."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.kernels.gathering import gather, medians


@given(st.integers(0, 2**31), st.lists(st.tuples(st.integers(0, 50), st.integers(0, 50)), max_size=6), st.booleans())
def test_spans_come_one_after_the_other_some_backwards(seed: int, ends: list[tuple[int, int]], flip: bool) -> None:
    rng = np.random.default_rng(seed)
    points, radius = rng.normal(size=(51, 2)), rng.normal(size=51)
    matrix = np.array([[0.0, -1.0], [1.0, 0.0]] if flip else [[1.0, 0.0], [0.0, -1.0]])
    spans = [(a, b, 1 if b >= a else -1) for a, b in ends]
    at = np.concatenate([np.arange(*span) for span in spans]) if spans else np.empty(0, np.int64)
    own, own_radius = gather(points, radius, np.array(spans, np.int64).reshape(-1, 3), matrix, np.array([3.0, 70.0]))
    np.testing.assert_array_equal(own, points[at] @ matrix.T + (3.0, 70.0))
    np.testing.assert_array_equal(own_radius, radius[at])


@given(st.integers(0, 2**31), st.lists(st.integers(1, 30), min_size=1, max_size=5))
def test_medians_of_several_series(seed: int, sizes: list[int]) -> None:
    values, first = np.random.default_rng(seed).integers(0, 9, sum(sizes)) / 3.0, np.cumsum([0, *sizes])
    expected = [np.median(values[start:stop]) for start, stop in pairwise(first)]
    np.testing.assert_array_equal(medians(values, first), expected)
