"""Values by their rank, against numpy's sorts."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numba import njit

from dloftbs.kernels.shared import selection

nth_least, count_up_to = njit(selection.nth_least), njit(selection.count_up_to)
median_of, falling_order = njit(selection.median_of), njit(selection.falling_order)

lists = st.lists(st.floats(-1e3, 1e3) | st.integers(-3, 3).map(float), max_size=60)
"""With many that are equal."""


@given(lists.filter(len), st.data())
def test_the_nth_least_stands_where_a_sort_brings_it(numbers, data):
    n = data.draw(st.integers(0, len(numbers) - 1))
    values = np.array(numbers)
    assert nth_least(values, n) == sorted(numbers)[n] == values[n]
    assert (values[:n] <= values[n]).all()
    assert (values[n:] >= values[n]).all()
    np.testing.assert_array_equal(np.sort(values), np.sort(numbers))


def test_the_nth_least_of_whole_numbers_is_a_whole_number():
    assert nth_least(np.array([5, 2**60 + 1, 2**60]), 2) == 2**60 + 1


def test_it_ends_whatever_the_values_are():
    for n in range(5):
        nth_least(np.full(5, np.nan), n)
        nth_least(np.array([2.0, np.nan, np.inf, np.nan, 1.0]), n)


@given(lists, st.floats(-4.0, 4.0))
def test_as_many_are_counted_as_a_search_finds(numbers, most):
    values = np.sort(np.array(numbers, dtype=np.float64))
    assert count_up_to(values, most) == np.searchsorted(values, most, side="right")


@given(lists)
def test_the_median_is_numpy_s_to_the_bit_and_the_values_stay(numbers):
    values = np.array(numbers)
    expected = np.median(numbers) if numbers else np.nan
    np.testing.assert_array_equal(median_of(values), expected)
    np.testing.assert_array_equal(values, numbers)


@given(lists)
def test_the_falling_order_is_that_of_a_stable_sort(numbers):
    order = falling_order(np.array(numbers, dtype=np.float64))
    assert order.tolist() == sorted(range(len(numbers)), key=lambda i: -numbers[i])
