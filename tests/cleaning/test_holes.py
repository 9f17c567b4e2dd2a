"""Holes within one cable, told from ground between cables."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from drawings import EIGHT_VERSIONS, turn
from linking_examples import circle, cross, draw
from scipy import ndimage
from skeletons import framed_bitmask

import dloftbs
from dloftbs import Config
from dloftbs.cleaning import clean
from dloftbs.cleaning.holes import _distances, fill_holes
from dloftbs.cleaning.kernels.narrow_ground import find_narrow_ground
from dloftbs.config import CleaningConfig

NOWHERE = (False, False, False, False)
AROUND = np.ones((3, 3), np.uint8)
WIDTHS = pytest.mark.parametrize(("width", "size"), [(12, (480, 640)), (55, (2160, 3840))], ids=["VGA", "4K"])


def filled(mask: np.ndarray) -> np.ndarray | None:
    """Return a mask with its highlights filled, None where there is nothing to fill."""
    framed = framed_bitmask(mask)
    return fill_holes(np.pad(mask, 1), find_narrow_ground(framed, *mask.shape, 0, 0), NOWHERE)


def filled_slowly(mask: np.ndarray) -> np.ndarray | None:
    """Return the same where every piece is looked at."""
    pixels = np.pad(mask, 1)
    count, labels = cv2.connectedComponents(pixels)
    places = [(*np.argwhere(labels == k)[0], 1) for k in range(1, count)]
    return fill_holes(pixels, np.array(places), NOWHERE)


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


@pytest.mark.large
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


@pytest.mark.large
@pytest.mark.parametrize("seed", range(0, 60, 3))
def test_bundles_are_filled_alike_however_they_are_turned(seed: int) -> None:
    crop = clean(bundle(seed), CleaningConfig())
    assert crop is not None
    for how in EIGHT_VERSIONS:
        other = clean(np.ascontiguousarray(turn(bundle(seed), *how)), CleaningConfig())
        assert other is not None
        np.testing.assert_array_equal(crop.oriented(crop.pixels), other.oriented(other.pixels))


@pytest.mark.large
def test_in_noise_nothing_is_looked_at() -> None:
    noise = (np.random.default_rng(0).random((1000, 1500)) < 0.9).astype(np.uint8)
    opened = cv2.morphologyEx(noise, cv2.MORPH_OPEN, AROUND)
    assert len(find_narrow_ground(framed_bitmask(opened), *opened.shape, 0, 0)) == 0


@pytest.mark.parametrize("gap", [2, 4, 6])
def test_ground_between_two_cables_that_meet_twice_stays(gap: int) -> None:
    t = np.linspace(0.0, 1.0, 300)
    x = 20.0 + 560.0 * t
    apart = 0.5 * (12 + gap) * np.tanh(4.0 * np.sin(3.0 * np.pi * t + 0.5))
    mask = draw(np.column_stack((x, 120 + apart)), np.column_stack((x, 120 - apart)), width=12, size=(240, 600))
    assert filled(mask) is None


@pytest.mark.parametrize("radius", [12, 14, 30])
def test_the_inside_of_a_tight_loop_stays(radius: int) -> None:
    mask = draw(circle((200, 120), radius), [(20, 120 - radius), (380, 120 - radius)], width=12)
    assert filled(mask) is None


def test_the_inside_of_a_loop_that_a_hand_holds_stays() -> None:
    t = np.linspace(0.0, 2.0 * np.pi, 100)
    mask = draw(np.column_stack((52.0 + 34.0 * np.cos(t), 85.0 + 65.0 * np.sin(t))), width=14, size=(227, 131))
    mask[14:82, :34] = 1
    assert filled(mask) is None


def test_the_triangle_between_three_cables_stays() -> None:
    mask = draw(*cross(60), [(120, 150), (280, 150)], width=7)
    assert filled(mask) is None


def test_noise_stays_noise() -> None:
    pixels = (np.random.default_rng(0).random((600, 800)) < 0.9).astype(np.uint8)
    noise = cv2.morphologyEx(pixels, cv2.MORPH_OPEN, AROUND)
    assert filled(noise) is None


@pytest.mark.large
def test_every_piece_with_something_to_fill_is_looked_at() -> None:
    count = 0
    for seed in range(150):
        mask = bundle(seed)
        expected, found = filled_slowly(mask), filled(mask)
        if expected is not None:
            count += 1
            np.testing.assert_array_equal(found, expected)
    assert count > 20


def test_a_slit_that_the_border_opens_is_filled() -> None:
    mask = np.zeros((100, 300), np.uint8)
    mask[30:70, :280] = 1
    mask[44:52, :200] = 0
    crop = clean(mask, CleaningConfig())
    assert crop is not None
    assert crop.pixels[1:41, 1:281].all()


@pytest.mark.parametrize("gap", [3, 6])
def test_two_cables_that_leave_the_image_side_by_side_stay_two(gap: int) -> None:
    mask = np.zeros((200, 400), np.uint8)
    t = np.linspace(0.0, 1.0, 100)
    for side in (-1.0, 1.0):
        y = 100.0 + side * (0.5 * (12 + gap) * np.clip(8.0 * (0.5 - t), -12.0, 1.0))
        cv2.polylines(mask, [np.column_stack((400 * t, y)).round().astype(np.int32)], False, 1, 12)
    crop, open_ = clean(mask, CleaningConfig()), clean(mask, CleaningConfig(fill_holes=False))
    assert crop is not None
    assert open_ is not None
    np.testing.assert_array_equal(crop.pixels, open_.pixels)


@pytest.mark.parametrize("angle", [10, 15, 20, 30, 45, 60, 90])
def test_corners_of_crossings_stay(angle: int) -> None:
    direction = 180.0 * np.array([np.cos(np.deg2rad(angle)), np.sin(np.deg2rad(angle))])
    mask = draw([(20, 200), (380, 200)], [200 - direction, 200 + direction], width=12, size=(400, 400))
    assert filled(mask) is None


def test_what_lies_elsewhere_does_not_matter() -> None:
    mask, _, _ = glossy(24, (300, 500))
    threads = np.zeros((300, 200), np.uint8)
    threads[20:280, 20:180:8] = 1
    beside = np.hstack((mask, threads))
    found = filled(beside)
    assert found is not None
    np.testing.assert_array_equal(found[1:-1, 1:501], filled(mask)[1:-1, 1:-1])
    np.testing.assert_array_equal(found[1:-1, 501:-1], threads)


@pytest.mark.large
def test_what_is_longer_than_opencv_counts_stays_as_it_is() -> None:
    mask = np.zeros((20, 1 << 16), np.uint8)
    mask[4:16] = 1
    mask[9:11, 100:-100] = 0
    assert filled(mask) is None
    assert filled(np.ascontiguousarray(mask[:, :3000])) is not None


def test_a_speck_within_a_highlight_does_not_keep_it_open() -> None:
    mask = np.zeros((120, 400), np.uint8)
    mask[30:90, 20:380] = 1
    mask[50:66, 100:300] = 0
    mask[55:61, 190:200] = 1
    found = filled(mask)
    assert found is not None
    assert found[31:91, 21:381].all()


def test_the_mask_given_is_not_changed() -> None:
    mask, _, _ = glossy(28, (540, 960))
    before = np.pad(mask, 1)
    pixels = before.copy()
    found = fill_holes(pixels, find_narrow_ground(framed_bitmask(mask), *mask.shape, 0, 0), NOWHERE)
    assert found is not None
    assert found.sum() > before.sum()
    np.testing.assert_array_equal(pixels, before)


@pytest.mark.parametrize("seed", range(20))
def test_distances_are_exact_and_so_the_same_each_time(seed: int) -> None:
    rng = np.random.default_rng(seed)
    smooth = ndimage.gaussian_filter(rng.standard_normal((rng.integers(20, 120), rng.integers(20, 120))), 4.0)
    mask = np.pad((smooth > 0.0).astype(np.uint8), 1)
    exact = ndimage.distance_transform_edt(mask).astype(np.float32)
    for _ in range(4):
        np.testing.assert_array_equal(_distances(mask), exact)
