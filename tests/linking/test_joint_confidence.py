"""The confidence of joints, and gaps that are left open because they rather are none."""

from __future__ import annotations

import math

import numpy as np
import pytest
from builders import line
from linking_examples import cross, draw, matching_of

from dloftbs import detect
from dloftbs.data.graph import branch_of
from dloftbs.linking.joint_confidence import (
    Gaps,
    crossing_confidence,
    gap_log_odds,
    open_doubtful_gaps,
    taper_of,
    usual_width,
)
from dloftbs_lab.synthetic import draw_tube_mask


def in_line(*pieces: tuple[float, float], width: float = 6.4, widths: tuple[float, ...] = ()) -> np.ndarray:
    """Return the mask of pieces of one straight line, from one x to another, each of its own width."""
    mask = np.zeros((80, 420), np.bool_)
    for k, (start, stop) in enumerate(pieces):
        mask |= draw_tube_mask(line((start, 40.3), (stop, 40.3)), widths[k] if widths else width, mask.shape)
    return mask


def the_gap(mask: np.ndarray):
    _, graph, matching = matching_of(mask)
    (pair,) = {(min(i, j), max(i, j)) for i, j in enumerate(matching.partner) if j >= 0}
    return graph, matching, pair


def test_a_gap_is_surer_the_more_of_the_cable_is_seen_beside_it():
    found = []
    for length in (20.0, 60.0, 140.0):
        graph, matching, (i, j) = the_gap(in_line((200.0 - length, 200.0), (230.0, 230.0 + length)))
        found.append(Gaps(matching, graph.width).confidence(i, j, matching.margin[i]))
    assert found == sorted(found)
    assert found[0] < 0.5 < 0.9 < found[-1]


def test_the_longer_side_tells():
    _, matching, (i, j) = the_gap(in_line((20.0, 200.0), (230.0, 250.0)))
    _, other, (k, m) = the_gap(in_line((20.0, 200.0), (230.0, 390.0)))
    one, both = Gaps(matching, 6.0).confidence(i, j, 3.0), Gaps(other, 6.0).confidence(k, m, 3.0)
    assert one == pytest.approx(both, abs=0.02)


def test_a_gap_between_different_widths_is_less_sure():
    confidence = {}
    for width in (2.4, 6.4, 12.4):
        _, matching, (i, j) = the_gap(in_line((20.0, 200.0), (225.0, 400.0), widths=(6.4, width)))
        confidence[width] = Gaps(matching, 6.0).confidence(i, j, 4.0)
    assert confidence[6.4] > confidence[12.4] > confidence[2.4]


def test_the_taper_is_that_of_widths_a_pixel_wider():
    assert taper_of(5.0, 2.0) == taper_of(2.0, 5.0) == pytest.approx(math.log(2.0))
    assert taper_of(0.0, 0.0) == 0.0


def test_a_branch_without_points_of_its_own_has_no_width():
    _, matching, (i, _) = the_gap(in_line((20.0, 200.0), (230.0, 390.0)))
    assert usual_width(matching, i) == pytest.approx(6.4, abs=1.0)
    start, _ = matching.branches.spans[branch_of(i)]
    matching.branches.spans[branch_of(i)] = start, start
    assert usual_width(matching, i) == 0.0


def test_the_odds_are_at_most_those_of_the_alternative():
    _, matching, (i, j) = the_gap(in_line((20.0, 200.0), (210.0, 390.0)))
    for margin in (-2.0, 0.0, 0.5):
        assert Gaps(matching, 6.0).confidence(i, j, margin) == pytest.approx(1.0 / (1.0 + math.exp(-margin)))
    assert crossing_confidence(0.5, 0.0, bounded=True) == pytest.approx(1.0 / (1.0 + math.exp(-0.5)))
    assert crossing_confidence(0.5, 0.0, bounded=False) > crossing_confidence(0.5, 0.0, bounded=True)
    assert crossing_confidence(math.inf, 0.0, bounded=True) == 1.0


def test_the_log_odds_rise_with_margin_and_length_and_fall_with_taper():
    base = gap_log_odds(1.0, 2.0, 0.1)
    assert gap_log_odds(1.5, 2.0, 0.1) > base
    assert gap_log_odds(1.0, 2.5, 0.1) > base
    assert gap_log_odds(1.0, 2.0, 0.3) < base


SHORT = in_line((150.0, 175.0), (205.0, 230.0))


def test_a_doubtful_gap_is_opened_and_kept_as_a_near_joint():
    graph, matching, (i, j) = the_gap(SHORT)
    margin = matching.margin[i]
    open_doubtful_gaps(matching, graph.width, 0.0)
    assert matching.partner[i] == j
    open_doubtful_gaps(matching, graph.width, 0.5)
    assert matching.is_open(i)
    assert matching.is_open(j)
    assert (-margin, i, j) in matching.near_joints
    assert list(matching.near_joints) == sorted(matching.near_joints)


def test_each_piece_has_the_other_as_its_near_joint():
    result = detect(SHORT)
    assert sorted(round(one.curve.length) for one in result) == [30, 30]
    for one, other in (result, result[::-1]):
        (near,) = one.near_joints
        assert 0.0 < near.confidence < 0.5
        known = one.existence * one.centerline.course_confidence
        assert one.confidence == pytest.approx((1.0 - near.confidence) * known)
        here = one.curve.sample(2)[int(near.u)]
        there = min(other.curve.sample(2), key=lambda end: np.hypot(*(end - here)))
        assert np.hypot(*(there - near.point)) < 6.0


def test_the_least_confidence_may_be_set():
    assert len(detect(SHORT, config={"linking": {"min_gap_confidence": 0.0}})) == 1
    long = in_line((20.0, 200.0), (230.0, 390.0))
    assert len(detect(long)) == 1
    (one, other) = detect(long, config={"linking": {"min_gap_confidence": 1.0}})
    assert len(one.near_joints) == len(other.near_joints) == 1
    assert one.near_joints[0].confidence > 0.5


def test_a_known_number_of_objects_bridges_it_all_the_same():
    (found,) = detect(SHORT, objects=1)
    assert found.curve.length == pytest.approx(86.0, abs=3.0)


def test_a_crossing_is_never_opened():
    assert len(detect(draw(*cross(60)), config={"linking": {"min_gap_confidence": 1.0}})) == 2
