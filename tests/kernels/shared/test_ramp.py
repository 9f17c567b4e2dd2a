"""Ramps against numpy's interpolation."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numba import njit

from dloftbs.kernels.shared.ramp import ramp_down

ramp_down = njit(ramp_down)

numbers = st.floats(-100.0, 100.0)


@given(numbers, numbers, st.floats(0.01, 100.0))
def test_it_falls_in_a_straight_line(value: float, full: float, width: float) -> None:
    expected = np.interp(value, [full, full + width], [1.0, 0.0])
    assert ramp_down(value, full, full + width) == pytest.approx(expected, abs=1e-9)
