"""Where the order of a crossing is looked for, and what is made of it, against slow twins."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.fitting.crossings.kernels.crossing_order import (
    ACROSS,
    ALONG,
    PLACES,
    choose_places,
    find_pixels,
    judge_depth,
    judge_image,
)

CELLS = ACROSS * ACROSS
CORE = slice(1, 6)


def depth_verdict(metres: np.ndarray, pixels: np.ndarray, resolution_m: float) -> np.ndarray:
    """Return what the kernel tells of depth (k, PLACES) in metres, stored in half of them."""
    return judge_depth(2.0 * metres, 0.5, 0.5, 1.5, pixels, resolution_m)


def image_verdict(colours: np.ndarray, missing: np.ndarray | None = None) -> np.ndarray:
    """Return what the kernel tells of colours (k, PLACES, 3), but for some places (PLACES,) outside of the image."""
    rows, columns = np.indices(colours.shape[:2])
    if missing is not None:
        rows[:, missing] = columns[:, missing] = -1
    return judge_image(colours.astype(np.uint8), rows, columns)


def places_of(angle: float, width: float = 10.0, reach: float = 200.0, at: float = 0.0) -> np.ndarray:
    """Return the places of two straight lines through (0, 0), the first along x, the second turned by `angle`."""
    s = np.linspace(-reach, reach, 101)
    lines = [s[:, None] * (1.0, 0.0), s[:, None] * (np.cos(angle), np.sin(angle))]
    arc = np.concatenate((s + reach, s + reach))
    first, closed, widths = np.array([0, 101, 202]), np.array([False, False]), np.array([width, width])
    middle = np.full((1, 2), reach + at)
    return choose_places(np.concatenate(lines), arc, first, closed, widths, np.array([[0, 1]]), middle)[0]


@pytest.mark.parametrize("angle", [np.pi / 2, 0.6, -0.9, 2.4])
def test_the_grid_and_the_sides_lie_on_the_same_lines_across(angle: float) -> None:
    places = places_of(angle)
    grid, sides = places[:CELLS].reshape(ACROSS, ACROSS, 2), places[CELLS:].reshape(2, 2, ALONG, ACROSS, 2)
    normals = np.array([[0.0, 1.0], [-np.sin(angle), np.cos(angle)]])
    offsets = np.linspace(-4.0, 4.0, ACROSS)
    np.testing.assert_allclose(grid @ normals[0], np.broadcast_to(offsets[:, None], (ACROSS, ACROSS)), atol=1e-9)
    np.testing.assert_allclose(grid @ normals[1], np.broadcast_to(offsets, (ACROSS, ACROSS)), atol=1e-9)
    for p in range(2):
        np.testing.assert_allclose(sides[p] @ normals[p], np.broadcast_to(offsets, (2, ALONG, ACROSS)), atol=1e-9)
        # The sides do not reach the other object.
        assert np.abs(sides[p] @ normals[1 - p]).min() > 5.0


def test_there_are_no_places_beyond_an_end_or_where_it_is_too_oblique() -> None:
    assert not np.isnan(places_of(1.0)).any()
    assert np.isnan(places_of(1.0, reach=20.0)).any()
    assert np.isnan(places_of(0.2)).all()
    assert np.isnan(places_of(np.pi - 0.2)).all()


def test_pixels_are_the_nearest_ones_inside() -> None:
    places = np.array([[[0.0, 0.0], [2.4, 1.4], [-0.4, -0.4], [-0.6, 0.0], [2.6, 0.0], [0.0, 1.6], [np.nan, 0.0]]])
    rows, columns = find_pixels(places, 2, 3)
    assert rows.tolist() == [[0, 1, 0, -1, -1, -1, -1]]
    assert columns.tolist() == [[0, 2, 0, -1, -1, -1, -1]]


def literal_depth(values: np.ndarray, pixels: float, resolution_m: float) -> float:
    grid, sides = values[:CELLS].reshape(ACROSS, ACROSS), values[CELLS:].reshape(2, 2, ALONG, ACROSS)[..., CORE]
    variance = resolution_m**2 / 12
    expected = np.empty(2)
    for p, own in enumerate(sides):
        pairs = own.mean(axis=0)
        sigma = np.nanmedian(np.abs(np.diff(own, 2, axis=1))) / 0.6745 / 6**0.5
        variance += sigma**2 * np.pi / 4 / min(max(pixels, 1), (~np.isnan(pairs)).sum())
        expected[p] = np.nanmedian(pairs)
    measured = np.nanmedian(grid[CORE, CORE])
    miss = np.abs(measured - expected)
    return float((miss[1] - miss[0]) / max(variance**0.5, 1e-4 * measured**2))


def literal_image(values: np.ndarray) -> float:
    grid, sides = values[:CELLS].reshape(ACROSS, ACROSS, 3), values[CELLS:].reshape(2, 2, ALONG, ACROSS, 3)
    look = np.median(sides, axis=2).mean(axis=1)
    noise = np.sqrt(((sides - look[:, None, None]) ** 2).sum(axis=-1).mean())
    first = np.sqrt(((grid - look[0][:, None]) ** 2).sum(axis=-1).mean())
    second = np.sqrt(((grid - look[1][None]) ** 2).sum(axis=-1).mean())
    return float((second - first) / (max(first, second) + noise))


@given(st.integers(0, 2**31))
def test_the_verdict_on_depth_agrees_with_the_literal_twin(seed: int) -> None:
    rng = np.random.default_rng(seed)
    values = rng.choice([0.99, 1.0, 1.01], (4, 1)) + rng.normal(0, 0.002, (4, PLACES))
    values[:, CELLS : CELLS + 2 * ALONG * ACROSS] += rng.choice([-0.01, 0.0, 0.01], (4, 1))
    bad = rng.random(values.shape) < 0.04
    values[bad] = rng.choice([0.0, 2.0, np.nan, np.inf], bad.sum())
    pixels = rng.uniform(0.5, 100.0, 4)
    known = np.where((values >= 0.5) & (values <= 1.5), values, np.nan)
    expected = [literal_depth(*row, 0.001) for row in zip(known, pixels, strict=True)]
    np.testing.assert_allclose(depth_verdict(values, pixels, 0.001), expected, atol=1e-9)


@given(st.integers(0, 2**31))
def test_the_verdict_on_colours_agrees_with_the_literal_twin(seed: int) -> None:
    rng = np.random.default_rng(seed)
    values = np.floor(rng.uniform(0, 256, (3, PLACES, 3)) * rng.random((3, 1, 3)))
    np.testing.assert_allclose(image_verdict(values), [literal_image(one) for one in values], atol=1e-9)


def test_where_too_much_is_missing_nothing_is_told() -> None:
    values = np.where(np.arange(PLACES) < CELLS + 2 * ALONG * ACROSS, 0.99, 1.0)
    assert depth_verdict(values[None], np.array([9.0]), 0.0)[0] == pytest.approx(0.01 / (1e-4 * 0.99**2))
    for hole in (np.s_[:CELLS], np.s_[CELLS : CELLS + ALONG * ACROSS], np.s_[-ALONG * ACROSS :]):
        holed = values.copy()
        holed[hole] = np.nan
        assert depth_verdict(holed[None], np.array([9.0]), 0.0)[0] == 0.0
        two_kinds = np.repeat(200.0 * (values[None, :, None] == 1.0), 3, axis=2)
        assert image_verdict(two_kinds, np.isnan(holed))[0] == 0.0
        assert image_verdict(two_kinds)[0] != 0.0


@pytest.mark.parametrize("hole", [np.s_[:, 0, 2:], np.s_[0, 1, :4], np.s_[1, :, :, 3:]], ids=["far", "near", "along"])
def test_a_hole_that_leaves_a_part_does_not_matter(hole: tuple[slice, ...]) -> None:
    values = np.where(np.arange(PLACES) < CELLS + 2 * ALONG * ACROSS, 0.99, 1.0)
    sides = values[CELLS:].reshape(2, 2, ALONG, ACROSS)  # a view
    sides += 0.02 * np.array([-1.0, 1.0])[:, None, None] * np.arange(3.0, 3.0 + ALONG)[:, None]
    sides[hole] = np.nan
    values[: CELLS // 2] = np.nan
    assert depth_verdict(values[None], np.array([9.0]), 0.0)[0] == pytest.approx(0.01 / (1e-4 * 0.99**2))


def test_rows_whose_noise_nothing_shows_tell_nothing() -> None:
    """Noise is measured by three rows in a line; here every third one is missing."""
    values = np.where(np.arange(PLACES) < CELLS + 2 * ALONG * ACROSS, 0.99, 1.0)
    values[CELLS:].reshape(2, 2, ALONG, ACROSS)[:, :, 2::3] = np.nan
    assert depth_verdict(values[None], np.array([9.0]), 0.0)[0] == 0.0


def test_a_picture_of_one_colour_tells_nothing() -> None:
    assert image_verdict(np.full((1, PLACES, 3), 80.0))[0] == 0.0
