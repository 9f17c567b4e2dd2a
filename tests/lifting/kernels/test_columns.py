"""Few values in each of many columns, against numpy."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.lifting.kernels.columns import MAX_ROWS, medians_of_columns, sort_columns


@pytest.mark.parametrize("rows", range(MAX_ROWS + 1))
def test_any_number_of_rows_comes_in_order(rows: int) -> None:
    values = np.random.default_rng(rows).integers(0, 9, (rows, 200)).astype(float)
    expected = np.sort(values, axis=0)
    sort_columns(values)
    np.testing.assert_array_equal(values, expected)


@given(st.integers(0, 2**31), st.integers(1, 9))
def test_medians_leave_out_what_is_infinite(seed: int, rows: int) -> None:
    rng = np.random.default_rng(seed)
    values = rng.normal(size=(rows, 12))
    values[rng.random(values.shape) < rng.choice([0.0, 0.3, 0.9])] = np.inf
    known = [column[np.isfinite(column)] for column in values.T]
    expected = [np.median(column) if len(column) else np.nan for column in known]
    np.testing.assert_array_equal(medians_of_columns(values), expected)
