"""Branch points of drawn masks: where branches part late, under ties and blobs, and under what hides them."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

import dloftbs
from dloftbs import FrameResult
from dloftbs.linking.branch_points import confidence_of
from dloftbs_lab.synthetic.harnesses import HarnessSequence

JOINT = (320, 240)
ARMS = ((60, 240), (580, 220), (430, 60))


def tee(width: int = 12) -> np.ndarray:
    mask = np.zeros((480, 640), np.uint8)
    for end in ARMS:
        cv2.line(mask, JOINT, end, 255, width)
    return mask


def read(mask: np.ndarray) -> FrameResult:
    return dloftbs.detect(mask, branched=True, mask_is="binary")


def assert_a_harness_of_three(result: FrameResult, within_px: float) -> None:
    (point,) = result.branch_points
    assert np.hypot(*np.subtract(point.position, JOINT)) < within_px
    assert len(point.members) == len(result) == 3
    for number, end in point.members:
        curve = result[number].curve
        assert np.allclose(curve(float(end)), point.position, atol=2.0)
        far = curve(float(1 - end))
        assert min(np.hypot(*(far - arm)) for arm in ARMS) < 8.0


def test_branches_that_part_at_once_meet_where_their_axes_do():
    assert_a_harness_of_three(read(tee()), 3.0)


def test_a_tie_around_the_joint_is_no_end_of_a_branch():
    mask = tee()
    cv2.ellipse(mask, JOINT, (5, 17), 0, 0, 360, 255, -1)
    assert_a_harness_of_three(read(mask), 10.0)


def test_under_tape_the_joint_is_where_the_axes_meet():
    mask = tee()
    cv2.ellipse(mask, JOINT, (22, 15), 0, 0, 360, 255, -1)
    assert_a_harness_of_three(read(mask), 10.0)


def test_a_hidden_joint_is_where_the_branches_point():
    mask = tee()
    cv2.circle(mask, JOINT, 18, 0, -1)
    assert_a_harness_of_three(read(mask), 10.0)


def test_a_branch_that_leaves_along_the_trunk_begins_where_the_mask_gets_wider():
    mask = np.zeros((480, 640), np.uint8)
    cv2.line(mask, (60, 240), (580, 240), 255, 12)
    x = np.arange(300, 460)
    line = np.column_stack((x, 240 - np.maximum(x - 300, 0) ** 2 / 160))  # tangential at x = 300
    cv2.polylines(mask, [line.astype(np.int32)], False, (255,), 12)
    (point,) = read(mask).branch_points
    assert abs(point.position[0] - 300) < 15
    assert abs(point.position[1] - 240) < 3


@pytest.mark.parametrize(("branches", "seed", "frame"), [(2, 52006, 5), (2, 52011, 35), (2, 52023, 35), (3, 52001, 35)])
def test_a_branch_that_bends_at_once_leaves_where_the_outline_shows_it(branches, seed, frame):
    sequence = HarnessSequence(branches, seed=seed)
    result = dloftbs.detect(sequence.frame(frame).mask, branched=True)
    found = np.array([point.position for point in result.branch_points])
    true = np.array([curve.end for curve in sequence.truth(frame).curves[:branches]])
    assert len(found) == branches
    assert np.hypot(*(true[:, None] - found).transpose(2, 0, 1)).min(axis=1).max() < 7.0


@pytest.mark.parametrize("seed", range(3))
def test_an_edge_that_wanders_moves_no_joint(seed):
    mask = tee()
    noise = cv2.GaussianBlur(np.random.default_rng(seed).normal(size=mask.shape), (0, 0), 2.0)
    near = np.abs(cv2.distanceTransform(255 - mask, cv2.DIST_L2, 5) - cv2.distanceTransform(mask, cv2.DIST_L2, 5))
    mask[(near < 1.5) & (noise > 0.1)] = 255
    assert_a_harness_of_three(read(mask), 10.0)


def test_two_plain_cables_that_cross_stay_two():
    mask = np.zeros((480, 640), np.uint8)
    cv2.line(mask, (60, 200), (580, 280), 255, 12)
    cv2.line(mask, (60, 330), (580, 150), 255, 12)
    result = read(mask)
    assert len(result) == 2
    assert result.branch_points == ()


def test_a_cable_that_ends_beside_the_gap_of_another_one_stays_by_itself():
    mask = np.zeros((480, 640), np.uint8)
    cv2.line(mask, (60, 240), (580, 240), 255, 12)
    mask[:, 300:330] = 0
    cv2.line(mask, (200, 60), (200, 190), 255, 12)  # points at the cable, but not into the gap
    assert read(mask).branch_points == ()


def drawn(lines: list[tuple[int, int, int, int, int]]) -> np.ndarray:
    """Return a mask of straight cables ``(x, y, x, y, width)``, px."""
    mask = np.zeros((400, 500), np.uint8)
    for *at, width in lines:
        cv2.line(mask, tuple(at[:2]), tuple(at[2:]), 255, width)
    return mask


LENS = drawn(
    [
        (405, 101, 419, 315, 9),
        (419, 315, 397, 85, 10),
        (419, 315, 340, 151, 8),
        (408, 200, 109, 64, 9),
        (258, 132, 465, 271, 9),
        (397, 85, 264, 45, 8),
        (109, 64, 27, 102, 10),
    ]
)
"""Two branch points with a long branch and a short one between them, and an end branch that is as short as wide."""

KNOT = drawn(
    [
        (202, 276, 346, 176, 10),
        (274, 226, 479, 361, 10),
        (202, 276, 335, 260, 8),
        (376, 293, 283, 256, 10),
        (274, 226, 233, 48, 6),
        (233, 48, 29, 28, 9),
    ]
)
cv2.circle(KNOT, (380, 252), 88, 255, 8)
"""A wide junction with a hole, beside which a short branch has both its ends at the branch point."""


@pytest.mark.parametrize("mask", [LENS, KNOT], ids=["lens", "knot"])
def test_branches_end_at_their_branch_points_however_short_they_are(mask):
    result = read(mask)
    assert result.branch_points
    for point in result.branch_points:
        for number, end in point.members:
            assert np.allclose(result[number].curve(float(end)), point.position, atol=2.0)


def test_two_branch_points_with_a_long_branch_between_them_stay_two_beside_a_short_one():
    inner = [
        branch
        for branch in read(LENS).harnesses[0].edges
        if branch[0].startswith("point") and branch[1].startswith("point")
    ]
    assert len(inner) == 2
    assert {frozenset(ends) for *ends, _ in inner} == {frozenset(("point 0", "point 1"))}


def test_a_long_branch_is_surer():
    assert confidence_of(3.0) > confidence_of(0.5)
    (point,) = read(tee()).branch_points
    assert 0.8 < point.confidence < 1.0


@pytest.mark.parametrize("seed", range(40))
def test_loops_and_small_pieces_at_a_joint_are_no_error(seed):
    rng = np.random.default_rng(seed)
    mask = np.zeros((120, 160), np.uint8)
    for _ in range(6):
        cv2.line(mask, *[tuple(map(int, rng.integers(10, 110, 2))) for _ in range(2)], 255, int(rng.integers(3, 9)))
    mask[rng.random(mask.shape) < 0.01] ^= 255
    for point in read(mask).branch_points:
        assert len(point.members) >= 3
