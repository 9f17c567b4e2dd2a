"""Colours of cables and their ground against slow twins, and what places that look like them tell."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.evidence.kernels.appearance_pixels import compare_with_ground, sample_appearance
from dloftbs.evidence.kernels.colours import FLOOR

SIZE = (90, 160)
WIDTH = 8.0
GROUND, CABLE, HAND, SHADE = (120, 160, 180), (200, 90, 20), (60, 120, 60), (72, 96, 108)
CURVE = np.stack((np.linspace(10.0, 150.0, 64), np.full(64, 45.0)), axis=1)
EVERYWHERE = np.ones(64, dtype=np.bool_)


def picture(seed: int = 0, noise: float = 3.0) -> tuple[np.ndarray, np.ndarray]:
    """Return an image of a level cable on noisy ground, and its mask."""
    image, mask = np.full((*SIZE, 3), GROUND, np.uint8), np.zeros(SIZE, np.uint8)
    image[41:50], mask[41:50] = CABLE, 1
    grain = np.random.default_rng(seed).normal(0.0, noise, image.shape)
    return np.clip(image + grain, 0, 255).astype(np.uint8), mask


def block(image: np.ndarray, x: float, y: float, half: int) -> np.ndarray | None:
    row, column = int(np.floor(y + 0.5)), int(np.floor(x + 0.5))
    if row < half or column < half or row + half >= image.shape[0] or column + half >= image.shape[1]:
        return None
    square = image[row - half : row + half + 1, column - half : column + half + 1]
    return square.reshape(-1, 3).astype(np.float64).mean(axis=0)


@given(st.integers(0, 10_000))
def test_samples_are_means_of_squares_on_the_cable_and_two_widths_beside_it(seed: int) -> None:
    rng = np.random.default_rng(seed)
    image = rng.integers(0, 256, (*SIZE, 3), dtype=np.uint8)
    mask = (rng.random(SIZE) < 0.02).astype(np.uint8)
    points = 20.0 + np.cumsum(rng.normal(1.0, 2.0, (64, 2)), axis=0)
    seen, width = rng.random(64) < 0.8, float(rng.uniform(3.0, 14.0))
    cable, ground, median = sample_appearance(image, mask, points, seen, width)
    half, clear, aside = int(0.2 * width), 0.25 * width + 1.0, 2.0 * width + 1.0
    cables, grounds = [], []
    for k in range(1, 64, 3):
        if not seen[k]:
            continue
        cables += [b for b in [block(image, *points[k], half)] if b is not None]
        way = points[min(k + 1, 63)] - points[k - 1]
        way /= np.linalg.norm(way)
        for side in (-1.0, 1.0):
            x, y = points[k] + side * aside * np.array([-way[1], way[0]])
            around = [(x, y), (x - clear, y), (x + clear, y), (x, y - clear), (x, y + clear)]
            pixels = [(int(np.floor(b + 0.5)), int(np.floor(a + 0.5))) for a, b in around]
            on_mask = any(0 <= r < SIZE[0] and 0 <= c < SIZE[1] and mask[r, c] for r, c in pixels)
            colour = block(image, x, y, half)
            if not on_mask and colour is not None:
                grounds.append((x, y, *colour))
    np.testing.assert_allclose(cable, np.array(cables).reshape(-1, 3))
    np.testing.assert_allclose(ground, np.array(grounds).reshape(-1, 5))
    np.testing.assert_allclose(median, np.median(cables, axis=0) if cables else np.full(3, np.nan))


def told(image: np.ndarray, mask: np.ndarray, *places: tuple[float, float], before: int = 0) -> list[int]:
    clean = picture()
    appearance = sample_appearance(*clean, CURVE, EVERYWHERE, WIDTH)[:2]
    result = np.full(len(places), before, dtype=np.int64)
    compare_with_ground(image, mask, np.array(places), *appearance, WIDTH, 1, -1, result)
    return result.tolist()


@pytest.mark.parametrize(
    ("colour", "expected"),
    [(GROUND, -1), (HAND, 1), (SHADE, 0), (CABLE, 0), (tuple(c + FLOOR / 3 for c in GROUND), -1)],
)
def test_ground_is_in_sight_a_hand_hides_and_shadow_and_cable_tell_nothing(colour, expected) -> None:
    image, _ = picture(1)
    image[30:60, 60:100] = np.rint(colour).astype(np.uint8)
    assert told(image, np.zeros(SIZE, np.uint8), (80.0, 45.0)) == [expected]


def test_a_place_beside_a_seen_cable_or_told_already_stays_as_it_is() -> None:
    image, mask = picture(1)
    assert told(image, mask, (80.0, 45.0), (80.0, 51.0), (80.0, 70.0)) == [0, 0, -1]
    assert told(image, mask, (80.0, 70.0), before=1) == [1]


def test_a_hand_beside_a_few_samples_makes_it_no_ground() -> None:
    """As it comes over an end: the cable's surroundings have some of it already."""
    image, mask = picture()
    image[:, 128:] = HAND
    cable, ground, _ = sample_appearance(image, mask, CURVE, CURVE[:, 0] < 133.0, WIDTH)
    assert (np.abs(ground[:, 2:] - HAND) < 8.0).all(axis=1).any()
    result = np.zeros(2, dtype=np.int64)
    places = np.array([(145.0, 45.0), (120.0, 70.0)])
    compare_with_ground(image, np.zeros_like(mask), places, cable, ground, WIDTH, 1, -1, result)
    assert result.tolist() == [0, -1]


def test_without_enough_samples_or_a_width_nothing_is_told() -> None:
    image, mask = picture()
    cable, ground, _ = sample_appearance(image, mask, CURVE, EVERYWHERE, WIDTH)
    unknown = sample_appearance(image, mask, CURVE, EVERYWHERE, np.nan)
    assert len(unknown[0]) > 0
    assert len(unknown[1]) == 0
    for arguments in ((cable[:0], ground, WIDTH), (cable, ground[:5], WIDTH), (cable, ground, np.nan)):
        result = np.zeros(1, dtype=np.int64)
        compare_with_ground(image, np.zeros_like(mask), np.array([(80.0, 70.0)]), *arguments, 1, -1, result)
        assert result.tolist() == [0]
