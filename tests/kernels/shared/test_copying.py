"""Copies between arrays, against numpy."""

from __future__ import annotations

import numpy as np
import pytest
from numba import njit

from dloftbs.kernels.shared import copying

copy_to, copy_rows_to = njit(copying.copy_to), njit(copying.copy_rows_to)
longer, longer_rows = njit(copying.longer), njit(copying.longer_rows)


@pytest.mark.parametrize("dtype", [np.int64, np.float64, np.bool_])
def test_numbers_are_copied_to_the_first_places(dtype):
    target = np.ones(5, dtype)
    copy_to(target, np.zeros(3, dtype))
    np.testing.assert_array_equal(target, [0, 0, 0, 1, 1])


def test_rows_are_copied_to_the_first_rows():
    target, source = np.zeros((4, 3)), np.arange(12.0).reshape(3, 4).T[:2]
    copy_rows_to(target, source)
    np.testing.assert_array_equal(target, np.concatenate((source, np.zeros((2, 3)))))


@pytest.mark.parametrize(("lengthen", "shape"), [(longer, (3,)), (longer_rows, (3, 2))])
@pytest.mark.parametrize("dtype", [np.int64, np.float64])
def test_what_is_longer_begins_with_the_same(lengthen, shape, dtype):
    values = np.arange(np.prod(shape), dtype=dtype).reshape(shape)
    twice = lengthen(values)
    assert twice.shape == (6, *shape[1:])
    assert twice.dtype == dtype
    np.testing.assert_array_equal(twice[:3], values)
