"""A cable that is cut in plain sight is two; one that something passes over, or whose ends come to light, is one."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from builders import detection_of, line
from linking_examples import draw
from tracked_curves import error_px, ids, see, shown_for

from dloftbs import BSplineCurve, Frame, OcclusionEvidence, Pipeline
from dloftbs.data.centerline import Joint, JointKind
from dloftbs.tracking import Tracker

LENGTH, CUT = 500.0, 300.0
BELOW = 200.0
GAPS = np.arange(2.0, 42.0, 2.0)
"""Widths of a gap that grows, px; the objects are 6 px wide."""


def joined(gap: float, *, left: float = 0.0, right: float = LENGTH, at: float = CUT):
    """Return the detection of a cable from `left` to `right` that bridges a gap behind a place."""
    span = (at - left) / (right - left), (at + gap - left) / (right - left)
    return detection_of(line((left, BELOW), (right, BELOW)), joints=(Joint(JointKind.GAP, span, 1.0, 1.0),))


def apart(gap: float, *, right: float = LENGTH, at: float = CUT) -> list[BSplineCurve]:
    return [line((0.0, BELOW), (at, BELOW)), line((at + gap, BELOW), (right, BELOW))]


@pytest.mark.parametrize("bridged", [True, False])
@pytest.mark.parametrize("share", [0.6, 0.4])
def test_a_cable_that_is_cut_in_plain_sight_is_two_and_the_longer_one_keeps_the_track(bridged: bool, share: float):
    tracker, at = Tracker(), share * LENGTH
    shown_for(tracker, 20, line((0.0, BELOW), (LENGTH, BELOW)))
    for gap in GAPS:
        parts = apart(gap, right=LENGTH + gap, at=at)
        tracks = tracker.update([joined(gap, right=LENGTH + gap, at=at)]) if bridged else see(tracker, *parts)
    assert ids(tracks) == [1, 2]
    longer, shorter = sorted(parts, key=lambda one: -one.length)
    for track, part in zip(tracks, (longer, shorter), strict=True):
        assert track.state.value == "confirmed"
        assert not track.inferred
        assert error_px(track.curve, part) < 1.0
    assert [one.apart for one in tracker.predict()] == [{2}, {1}]
    tracks = see(tracker, *parts)
    assert ids(tracks) == [1, 2]
    np.testing.assert_array_equal(tracks[0].curve.control_points, longer.control_points)
    assert {track.velocity is not None for track in tracks} == {True}


def test_parts_that_move_together_are_not_apart_though_one_was_covered_for_a_while():
    """The ends of both are compared in the frames that showed both."""
    tracker, gap = Tracker(), 6.0
    for k in range(34):
        x = 6.0 * k
        if k == 33:
            tracker.update([joined(gap, left=x, right=x + LENGTH, at=x + CUT)], k / 30)
            continue
        first, second = line((x, BELOW), (x + CUT, BELOW)), line((x + CUT + gap, BELOW), (x + LENGTH, BELOW))
        tracker.update([second] if 18 <= k < 28 else [first, second], k / 30)
    assert [one.apart for one in tracker.predict()] == [set(), set()]


@pytest.mark.parametrize("bridged", [True, False])
def test_a_cable_that_something_passes_over_is_one_since_its_parts_are_shorter_by_the_gap(bridged: bool):
    tracker = Tracker()
    shown_for(tracker, 20, line((0.0, BELOW), (LENGTH, BELOW)))
    for gap in [*GAPS, *[GAPS[-1]] * 20, *(GAPS[::-1] if bridged else [])]:
        at = CUT - 0.5 * gap
        tracks = tracker.update([joined(gap, at=at)]) if bridged else see(tracker, *apart(gap, at=at))
        assert ids(tracks) == [1]


@pytest.mark.parametrize("bridged", [True, False])
def test_a_cable_that_loses_an_end_before_something_passes_over_it_is_one(bridged: bool):
    tracker, gap = Tracker(), 20.0
    shown_for(tracker, 20, line((0.0, BELOW), (LENGTH, BELOW)))
    shown_for(tracker, 1, line((0.0, BELOW), (LENGTH - 12.0, BELOW)))
    for _ in range(10):
        at = CUT - 0.5 * gap
        tracks = tracker.update([joined(gap, at=at)]) if bridged else see(tracker, *apart(gap, at=at))
        assert ids(tracks) == [1]


def test_a_gap_below_two_widths_that_grows_at_one_side_leaves_a_cable_one():
    tracker, other = Tracker(), line((0.0, 2.0 * BELOW), (LENGTH, 2.0 * BELOW))
    shown_for(tracker, 20, line((0.0, BELOW), (LENGTH, BELOW)), other)
    for gap in np.arange(1.0, 7.0, 0.2):
        assert ids(see(tracker, *apart(gap), other)) == [1, 2]


@pytest.mark.parametrize("rate", [0.004, 0.01])
def test_a_cable_that_comes_nearer_under_an_occluder_is_one(rate: float):
    tracker = Tracker()
    for frame in range(40):
        scale = (1.0 + rate) ** frame
        gap = max(2.0 * (frame - 20), 0.0)
        right = LENGTH * scale
        found = joined(gap, right=right) if gap else detection_of(line((0.0, BELOW), (right, BELOW)))
        assert ids(tracker.update([found])) == [1]


def test_an_end_that_comes_out_beyond_what_hid_it_belongs_to_its_cable():
    tracker, hidden = Tracker(), 60.0
    for way in np.arange(-20.0, LENGTH, 3.0):
        low, high = max(way, 0.0), min(max(way + hidden, 0.0), LENGTH)
        curves = [line((a, BELOW), (b, BELOW)) for a, b in ((0.0, low), (high, LENGTH)) if b - a > 6.0]
        found = [joined(high - low, at=low)] if len(curves) == 2 else [detection_of(one) for one in curves]
        tracks = tracker.update(found)
        assert ids(tracks) == [1]


def test_a_gap_under_a_known_occluder_is_none_between_two():
    hiding = np.zeros((400, 600), dtype=np.uint8)
    hiding[:, 290:350] = 1
    tracker = Tracker()
    shown_for(tracker, 20, line((0.0, BELOW), (LENGTH, BELOW)))
    for gap in GAPS:  # it is pulled out under what hides it
        tracks = tracker.update([joined(gap, right=LENGTH + gap)], occlusion=OcclusionEvidence(occluders=hiding))
    assert ids(tracks) == [1]


def test_each_part_of_a_cable_that_is_cut_has_its_part_in_space():
    tracker = Tracker()
    for gap in [0.0] * 20 + GAPS.tolist():
        parts = apart(gap, right=LENGTH + gap) if gap else [line((0.0, BELOW), (LENGTH, BELOW))]
        in_space = [line(*((0.001 * one(u)[0], 0.2, 1.0) for u in (0.0, 1.0))) for one in parts]
        tracks = tracker.update([detection_of(*both) for both in zip(parts, in_space, strict=True)])
    assert ids(tracks) == [1, 2]
    assert [round(track.curve_3d.length, 3) for track in tracks] == [0.3, 0.2]


def test_a_cable_that_is_cut_twice_is_three():
    tracker = Tracker()
    shown_for(tracker, 20, line((0.0, BELOW), (LENGTH, BELOW)))
    for gap in GAPS:
        see(tracker, *apart(gap, right=LENGTH + gap))
    first, last = apart(40.0, right=540.0)
    shown_for(tracker, 20, first, last)
    for gap in GAPS:
        parts = line((-gap, BELOW), (150.0 - gap, BELOW)), line((150.0, BELOW), (300.0, BELOW))
        tracks = see(tracker, *parts, last)
    assert ids(tracks) == [1, 2, 3]
    assert sorted(round(track.curve.length) for track in tracks) == [150, 150, 200]


def masks_of_a_cut(count: int = 40) -> list[np.ndarray]:
    """Return frames of a cable that is cut after ten of them, and its parts move away from each other."""
    ways = [1.0 * max(frame - 10, 0) for frame in range(count)]
    return [draw([(40, 100), (190, 100)], [(190 + way, 100), (300 + way, 100)]) for way in ways]


def test_the_linking_does_not_join_what_was_cut():
    pipeline = Pipeline()
    results = [pipeline.process(Frame(mask=mask, index=k)) for k, mask in enumerate(masks_of_a_cut())]
    two = [len(result.tracks) == 2 for result in results]
    first = two.index(True)
    assert first < 36
    assert all(two[first:])
    assert all(len(result.detections) == 2 for result in results[first + 1 :])
    assert len(pipeline.detect(Frame(mask=masks_of_a_cut()[first + 1])).detections) == 1


@pytest.mark.parametrize("seen_apart", [True, False])
def test_the_linking_does_not_join_two_whose_ends_moved_towards_each_other(seen_apart: bool):
    pipeline = Pipeline()
    distances = [150.0] * 12 + [float(way) for way in range(144, 12, -6)] if seen_apart else []
    results = [
        pipeline.process(Frame(mask=draw([(20, 100), (120, 100)], [(120 + way, 100), (220 + way, 100)]), index=k))
        for k, way in enumerate([*distances, *[18.0] * 3])
    ]
    assert len(results[-1].detections) == (2 if seen_apart else 1)
    assert all(one.id != other.id for one, other in itertools.combinations(results[-1].tracks, 2))
