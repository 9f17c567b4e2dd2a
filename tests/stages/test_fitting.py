"""Centre line to curve."""

from __future__ import annotations

import numpy as np
import pytest
from drawings import wave

from dloftbs import FittingConfig
from dloftbs.centerline import arc_parameter
from dloftbs.kernels.fitting import open_knots
from dloftbs.stages.fitting import closed_knots, fit


def test_k_knots_equidistant_in_element_number() -> None:
    u = np.sort(np.random.default_rng(0).random(241))
    u = (u - u[0]) / (u[-1] - u[0])
    knots = open_knots(u, 25)
    assert len(np.unique(knots)) == 25
    np.testing.assert_array_equal(np.unique(knots), u[::10])
    assert (knots[:4] == 0).all()
    assert (knots[-4:] == 1).all()


@pytest.mark.parametrize("n", range(2, 60))
def test_every_span_holds_a_point(n: int) -> None:
    u = np.linspace(0.0, 1.0, n)
    breaks = np.unique(open_knots(u, 25))
    assert (np.histogram(u, breaks)[0] >= 1).all()


def test_a_wave_is_fitted_within_a_pixel() -> None:
    points = wave((720, 1280))
    curve = fit(points, arc_parameter(points, False), False, FittingConfig(knots=25))
    assert np.abs(curve(arc_parameter(points, False)) - points).max() < 0.7
    assert len(curve.control_points) == 27


def test_a_circle_is_fitted_without_a_seam() -> None:
    angle = np.linspace(0.0, 2 * np.pi, 400, endpoint=False)
    points = 100 + 80 * np.stack((np.cos(angle), np.sin(angle)), axis=1)
    curve = fit(points, arc_parameter(points, True), True, FittingConfig(knots=25))
    assert curve.closed
    np.testing.assert_allclose(curve(0.0), curve(1.0), atol=1e-9)
    np.testing.assert_allclose(curve(0.0, 1), curve(1.0, 1), atol=1e-6)
    assert np.abs(np.linalg.norm(curve.sample(1000) - 100, axis=1) - 80).max() < 0.01
    assert curve.length == pytest.approx(2 * np.pi * 80, rel=1e-4)


def test_closed_knots_have_period_one() -> None:
    knots = closed_knots(np.arange(100) / 100, 25)
    assert len(knots) == 24 + 7
    np.testing.assert_allclose(knots[-4:] - knots[3:7], 1.0)
    np.testing.assert_allclose(knots[-7:-4] - knots[:3], 1.0)


@pytest.mark.parametrize("n", [2, 3])
def test_two_or_three_points_make_a_straight_or_bent_line(n: int) -> None:
    points = np.array([[0.0, 0.0], [5.0, 0.0], [10.0, 0.0]])[:n]
    curve = fit(points, arc_parameter(points, False), False, FittingConfig())
    np.testing.assert_allclose(curve.sample(2), points[[0, -1]], atol=1e-9)


def test_three_coordinates_share_the_knots() -> None:
    points = np.stack((np.linspace(0, 1, 60), np.linspace(1, 2, 60) ** 2, np.linspace(2, 3, 60)), axis=1)
    curve = fit(points, arc_parameter(points, False), False, FittingConfig(knots=8))
    assert curve.ndim == 3
    assert np.abs(curve(arc_parameter(points, False)) - points).max() < 1e-4
