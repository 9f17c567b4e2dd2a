"""Two cables in one run: where each of them lies, and where they change sides."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numba import njit

from dloftbs.linking.kernels.parallel_runs import _misfit, _roughness, continuing_axis, find_swaps, offset_axes

_misfit = njit(_misfit)
_roughness = njit(_roughness)

NOTHING = np.empty((0, 2))


@given(st.integers(0, 10**6), st.integers(9, 60))
def test_the_misfit_is_that_of_least_squares(seed: int, n: int) -> None:
    rng = np.random.default_rng(seed)
    x = np.linspace(-1, 1, n)
    y = np.polynomial.Polynomial(rng.uniform(-5, 5, 4))(x) + rng.uniform(0, 2) * rng.standard_normal(n)
    expected = np.mean((np.polynomial.Polynomial.fit(x, y, 3)(x) - y) ** 2)
    assert _misfit(x, y, 0, n) == pytest.approx(expected, rel=1e-3, abs=3e-4)  # the diagonal adds to it


def test_a_smooth_curve_is_not_rough_and_a_corner_is() -> None:
    t = np.linspace(-20, 20, 41)
    smooth = np.column_stack((t, 0.02 * t**2 + 1e-4 * t**3))
    corner = np.column_stack((t, 0.7 * np.abs(t)))
    assert _roughness(smooth, 41) < 0.02
    assert _roughness(corner, 41) > 0.3
    assert _roughness(corner, 7) == 0.0  # fewer points than can tell


def two_smooth(kind: str, width: float, length: int = 121, slope: float = 0.35) -> tuple[np.ndarray, np.ndarray]:
    """Return two cables that pass each other along x: crossing straight, or coming close and parting."""
    x = np.arange(float(length)) - length // 2
    if kind == "cross":
        y = slope * x
    else:
        y = np.sqrt((slope * x) ** 2 + (0.05 * width) ** 2) if kind == "corner" else 0.02 * width + 0.004 * x**2
    return np.column_stack((x, y)), np.column_stack((x, -y))


def follow(one: np.ndarray, two: np.ndarray, first: int, last: int, width: float) -> tuple[np.ndarray, float, int]:
    """Share the points from `first` to `last`; the rest leads there and on, sorted by side as in the mask."""
    above = np.where((one[:, 1] >= two[:, 1])[:, None], one, two)
    below = np.where((one[:, 1] >= two[:, 1])[:, None], two, one)
    run = slice(first, last)
    arc = above[run, 0] - above[first, 0]
    separation = np.abs(one[run, 1] - two[run, 1])
    return find_swaps(
        above[run], below[run], arc, separation,
        above[:first][::-1].copy(), below[:first][::-1].copy(), above[last:].copy(), below[last:].copy(), width,
    )  # fmt: skip


@pytest.mark.parametrize("width", [5.0, 12.0])
@pytest.mark.parametrize(("first", "last"), [(50, 71), (30, 91), (0, 121)])
def test_cables_that_cross_change_lanes_in_the_middle(width: float, first: int, last: int) -> None:
    changed, margin, weakest = follow(*two_smooth("cross", width), first, last, width)
    assert abs(weakest - (60 - first)) <= 3
    assert len(changed) == last - first + 1
    middle = 60 - first
    assert not changed[: middle - 3].any()
    assert changed[middle + 3 :].all()
    assert margin > 2.0


@pytest.mark.parametrize("width", [5.0, 12.0])
@pytest.mark.parametrize(("first", "last"), [(50, 71), (30, 91), (0, 121)])
def test_cables_that_touch_and_part_keep_their_lanes(width: float, first: int, last: int) -> None:
    changed, margin, weakest = follow(*two_smooth("touch", width), first, last, width)
    assert 0 <= weakest <= last - first
    assert not changed.any()
    assert np.isfinite(margin)
    assert margin > 0.0


def test_cables_that_stay_apart_take_no_decision() -> None:
    x = np.arange(80.0)
    changed, margin, weakest = follow(np.column_stack((x, x * 0 + 5)), np.column_stack((x, x * 0 - 5)), 20, 60, 10.0)
    assert not changed.any()
    assert weakest == -1
    assert margin == np.inf


def test_two_crossings_change_lanes_and_back() -> None:
    x = np.arange(201.0)
    y = 9.0 * np.sin(2 * np.pi * (x - 50) / 200)  # crosses at 50 and 150
    changed, _, _ = follow(np.column_stack((x, y)), np.column_stack((x, -y)), 0, 201, 10.0)
    assert not changed[:45].any()
    assert changed[56:145].all()
    assert not changed[156:].any()


@pytest.mark.parametrize("kind", ["cross", "touch"])
def test_which_lane_is_called_the_first_does_not_matter(kind: str) -> None:
    one, two = two_smooth(kind, 8.0)
    above = np.where((one[:, 1] >= two[:, 1])[:, None], one, two)
    below = np.where((one[:, 1] >= two[:, 1])[:, None], two, one)
    arc, separation = np.arange(121.0), np.abs(one[:, 1] - two[:, 1])
    there = find_swaps(above, below, arc, separation, *[NOTHING] * 4, 8.0)
    back = find_swaps(below, above, arc, separation, *[NOTHING] * 4, 8.0)
    np.testing.assert_array_equal(there[0], back[0])
    assert there[1] == pytest.approx(back[1])


def test_lanes_lie_half_a_width_inside_of_the_edges() -> None:
    angle = np.linspace(0, 1, 80)
    way = np.column_stack((80 * np.cos(angle), 80 * np.sin(angle)))
    radius = np.linspace(3.0, 30.0, 80)
    shift, arc, separation = offset_axes(way, radius, 8.0)
    np.testing.assert_allclose(separation, np.clip(2 * radius - 8.0, 0.0, 8.0))
    np.testing.assert_allclose(arc, 80 * angle, atol=0.01)
    np.testing.assert_allclose(np.linalg.norm(shift, axis=1), 0.5 * separation, atol=1e-9)
    # The way turns from x to y, so that this side is the inner one.
    inwards = -way / 80
    apart = separation > 0.1
    assert (np.einsum("ij,ij->i", shift, inwards)[apart] > 0.45 * separation[apart]).all()


def ending(goes_on: float, width: float = 8.0, end: int = 80) -> tuple[np.ndarray, np.ndarray]:
    """Return the middle of the mask and the first axis's shift, where one of two straight cables ends at a point.

    `goes_on` is 1 where the cable in the first axis goes on straight, -1 where the other one does.
    """
    x = np.arange(160.0)
    y = np.where(x < end, 0.0, goes_on * 0.5 * width)
    shift = np.column_stack((np.zeros(160), np.full(160, 0.5 * width)))
    return np.column_stack((x, y)), shift


@pytest.mark.parametrize("goes_on", [1.0, -1.0])
def test_the_lane_that_goes_on_is_the_smoother_one(goes_on: float) -> None:
    evidence = continuing_axis(*ending(goes_on), 80, 8.0)
    assert evidence * goes_on > 0.5


def test_where_too_little_is_left_the_survivor_is_not_known() -> None:
    way, shift = ending(1.0)
    assert continuing_axis(way[:85], shift[:85], 80, 8.0) == 0.0
