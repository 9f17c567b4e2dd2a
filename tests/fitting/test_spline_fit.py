"""Centre line to curve."""

from __future__ import annotations

import numpy as np
import pytest
from drawings import wave

from dloftbs.config import FittingConfig
from dloftbs.data.centerline import arc_parameter
from dloftbs.fitting.spline_fit import closed_knots, distinct_knots, fit, fit_with_knots, needed_knots
from dloftbs.kernels.least_squares import open_knots


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
    curve = fit(points, arc_parameter(points, False), False, FittingConfig(knots=25), 12.0)
    assert np.abs(curve(arc_parameter(points, False)) - points).max() < 0.7
    assert len(curve.control_points) == 27


def test_a_circle_is_fitted_without_a_seam() -> None:
    angle = np.linspace(0.0, 2 * np.pi, 400, endpoint=False)
    points = 100 + 80 * np.stack((np.cos(angle), np.sin(angle)), axis=1)
    curve = fit(points, arc_parameter(points, True), True, FittingConfig(knots=25), 12.0)
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
    curve = fit(points, arc_parameter(points, False), False, FittingConfig(), 12.0)
    np.testing.assert_allclose(curve.sample(2), points[[0, -1]], atol=1e-9)


def test_three_coordinates_share_the_knots() -> None:
    points = np.stack((np.linspace(0, 1, 60), np.linspace(1, 2, 60) ** 2, np.linspace(2, 3, 60)), axis=1)
    curve = fit_with_knots(points, arc_parameter(points, False), False, 8)
    assert curve.ndim == 3
    assert np.abs(curve(arc_parameter(points, False)) - points).max() < 1e-4


def arc(radius: float, length: float) -> np.ndarray:
    """Return points 1 px apart along a circle."""
    angle = np.arange(0.0, length) / radius
    return 500.0 + radius * np.stack((np.sin(angle), np.cos(angle)), axis=1)


def wiggle(length: int, wavelength_px: float) -> np.ndarray:
    x = np.arange(float(length))
    return np.stack((x, 0.1 * wavelength_px * np.sin(2 * np.pi * x / wavelength_px)), axis=1)


def test_the_need_grows_with_the_bending_and_the_length() -> None:
    def need(points: np.ndarray) -> int:
        return needed_knots(points, arc_parameter(points, False), False, 0.2, 12.0)

    straight, wide, tight = (need(arc(radius, 1000.0)) for radius in (1e6, 200.0, 30.0))
    assert straight <= wide < tight <= 57
    assert need(wiggle(1000, 300.0)) < need(wiggle(1000, 80.0))
    assert need(arc(60.0, 300.0)) < need(arc(60.0, 1200.0))


@pytest.mark.parametrize("wavelength_px", [80.0, 150.0, 400.0])
@pytest.mark.parametrize("length", [200, 700, 2000])
def test_the_curve_keeps_to_the_points(wavelength_px: float, length: int) -> None:
    points = wiggle(length, wavelength_px)
    u = arc_parameter(points, False)
    curve = fit(points, u, False, FittingConfig(), 12.0)
    assert np.abs(curve(u) - points).max() < 0.8


def test_noise_does_not_bring_more_knots_than_one_and_a_half_widths_apart() -> None:
    points = wiggle(900, 300.0) + np.random.default_rng(0).normal(size=(900, 2)) * 3.0
    assert needed_knots(points, arc_parameter(points, False), False, 0.01, 12.0) == 51


def test_knots_by_need_around_a_loop() -> None:
    angle = np.linspace(0.0, 2 * np.pi, 1200, endpoint=False)
    radius = 180.0 + 15.0 * np.sin(9 * angle)
    points = 300 + radius[:, None] * np.stack((np.cos(angle), np.sin(angle)), axis=1)
    u = arc_parameter(points, True)
    curve = fit(points, u, True, FittingConfig(), 12.0)
    assert np.abs(curve(u) - points).max() < 0.8
    np.testing.assert_allclose(curve(0.0, 1), curve(1.0, 1), atol=1e-6)


@pytest.mark.parametrize("closed", [False, True])
def test_the_number_of_distinct_knots_is_read_back(closed: bool) -> None:
    points = arc(100.0, 600.0)
    curve = fit_with_knots(points, arc_parameter(points, closed), closed, 17)
    assert distinct_knots(curve) == 17


@pytest.mark.parametrize("radius", [60.0, 100.0, 1e5])
@pytest.mark.parametrize("length", [300.0, 900.0])
def test_a_gap_between_bent_ends_is_bridged_without_a_wiggle(radius: float, length: float) -> None:
    whole = arc(radius, length)
    middle = int(length / 2)
    points = np.delete(whole, slice(middle - 30, middle + 30), axis=0)
    curve = fit(points, arc_parameter(points, False), False, FittingConfig(), 12.0)
    distance = np.abs(np.linalg.norm(curve.sample(2000) - 500.0, axis=1) - radius)
    assert distance.max() < 1.5


@pytest.mark.parametrize("n", range(2, 30))
def test_few_points_by_need(n: int) -> None:
    points = arc(50.0, float(n))
    for closed in (False, True) if n >= 8 else (False,):
        assert np.isfinite(fit(points, arc_parameter(points, closed), closed, FittingConfig(), 12.0).sample(20)).all()


@pytest.mark.parametrize("knots", [None, 2, 25])
def test_points_at_one_place_count_once(knots: int | None) -> None:
    points = np.array([[38.0, 17.0], [38.0, 11.0], [38.0, 11.0], [41.0, 14.0]])
    curve = fit(points, arc_parameter(points), False, FittingConfig(knots=knots), 5.5)
    assert np.isfinite(curve.control_points).all()
    away = np.linalg.norm(curve.sample(200)[:, None] - points, axis=2).min(axis=0)
    assert away.max() < 2.0
