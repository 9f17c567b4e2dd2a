"""DICE of label images against sets of pixels."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from dloftbs.errors import InputError
from dloftbs_lab.evaluation import InstanceScore, dice

images = arrays(np.uint8, (5, 6), elements=st.sampled_from([0, 0, 1, 4, 9]))


def pixel_sets(labels):
    sets = {}
    for index, label in np.ndenumerate(labels):
        if label:
            sets.setdefault(int(label), set()).add(index)
    return sets


def slow_dice(a, b):
    return 2 * len(a & b) / (len(a) + len(b))


def slow_best_total(found, true):
    found, true = list(pixel_sets(found).values()), list(pixel_sets(true).values())
    fewer, more = sorted((found, true), key=len)
    ways = itertools.permutations(more, len(fewer))
    return max(sum(slow_dice(a, b) for a, b in zip(fewer, way, strict=True)) for way in ways)


@given(images, images)
def test_dice_is_what_sets_of_pixels_give(found, true):
    found_sets, true_sets = pixel_sets(found), pixel_sets(true)
    score = dice(found, true)
    assert [instance.true_label for instance in score.instances] == sorted(true_sets)
    for instance in score.instances:
        if instance.found_label is None:
            assert instance.dice == 0.0
        else:
            pixels = found_sets[instance.found_label]
            assert instance.dice == pytest.approx(slow_dice(pixels, true_sets[instance.true_label]))
            assert instance.dice > 0.0
    assert sum(instance.dice for instance in score.instances) == pytest.approx(slow_best_total(found, true))
    given_labels = {instance.found_label for instance in score.instances} - {None}
    assert given_labels | {*score.redundant} == found_sets.keys()
    assert given_labels.isdisjoint(score.redundant)
    if true_sets:
        assert score.mean == pytest.approx(slow_best_total(found, true) / len(true_sets))


@given(images, st.permutations([1, 4, 9]))
def test_which_label_an_instance_has_does_not_matter(true, names):
    renamed = np.zeros_like(true)
    for label, name in zip([1, 4, 9], names, strict=True):
        renamed[true == label] = name
    score = dice(renamed, true)
    assert all(instance.dice == 1.0 for instance in score.instances)
    assert (score.missing, score.redundant) == ((), ())


def test_what_is_missing_counts_as_nothing_and_what_is_redundant_is_listed():
    true = np.array([[1, 1, 0, 2, 2]])
    found = np.array([[7, 0, 3, 0, 0]])
    score = dice(found, true)
    assert score.instances == (InstanceScore(1, 7, pytest.approx(2 / 3)), InstanceScore(2, None, 0.0))
    assert (score.missing, score.redundant) == ((2,), (3,))
    assert score.mean == pytest.approx(1 / 3)


def test_two_merged_instances_leave_one_missing():
    true = np.repeat([[1, 2]], 6, axis=1)
    score = dice(np.ones_like(true), true)
    assert score.mean == pytest.approx((2 * 6 / (6 + 12)) / 2)
    assert len(score.missing) == 1


def test_empty_images_are_values():
    nothing, something = np.zeros((4, 4), dtype=bool), np.eye(4, dtype=bool)
    assert math.isnan(dice(nothing, nothing).mean)
    assert dice(something, nothing).redundant == (1,)
    assert dice(nothing, something).missing == (1,)
    assert dice(nothing, something).mean == 0.0
    assert dice(something, something).mean == 1.0


@pytest.mark.parametrize(
    ("found", "message"),
    [
        (np.zeros((2, 2, 3), dtype=int), r"found_labels must have shape \(H, W\), got \(2, 2, 3\)"),
        (np.zeros((2, 2)), "found_labels must be bool or integer, got float64"),
        (np.full((2, 2), -1), "found_labels must not be negative, got -1"),
        (np.zeros((2, 3), dtype=int), r"same size, got \(2, 3\) and \(2, 2\)"),
    ],
)
def test_images_that_make_no_sense_are_refused(found, message):
    with pytest.raises(InputError, match=message):
        dice(found, np.zeros((2, 2), dtype=int))
