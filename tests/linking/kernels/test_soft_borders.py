"""What a probability shows ahead of an end and to the sides of a cable, against slow twins."""

from __future__ import annotations

import math

import cv2
import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.ndimage import map_coordinates

from dloftbs.linking.kernels.soft_borders import least_ahead, ridge_values, soft_width

SIZE = (120, 200)

Points = npt.NDArray[np.float64]


def line_of(start: tuple[float, float], stop: tuple[float, float]) -> Points:
    count = max(int(math.dist(start, stop)), 2)
    return np.linspace(start, stop, count)


def slow_ridge(soft: np.ndarray, place: np.ndarray, way: np.ndarray, width: float) -> int:
    """Return the largest value across a place, 0 where there is as much beside it, and -1 off the image."""

    def value(aside: float) -> int | None:
        x, y = np.floor(place + aside * width * np.array([-way[1], way[0]]) + 0.5).astype(int)
        return int(soft[y, x]) if 0 <= y < soft.shape[0] and 0 <= x < soft.shape[1] else None

    across = [value(aside) for aside in (-0.4, -0.2, 0.0, 0.2, 0.4)]
    if None in across:
        return -1
    most = max(across)
    return 0 if any((value(aside) or 0) >= most for aside in (-1.0, 1.0)) else most


def slowly_ahead(points: Points, at_end: bool, soft: np.ndarray, width: float, limit: int) -> int:
    own = points[::-1] if at_end else points
    back = own[min(math.ceil(1.5 * width), len(own) - 1)]
    way = own[0] - back
    if not way.any():
        return -1
    way = way / np.hypot(*way)
    found = []
    for along in (1.0, 1.25, 1.5):
        most = slow_ridge(soft, own[0] + along * width * way, way, width)
        if most < 0:
            return -1
        if most >= limit:
            continue
        sides = [back + side * (along + 0.5) * width * np.array([-way[1], way[0]]) for side in (-1.0, 1.0)]
        border = min(map_coordinates(soft.astype(float), ([y], [x]), order=1, mode="nearest")[0] for x, y in sides)
        found.append(max(most - round(border), 0))
    return min(found, default=-1)


def slow_width(points: Points, soft: np.ndarray, width: float) -> float:
    back = math.ceil(0.5 * width)
    steps = np.arange(math.ceil(width) + 1)
    found = []
    for at in range(0, len(points), back):
        along = points[min(at + back, len(points) - 1)] - points[max(at - back, 0)]
        across = np.array([-along[1], along[0]]) / max(np.hypot(*along), 1e-9)
        total = 0.0
        for sign in (-1.0, 1.0):
            x, y = (points[at] + sign * steps[:, None] * across).T
            values = map_coordinates(soft.astype(float), (y, x), order=1, mode="nearest")
            below = np.flatnonzero(values < 0.5 * values[0])
            if len(below) == 0:
                total += steps[-1]
            else:
                outside, inside = values[below[0]], values[below[0] - 1]
                total += below[0] - 1 + (inside - 0.5 * values[0]) / (inside - outside)
        found.append(total)
    return float(np.median(found))


@st.composite
def scenes(draw: st.DrawFn) -> tuple[Points, np.ndarray, float]:
    seed = draw(st.integers(0, 10_000))
    rng = np.random.default_rng(seed)
    start, stop = rng.uniform((0.0, 0.0), SIZE[::-1]), rng.uniform((0.0, 0.0), SIZE[::-1])
    width = rng.uniform(1.0, 14.0)
    mask = np.zeros(SIZE, np.uint8)
    ends = [np.rint(start).astype(int).tolist(), np.rint(stop).astype(int).tolist()]
    cv2.line(mask, *ends, int(rng.integers(60, 256)), max(round(width), 1))
    soft = cv2.GaussianBlur(mask, None, rng.uniform(0.5, 4.0)) | rng.integers(0, 8, SIZE).astype(np.uint8)
    return line_of(tuple(start), tuple(stop)), soft, width


@given(scenes(), st.booleans(), st.sampled_from([128, 64, 32, 16]))
def test_what_lies_ahead_is_that_of_the_slow_twin(
    scene: tuple[Points, np.ndarray, float], at_end: bool, limit: int
) -> None:
    points, soft, width = scene
    assert least_ahead(points, at_end, soft, width, limit) == slowly_ahead(points, at_end, soft, width, limit)


@given(scenes())
def test_the_width_is_that_of_the_slow_twin(scene: tuple[Points, np.ndarray, float]) -> None:
    points, soft, width = scene
    assert soft_width(points, soft, width) == pytest.approx(slow_width(points, soft, width), abs=1e-6)


@pytest.mark.parametrize("width", [4.0, 9.0, 20.0])
@pytest.mark.parametrize("peak", [255, 60])
def test_a_blurred_bar_is_as_wide_as_it_was(width: float, peak: int) -> None:
    mask = np.zeros(SIZE, np.uint8)
    mask[60 : 60 + int(width)] = peak
    points = line_of((20.0, 59.5 + 0.5 * width), (180.0, 59.5 + 0.5 * width))
    blurred = cv2.GaussianBlur(mask, None, width / 6.0)
    assert soft_width(points, blurred, 1.5 * width) == pytest.approx(width, abs=0.6)


def test_an_end_at_the_border_or_on_another_cable_has_nothing_ahead() -> None:
    soft = np.zeros(SIZE, np.uint8)
    points = line_of((20.0, 60.0), (100.0, 60.0))
    assert least_ahead(points, True, soft, 8.0, 32) == 0
    assert least_ahead(points[:12], False, soft, 14.0, 32) == -1
    soft[57:64, 106:] = 200
    assert least_ahead(points, True, soft, 8.0, 32) == -1
    assert least_ahead(points, True, soft, 8.0, 255) == 200


def test_the_soft_border_of_an_end_or_of_a_cable_beside_it_is_nothing_ahead() -> None:
    mask = np.zeros(SIZE, np.uint8)
    cv2.line(mask, (20, 60), (100, 60), 255, 9)
    blurred = cv2.GaussianBlur(mask, None, 6.0)
    points = line_of((20.0, 60.0), (100.0, 60.0))
    assert blurred[60, 110] > 16
    assert least_ahead(points, True, blurred, 9.0, 128) < 6
    beside = np.zeros(SIZE, np.uint8)
    cv2.line(beside, (20, 76), (190, 76), 255, 9)
    both = np.maximum(blurred, cv2.GaussianBlur(beside, None, 6.0))
    assert both[60, 112] > 10
    assert least_ahead(points, True, both, 9.0, 128) == 0


@given(st.integers(0, 10**6))
def test_values_along_a_curve_are_those_across_each_point(seed: int) -> None:
    rng = np.random.default_rng(seed)
    soft = cv2.GaussianBlur(rng.integers(0, 256, SIZE).astype(np.uint8), None, 3.0)
    cv2.line(soft, (10, 60), (190, 40), int(rng.integers(10, 256)), 7)
    points = (
        line_of(tuple(rng.uniform(-5, 205, 2)), (190.0, 40.0)) if rng.random() < 0.3 else line_of((5, 61), (195, 38))
    )
    width = float(rng.uniform(4, 12))
    expected = []
    for at, point in enumerate(points):
        way = points[min(at + 1, len(points) - 1)] - points[max(at - 1, 0)]
        way = way / np.hypot(*way)
        value = slow_ridge(soft, point, way, width)
        sides = [point + side * width * np.array([-way[1], way[0]]) for side in (-1.0, 1.0)]
        beside = max(map_coordinates(soft.astype(float), ([y], [x]), order=1, mode="nearest")[0] for x, y in sides)
        expected.append(0 if value > 0 and 2.0 * beside >= value else value)
    agree = ridge_values(points, soft, width) == expected
    assert np.count_nonzero(~agree) <= 1  # rounding of places half way between pixels


def test_a_cable_has_a_value_and_its_haze_has_none() -> None:
    soft = np.zeros(SIZE, np.uint8)
    cv2.line(soft, (0, 60), (199, 60), 60, 7)
    along = line_of((20.0, 60.0), (180.0, 60.0))
    assert (ridge_values(along, soft, 7.0) == 60).all()
    assert (ridge_values(along, np.maximum(soft, 30), 7.0) == 0).all()
