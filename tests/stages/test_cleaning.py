"""Mask to patch."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from drawings import EIGHT_VERSIONS, mask_from_text, random_mask, random_masks, turn
from hypothesis import given
from hypothesis import strategies as st

from dloftbs import CleaningConfig
from dloftbs.patch import Patch
from dloftbs.stages.cleaning import clean


def to_image(patch: Patch | None, size: tuple[int, int]) -> np.ndarray:
    """Put a patch back into an image of `size`."""
    image = np.zeros(size, dtype=np.uint8)
    if patch is not None:
        (x, y), (h, w) = patch.origin, patch.size
        image[y : y + h, x : x + w] = patch.pixels[1 : h + 1, 1 : w + 1]
    return image


def with_opencv(mask: np.ndarray, open_px: int, close_px: int) -> np.ndarray:
    """Clean the whole image, without any bounding box."""
    mask = (mask != 0).astype(np.uint8)
    mask = cv2.morphologyEx(mask, cv2.MORPH_CLOSE, np.ones((close_px, close_px), np.uint8))
    return cv2.morphologyEx(mask, cv2.MORPH_OPEN, np.ones((open_px, open_px), np.uint8))


@given(random_masks, st.sampled_from([1, 3, 5]), st.sampled_from([1, 3, 7]))
def test_cleaning_the_box_is_cleaning_the_image(mask: np.ndarray, open_px: int, close_px: int) -> None:
    patch = clean(mask, CleaningConfig(open_px=open_px, close_px=close_px))
    np.testing.assert_array_equal(to_image(patch, mask.shape), with_opencv(mask, open_px, close_px))


@given(random_masks)
def test_the_box_is_tight_and_the_margin_empty(mask: np.ndarray) -> None:
    patch = clean(mask, CleaningConfig(open_px=1))
    if patch is None:
        assert not mask.any()
        return
    (h, w), pixels = patch.size, patch.pixels
    inner = pixels[1 : h + 1, 1 : w + 1]
    assert inner[0].any()
    assert inner[-1].any()
    assert inner[:, 0].any()
    assert inner[:, -1].any()
    assert pixels.sum() == inner.sum() == patch.area
    assert pixels.shape[1] % 8 == 0


@pytest.mark.parametrize("dtype", [np.bool_, np.uint8, np.int8, np.uint16, np.int32, np.int64])
def test_any_non_zero_of_any_integer_type_is_cable(dtype: type) -> None:
    mask = random_mask(1, 60).astype(dtype)
    if dtype is not np.bool_:
        mask *= np.array(-7 if np.issubdtype(dtype, np.signedinteger) else 200).astype(dtype)
    before = mask.copy()
    patch = clean(mask, CleaningConfig())
    np.testing.assert_array_equal(to_image(patch, mask.shape), with_opencv(mask, 3, 1))
    np.testing.assert_array_equal(mask, before)


def test_values_that_are_multiples_of_256_are_cable() -> None:
    mask = np.full((9, 9), 256, dtype=np.uint16)
    patch = clean(mask, CleaningConfig())
    assert patch is not None
    assert patch.area == 81


def test_masks_that_are_not_contiguous() -> None:
    mask = random_mask(5, 80)
    for view in (mask[::2, ::3], mask.T, mask[::-1]):
        np.testing.assert_array_equal(to_image(clean(view, CleaningConfig()), view.shape), with_opencv(view, 3, 1))


@pytest.mark.parametrize("mask", [np.zeros((5, 5), bool), np.zeros((0, 7), bool), np.eye(9, dtype=bool)])
def test_nothing_left_is_none(mask: np.ndarray) -> None:
    assert clean(mask, CleaningConfig()) is None


def test_a_closing_fills_pin_holes() -> None:
    mask = np.ones((11, 11), dtype=np.uint8)
    mask[5, 5] = 0
    patch = clean(mask, CleaningConfig(close_px=3))
    assert patch is not None
    assert patch.area == 121


@given(random_masks)
def test_all_eight_versions_of_a_mask_come_into_one_pose(mask: np.ndarray) -> None:
    patches = [clean(np.ascontiguousarray(turn(mask, *how)), CleaningConfig(open_px=1)) for how in EIGHT_VERSIONS]
    first = patches[0]
    for patch in patches[1:]:
        if first is None or patch is None:
            assert first is patch is None
        else:
            np.testing.assert_array_equal(patch.posed(patch.pixels), first.posed(first.pixels))


@pytest.mark.parametrize(
    "text",
    [
        "###\n#..\n#..",  # symmetric about its diagonal
        "#..#\n####\n#..#",  # symmetric about both axes
        "##..\n.##.\n..##",  # symmetric under a half turn only
        "#.#\n.#.\n#.#",
    ],
)
def test_symmetric_masks_come_into_one_pose(text: str) -> None:
    mask = mask_from_text(text)
    views = set()
    for how in EIGHT_VERSIONS:
        patch = clean(np.ascontiguousarray(turn(mask, *how)), CleaningConfig(open_px=1))
        assert patch is not None
        views.add((patch.posed(patch.pixels).shape, patch.posed(patch.pixels).tobytes()))
    assert len(views) == 1


@given(random_masks)
def test_posed_pixels_find_back_to_the_image(mask: np.ndarray) -> None:
    patch = clean(mask, CleaningConfig(open_px=1))
    if patch is None:
        return
    posed_rc = patch.posed_rc(np.flatnonzero(patch.pixels).astype(np.int32))
    assert patch.posed(patch.pixels)[tuple(posed_rc.T)].all()
    assert posed_rc.tolist() == sorted(posed_rc.tolist())
    x, y = patch.to_image(posed_rc[:, ::-1].astype(np.float64)).astype(int).T
    image = np.zeros_like(mask)
    image[y, x] = 1
    np.testing.assert_array_equal(image, mask)
