"""Cables that cross, touch, lie side by side and end, from the mask to the curve, by the default method."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from drawings import EIGHT_VERSIONS, draw_cable, turn, turn_points
from linking_examples import beside, circle, cross, detect, distances, draw, hide
from scipy.spatial import cKDTree

from dloftbs import Detection, JointKind

LINE = np.array([[20.0, 120.0], [380.0, 130.0]])


def kinds(detections: list[Detection]) -> list[list[JointKind]]:
    return sorted([joint.kind for joint in detection.joints] for detection in detections)


def loop() -> np.ndarray:
    t = np.linspace(-1.35, 1.35, 400)
    return np.column_stack((200 + 132 * (t**3 - t), 30 + 170 * (1 - t**2 / 1.9)))


def figure_eight() -> np.ndarray:
    a = np.linspace(0, 2 * np.pi, 600)
    return np.column_stack((200 + 150 * np.sin(a), 120 + 80 * np.sin(2 * a)))


class TestCrossings:
    @pytest.mark.parametrize("angle", [90, 60, 30, 15])
    def test_two_straight_cables_stay_straight(self, angle: float) -> None:
        found = detect(draw(*cross(angle)))
        assert len(found) == 2
        assert max(distances(found, cross(angle))) < 5.0  # an end lies up to half a width beyond the last point
        assert [{joint.kind for joint in detection.joints} for detection in found] == [{JointKind.CROSSING}] * 2

    @pytest.mark.parametrize("size", [(240, 320), (2160, 3840)], ids=["320 x 240", "4K"])
    @pytest.mark.parametrize("width", [2, 5, 12, 40])
    def test_of_any_width_in_any_image(self, width: int, size: tuple[int, int]) -> None:
        if 6 * width > size[0]:
            pytest.skip("as good as full")
        length = min(80.0 * width, 0.85 * size[0])
        cables = cross(60, length, (size[1] / 2, size[0] / 2))
        found = detect(draw(*cables, width=width, size=size))
        assert len(found) == 2
        assert max(distances(found, cables)) < 0.5 * width + 2.5
        assert [detection.width_px for detection in found] == pytest.approx([width] * 2, abs=0.6)

    @pytest.mark.parametrize("tilt_deg", range(0, 360, 30))
    def test_two_arms_that_a_disc_leaves_are_no_bend(self, tilt_deg: int) -> None:
        """Where the other two arms begin beyond the disc, and point at the place where the two meet."""
        tilt, middle, radius = np.radians(tilt_deg), np.array([150.0, 150.0]), 18.0
        arms = [110.0 * np.array([np.cos(tilt + x), np.sin(tilt + x)]) for x in (0.0, np.pi / 2)]
        cables = [np.add(middle, [-arm, arm]) for arm in arms]
        disc = middle + (radius - 3.0) * np.array([np.cos(tilt + np.pi / 4), np.sin(tilt + np.pi / 4)])
        found = detect(hide(draw(*cables, width=12, size=(300, 300)), *disc, radius))
        assert len(found) == 2
        assert max(distances(found, cables)) < 8.0

    def test_thin_cables_cross_obliquely(self) -> None:
        wrong = []
        for tilt in np.arange(3, 180, 12):
            for width, angle in ((3, 30), (5, 20)):
                a, b = np.radians(tilt + angle / 2), np.radians(tilt - angle / 2)
                arms = [21.5 * width * np.array([np.cos(x), np.sin(x)]) for x in (a, b)]
                cables = [np.add((120.3, 120.6), [-arm, arm]) for arm in arms]
                if max(distances(detect(draw(*cables, width=width, size=(240, 240))), cables)) > 10:
                    wrong.append((width, angle, int(tilt)))
        assert wrong == []

    def test_a_loop_that_crosses_itself_is_one_cable(self) -> None:
        found = detect(draw(loop()))
        assert kinds(found) == [[JointKind.CROSSING] * 2]
        assert max(distances(found, [loop()])) < 5.0

    def test_a_figure_eight_is_one_closed_curve(self) -> None:
        (found,) = detect(draw(figure_eight()))
        assert found.curve.closed
        assert distances([found], [figure_eight()])[0] < 1.5

    def test_a_ring_is_one_closed_curve(self) -> None:
        (found,) = detect(draw(circle((200, 120), 80)))
        assert found.curve.closed
        assert distances([found], [circle((200, 120), 80)])[0] < 1.0

    def test_a_ring_and_the_cable_that_crosses_it_are_two(self) -> None:
        ring, cable = circle((200, 100), 70), np.array([(20, 120), (380, 140)])
        found = detect(draw(ring, cable))
        assert sorted(detection.curve.closed for detection in found) == [False, True]

    def test_a_ring_that_a_cable_touches_is_covered(self) -> None:
        """Whether it is a ring beside a cable or a loop of the cable, the mask does not tell."""
        ring, cable = circle((200, 100), 70), np.array([(20.0, 174.0), (380.0, 180.0)])
        found = detect(draw(ring, cable))
        total = sum(detection.curve.length for detection in found)
        assert len(found) in (1, 2)
        assert total == pytest.approx(2 * np.pi * 70 + 360, rel=0.03)


class TestSideBySide:
    @pytest.mark.parametrize("crosses", [False, True])
    @pytest.mark.parametrize(("width", "size"), [(7, (240, 400)), (12, (480, 800)), (40, (2160, 3840))])
    def test_two_cables_over_ten_widths(self, crosses: bool, width: int, size: tuple[int, int]) -> None:
        cables = beside(10.0 * width, width, crosses, size)
        found = detect(draw(*cables, width=width, size=size))
        assert len(found) == 2
        assert max(distances(found, cables)) < 0.5 * width + 2.5

    def test_two_arcs_that_touch(self) -> None:
        t = np.linspace(-1, 1, 200)
        arcs = [np.column_stack((200 + 120 * t, 120 + side * (3 + 50 * t**2))) for side in (-1, 1)]
        found = detect(draw(*arcs))
        assert len(found) == 2
        assert max(distances(found, arcs)) < 5.0

    @pytest.mark.parametrize("share", [0.4, 0.7])
    def test_a_cable_ends_inside_a_bundle(self, share: float) -> None:
        whole, other = beside(126, 7, False)
        ends = other[other[:, 0] < 200 - 63 + share * 126]
        found = detect(draw(whole, ends))
        assert len(found) == 2
        assert max(distances(found, [whole, ends])) < 8.0


class TestEnds:
    def test_the_stem_of_a_t_is_a_cable_of_its_own(self) -> None:
        stem = np.array([(200.0, 125.0), (210.0, 220.0)])
        found = detect(draw(LINE, stem))
        assert kinds(found) == [[], [JointKind.CROSSING]]
        assert max(distances(found, [LINE, stem])) < 8.0

    def test_a_spur_is_no_cable_and_no_joint(self) -> None:
        (found,) = detect(draw(LINE) | draw([(200, 125), (202, 133)], width=4))
        assert found.joints == ()
        assert distances([found], [LINE])[0] < 4.5

    @pytest.mark.parametrize("slant", [-1.6, -1.2, 0.8, 1.2, 1.6])
    def test_a_slanting_band_over_a_cable_leaves_it_one(self, slant: float) -> None:
        mask = draw([(20, 120), (380, 120)], width=13)
        yy, xx = np.indices(mask.shape)
        mask[np.abs(xx - 200 - slant * (yy - 120)) < 10 * np.hypot(1.0, slant)] = 0
        (detection,) = detect(mask)
        assert [joint.kind.value for joint in detection.joints] == ["gap"]
        assert np.abs(detection.curve.sample(200)[:, 1] - 120.0).max() < 2.0

    def test_a_gap_of_four_widths_is_bridged_and_reported(self) -> None:
        mask = draw(LINE)
        mask[:, 186:214] = 0
        (found,) = detect(mask)
        assert [joint.kind for joint in found.joints] == [JointKind.GAP]
        ((first, last),) = found.inferred
        assert (last - first) * found.curve.length == pytest.approx(28, abs=6)
        assert distances([found], [LINE])[0] < 4.5

    @pytest.mark.parametrize(("max_gap_widths", "count"), [(3.0, 2), (6.0, 1), (0.0, 2)])
    def test_a_gap_longer_than_the_longest_is_not(self, max_gap_widths: float, count: int) -> None:
        mask = draw(LINE)
        mask[:, 186:214] = 0
        assert len(detect(mask, max_gap_widths=max_gap_widths)) == count

    @pytest.mark.parametrize("width", [7, 9])
    def test_round_ends_that_face_each_other_across_eleven_widths_stay_open(self, width: int) -> None:
        left, right = [(20, 60), (150, 60)], [(150 + 12 * width, 60), (280 + 12 * width, 60)]
        mask = draw(np.array(left), np.array(right), width=width, size=(120, 420))
        assert [detection.inferred for detection in detect(mask)] == [(), ()]

    def test_a_gap_longer_than_the_default_longest_is_not(self) -> None:
        mask = draw(LINE, width=4)
        mask[:, 140:260] = 0  # 30 widths
        assert len(detect(mask)) == 2

    def test_dashes_that_are_nearly_joined_are_one_cable_where_that_is_known(self) -> None:
        dashes = draw([(10, 100), (90, 103)], [(158, 106), (225, 109)], [(293, 113), (395, 116)])
        apart = detect(dashes)
        assert len(apart) == 3
        assert all(0.5 < found.confidence < 0.9 for found in apart)  # it is in doubt
        assert len(detect(dashes, objects=2)) == 2
        (found,) = detect(dashes, objects=1)
        assert [joint.kind for joint in found.joints] == [JointKind.GAP] * 2
        xs = [segment.points[:, 0].mean() for segment in found.centerline.segments]
        assert xs == sorted(xs) or xs == sorted(xs, reverse=True)
        assert found.confidence < 0.5  # of what is seen alone; the number is the user's

    def test_cables_that_run_out_of_the_image_end_at_its_border(self) -> None:
        (found,) = detect(draw([(-20, 100), (420, 140)]))
        xs = np.sort(found.curve.sample(2)[:, 0])
        np.testing.assert_allclose(xs, (0, 399), atol=2.0)


class TestBlobs:
    """A hand, a gripper or a connector that a mask takes for cable."""

    def test_curves_stay_on_the_mask_in_a_blob_at_the_border(self) -> None:
        t = np.linspace(0.0, 1.0, 60)
        bow = np.outer(2 * (t - 0.5) * (t - 1), (476, 260)) + np.outer(4 * t * (1 - t), (227, 348))
        bow += np.outer(2 * t * (t - 0.5), (546, 460))
        mask = draw(bow, width=9, size=(480, 640))
        cv2.fillConvexPoly(mask, np.array([(676, 480), (543, 573), (488, 498), (549, 348)]), 1)
        on_mask = cKDTree(np.argwhere(mask)[:, ::-1])
        found = detect(mask)
        assert found
        for detection in found:
            assert on_mask.query(detection.curve.sample(400))[0].max() < 0.5 * detection.width_px


class TestConfidence:
    def test_a_joint_carries_what_it_costs_and_what_else_there_was(self) -> None:
        found = detect(draw(*cross(60)))
        assert len(found) == 2
        for detection in found:
            (joint,) = detection.joints
            assert 0.0 <= joint.cost < 1.0
            assert 0.0 < joint.margin < 7.0
            assert 0.9 < joint.confidence <= 1.0
            line = detection.centerline
            assert detection.confidence == line.existence * line.course_confidence * joint.confidence
            assert joint.alternatives != (None, None)

    def test_what_could_go_either_way_is_less_sure_than_what_could_not(self) -> None:
        """Three arms alike; and a T, of which two are in line."""
        ends = [(200 + 100 * np.cos(a), 120 + 100 * np.sin(a)) for a in 0.2 + np.arange(3) * 2 * np.pi / 3]
        star = detect(draw(*[[(200, 120), end] for end in ends]))
        clear = detect(draw(LINE, [(200, 125), (210, 220)]))
        margins = [min(j.margin for d in found for j in d.joints) for found in (star, clear)]
        assert margins[0] < 0.2 < 1.0 < margins[1]
        through = [min(d.confidence for d in found if d.joints) for found in (star, clear)]  # the others end on these
        assert through[0] < 0.9 * through[1]

    def test_three_arms_alike_have_low_confidence(self) -> None:
        ends = [(200 + 100 * np.cos(a), 120 + 100 * np.sin(a)) for a in 0.2 + np.arange(3) * 2 * np.pi / 3]
        found = detect(draw(*[[(200, 120), end] for end in ends]))
        assert min(detection.confidence for detection in found) < 0.85


SCENES = {
    "cross": draw(*cross(50)),
    "oblique cross": draw(*cross(15)),
    "side by side": draw(*beside(70, 7, False)),
    "side by side, crossing": draw(*beside(70, 7, True)),
    "loop": draw(loop()),
    "t": draw(LINE, [(200, 125), (210, 220)]),
    "three": draw(*cross(70), [(30, 60), (370, 90)]),
    "thick": draw_cable(np.array([[40.0, 60.0], [330.0, 190.0], [360.0, 60.0]]), 33, (240, 400)),
    "gap": draw(LINE) * (np.abs(np.arange(400) - 170) > 14).astype(np.uint8),
}


class TestSymmetry:
    """What is symmetric itself has several curves that are equally good."""

    @pytest.mark.parametrize("mask", SCENES.values(), ids=SCENES.keys())
    def test_turning_and_flipping_the_mask_turns_and_flips_the_curves(self, mask: np.ndarray) -> None:
        mask = mask * (np.arange(400) < 335).astype(np.uint8)
        expected = [detection.curve.sample(80) for detection in detect(mask)]
        assert expected
        for how in EIGHT_VERSIONS:
            found = [detection.curve.sample(80) for detection in detect(turn(mask, *how))]
            assert len(found) == len(expected)
            for points, other in zip(expected, found, strict=True):
                np.testing.assert_allclose(turn_points(points, mask.shape, *how), other, atol=1e-6)

    @pytest.mark.parametrize("mask", SCENES.values(), ids=SCENES.keys())
    def test_moving_the_mask_moves_the_curves(self, mask: np.ndarray) -> None:
        # Only for masks that touch no border: there, ends are led on to it.
        moved = np.zeros((300, 500), dtype=np.uint8)
        moved[41 : 41 + 240, 67 : 67 + 400] = mask
        still = np.zeros((300, 500), dtype=np.uint8)
        still[30 : 30 + 240, 50 : 50 + 400] = mask
        expected = detect(still)
        assert expected
        for one, other in zip(expected, detect(moved), strict=True):
            np.testing.assert_allclose(one.curve.sample(80) + np.array([17, 11]), other.curve.sample(80), atol=1e-6)

    @pytest.mark.parametrize("mask", SCENES.values(), ids=SCENES.keys())
    def test_the_same_mask_gives_the_same_bits(self, mask: np.ndarray) -> None:
        first, second = (detect(mask) for _ in range(2))
        assert first
        assert [d.to_dict() for d in first] == [d.to_dict() for d in second]
