"""Holes within one cable, told from ground between cables."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from drawings import EIGHT_VERSIONS, turn
from linking_examples import circle, cross, draw
from skeletons import as_words

import dloftbs
from dloftbs import Config
from dloftbs.cleaning import clean
from dloftbs.cleaning.kernels.holes import fill_holes
from dloftbs.config import CleaningConfig
from dloftbs.kernels.bitmask import as_bytes, cut, frame

AROUND = np.ones((3, 3), np.uint8)
WIDTHS = pytest.mark.parametrize(("width", "size"), [(12, (480, 640)), (55, (2160, 3840))], ids=["VGA", "4K"])


NOWHERE = (False, False, False, False)


def with_kernel(mask: np.ndarray, beyond: tuple[bool, bool, bool, bool] = NOWHERE) -> np.ndarray | None:
    """Return a mask with its holes filled, None where there is nothing to fill."""
    bitmask, _, x0, y0, _ = cut(as_words(mask), mask.shape[1], 0)
    _, framed, (left, top, h, w), _ = frame(bitmask)
    found = fill_holes(framed, h, w, beyond)
    if len(found) == 0:
        return None
    filled = mask.copy()
    filled[y0 + top : y0 + top + h, x0 + left : x0 + left + w] = as_bytes(found, h, w)[1 : h + 1, 1 : w + 1]
    return filled


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
    assert as_bytes(fill_holes(framed, h, w, NOWHERE), h, w).sum() > as_bytes(before, h, w).sum()
    np.testing.assert_array_equal(framed, before)


def along(width: int, shine: int, first: float = 0.0, off: float = 0.0) -> np.ndarray:
    """Return a straight cable across a picture, with a highlight from a share of its length on to the right border."""
    mask = np.zeros((200, 400), np.uint8)
    mask[100 - width // 2 : 100 + width // 2] = 1
    top = round(100 + off) - shine // 2
    mask[top : top + shine, int(400 * first) :] = 0
    return mask


@pytest.mark.parametrize("turns", range(4))
@pytest.mark.parametrize("off", [0.0, 4.0])
def test_a_slit_that_the_border_opens_is_filled(turns: int, off: float) -> None:
    mask = np.ascontiguousarray(np.rot90(along(30, 8, 0.4, off), turns))
    crop = clean(mask, CleaningConfig())
    assert crop is not None
    assert crop.pixels.sum() == 30 * 400
    (found,) = dloftbs.detect(mask)
    assert found.width_px == pytest.approx(30, abs=1.5)


def test_two_cables_that_leave_the_picture_side_by_side_stay_two() -> None:
    mask = along(30, 6)
    assert len(dloftbs.detect(mask)) == 2


def test_two_cables_that_part_towards_the_border_stay_apart() -> None:
    x = np.linspace(0.0, 400.0, 200)
    apart = 6.0 + np.clip(x - 200.0, 0.0, None) * 0.03  # a slit of 12 px at the border
    mask = draw(np.column_stack((x, 100 + apart)), np.column_stack((x, 100 - apart)), width=12, size=(200, 400))
    assert with_kernel(mask, (False, False, True, True)) is None


@pytest.mark.parametrize("specks", [0, 3000])
def test_what_lies_far_away_does_not_decide_about_a_highlight(specks: int) -> None:
    mask, plain, _ = glossy(24, (480, 640))
    far = np.zeros((480, 2000), np.uint8)
    junk = np.random.default_rng(0).random((240, 600)) < 0.2
    far[:, 1360:] = np.kron(junk[:, :320], np.ones((2, 2), np.uint8)) if specks else 0
    far[:, :640] = mask
    filled = with_kernel(far)
    assert filled is not None
    alone = with_kernel(mask)
    np.testing.assert_array_equal(filled[:, :640], alone)
    assert (plain & ~alone).sum() < 0.01 * plain.sum()


def test_a_highlight_in_a_thick_cable_that_crosses_a_thin_one_is_filled() -> None:
    mask = along(30, 8)
    mask[96:104, :100] = mask[96:104, 250:] = 1
    mask[:, 320:326] = 1
    filled = with_kernel(mask)
    assert filled is not None
    assert filled[85:115].all()


def test_a_row_of_holes_with_thin_bridges_is_filled() -> None:
    mask = along(30, 8)
    mask[96:104, :100] = mask[96:104, 300:] = mask[96:104, 120:300:20] = mask[96:104, 121:300:20] = 1
    filled = with_kernel(mask)
    assert filled is not None
    assert filled[85:115].all()


def test_a_hole_near_the_end_of_a_cable_is_filled() -> None:
    mask = np.zeros((60, 300), np.uint8)
    mask[20:32, 20:260] = 1
    mask[23:28, 251:256] = 0
    filled = with_kernel(mask)
    assert filled is not None
    assert filled[20:32, 20:260].all()
