"""Loops that start elsewhere."""

from __future__ import annotations

import numpy as np
import pytest
from builders import loop, random_curve
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.data.curve import BSplineCurve
from dloftbs.tracking.loop_start import move_start


@given(st.integers(0, 1000), st.floats(0.0, 1.0))
def test_it_is_the_same_loop_from_another_place_on(seed, start):
    curve = random_curve(seed, closed=True)
    result = move_start(curve, start)
    u = np.linspace(0.0, 1.0, 200, endpoint=False)
    np.testing.assert_allclose(result.spline(u), curve.spline((u + start) % 1.0), atol=1e-6)
    checked = BSplineCurve(result.knots, result.control_points, closed=True)
    assert checked == result


@pytest.mark.parametrize("k", [1, 5, 40])
def test_at_a_knot_no_other_is_added(k):
    curve = loop(60.0)
    result = move_start(curve, float(curve.knots[3 + k]))
    assert len(result.control_points) == len(curve.control_points)
    np.testing.assert_allclose(result(0.0), curve.spline(curve.knots[3 + k]), atol=1e-9)


@pytest.mark.parametrize("start", [0.0, 1.0])
def test_where_it_starts_already_it_stays_as_it_is(start):
    curve = loop(60.0)
    assert move_start(curve, start) is curve
