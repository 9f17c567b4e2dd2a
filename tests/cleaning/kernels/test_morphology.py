"""What stays of a closing, and what comes back after an opening."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from drawings import EIGHT_VERSIONS, mask_from_text, random_mask, random_masks, turn
from hypothesis import given
from hypothesis import strategies as st
from scipy import ndimage
from skeletons import as_words, pasted
from thin_parts import AROUND, opened, slow_open_up

from dloftbs.cleaning.kernels.morphology import close, open_up
from dloftbs.kernels.bitmask import cut

NOTCH = 9


def with_kernel(mask: np.ndarray, least: int, most: int = 10**9) -> np.ndarray:
    bitmask, inside, x0, y0, _ = cut(as_words(mask), mask.shape[1], 1)
    return pasted(open_up(bitmask, inside, 1, least, most), x0, y0, mask.shape) if len(bitmask) else mask


def filled(mask: np.ndarray, side: int = 3, most: int = 10**9) -> np.ndarray:
    bitmask, inside, x0, y0, _ = cut(as_words(mask), mask.shape[1], 2 * (side // 2))
    return pasted(close(bitmask, inside, side // 2, most), x0, y0, mask.shape) if len(bitmask) else mask


def slow_closed(mask: np.ndarray, side: int = 3) -> np.ndarray:
    return cv2.morphologyEx(mask, cv2.MORPH_CLOSE, np.ones((side, side), np.uint8))


def slow_filled(mask: np.ndarray, side: int = 3) -> np.ndarray:
    """Label the background, and look which parts of it the closing fills wholly; then label what else it adds."""
    closed = slow_closed(mask, side)
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


@pytest.mark.parametrize("share", [0.1, 0.3, 0.5, 0.7, 0.9])
def test_noise_over_the_whole_mask_is_filled_the_same(share: float) -> None:
    mask = (np.random.default_rng(0).random((60, 81)) < share).astype(np.uint8)
    np.testing.assert_array_equal(filled(mask), slow_filled(mask))


@given(random_masks, st.integers(1, 30))
def test_what_comes_back_agrees_with_labelled_pieces(mask: np.ndarray, least: int) -> None:
    np.testing.assert_array_equal(with_kernel(mask, least), slow_open_up(mask, least))


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


def test_more_noise_than_that_is_left_as_it_is() -> None:
    mask = (np.random.default_rng(0).random((300, 401)) < 0.5).astype(np.uint8)
    added = int(slow_closed(mask).sum() - mask.sum())
    np.testing.assert_array_equal(filled(mask, most=added - 1), mask)
    assert (filled(mask, most=added) != mask).any()
    lost = int(mask.sum() - opened(mask).sum())
    np.testing.assert_array_equal(with_kernel(mask, 20, (lost - 1) // 8), opened(mask))
    assert (with_kernel(mask, 20, lost) != opened(mask)).any()


def test_what_is_lost_in_large_pieces_is_no_noise() -> None:
    mask = (np.random.default_rng(0).random((300, 401)) < 0.3).astype(np.uint8)
    _, _, stats, _ = cv2.connectedComponentsWithStats(mask - opened(mask), connectivity=8)
    sizes = stats[1:, cv2.CC_STAT_AREA]
    small = int(sizes[sizes < 20].sum())
    assert small < sizes.sum()
    np.testing.assert_array_equal(with_kernel(mask, 20, small - 1), opened(mask))
    assert (with_kernel(mask, 20, small) != opened(mask)).any()


def test_without_a_length_nothing_comes_back() -> None:
    mask = random_mask(3, 90)
    np.testing.assert_array_equal(with_kernel(mask, 0), opened(mask))


@pytest.mark.parametrize("width", [63, 64, 65, 127, 128, 200])
@pytest.mark.parametrize("side", [3, 7, 99])
def test_morphology_agrees_with_opencv_where_stripes_meet(width: int, side: int) -> None:
    for seed in range(4):
        rng = np.random.default_rng(seed)
        mask = (cv2.GaussianBlur(rng.random((70, width)), (0, 0), 2.0) > 0.5).astype(np.uint8)
        np.testing.assert_array_equal(filled(mask, side), slow_filled(mask, side))
        bitmask, inside, x0, y0, _ = cut(as_words(mask), width, side // 2)
        square = np.ones((side, side), np.uint8)
        expected = cv2.morphologyEx(mask, cv2.MORPH_OPEN, square)
        opened_up = open_up(bitmask, inside, side // 2, 0, 0)
        np.testing.assert_array_equal(pasted(opened_up, x0, y0, mask.shape), expected)
