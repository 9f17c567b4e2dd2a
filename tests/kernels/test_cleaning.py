"""What stays of a closing, and what comes back after an opening."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from drawings import EIGHT_VERSIONS, mask_from_text, random_masks, turn
from hypothesis import given
from hypothesis import strategies as st
from scipy import ndimage

from dloftbs.kernels.cleaning import give_back, keep_filled

AROUND = np.ones((3, 3), np.uint8)
NOTCH = 9


def opened(mask: np.ndarray) -> np.ndarray:
    return cv2.morphologyEx(mask, cv2.MORPH_OPEN, AROUND)


def with_kernel(mask: np.ndarray, least: int) -> np.ndarray:
    kept = opened(mask)
    give_back(mask.copy(), kept, least)
    return kept


def filled(mask: np.ndarray, side: int = 3) -> np.ndarray:
    closed = cv2.morphologyEx(mask, cv2.MORPH_CLOSE, np.ones((side, side), np.uint8))
    keep_filled(mask.copy(), closed)
    return closed


def slow_filled(mask: np.ndarray, side: int = 3) -> np.ndarray:
    """Label the background, and look which parts of it the closing fills wholly; then label what else it adds."""
    closed = cv2.morphologyEx(mask, cv2.MORPH_CLOSE, np.ones((side, side), np.uint8))
    result = mask.copy()
    parts, count = ndimage.label(np.pad(mask == 0, 1, constant_values=True))
    parts = parts[1:-1, 1:-1]
    for part in set(range(1, count + 1)) - {*parts[0], *parts[-1], *parts[:, 0], *parts[:, -1]}:
        if closed[parts == part].all():
            result[parts == part] = 1
    notches = np.zeros_like(mask)
    pieces, count = ndimage.label((closed != 0) & (result == 0), AROUND)
    for piece in range(1, count + 1):
        here = pieces == piece
        touched = ndimage.binary_dilation(here, AROUND) & (result != 0)
        notches[here] = here.sum() <= NOTCH and ndimage.label(touched, AROUND)[1] == 1
    return result | notches


def outer_pieces(mask: np.ndarray) -> int:
    return int(ndimage.label(ndimage.binary_fill_holes(mask), AROUND)[1])


def holes(mask: np.ndarray) -> int:
    return int(ndimage.label(np.pad(mask == 0, 1, constant_values=True))[1]) - 1


def slow_give_back(mask: np.ndarray, least: int) -> np.ndarray:
    """Label the pieces, and what each of them touches, by scipy."""
    kept = opened(mask)
    result = kept.copy()
    pieces, count = ndimage.label(mask & ~kept, AROUND)
    for piece in range(1, count + 1):
        here = pieces == piece
        touched = ndimage.binary_dilation(here, AROUND) & (kept != 0)
        if here.sum() >= least or ndimage.label(touched, AROUND)[1] > 1:
            result[here] = 1
    return result


@given(random_masks, st.sampled_from([3, 5, 7]))
def test_what_stays_of_a_closing_agrees_with_labelled_background(mask: np.ndarray, side: int) -> None:
    np.testing.assert_array_equal(filled(mask, side), slow_filled(mask, side))


@given(random_masks)
def test_all_eight_versions_of_a_mask_are_filled_the_same(mask: np.ndarray) -> None:
    for how in EIGHT_VERSIONS:
        turned = np.ascontiguousarray(turn(mask, *how))
        np.testing.assert_array_equal(filled(turned, 5), turn(filled(mask, 5), *how))


@given(random_masks)
def test_filling_joins_only_what_one_encloses_and_makes_no_hole(mask: np.ndarray) -> None:
    again = filled(mask)
    assert (again >= mask).all()
    assert outer_pieces(again) == outer_pieces(mask)
    assert holes(again) <= holes(mask)


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("#####\n##.##\n#####", "#####\n#####\n#####"),  # a pin-hole
        ("#####\n#.#.#\n##.##\n#####", "#####\n#####\n#####\n#####"),  # three that touch by their corners
        ("###.###\n#######\n#######", "#######\n#######\n#######"),  # a notch
    ],
)
def test_holes_and_notches_are_filled(before: str, after: str) -> None:
    mask, expected = (np.pad(mask_from_text(text), 3) for text in (before, after))
    np.testing.assert_array_equal(filled(mask), expected)


@pytest.mark.parametrize("gap", [1, 2])
@pytest.mark.parametrize("width", [1, 2, 3, 12])
def test_a_slit_stays_open(width: int, gap: int) -> None:
    side = np.zeros((60, 80), np.uint8)
    side[20 : 20 + width, 10:70] = 1
    side[20 + width + gap : 50, 40 : 40 + width] = 1  # the end of one at the side of another
    np.testing.assert_array_equal(filled(side), side)
    along = np.zeros((60, 80), np.uint8)
    along[20 : 20 + width, 10:70] = along[20 + width + gap : 20 + 2 * width + gap, 10:70] = 1
    np.testing.assert_array_equal(filled(along), along)


def test_holes_in_a_mask_of_other_values_are_filled() -> None:
    mask = np.full((9, 40), 7, np.uint8)
    mask[:, 20:] = 255
    mask[4, [10, 20, 30]] = 0
    assert filled(mask).all()


@pytest.mark.parametrize("share", [0.1, 0.3, 0.5, 0.7, 0.9])
def test_noise_over_the_whole_mask_is_filled_the_same(share: float) -> None:
    mask = (np.random.default_rng(0).random((60, 81)) < share).astype(np.uint8)
    np.testing.assert_array_equal(filled(mask), slow_filled(mask))


@given(random_masks, st.integers(1, 30))
def test_what_comes_back_agrees_with_labelled_pieces(mask: np.ndarray, least: int) -> None:
    np.testing.assert_array_equal(with_kernel(mask, least), slow_give_back(mask, least))


@given(random_masks)
def test_all_eight_versions_of_a_mask_keep_the_same(mask: np.ndarray) -> None:
    for how in EIGHT_VERSIONS:
        turned = np.ascontiguousarray(turn(mask, *how))
        np.testing.assert_array_equal(with_kernel(turned, 6), turn(with_kernel(mask, 6), *how))


def test_a_long_piece_comes_back_and_a_short_one_does_not() -> None:
    mask = mask_from_text(
        """
        ..........
        .#######..
        ..........
        .###......
        ..........
        """
    )
    kept = with_kernel(mask, 5)
    np.testing.assert_array_equal(kept[1], mask[1])
    assert kept[3].sum() == 0


def test_a_short_piece_between_two_parts_comes_back_and_a_bump_does_not() -> None:
    mask = mask_from_text(
        """
        .....#.......
        .####....####
        .############
        .####....####
        .............
        """
    )
    kept = with_kernel(mask, 10)
    np.testing.assert_array_equal(kept[2], mask[2])
    assert kept[0].sum() == 0


@pytest.mark.parametrize("value", [1, 2, 255])
def test_any_value_is_foreground(value: int) -> None:
    mask = np.zeros((5, 30), np.uint8)
    mask[2, 3:27] = value
    assert (with_kernel(mask, 20) != 0).sum() == 24


def test_more_noise_than_that_is_refused_and_can_be_undone() -> None:
    mask = (np.random.default_rng(0).random((300, 401)) < 0.5).astype(np.uint8)
    closed = cv2.morphologyEx(mask, cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8))
    keep_filled(mask.copy(), closed)
    np.testing.assert_array_equal(closed, mask)
    kept = opened(mask)
    assert not give_back(mask.copy(), kept, 20)
    np.testing.assert_array_equal(opened(kept), opened(mask))
