"""From surface to axis, and which sections another pass hides."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from dloftbs.data.centerline import arc_parameter
from dloftbs.lifting.kernels.tubes import mask_occluded, surface_to_axis


@given(st.floats(0.5, 2.6), st.floats(0.0, 2.0 * math.pi), st.floats(0.002, 0.02), st.floats(-0.3, 0.3))
def test_a_cylinder_s_axis_is_found_from_its_surface(lean: float, turn: float, radius: float, off: float) -> None:
    """Rays in the plane of camera and axis meet the surface ``radius / sin`` before the axis."""
    way = np.array([math.sin(lean) * math.cos(turn), math.sin(lean) * math.sin(turn), math.cos(lean)])
    axis = np.array([off, -off, 1.0]) + 0.01 * np.arange(-10, 11)[:, None] * way
    rays = axis / axis[:, 2:]
    unit = axis / np.linalg.norm(axis, axis=1, keepdims=True)
    sine = np.linalg.norm(np.cross(unit, way), axis=1)
    assume(sine.min() > 0.25)
    surface = axis - unit * (radius / sine)[:, None]
    # The rays that touch: turned about the axis' direction, in the plane across it, as far as the radius asks for.
    normal = np.cross(axis[0], way) / np.linalg.norm(np.cross(axis[0], way))
    nearest = axis - (axis @ way)[:, None] * way
    distance = np.linalg.norm(nearest, axis=1)
    tilt = np.arcsin(radius / distance)
    toward = nearest / distance[:, None]
    borders = []
    for side in (-1.0, 1.0):
        border = (axis @ way)[:, None] * way + distance[:, None] * (
            np.cos(tilt)[:, None] * toward + side * np.sin(tilt)[:, None] * normal
        )
        borders.append(border / border[:, 2:])
    points, _, found = surface_to_axis(
        np.stack((rays, *borders)), 1.0 / surface[:, 2], 0.0, np.ones(len(axis), bool), False
    )
    assert found == pytest.approx(radius, rel=0.02)
    np.testing.assert_allclose(points, axis, atol=0.05 * radius)


def test_the_radius_is_that_of_the_sections_that_are_seen() -> None:
    x = np.linspace(-0.2, 0.2, 21)
    rays = np.stack((x, np.zeros(21), np.ones(21)), axis=1)
    half = np.where(np.arange(21) < 15, 0.5, 0.01)
    borders = [rays + np.array([0.0, 1.0, 0.0]) * (side * half)[:, None] for side in (-1.0, 1.0)]
    points, _, radius = surface_to_axis(np.stack((rays, *borders)), np.full(21, 1.0), 0.0, np.arange(21) >= 15, False)
    assert radius == pytest.approx(0.01, rel=0.02)
    np.testing.assert_allclose(points[:, 2], 1.0 + radius, rtol=1e-3)


def test_around_a_loop_the_ends_are_neighbours() -> None:
    angle = np.linspace(0.0, 2.0 * np.pi, 40, endpoint=False)
    rays = np.stack((0.2 * np.cos(angle), 0.2 * np.sin(angle), np.ones(40)), axis=1)
    borders = [rays * (factor, factor, 1.0) for factor in (0.95, 1.05)]
    points, u, _ = surface_to_axis(np.stack((rays, *borders)), np.ones(40), 0.0, np.ones(40, bool), True)
    np.testing.assert_allclose(points[:, 2], points[0, 2], atol=1e-9)
    np.testing.assert_allclose(u, angle / (2.0 * np.pi), atol=1e-9)


@given(st.integers(0, 2**31), st.integers(2, 30), st.booleans())
def test_the_parameter_is_the_arc_length_along_the_axis(seed: int, n: int, closed: bool) -> None:
    rng = np.random.default_rng(seed)
    rays = np.stack((np.linspace(-0.3, 0.3, n), rng.uniform(-0.1, 0.1, n), np.ones(n)), axis=1)
    borders = [rays + np.array([0.0, side * 0.01, 0.0]) for side in (-1.0, 1.0)]
    points, u, _ = surface_to_axis(np.stack((rays, *borders)), rng.uniform(0.5, 2.0, n), 0.1, np.ones(n, bool), closed)
    np.testing.assert_allclose(u, arc_parameter(points, closed), atol=1e-12)


def line(angle: float, n: int = 81) -> np.ndarray:
    return np.linspace(-40.0, 40.0, n)[:, None] * (math.cos(angle), math.sin(angle))


@given(st.floats(0.3, math.pi - 0.3), st.floats(2.0, 12.0))
def test_what_lies_on_a_straight_pass_is_hidden(angle: float, reach: float) -> None:
    own, other = line(0.0), line(angle)
    used = np.ones(81, bool)
    mask_occluded(used, own, False, 40, other, False, 40, reach)
    # Points of the other pass are a pixel apart.
    distance = np.sqrt(((own[:, None] - other[None]) ** 2).sum(axis=2)).min(axis=1)
    np.testing.assert_array_equal(used, distance > reach)


def test_a_pass_that_ends_there_is_hidden_up_to_its_end() -> None:
    own, other = line(0.0)[38:], line(1.5)
    used = np.ones(len(own), bool)
    mask_occluded(used, own, False, 2, other, False, 40, 5.0)
    assert not used[:7].any()
    assert used[8:].all()


def test_on_a_loop_hiding_goes_on_through_the_seam() -> None:
    angle = np.linspace(0.0, 2.0 * np.pi, 60, endpoint=False)
    loop = 30.0 * np.stack((np.cos(angle), np.sin(angle)), axis=1)
    other = np.linspace((10.0, 0.5), (50.0, 0.5), 41)
    used = np.ones(60, bool)
    mask_occluded(used, loop, True, 0, other, False, 20, 5.0)
    assert np.flatnonzero(~used).tolist() == [0, 1, 59]


def test_passes_that_run_together_are_hidden_wholly() -> None:
    used = np.ones(81, bool)
    beside = line(0.0) + np.array([0.0, 1.0])
    mask_occluded(used, line(0.0), False, 40, beside, False, 40, 5.0)
    assert not used.any()
