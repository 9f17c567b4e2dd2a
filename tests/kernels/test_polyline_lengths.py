"""Centre lines put together of spans of points."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.data import centerline
from dloftbs.kernels.polyline_lengths import arc_parameter, lay_out

ends = st.tuples(st.integers(0, 50), st.integers(0, 50)).filter(lambda span: span[0] != span[1])


@given(
    st.integers(0, 2**31),
    st.lists(st.lists(ends, min_size=1, max_size=4), min_size=1, max_size=4),
    st.integers(0, 4),
    st.booleans(),
)
def test_lines_are_their_spans_one_after_the_other(
    seed: int, lines: list[list[tuple[int, int]]], n_open: int, flip: bool
) -> None:
    rng = np.random.default_rng(seed)
    points, radius, arms = rng.normal(size=(51, 2)), rng.normal(size=51), rng.normal(size=(5, 6))
    matrix, offset = np.array([[0.0, -1.0], [1.0, 0.0]] if flip else [[1.0, 0.0], [0.0, -1.0]]), np.array([3.0, 70.0])
    spans = [[(a, b, 1 if b > a else -1) for a, b in line] for line in lines]
    at = [np.concatenate([np.arange(*span) for span in line]) for line in spans]
    first = np.cumsum([0, *map(len, at)])
    flat = np.array([span for line in spans for span in line])
    own, own_radius, u, widths, places = lay_out(points, radius, flat, first, n_open, arms, matrix, offset)
    np.testing.assert_array_equal(places, arms[:, :2] @ matrix.T + offset)
    for k, (start, stop) in enumerate(pairwise(first)):
        np.testing.assert_array_equal(own[start:stop], points[at[k]] @ matrix.T + offset)
        np.testing.assert_array_equal(own_radius[start:stop], radius[at[k]])
        np.testing.assert_array_equal(u[start:stop], arc_parameter(own[start:stop], k >= n_open))
        assert widths[k] == 2.0 * np.median(radius[at[k]])


@given(st.integers(0, 2**31), st.integers(1, 40), st.sampled_from([2, 3]), st.booleans())
def test_the_parameter_agrees_with_its_slow_twin(seed: int, n: int, dims: int, closed: bool) -> None:
    points = np.random.default_rng(seed).integers(0, 3, (n, dims)).astype(float)
    np.testing.assert_allclose(arc_parameter(points, closed), centerline.arc_parameter(points, closed), atol=1e-14)


@pytest.mark.parametrize("closed", [False, True])
def test_the_parameter_of_a_square(closed: bool) -> None:
    square = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]])
    np.testing.assert_allclose(arc_parameter(square, closed), np.arange(4.0) / (4.0 if closed else 3.0))
