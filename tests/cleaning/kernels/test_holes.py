"""Holes within one cable, told from ground between cables."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from drawings import EIGHT_VERSIONS, turn
from linking_examples import circle, cross, draw
from scipy import ndimage
from skeletons import as_words

import dloftbs
from dloftbs import Config
from dloftbs.cleaning import clean
from dloftbs.cleaning.kernels.holes import fill_holes
from dloftbs.config import CleaningConfig
from dloftbs.kernels.bitmask import as_bytes, cut, frame

AROUND = np.ones((3, 3), np.uint8)
WIDTHS = pytest.mark.parametrize(("width", "size"), [(12, (480, 640)), (55, (2160, 3840))], ids=["VGA", "4K"])


def with_kernel(mask: np.ndarray, flip_x: bool = False, flip_y: bool = False) -> np.ndarray | None:
    """Return a mask with its holes filled, None where there is nothing to fill."""
    bitmask, _, x0, y0, _ = cut(as_words(mask), mask.shape[1], 0)
    _, framed, (left, top, h, w), _ = frame(bitmask)
    found = fill_holes(framed, h, w, flip_x, flip_y)
    if len(found) == 0:
        return None
    filled = mask.copy()
    filled[y0 + top : y0 + top + h, x0 + left : x0 + left + w] = as_bytes(found, h, w)[1 : h + 1, 1 : w + 1]
    return filled


def slow_fill(mask: np.ndarray, flip_x: bool = False, flip_y: bool = False) -> np.ndarray | None:
    """Label the ground, follow the outlines, and measure all distances; for masks without anything within holes."""
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    box = slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1)
    framed = np.pad(mask[box], 1)
    top, left = (framed.shape[0] - 1) % 2 if flip_y else 0, (framed.shape[1] - 1) % 2 if flip_x else 0
    coarse = np.pad(framed[top::2, left::2], 1)
    likely = slow_within(coarse, np.inf, 0.5)
    if not likely.any():
        return None
    away = np.maximum(ndimage.distance_transform_edt(coarse | likely) - 0.5, 0.0)
    single = 2.0 * float(np.quantile(away[(away > 0.0) & (away >= cv2.dilate(away, AROUND))], 0.15))
    if not slow_within(coarse, single, 0.5).any():
        return None
    within = slow_within(framed, 2.0 * single, 0.0)
    filled = mask.copy()
    filled[box] |= within[1:-1, 1:-1]
    return filled if within.any() else None


def slow_within(mask: np.ndarray, single: float, error: float) -> np.ndarray:
    outlines, hierarchy = cv2.findContours(mask, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    inner = [outlines[k] for k in np.flatnonzero(hierarchy[0, :, 3] >= 0)]
    sizes = [cv2.contourArea(outline) - 0.5 * len(outline) + 1.0 for outline in inner]
    area, length, narrow = int(mask.sum()), sum(map(len, outlines)), np.zeros_like(mask)
    for outline, size in zip(inner, sizes, strict=True):
        if size * sum(map(len, outlines)) < 2.0 * int(mask.sum()) * len(outline):
            area, length = area + int(size), length - len(outline)
            cv2.drawContours(narrow, [outline], -1, 1, cv2.FILLED)
    away = np.maximum(ndimage.distance_transform_edt(mask | narrow) - 0.5, 0.0)
    parts, count = ndimage.label(narrow & ~mask)
    deepest = 0.85 * min(2.0 * area / length, single) + error
    within = [k for k in range(1, count + 1) if away[parts == k].max() <= deepest]
    if error == 0.0:
        across = 2.0 * ndimage.distance_transform_edt(parts) - 1.0
        within = [k for k in within if across[parts == k].max() <= away[parts == k].max()]
    return np.isin(parts, within).astype(np.uint8)


def bundle(seed: int) -> np.ndarray:
    """Return a mask of bent cables that touch and cross, some with highlights."""
    rng = np.random.default_rng(seed)
    mask, shine = np.zeros((2, 220, 300), np.uint8)
    t = np.linspace(0.0, 1.0, 120)
    for _ in range(int(rng.integers(1, 6))):
        coefficients = rng.uniform(-60.0, 60.0, (3, 2))
        axis = rng.uniform((60.0, 40.0), (240.0, 180.0)) + np.stack((t, t**2, t**3), axis=1) @ coefficients * 3.0
        width = int(rng.integers(3, 30))
        cv2.polylines(mask, [np.round(axis).astype(np.int32)], False, 1, width)
        first = int(rng.integers(0, 100))
        cv2.polylines(shine, [np.round(axis[first : first + 15]).astype(np.int32)], False, 1, max(width // 4, 1))
    mask[shine != 0] = 0
    opened = cv2.morphologyEx(mask, cv2.MORPH_OPEN, AROUND)
    pieces, _ = ndimage.label(opened, AROUND)
    largest = (pieces == np.argmax(np.bincount(pieces.ravel())[1:]) + 1).astype(np.uint8)
    return largest


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
    split = dloftbs.detect(mask, config=Config().replace({"cleaning.fill_holes": False}))
    assert len(split) != 1 or split[0].curve.closed  # its two halves, or one around the highlight
    (found,) = dloftbs.detect(mask)
    assert found.width_px == pytest.approx(width, rel=0.1)
    (expected,) = dloftbs.detect(plain)
    np.testing.assert_allclose(found.curve.sample(100), expected.curve.sample(100), atol=1.0)


@pytest.mark.parametrize("how", EIGHT_VERSIONS)
def test_all_eight_versions_are_filled_alike(how: tuple[bool, bool, bool]) -> None:
    mask, _, _ = glossy(12, (301, 403))
    crop, other = clean(mask, CleaningConfig()), clean(np.ascontiguousarray(turn(mask, *how)), CleaningConfig())
    assert crop is not None
    assert other is not None
    np.testing.assert_array_equal(crop.oriented(crop.pixels), other.oriented(other.pixels))


@pytest.mark.parametrize("gap", [2, 4, 6])
def test_ground_between_two_cables_that_meet_twice_stays(gap: int) -> None:
    t = np.linspace(0.0, 1.0, 300)
    x = 20.0 + 560.0 * t
    apart = 0.5 * (12 + gap) * np.tanh(4.0 * np.sin(3.0 * np.pi * t + 0.5))
    mask = draw(np.column_stack((x, 120 + apart)), np.column_stack((x, 120 - apart)), width=12, size=(240, 600))
    assert with_kernel(mask) is None


@pytest.mark.parametrize("radius", [12, 14, 30])
def test_the_inside_of_a_tight_loop_stays(radius: int) -> None:
    mask = draw(circle((200, 120), radius), [(20, 120 - radius), (380, 120 - radius)], width=12)
    assert with_kernel(mask) is None


def test_the_inside_of_a_loop_that_a_hand_holds_stays() -> None:
    t = np.linspace(0.0, 2.0 * np.pi, 100)
    mask = draw(np.column_stack((52.0 + 34.0 * np.cos(t), 85.0 + 65.0 * np.sin(t))), width=14, size=(227, 131))
    mask[14:82, :34] = 1
    assert with_kernel(mask) is None


def test_the_triangle_between_three_cables_stays() -> None:
    mask = draw(*cross(60), [(120, 150), (280, 150)], width=7)
    assert with_kernel(mask) is None


def test_noise_is_not_filled() -> None:
    pixels = (np.random.default_rng(0).random((600, 800)) < 0.9).astype(np.uint8)
    assert with_kernel(cv2.morphologyEx(pixels, cv2.MORPH_OPEN, AROUND)) is None


@pytest.mark.parametrize("flips", [(False, False), (True, False), (False, True), (True, True)])
def test_what_is_filled_agrees_with_outlines_and_distances(flips: tuple[bool, bool]) -> None:
    filled = 0
    for seed in range(60):
        mask = bundle(seed)
        expected, found = slow_fill(mask, *flips), with_kernel(mask, *flips)
        assert (found is None) == (expected is None)
        if expected is not None:
            filled += 1
            np.testing.assert_array_equal(found, expected)
    assert filled > 10


def test_a_speck_within_a_highlight_does_not_keep_it_open() -> None:
    mask = np.zeros((120, 400), np.uint8)
    mask[30:90, 20:380] = 1
    mask[50:66, 100:300] = 0
    mask[55:61, 190:200] = 1
    filled = with_kernel(mask)
    assert filled is not None
    assert filled[30:90, 20:380].all()


def test_the_mask_given_is_not_changed() -> None:
    mask, _, _ = glossy(55, (1080, 1920))
    bitmask, _, _, _, _ = cut(as_words(mask), mask.shape[1], 0)
    _, framed, (_, _, h, w), _ = frame(bitmask)
    before = framed.copy()
    assert as_bytes(fill_holes(framed, h, w, False, False), h, w).sum() > as_bytes(before, h, w).sum()
    np.testing.assert_array_equal(framed, before)
