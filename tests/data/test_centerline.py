"""Segments, joints and centre lines: their checks, their reversal, and the parameter along them."""

from __future__ import annotations

import math
import pickle
from dataclasses import FrozenInstanceError, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from dloftbs.data.centerline import Centerline, Joint, JointKind, NearJoint, Segment, arc_parameter
from dloftbs.errors import InputError

LEFT = Segment([[0, 0], [3, 0], [6, 0]], [1, 2, 3])
RIGHT = Segment([[10, 0], [20, 0]], [4, 5])
GAP = Joint(JointKind.GAP, (0.3, 0.5), cost=1.0, margin=3.0, confidence=0.75, alternatives=((4.0, 5.0), None))
LINE = Centerline((LEFT, RIGHT), (GAP,))

polylines = arrays(np.float64, st.tuples(st.integers(1, 30), st.sampled_from([2, 3])), elements=st.floats(-1e3, 1e3))


def assert_same(line: Centerline, other: Centerline) -> None:
    np.testing.assert_array_equal(line.points, other.points)
    np.testing.assert_array_equal(line.radius, other.radius)
    assert [len(s) for s in line.segments] == [len(s) for s in other.segments]
    assert line.closed == other.closed


class TestSegment:
    @pytest.mark.parametrize(
        ("points", "radius", "message"),
        [
            (np.ones((3, 3)), np.ones(3), r"points must have shape \(n, 2\), got \(3, 3\)"),
            (np.ones(2), np.ones(1), r"points must have shape \(n, 2\), got \(2,\)"),
            (np.ones((3, 2)), np.ones(2), r"radius must have shape \(3,\), got \(2,\)"),
            (np.ones((3, 2)), np.ones((3, 1)), r"radius must have shape \(3,\), got \(3, 1\)"),
            ([[0, np.nan]], [1], "points must be finite"),
            ([[0, 0]], [np.inf], "radius must be finite"),
            ("points", [1], "points must be an array of numbers"),
            (np.ones((0, 2)), np.ones(0), "at least one point"),
        ],
    )
    def test_what_is_wrong_is_said_with_what_came(self, points, radius, message):
        with pytest.raises(InputError, match=message):
            Segment(points, radius)

    def test_the_arrays_are_read_only_copies(self):
        points, radius = np.ones((2, 2)), np.ones(2)
        segment = Segment(points, radius)
        points[0], radius[0] = 5.0, 5.0
        assert segment.points[0, 0] == segment.radius[0] == 1.0
        for array in (segment.points, segment.radius, segment.reversed().points):
            with pytest.raises(ValueError, match="read-only"):
                array[0] = 0.0
        with pytest.raises(FrozenInstanceError):
            segment.points = points

    def test_the_unchecked_constructor_copies_nothing(self):
        points, radius = np.ones((2, 2)), np.ones(2)
        segment = Segment._unchecked(points, radius)
        assert segment.points is points
        assert segment.radius is radius
        assert not points.flags.writeable
        assert not radius.flags.writeable

    def test_its_length_is_that_of_its_points(self):
        assert [len(LEFT), len(RIGHT)] == [3, 2]

    def test_reversed_turns_points_and_radius(self):
        back = LEFT.reversed()
        np.testing.assert_array_equal(back.points, [[6, 0], [3, 0], [0, 0]])
        np.testing.assert_array_equal(back.radius, [3, 2, 1])


class TestJoint:
    def test_reversed_mirrors_the_span(self):
        back = GAP.reversed()
        assert back == Joint(JointKind.GAP, (0.5, 0.7), 1.0, 3.0, 0.75, (None, (4.0, 5.0)))
        assert back.reversed().u == pytest.approx(GAP.u)

    def test_a_joint_is_a_value(self):
        assert len({GAP, replace(GAP)}) == 1
        with pytest.raises(FrozenInstanceError):
            GAP.cost = 0.0

    def test_kinds_are_their_names(self):
        assert JointKind("gap") is JointKind.GAP
        assert JointKind.CROSSING == "crossing"

    @pytest.mark.parametrize(
        ("name", "value"),
        [
            *(("u", value) for value in ((0.5, 0.2), (-0.1, 0.2), None, (0.1,))),
            *(("kind", value) for value in ("gap", None)),
            *(("cost", value) for value in (-1.0, math.inf, "1")),
            *(("margin", value) for value in (math.nan, -math.inf)),
            *(("confidence", value) for value in (1.1, None)),
            *(("alternatives", value) for value in ((None,), ((1.0,), None), None)),
        ],
    )
    def test_wrong_fields_are_refused(self, name, value):
        with pytest.raises(InputError, match=f"{name} must be"):
            replace(GAP, **{name: value})


class TestNearJoint:
    NEAR = NearJoint(1.0, (30.0, 4.0), 0.4)

    def test_it_lies_at_the_other_end_of_the_reversed_line(self):
        line = Centerline((LEFT,), near_joints=(self.NEAR,))
        assert line.reversed().near_joints == (NearJoint(0.0, (30.0, 4.0), 0.4),)
        assert line.reversed().reversed().near_joints == (self.NEAR,)

    def test_an_end_that_may_go_on_lowers_the_confidence(self):
        line = Centerline((LEFT,), near_joints=(self.NEAR, NearJoint(0.0, (1.0, 1.0), 0.1)))
        assert line.ends_confidence == line.confidence == line.reversed().confidence == pytest.approx(0.6)
        assert Centerline((LEFT,)).ends_confidence == 1.0

    def test_nothing_of_the_dictionary_is_lost(self):
        assert NearJoint.from_dict(self.NEAR.to_dict()) == self.NEAR
        with pytest.raises(InputError, match=r"a near joint .*point"):
            NearJoint.from_dict({"u": 1.0, "confidence": 0.4})

    @pytest.mark.parametrize(
        ("name", "value"),
        [*(("u", value) for value in (0.5, -1.0, None)), ("point", (1.0,)), *(("confidence", v) for v in (1.1, "x"))],
    )
    def test_wrong_fields_are_refused(self, name, value):
        with pytest.raises(InputError, match=f"{name} must be"):
            replace(self.NEAR, **{name: value})


class TestCenterline:
    @pytest.mark.parametrize(
        ("segments", "joints", "closed", "message"),
        [
            ((), (), False, "at least one segment"),
            ((LEFT,), (GAP,), False, "1 segments need 0 joints, got 1"),
            ((LEFT, RIGHT), (), False, "2 segments need 1 joints, got 0"),
            ((LEFT, RIGHT), (GAP,), True, "a closed centre line is one segment, got 2"),
        ],
    )
    def test_what_is_wrong_is_said_with_what_came(self, segments, joints, closed, message):
        with pytest.raises(InputError, match=message):
            Centerline(segments, joints, closed)

    def test_lists_become_tuples(self):
        line = Centerline([LEFT, RIGHT], [GAP])
        assert (line.segments, line.joints) == ((LEFT, RIGHT), (GAP,))
        with pytest.raises(FrozenInstanceError):
            line.joints = ()

    def test_points_and_radius_run_through_the_segments(self):
        np.testing.assert_array_equal(LINE.points[:, 0], [0, 3, 6, 10, 20])
        np.testing.assert_array_equal(LINE.radius, [1, 2, 3, 4, 5])

    def test_the_parameter_counts_the_gap_in(self):
        np.testing.assert_allclose(LINE.u, [0.0, 0.15, 0.3, 0.5, 1.0], atol=1e-15)

    @pytest.mark.parametrize("line", [LINE, Centerline((LEFT,))], ids=["two", "one"])
    def test_the_arrays_are_read_only(self, line):
        for array in (line.points, line.radius, line.u):
            with pytest.raises(ValueError, match="read-only"):
                array[0] = 0.0

    def test_reversed_turns_everything(self):
        third = Segment([[20, 5], [20, 9]], [6, 7])
        crossing = Joint(JointKind.CROSSING, (0.7, 0.8), 0.5, 1.0)
        line = Centerline((LEFT, RIGHT, third), (GAP, crossing))
        back = line.reversed()
        np.testing.assert_array_equal(back.points, line.points[::-1])
        np.testing.assert_array_equal(back.radius, line.radius[::-1])
        np.testing.assert_allclose(back.u, 1.0 - line.u[::-1], atol=1e-12)
        assert back.joints == (crossing.reversed(), GAP.reversed())
        assert_same(back.reversed(), line)

    def test_reversed_turns_a_parameter_that_is_longer_across_a_gap_than_its_chord(self):
        around_a_turn = np.array([0.0, 0.1, 0.2, 0.6, 1.0])
        line = Centerline._unchecked((LEFT, RIGHT), (GAP,), False, u=around_a_turn)
        np.testing.assert_array_equal(line.reversed().u, 1.0 - around_a_turn[::-1])
        np.testing.assert_allclose(line.reversed().reversed().u, around_a_turn, atol=1e-15)

    def test_reversed_survives_a_pickle_and_has_no_other_names(self):
        back = pickle.loads(pickle.dumps(LINE.reversed()))
        assert_same(back, LINE.reversed())
        assert (back.width_px, replace(back, closed=False).joints) == (LINE.width_px, (GAP.reversed(),))
        for line in (LINE, back):
            with pytest.raises(AttributeError, match="'Centerline' object has no attribute 'segment'"):
                _ = line.segment

    def test_a_loop_stays_one(self):
        ring = Centerline((Segment([[0, 0], [4, 0], [4, 4], [0, 4]], np.ones(4)),), closed=True)
        np.testing.assert_array_equal(ring.u, [0.0, 0.25, 0.5, 0.75])
        assert ring.reversed().closed
        np.testing.assert_array_equal(ring.reversed().u, [0.25, 0.5, 0.75, 1.0])


class TestArcParameter:
    def test_steps_of_a_known_length(self):
        np.testing.assert_array_equal(arc_parameter(np.array([[0, 0], [3, 4], [3, 9], [13, 9]])), [0, 0.25, 0.5, 1])

    def test_the_way_back_counts_where_it_is_closed(self):
        square = np.array([[0.0, 0, 1], [2, 0, 1], [2, 2, 1], [0, 2, 1]])
        np.testing.assert_array_equal(arc_parameter(square, closed=True), [0, 0.25, 0.5, 0.75])

    @pytest.mark.parametrize("closed", [False, True])
    @pytest.mark.parametrize("n", [1, 4])
    def test_points_that_are_all_the_same_stay_at_zero(self, n, closed):
        np.testing.assert_array_equal(arc_parameter(np.ones((n, 2)), closed), np.zeros(n))

    @given(polylines)
    def test_it_runs_from_zero_to_one_and_never_back(self, points):
        u = arc_parameter(points)
        assert (np.diff(u) >= 0).all()
        assert u[0] == 0.0
        assert u[-1] == (1.0 if np.ptp(points, axis=0).max() > 1e-150 else u[-1])
        assert (arc_parameter(points, closed=True) <= u).all()
