"""Joints whose curve leaves the mask."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from builders import curve_through

from dloftbs import Centerline, Joint, JointKind, NearJoint, Segment
from dloftbs.cleaning import clean
from dloftbs.config import CleaningConfig
from dloftbs.data.mask_crop import MaskCrop
from dloftbs.fitting.seen_joints import mark_unseen_joints

CROSSING, GAP = JointKind.CROSSING, JointKind.GAP
WIDTH = 6
LEFT, RIGHT = np.arange(20.0, 81.0), np.arange(120.0, 181.0)


def crop_of(*, blob: bool) -> MaskCrop:
    """Return a straight cable from x = 20 to 180, which lies in a blob in the middle or is alone there."""
    mask = np.zeros((100, 200), np.uint8)
    mask[47:54, 17:184] = 1
    if blob:
        mask[20:54, 80:121] = 1
    crop = clean(mask, CleaningConfig())
    assert crop is not None
    return crop


def line_of(kind: JointKind = CROSSING) -> Centerline:
    parts = [Segment(np.column_stack((x, np.full_like(x, 50.0))), np.full_like(x, 3.5)) for x in (LEFT, RIGHT)]
    return Centerline(
        tuple(parts), (Joint(kind, (0.375, 0.625), 0.1, 1.0, 0.8),), near_joints=(NearJoint(1.0, (250.0, 50.0), 0.3),)
    )


def bulging(height: float):
    """Return a curve along the line that bulges to a height above it between the two segments."""
    x = np.concatenate((LEFT[::4], np.arange(84.0, 120.0, 4.0), RIGHT[::4]))
    between = (x > 80.0) & (x < 120.0)
    return curve_through(
        np.column_stack((x, 50.0 - height * np.where(between, np.sin(np.pi * (x - 80.0) / 40.0), 0.0)))
    )


@pytest.mark.parametrize(("height", "blob", "seen"), [(0.0, False, True), (14.0, True, True), (14.0, False, False)])
def test_a_joint_is_a_gap_where_the_curve_leaves_the_mask(height: float, blob: bool, seen: bool) -> None:
    line = line_of()
    marked = mark_unseen_joints(line, bulging(height), crop_of(blob=blob))
    assert (marked is line) == seen
    assert marked.joints[0].kind is (CROSSING if seen else GAP)
    assert marked.joints[0].u == line.joints[0].u
    assert (marked.confidence, marked.width_px, marked.segments) == (line.confidence, line.width_px, line.segments)
    np.testing.assert_array_equal(marked.u, line.u)


def test_the_gap_goes_on_until_the_curve_is_on_the_mask_again() -> None:
    (joint,) = line_of().joints
    line = Centerline(line_of().segments, (replace(joint, u=(0.43, 0.57)),))
    (low, high) = mark_unseen_joints(line, bulging(14.0), crop_of(blob=False)).joints[0].u
    assert low < 0.43
    assert high > 0.57
    beside = bulging(14.0)(np.array([low, high])) - 50.0
    assert np.abs(beside[:, 1]).max() < 7.5  # the mask is 3.5 px to either side, and half a width beside it counts


def test_a_gap_begins_and_ends_where_the_curve_leaves_the_mask() -> None:
    mask = np.zeros((100, 200), np.uint8)
    mask[47:54, 17:88] = mask[47:54, 113:184] = 1
    crop = clean(mask, CleaningConfig())
    assert crop is not None
    (trimmed,) = mark_unseen_joints(line_of(GAP), bulging(0.0), crop).joints
    assert trimmed.kind is GAP
    np.testing.assert_allclose(bulging(0.0)(np.array(trimmed.u))[:, 0], [87.5, 112.5], atol=0.6)


def test_a_gap_that_is_one_from_end_to_end_stays_to_the_last_bit() -> None:
    mask = np.zeros((100, 200), np.uint8)
    mask[47:54, 17:75] = mask[47:54, 125:184] = 1
    crop = clean(mask, CleaningConfig())
    assert crop is not None
    (joint,) = line_of(GAP).joints
    for span in ((0.375, 0.625), (0.1 * 3.9, 0.61)):
        line = Centerline(line_of(GAP).segments, (replace(joint, u=span),))
        assert mark_unseen_joints(line, bulging(0.0), crop).joints[0].u == span


def test_a_gap_over_another_object_stays_and_a_short_joint_is_not_questioned() -> None:
    line = line_of(GAP)
    assert mark_unseen_joints(line, bulging(0.0), crop_of(blob=True)) is line
    (joint,) = line_of().joints
    nearer = Segment(line.segments[1].points - (32.0, 0.0), line.segments[1].radius)
    short = Centerline((line.segments[0], nearer), (replace(joint, u=(0.469, 0.531)),))
    assert mark_unseen_joints(short, bulging(14.0), crop_of(blob=False)) is short
