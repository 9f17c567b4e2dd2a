"""A few numbers in order, against numpy."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numba import njit

from dloftbs.kernels.shared.few import insert, median, middle

insert = njit(insert)
median = njit(median)
middle = njit(middle)

lists = st.lists(st.floats(-1e3, 1e3), max_size=12)


@given(lists, st.floats(-1e3, 1e3))
def test_an_inserted_value_takes_its_place(numbers: list[float], value: float) -> None:
    few = np.array([*sorted(numbers), 7.0, 8.0])
    insert(value, few, len(numbers))
    np.testing.assert_array_equal(few, [*sorted([*numbers, value]), 8.0])  # what lies beyond stays


@given(lists.filter(len))
def test_the_median_is_numpy_s_and_the_values_stay(numbers: list[float]) -> None:
    values, few = np.array(numbers), np.full(len(numbers) + 3, -5.0)
    assert median(values, few) == pytest.approx(np.median(numbers))
    assert middle(np.sort(values), len(values)) == pytest.approx(np.median(numbers))
    np.testing.assert_array_equal(values, numbers)
    np.testing.assert_array_equal(few[len(numbers) :], -5.0)


def test_the_median_of_none_is_none() -> None:
    assert np.isnan(median(np.zeros(0), np.zeros(3)))
    assert np.isnan(middle(np.zeros(3), 0))
