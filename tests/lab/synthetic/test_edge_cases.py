"""Drawn edge cases: what their names say, with the truth where the mask is."""

import math
import pickle

import cv2
import numpy as np
import pytest
from scipy.spatial import cKDTree

from dloftbs.errors import InputError
from dloftbs_lab.synthetic import EDGE_CASES, EdgeCaseSequence, edge_cases
from dloftbs_lab.synthetic.edge_cases import paint_picture

IMAGES = range(0, 24, 5)


def truths(kind, **options):
    sequence = EdgeCaseSequence(kind, **options)
    return [sequence.truth(index) for index in IMAGES]


def apart(one, other):
    """The least distance of two curves."""
    return cKDTree(one.sample(900)).query(other.sample(900))[0].min()


@pytest.mark.parametrize("kind", EDGE_CASES)
@pytest.mark.parametrize("size", [(480, 640), (720, 1280)])
def test_masks_are_where_the_curves_are(kind, size):
    sequence = EdgeCaseSequence(kind, size=size, seed=2)
    assert (sequence.tolerance_px, sequence.fps) == (5.0, None)
    for index in (0, 9):
        frame, truth = sequence.frame(index), sequence.truth(index)
        np.testing.assert_array_equal(frame.mask, truth.mask)
        assert (frame.image is not None) == ("picture" in kind)
        points = np.concatenate([curve.sample(900) for curve in truth.curves])
        rows, columns = np.nonzero(truth.mask)
        most = 60.0 if "near the camera" in kind else 17.0  # half a width, or frayed
        assert cKDTree(points).query(np.column_stack((columns, rows)))[0].max() < most
        least = {"ends at the border": 0.6, "broken": 0.4, "broken, picture": 0.4}.get(kind, 0.95)
        spans = [sum(high - low for low, high in shown) for shown in truth.shown_spans]
        assert min(spans) > least


@pytest.mark.parametrize("kind", EDGE_CASES)
@pytest.mark.parametrize("size", [(100, 100), (135, 240)])
def test_small_images_have_cables_too(kind, size):
    """Breaks, gaps and ends are as long as in large ones, and there is little room for them."""
    for seed in range(30, 40):
        assert EdgeCaseSequence(kind, size=size, seed=seed).frame(seed % 24).mask.any()


@pytest.mark.parametrize("degrees", [90, 75, 60, 45, 40, 35, 30])
def test_bends_have_their_angle_at_every_rotation(degrees):
    turns = []
    for width in (4, 12):
        sequence = EdgeCaseSequence(f"bend of {degrees} degrees, {width} px")
        for index in range(24):
            (curve,) = sequence.truth(index).curves
            first, corner, last = curve.control_points
            one, other = (math.atan2(*(end - corner)[::-1]) for end in (first, last))
            assert math.degrees(abs((other - one + math.pi) % (2.0 * math.pi) - math.pi)) == pytest.approx(degrees)
            turns.append(one % (2.0 * math.pi))
    assert np.diff(np.sort(turns)).max() < 0.6


@pytest.mark.parametrize("kind", ["facing flat ends", "facing ends", "facing ends, picture"])
def test_facing_ends_lie_on_one_smooth_line(kind):
    for truth in truths(kind):
        one, other = truth.curves
        gap = other(0.0) - one(1.0)
        assert 35.0 < np.linalg.norm(gap) < 151.0
        along = gap / np.linalg.norm(gap)
        for curve, u in ((one, 1.0), (other, 0.0)):
            tangent = curve(u, 1) / np.linalg.norm(curve(u, 1))
            assert tangent @ along > math.cos(0.4)


def test_t_and_y_end_on_the_other_at_their_angle():
    for kind, low, high in (("T", 68.0, 90.0), ("Y", 24.0, 56.0)):
        for truth in truths(kind):
            branch, through = truth.curves
            points = through.sample(2000)
            at = int(np.linalg.norm(points - branch(0.0), axis=1).argmin())
            assert np.linalg.norm(points[at] - branch(0.0)) < 1.0
            across, out = through(at / 1999.0, 1), branch(0.0, 1)
            cos = abs(across @ out) / np.linalg.norm(across) / np.linalg.norm(out)
            assert low < math.degrees(math.acos(cos)) < high


def test_parallel_cables_never_touch():
    for truth in truths("parallel"):
        one, other = truth.visible_masks
        rows, columns = np.nonzero(one)
        distance = cKDTree(np.argwhere(other)).query(np.column_stack((rows, columns)))[0]
        assert distance.min() > 2.0
        assert apart(*truth.curves) < 40.0


def test_the_border_cuts_two_cables_close_together():
    for truth in truths("ends at the border"):
        cut = []
        for mask in truth.visible_masks:
            places = [np.argwhere(edge) for edge in (mask[0], mask[-1], mask[:, 0], mask[:, -1])]
            assert sum(len(place) > 0 for place in places) == 1
            cut.append(next((i, float(place.mean())) for i, place in enumerate(places) if len(place)))
        assert cut[0][0] == cut[1][0]
        assert abs(cut[0][1] - cut[1][1]) < 90.0


def test_a_ring_is_closed_and_crossed_twice():
    for truth in truths("crossed ring"):
        assert sorted(curve.closed for curve in truth.curves) == [False, True]
        ring, straight = sorted(truth.curves, key=lambda curve: not curve.closed)
        near = cKDTree(ring.sample(2000)).query(straight.sample(2000))[0] < 0.5
        assert (np.diff(near.astype(int)) == 1).sum() == 2


def test_the_ground_shows_between_the_ends_in_the_picture():
    mask = np.zeros((60, 90), bool)
    mask[25:35, :40] = mask[25:35, 60:] = True
    picture = paint_picture(np.random.default_rng(4), mask).astype(float)
    cable, between, beside = picture[28:32, 5:35], picture[28:32, 44:56], picture[5:15, 44:56]
    off = np.linalg.norm(between.mean(axis=(0, 1)) - beside.mean(axis=(0, 1)))
    assert off < 0.5 * np.linalg.norm(cable.mean(axis=(0, 1)) - between.mean(axis=(0, 1)))


def test_images_are_the_same_bit_for_bit_in_any_order_and_after_pickling():
    one = EdgeCaseSequence("facing ends, picture")
    other = pickle.loads(pickle.dumps(EdgeCaseSequence("facing ends, picture")))
    other.frame(7)
    for index in (5, 3):
        np.testing.assert_array_equal(one.frame(index).image, other.frame(index).image)
        np.testing.assert_array_equal(one.frame(index).mask, other.frame(index).mask)
    assert (EdgeCaseSequence("facing ends, picture", seed=1).frame(3).mask != one.frame(3).mask).any()


def test_the_suite_has_all_kinds():
    assert [one.name for one in edge_cases(0.01, 0, (240, 320))] == list(EDGE_CASES)
    assert {len(one) for one in edge_cases()} == {24}


def test_an_unknown_kind_is_refused():
    with pytest.raises(InputError, match=r"kind must be one of 'bend of 90 degrees, 4 px', .* got 'knot'"):
        EdgeCaseSequence("knot")


def test_a_cable_that_comes_near_the_camera_gets_wider_and_is_frayed_there():
    sequence = EdgeCaseSequence("frayed near the camera", frames=6, size=(480, 640), seed=4)
    for index in range(len(sequence)):
        mask, (curve,) = sequence.truth(index).mask, sequence.truth(index).curves
        half = cv2.distanceTransform(mask.astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
        (far_x, far_y), (near_x, near_y) = np.rint(curve([0.15, 0.85])).astype(int)
        assert half[near_y, near_x] > 1.05 * half[far_y, far_x]
