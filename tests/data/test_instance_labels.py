"""Label images of a mask per object: every form in which segmenters give it, and what is refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

from dloftbs import InputError
from dloftbs.data.instance_labels import are_masks_of_objects, as_labels, paint
from dloftbs.data.run_lengths import encode

SIZE = (6, 8)
A, B = np.zeros(SIZE, bool), np.zeros(SIZE, bool)
A[1, 1:7] = True
B[0:5, 3] = True
LABELS = np.where(B, 2, A).astype(np.uint16)
"""The smaller of the two, B, lies on top."""


class Result:
    """A segmenter's result as `supervision.Detections` is one."""

    def __init__(self, mask: Any, count: int) -> None:
        self.mask = mask
        self._count = count

    def __len__(self) -> int:
        return self._count


@pytest.mark.parametrize(
    "given",
    [
        [A, B],
        (A, B),
        [A * 255, B.astype(np.uint8)],
        [A[None], B[:, :, None]],
        [A.tolist(), B.tolist()],
        np.stack([A, B]),
        np.stack([A, B]).astype(np.int64),
        np.stack([A, B])[:, None],
        np.stack([A, B])[None],
        np.stack([A, B])[..., None],
        [{"segmentation": A, "area": 6}, {"segmentation": B}],
        [{"segmentation": encode(A)}, {"segmentation": encode(B)}],
        [{"segmentation": encode(A)}, {"segmentation": {**encode(B), "counts": encode(B)["counts"].encode()}}],
        [{"segmentation": {"size": [6, 8], "counts": [7, 1, 5, 1, 5, 1, 5, 1, 5, 1, 5, 1, 10]}}, encode(B)],
        Result(np.stack([A, B]), 2),
        LABELS,
        LABELS.astype(np.int64),
        LABELS.astype(np.uint8)[..., None],
        LABELS.tolist(),
    ],
)
def test_every_form_gives_the_same_label_image(given):
    labels = as_labels(given)
    assert labels.dtype == np.uint16
    np.testing.assert_array_equal(labels, LABELS)
    np.testing.assert_array_equal(as_labels(given, SIZE), LABELS)


def test_a_label_image_keeps_its_numbers_and_one_of_16_bits_is_not_copied():
    labels = np.zeros(SIZE, np.uint16)
    labels[2], labels[4] = 300, 65535
    assert as_labels(labels) is labels
    np.testing.assert_array_equal(as_labels(labels.astype(np.uint32)), labels)
    np.testing.assert_array_equal(as_labels(A), A)  # the mask of one object


def test_smaller_masks_lie_on_top_and_of_equal_ones_the_later():
    large, small = np.ones(SIZE, bool), np.zeros(SIZE, bool)
    small[2:4] = True
    for masks, inside, outside in (([large, small], 2, 1), ([small, large], 1, 2), ([small, small, large], 2, 3)):
        labels = as_labels(masks)
        assert (labels[2, 2], labels[0, 0]) == (inside, outside)
    assert as_labels([np.zeros(SIZE, bool), small])[2, 0] == 2  # an empty one keeps its number


@given(arrays(np.uint8, array_shapes(min_dims=2, max_dims=2, min_side=1, max_side=12), elements=st.integers(0, 4)))
def test_masks_of_a_label_image_give_it_back(labels):
    masks = [labels == number for number in range(1, 5)]
    np.testing.assert_array_equal(as_labels(masks), labels)
    np.testing.assert_array_equal(as_labels([{"segmentation": encode(mask)} for mask in masks]), labels)
    np.testing.assert_array_equal(as_labels(labels), labels)
    np.testing.assert_array_equal(paint(iter(masks)), labels)


@pytest.mark.parametrize(
    "given", [[], (), np.zeros((0, *SIZE), bool), Result(None, 0), Result(np.zeros((0, *SIZE), bool), 0)]
)
def test_no_object_is_ground_alone_where_the_size_is_known(given):
    np.testing.assert_array_equal(as_labels(given, SIZE), np.zeros(SIZE))


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ([], r"an empty list, of which nothing says the size; give the image beside, or zeros \(H, W\)"),
        (Result(None, 0), "nothing says the size"),
        (Result(None, 3), r"this Result has no masks \(mask is None\); a detector of boxes gives none"),
        (Result(5, 1), r"the mask of Result must be a stack \(N, H, W\), got 5"),
        ([A, B[:5]], r"instances\[1\] must have the size \(6, 8\) .* got \(5, 8\)"),
        ([A, B * 0.5], r"instances\[1\] must be bool or integer, got float64; threshold it first: x > 0\.5"),
        (np.stack([A, B]) * 0.5, r"instances must be bool or integer, got float64; threshold it first"),
        (LABELS * 1.0, "instances must be bool or integer, got float64"),
        (LABELS.astype(int) - 1, r"at least 0, the ground, got -1; add 1 where -1 is the ground"),
        (LABELS.astype(int) * 40000, "at most 65535, got 80000; number them anew"),
        (np.zeros((6, 8, 3), np.uint8), r"instances must be a label image .* got a picture in colour, \(6, 8, 3\)"),
        (np.zeros((2, 2, 2, 6, 8), bool), r"got \(2, 2, 2, 6, 8\) of bool"),
        ([A, np.zeros((2, 6, 8), bool)], r"instances\[1\] must be a mask \(H, W\), got \(2, 6, 8\)"),
        ({"segmentation": A}, "put one dictionary into a list"),
        ([{"mask": A}], r"instances\[0\] must have the key 'segmentation', as SAM's do"),
        ([{"segmentation": [[1.0, 2.0, 5.0, 2.0, 5.0, 6.0]]}], r"\['segmentation'\] is a polygon; .* a file of COCO"),
        ([{"segmentation": {"size": [6, 8], "counts": [1, 2]}}], "must add up to 6 \\* 8"),
        ([A, None], r"instances\[1\] is None"),
        ("masks.png", "instances must be a label image"),
        (5, "instances must be a label image"),
        (object(), "instances must be a label image"),
    ],
)
def test_what_is_refused_says_what_to_do(given, message):
    with pytest.raises(InputError, match=message):
        as_labels(given)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ([A[:5]], r"instances\[0\] must have the size \(6, 8\)"),
        (LABELS[:5], r"instances must have the size \(6, 8\)"),
        (np.stack([A, B], axis=2), r"masks come first: x\.transpose\(2, 0, 1\)"),
        # No pixel is made of what says another size.
        (
            [{"segmentation": {"size": [60000, 60000], "counts": [3600000000]}}],
            r"\['segmentation'\] must have the size",
        ),
    ],
)
def test_another_size_than_the_frame_is_refused(given, message):
    with pytest.raises(InputError, match=message):
        as_labels(given, SIZE)


def test_more_objects_than_numbers_are_refused():
    pixel = np.ones((1, 1), bool)
    with pytest.raises(InputError, match="at most 65535 instances"):
        paint(pixel for _ in range(65536))


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        ([{"segmentation": A}], True),
        (Result(np.stack([A, B]), 2), True),
        ([], False),
        ([A, B], False),
        (np.stack([A, B]), False),
        (np.ma.masked_array(np.stack([A, B]), np.stack([A, B])), False),
        ([{"mask": A}], False),
        (None, False),
    ],
)
def test_what_can_only_be_masks_of_objects_is_known(value, expected):
    assert are_masks_of_objects(value) is expected
