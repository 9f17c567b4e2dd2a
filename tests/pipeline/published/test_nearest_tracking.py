"""Tracks as published, on curves built by hand."""

from __future__ import annotations

import pytest
from builders import detection_of, line, wave

from dloftbs.config import Config, NearestTrackingConfig, TrackingConfig
from dloftbs.data.tracks import TrackState
from dloftbs.errors import InputError
from dloftbs.pipeline import make_tracker
from dloftbs.pipeline.published import NearestTracker
from dloftbs.tracking import Tracker


def test_a_configuration_says_which_way_objects_are_followed():
    assert isinstance(make_tracker(Config().tracking), Tracker)
    assert isinstance(make_tracker(Config.paper().tracking), NearestTracker)
    assert Config.from_dict({"tracking": {"gate": 0.3}}).tracking == TrackingConfig(gate=0.3)
    assert Config.from_dict({"tracking": {"method": "nearest"}}).tracking == NearestTrackingConfig()


def test_ids_and_directions_are_those_of_the_nearest_curve():
    tracker, upper, lower = NearestTracker(), wave(), wave((0.0, 100.0))
    tracker.update([upper, lower])
    tracks = tracker.update([lower.reversed(), upper])
    assert [track.id for track in tracks] == [1, 2]
    assert [track.curve for track in tracks] == [upper, lower.reversed().reversed()]
    assert [track.hits for track in tracks] == [2, 2]
    assert all(track.state is TrackState.CONFIRMED for track in tracks)


def test_nothing_is_expected_and_nothing_made_up():
    tracker = NearestTracker()
    for step in range(5):
        tracker.update([wave((40.0 * step, 0.0))])
    assert tracker.update([]) == ()
    (track,) = tracker.update([wave((500.0, 300.0))])  # still the nearest to it
    assert (track.id, track.inferred, track.confidence) == (1, (), 1.0)
    assert [track.id for track in tracker.update([wave((500.0, 300.0)), wave()])] == [1, 2]


def test_a_detection_is_published_with_its_curve_in_space():
    tracker = NearestTracker()
    found = detection_of(wave(), line((0.0, 0.0, 1.0), (0.5, 0.0, 1.0)))
    tracker.update([found])
    (track,) = tracker.update([found.reversed()])
    assert (track.curve, track.curve_3d) == (track.detection.curve, track.detection.curve_3d)
    assert track.curve(0.0) == pytest.approx(wave()(0.0))


def test_the_same_frame_again_changes_nothing_and_ids_are_not_used_twice():
    tracker = NearestTracker()
    first = tracker.update([wave()], stamp=1.0)
    assert tracker.update([], stamp=1.0) is first
    tracker.reset()
    assert [track.id for track in tracker.update([wave()], stamp=1.0)] == [2]
    with pytest.raises(InputError, match="finite"):
        tracker.update([], stamp=float("inf"))
