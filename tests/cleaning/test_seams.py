"""Seams between the masks of objects."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from dloftbs.cleaning import open_seams

_LABELS = arrays(np.uint16, st.tuples(st.integers(1, 12), st.integers(1, 12)), elements=st.integers(0, 3))


def slow_seams(mask: np.ndarray, labels: np.ndarray) -> np.ndarray:
    """Return what `open_seams` does to a mask of the labels alone, pixel by pixel."""
    opened = mask.copy()
    for row, column in np.argwhere(labels > 0):
        around = labels[max(row - 1, 0) : row + 2, max(column - 1, 0) : column + 2]
        if around.max() > labels[row, column]:
            opened[row, column] = 0
    return opened


@given(_LABELS)
def test_no_pixel_that_is_left_touches_one_of_another_object(labels: np.ndarray) -> None:
    mask = labels > 0
    opened = open_seams(mask, labels)
    np.testing.assert_array_equal(opened, slow_seams(mask, labels))
    assert opened.dtype == mask.dtype
    _, pieces = cv2.connectedComponents(opened.astype(np.uint8), connectivity=8)
    for piece in range(1, pieces.max() + 1):
        assert len(np.unique(labels[pieces == piece])) == 1


@given(_LABELS)
def test_the_highest_object_stays_and_nothing_that_is_given_changes(labels: np.ndarray) -> None:
    mask, before = np.full(labels.shape, 255, np.uint8), labels.copy()
    opened = open_seams(mask, labels)
    assert (opened[labels == labels.max()] == 255).all()
    assert (mask == 255).all()
    np.testing.assert_array_equal(labels, before)


@pytest.mark.parametrize(("apart", "pieces"), [(0, 2), (4, 2), (6, 2), (7, 1), (20, 1)])
def test_mask_between_two_objects_is_parted_where_both_are_near(apart: int, pieces: int) -> None:
    mask, labels = np.ones((9, 60), np.uint8), np.zeros((9, 60), np.uint16)
    labels[:, :20], labels[:, 20 + apart :] = 1, 2
    count, _ = cv2.connectedComponents(open_seams(mask, labels), connectivity=8)
    assert count - 1 == pieces


@pytest.mark.parametrize("dtype", [np.bool_, np.uint8, np.int32])
def test_a_mask_without_seams_is_the_same_array(dtype: type) -> None:
    labels = np.zeros((9, 9), np.uint16)
    labels[1:3], labels[5:7] = 1, 2
    mask = (labels > 0).astype(dtype)
    assert open_seams(mask, labels) is mask


def test_labels_beyond_the_mask_do_not_count() -> None:
    mask, labels = np.zeros((9, 9), bool), np.ones((9, 9), np.uint16)
    mask[3:6], labels[:3], labels[6:] = True, 2, 3
    assert open_seams(mask, labels) is mask


@pytest.mark.parametrize("size", [(0, 0), (0, 7), (1, 1), (1, 7)])
def test_the_smallest_masks(size: tuple[int, int]) -> None:
    mask = np.ones(size, np.uint8)
    assert open_seams(mask, np.ones(size, np.uint16)) is mask
