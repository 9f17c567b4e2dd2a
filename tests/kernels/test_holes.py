"""Holes within one cable, told from ground between cables."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from drawings import EIGHT_VERSIONS, turn
from linking_examples import circle, cross, draw

import dloftbs
from dloftbs import CleaningConfig, Config
from dloftbs.kernels.holes import fill_holes
from dloftbs.stages.cleaning import clean

WIDTHS = pytest.mark.parametrize(("width", "size"), [(12, (480, 640)), (55, (2160, 3840))], ids=["VGA", "4K"])


def glossy(width: int, size: tuple[int, int], share: float = 0.2) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the mask of a bent cable with and without a highlight along it, and its axis."""
    t = np.linspace(-1.0, 1.0, 400)
    axis = np.column_stack((size[1] * (0.5 + 0.42 * t), size[0] * (0.5 + 0.3 * np.sin(3.0 * t))))
    plain = np.zeros(size, np.uint8)
    cv2.polylines(plain, [np.round(axis * 16).astype(np.int32)], False, 1, width, cv2.LINE_8, 4)
    mask = plain.copy()
    for first, last in ((20, 190), (205, 380)):
        line = np.round((axis[first:last] + np.array([0.0, 0.12 * width])) * 16).astype(np.int32)
        cv2.polylines(mask, [line], False, 0, round(share * width), cv2.LINE_8, 4)
    return mask, plain, axis


@WIDTHS
def test_a_highlight_along_a_cable_leaves_it_one(width: int, size: tuple[int, int]) -> None:
    mask, plain, _ = glossy(width, size, 0.3)
    split = dloftbs.detect(mask, Config().replace({"cleaning.fill_holes": False}))
    assert len(split) != 1 or split[0].curve.closed  # its two halves, or one around the highlight
    (found,) = dloftbs.detect(mask)
    assert found.width == pytest.approx(width, rel=0.1)
    (expected,) = dloftbs.detect(plain)
    np.testing.assert_allclose(found.curve.sample(100), expected.curve.sample(100), atol=1.0)


@pytest.mark.parametrize("how", EIGHT_VERSIONS)
def test_all_eight_versions_are_filled_alike(how: tuple[bool, bool, bool]) -> None:
    mask, _, _ = glossy(12, (301, 403))
    patch, other = clean(mask, CleaningConfig()), clean(np.ascontiguousarray(turn(mask, *how)), CleaningConfig())
    assert patch is not None
    assert other is not None
    np.testing.assert_array_equal(patch.posed(patch.pixels), other.posed(other.pixels))


@pytest.mark.parametrize("gap", [2, 4, 6])
def test_ground_between_two_cables_that_meet_twice_stays(gap: int) -> None:
    t = np.linspace(0.0, 1.0, 300)
    x = 20.0 + 560.0 * t
    apart = 0.5 * (12 + gap) * np.tanh(4.0 * np.sin(3.0 * np.pi * t + 0.5))
    mask = draw(np.column_stack((x, 120 + apart)), np.column_stack((x, 120 - apart)), width=12, size=(240, 600))
    assert fill_holes(np.pad(mask, 1)) is None


@pytest.mark.parametrize("radius", [12, 14, 30])
def test_the_inside_of_a_tight_loop_stays(radius: int) -> None:
    mask = draw(circle((200, 120), radius), [(20, 120 - radius), (380, 120 - radius)], width=12)
    assert fill_holes(np.pad(mask, 1)) is None


def test_the_triangle_between_three_cables_stays() -> None:
    mask = draw(*cross(60), [(120, 150), (280, 150)], width=7)
    assert fill_holes(np.pad(mask, 1)) is None


def test_noise_is_not_filled() -> None:
    pixels = np.pad((np.random.default_rng(0).random((600, 800)) < 0.9).astype(np.uint8), 1)
    pixels = cv2.morphologyEx(pixels, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
    assert fill_holes(pixels) is None


def test_the_mask_given_is_not_changed() -> None:
    mask, _, _ = glossy(55, (1080, 1920))
    pixels = np.pad(mask, 1)
    before = pixels.copy()
    filled = fill_holes(pixels)
    assert filled is not None
    assert filled.sum() > before.sum()
    np.testing.assert_array_equal(pixels, before)
