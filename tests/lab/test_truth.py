"""The truth of a frame: what may be unknown, what must agree, and the way to JSON and back."""

from __future__ import annotations

import re

import builders
import numpy as np
import pytest

from dloftbs.errors import InputError
from dloftbs_lab.truth import Truth

CURVES = (builders.wave(), builders.arc(40.0, 2.0))
CURVES_3D = (builders.line((0, 0, 1), (0.1, 0, 1)), builders.random_curve(1, ndim=3))
MASK = np.zeros((6, 8), np.bool_)
MASKS = (MASK.copy(), MASK.copy())
MASKS[0][2, 1:5] = True
MASKS[1][4, 3:7] = True


def test_mask_and_labels_are_those_of_all_objects():
    truth = Truth(CURVES, MASKS, (7, 3))
    np.testing.assert_array_equal(truth.mask, MASKS[0] | MASKS[1])
    np.testing.assert_array_equal(truth.labels, MASKS[0] * 1 + MASKS[1] * 2)


def test_masks_may_be_unknown():
    truth = Truth(CURVES, (), (1, 2), CURVES_3D)
    assert (truth.mask, truth.labels) == (None, None)


def test_curves_may_be_unknown_where_masks_are_known():
    assert Truth((), MASKS, (1, 2)).curves == ()


def test_a_frame_may_show_nothing():
    assert Truth((), (), ()).mask is None


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ((CURVES, MASKS, (1,)), "curves must be none or one for each of 1 ids, got 2"),
        ((CURVES[:1], (), (1, 2)), "curves must be none or one for each of 2 ids, got 1"),
        ((CURVES, MASKS[:1], (1, 2)), "visible_masks must be none or one for each of 2 ids, got 1"),
        ((CURVES, (), (1, 2), CURVES_3D[:1]), "curves_3d must be none or one for each of 2 ids, got 1"),
        ((CURVES, (), ()), "curves must be none or one for each of 0 ids, got 2"),
        ((CURVES, (), (1, 1)), "ids must differ, got (1, 1)"),
        (((), (), (1, 2)), "2 ids need curves or visible_masks, got neither"),
        (((), MASKS, (1, 2), CURVES_3D), "curves_3d need the curves in the image too"),
        ((CURVES_3D, (), (1, 2)), "curves must have 2 dimensions"),
        ((CURVES, (), (1, 2), CURVES), "curves_3d must have 3 dimensions"),
        (((), (MASK, MASK[1:]), (1, 2)), "such as (6, 8), got (5, 8) of bool"),
        (((), (MASK.astype(np.uint8),), (1,)), "visible_masks must be bool"),
        (((), (MASK[None],), (1,)), "got (1, 6, 8) of bool"),
    ],
)
def test_what_disagrees_is_refused(fields, message):
    with pytest.raises(InputError, match=re.escape(message)):
        Truth(*fields)


def test_a_truth_survives_json():
    truth = Truth(CURVES, MASKS, (np.int64(7), 3), CURVES_3D)
    back = Truth.from_dict(builders.through_json(truth.to_dict()), MASKS)
    assert (back.curves, back.curves_3d, back.ids) == (truth.curves, truth.curves_3d, truth.ids)
    assert back.visible_masks is MASKS


@pytest.mark.parametrize(
    ("data", "message"),
    [
        ({"ids": [], "curves": []}, "a truth needs the key 'curves_3d', got ['ids', 'curves']"),
        ({"ids": [1], "curves": [{}], "curves_3d": []}, "a curve needs the key 'knots'"),
        ({"ids": 1, "curves": [], "curves_3d": []}, "lists of ids and curves"),
        ({"ids": [1], "curves": [3], "curves_3d": []}, "a curve needs a dictionary"),
        (None, "a truth needs a dictionary as of to_dict, got None"),
        ({"ids": ["1"], "curves": [], "curves_3d": []}, "an id must be an integer"),
        ({"ids": [10**400], "curves": [], "curves_3d": []}, "an id must be an integer"),
    ],
)
def test_broken_values_are_refused(data, message):
    with pytest.raises(InputError, match=re.escape(message)):
        Truth.from_dict(data)


def test_spans_are_those_that_the_mask_shows():
    across = builders.line((1.0, 3.0), (9.0, 3.0))
    mask = np.zeros((6, 8), np.bool_)
    mask[3, :4] = mask[3, 6:] = True
    below, none = Truth((across,), (mask,), (1,)), Truth((across,), (np.zeros((6, 8), np.bool_),), (1,))
    # Columns 4 and 5 are hidden, and beyond column 7 the image ends.
    np.testing.assert_allclose(below.shown_spans, [[(0.0, 0.25), (0.625, 0.75)]])
    assert none.shown_spans == ((),)
    other = np.zeros((6, 8), np.bool_)
    other[3, 4:6] = True
    both = Truth((across, builders.line((4.5, 0.0), (4.5, 5.0))), (mask, other), (1, 2))
    np.testing.assert_allclose(both.shown_spans[0], [(0.0, 0.75)])
    assert Truth((across,), (), (1,)).shown_spans == (((0.0, 1.0),),)
