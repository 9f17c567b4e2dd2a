"""What a probability shows of centre lines."""

from __future__ import annotations

import numpy as np
import pytest

from dloftbs.data.centerline import Centerline, NearJoint, Segment
from dloftbs.linking.soft_lines import goes_on, with_ends_that_go_on, with_soft_widths

SIZE = (60, 200)


def line(closed: bool = False, near: tuple[NearJoint, ...] = ()) -> Centerline:
    points = np.column_stack((np.arange(50.0, 100.0), np.full(50, 30.0)))
    return Centerline((Segment(points, np.full(50, 5.0)),), closed=closed, near_joints=near)


def ahead(value: int) -> np.ndarray:
    soft = np.zeros(SIZE, np.uint8)
    soft[26:35, 50:100] = 200
    soft[26:35, 105:130] = value
    return soft


def test_the_more_is_seen_ahead_the_more_probably_a_cable_goes_on() -> None:
    stated = [goes_on(value) for value in (1, 4, 16, 64, 127)]
    assert stated == sorted(stated)
    assert stated[0] < 0.4 < 0.6 < stated[2]
    assert stated[-1] > 0.9


class TestEnds:
    def test_what_is_seen_ahead_is_a_near_joint(self) -> None:
        (found,), is_more = with_ends_that_go_on([line()], ahead(40), 64)
        assert is_more
        (near,) = found.near_joints
        assert (near.u, near.confidence) == (1.0, goes_on(40))
        assert near.point == pytest.approx((114.0, 30.0))
        assert found.confidence == pytest.approx(1.0 - goes_on(40))
        assert found.points is line().points or np.array_equal(found.points, line().points)

    def test_nothing_ahead_says_nothing(self) -> None:
        for soft in (ahead(0), ahead(90)):  # and what is above the limit is another object's
            (found,), is_more = with_ends_that_go_on([line()], soft, 64)
            assert found.near_joints == ()
            assert not is_more

    def test_the_surer_of_two_ways_on_is_kept(self) -> None:
        for confidence, kept in ((0.99, (150.0, 20.0)), (0.2, (114.0, 30.0))):
            near = (NearJoint(0.0, (10.0, 30.0), 0.1), NearJoint(1.0, (150.0, 20.0), confidence))
            ((found,), _) = with_ends_that_go_on([line(near=near)], ahead(40), 64)
            assert [one.point for one in found.near_joints] == [(10.0, 30.0), pytest.approx(kept)]

    def test_a_loop_has_no_ends(self) -> None:
        (found,), is_more = with_ends_that_go_on([line(closed=True)], ahead(40), 64)
        assert found.near_joints == ()
        assert not is_more

    def test_what_is_too_faint_for_any_limit_is_no_reason_to_read_on(self) -> None:
        (found,), is_more = with_ends_that_go_on([line()], ahead(10), 64)
        assert found.near_joints
        assert not is_more


class TestWidths:
    def test_a_line_is_as_wide_as_half_of_its_ridge_and_never_wider(self) -> None:
        soft = np.zeros(SIZE, np.uint8)
        soft[27:34] = 100
        for thick, expected in ((5.0, 7.0), (2.0, 4.0)):
            given = Centerline((Segment(line().points, np.full(50, thick)),))
            (found,) = with_soft_widths([given], soft)
            assert found.width_px == pytest.approx(expected, abs=0.6)
            assert found.radius == pytest.approx(np.full(50, 0.5 * found.width_px))
            assert found.segments[0].radius == pytest.approx(found.radius)
        assert given.radius == pytest.approx(np.full(50, 2.0))
