"""Hypotheses: what is followed on, what is given up, and that a later frame may decide an earlier one."""

from __future__ import annotations

import numpy as np
import pytest
from builders import bent, detection_of
from tracked_curves import level

from dloftbs import Tracker
from dloftbs.data.centerline import Joint, JointKind
from dloftbs.tracking.association import FrameReading
from dloftbs.tracking.hypotheses import MAX_HYPOTHESES, Hypothesis, Ids, continue_with, select_likeliest
from dloftbs.tracking.observation import make_observations
from dloftbs.tracking.partial_match import WHOLE, PartialMatch, TrackObservation
from dloftbs.tracking.track_model import TrackModel

SEEN = make_observations([detection_of(level(y)) for y in (100.0, 200.0)])

CLEAR_FRAMES = 3
"""Clear frames that outweigh any number of unsure ones."""


def whole(index: int) -> TrackObservation:
    return TrackObservation((PartialMatch(SEEN[index], WHOLE, WHOLE),))


def half(index: int, share: float = 0.5) -> TrackObservation:
    return TrackObservation((PartialMatch(SEEN[index], (0.0, share), WHOLE),))


NOTHING = TrackObservation()


def followed(nats: float, *readings: FrameReading):
    return continue_with(Hypothesis([], nats), readings)


def test_a_frame_adds_its_log_odds_to_those_before():
    (one,) = followed(-2.0, FrameReading([], 1.5))
    assert one.nats == pytest.approx(-0.5)


def test_the_likeliest_ones_are_followed_and_only_as_far_as_they_may_be_right():
    made = followed(
        0.0, *[FrameReading([half(0, 0.1 * k)], n) for k, n in enumerate((0.0, -99.0, 3.0, 2.0, 1.0, -1.0), 1)]
    )
    assert [one.nats for one in select_likeliest(made)] == [3.0, 2.0, 1.0, 0.0][:MAX_HYPOTHESES]
    assert [one.nats for one in select_likeliest(made[:2])] == [0.0]


def test_of_those_that_end_in_the_same_objects_only_the_likeliest_goes_on():
    """Whoever they are, and whatever else there is that is not seen."""
    same = followed(0.0, FrameReading([whole(0), whole(1)], 0.0), FrameReading([whole(1), NOTHING, whole(0)], 1.0))
    other = followed(0.0, FrameReading([whole(0), half(1)], -1.0), FrameReading([half(1), whole(0)], -2.0))
    less = followed(0.0, FrameReading([whole(0)], -2.0), FrameReading([whole(0), half(1, 0.3)], -2.5))
    assert [one.nats for one in select_likeliest([*same, *other, *less])] == [1.0, -1.0, -2.0, -2.5]


def test_an_object_that_a_frame_begins_has_one_id_in_all_hypotheses():
    ids = Ids()
    ids.start_frame()
    assert [ids.of_detection(3), ids.of_part(3), ids.of_detection(3), ids.of_detection(4)] == [1, 2, 1, 3]
    ids.start_frame()
    assert ids.of_detection(3) == 4


def test_a_track_that_is_copied_goes_on_by_itself():
    model = TrackModel.from_observation(1, SEEN[0])
    model.update_whole(SEEN[0])
    before = {name: np.array(getattr(model.lengths, name)) for name in ("recent_px", "recent_ends", "full_px")}
    points, seen, belief = model.points, model.sight.seen_frames.copy(), model.belief.log_odds
    other = model.copied()
    for _ in range(3):
        other.update_whole(SEEN[1])
        other.motion.step(other.points, SEEN[1].points, 0.1, is_known=True)
        other.count_hit(1)
        other.record(None)
    assert model.points is points
    assert model.hits == 0
    assert model.belief.log_odds == belief
    np.testing.assert_array_equal(model.sight.seen_frames, seen)
    assert not model.motion.velocity.any()
    for name, values in before.items():
        np.testing.assert_array_equal(getattr(model.lengths, name), values)


@pytest.mark.parametrize("frames", [1, 3, 100])
def test_clear_frames_outweigh_unsure_ones_however_many(frames):
    """Two cables cross and lie still; they are read as two that touch, however often, and then clearly."""
    left, middle, right = ((100.0, 200.0), (100.0, 400.0)), (300.0, 300.0), ((500.0, 200.0), (500.0, 400.0))
    apart = [bent(left[0], middle, right[0]), bent(left[1], middle, right[1])]
    crossing = [bent(left[0], middle, right[1]), bent(left[1], middle, right[0])]
    unsure = Joint(JointKind.CROSSING, (0.48, 0.52), 1.0, 0.2, 0.3)
    tracker = Tracker()
    for _ in range(frames):
        tracker.update([detection_of(one, joints=(unsure,)) for one in apart], size=(600, 900))
    for _ in range(CLEAR_FRAMES):
        seen = [detection_of(one) for one in crossing]
        tracks = tracker.update(seen, size=(600, 900))
    assert [track.id for track in tracks] == [1, 2]
    assert {track.detection for track in tracks} <= {*seen, *[one.reversed() for one in seen]}
    assert all(track.curve == track.detection.curve for track in tracks)
