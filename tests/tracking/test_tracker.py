"""The tracker: stamps, the life of a track, smoothing and bare curves, on curves built by hand."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
from builders import curve_through, detection_of, line, loop, through_json, wave
from tracked_curves import CONFIRMED, FRAME_S, HIDDEN, TENTATIVE, doubtful, error_px, ids, level, see, shown_for

from dloftbs.config import TrackingConfig
from dloftbs.data.detection import Detection
from dloftbs.data.tracks import TrackState
from dloftbs.errors import InputError
from dloftbs.tracking import Tracker

NO_STAMPS = {
    "nan": float("nan"),
    "inf": float("inf"),
    "text": "0.5",
    "bool": True,
    "400 digits": 10**400,
    "milliseconds": 1.7e12,
    "time": np.datetime64("2026-01-01"),
    "span": np.timedelta64(5, "s"),
    "array": np.array([1.0]),
}


@pytest.mark.parametrize("stamp", NO_STAMPS.values(), ids=NO_STAMPS)
def test_what_is_no_time_in_seconds_is_refused_and_changes_nothing(stamp):
    tracker = Tracker()
    before = tracker.update([wave()], 0.0)
    with pytest.raises(InputError, match="stamp must be a finite number of seconds, 1e\\+11 at most, got"):
        tracker.update([wave()], stamp)
    with pytest.raises(InputError, match="stamp must be"):
        tracker.predict(stamp)
    assert tracker.tracks == before
    assert tracker.update([wave()], 0.1)[0].hits == 2


@pytest.mark.parametrize("size", [(-1, 5), (5,), (5.0, 5.0), "55", 5, (10**400, 5), (True, 5)])
def test_what_is_no_size_is_refused(size):
    with pytest.raises(InputError, match="size must be two integers of at least 0"):
        Tracker().update([wave()], 0.0, size)


@pytest.mark.parametrize("width", ["3", None, -1.0, float("inf"), 10**400, True])
def test_what_is_no_width_is_refused(width):
    with pytest.raises(InputError, match="a width must be a finite number"):
        Tracker().update([wave()], widths=[width])


@pytest.mark.parametrize("later", [1e-300, 5e-324, 1e-9, -1e-9, 1e-6])
def test_a_stamp_that_differs_by_rounding_is_the_same_frame_once_more(later):
    tracker = Tracker()
    before = tracker.update([wave()], 0.0)
    assert tracker.update([wave((3.0, 0.0))], later) is before
    (track,) = tracker.update([wave((6.0, 0.0))], 0.1)
    assert track.hits == 2
    assert np.abs(tracker.predict(0.2)[0].curve.control_points - wave((12.0, 0.0)).control_points).max() < 3.0


def states(tracks) -> list[TrackState]:
    return [track.state for track in tracks]


class TestLife:
    def test_nothing_seen_is_no_track(self):
        tracker = Tracker()
        assert tracker.tracks == ()
        assert tracker.update([]) == ()
        assert tracker.update(()) == ()

    def test_bare_curves_are_confirmed_at_once(self):
        assert states(see(Tracker(), wave())) == [CONFIRMED]

    @pytest.mark.parametrize(("existence", "frames"), [(1.0, 2), (0.75, 4), (0.5, 7), (0.1, 7)])
    def test_a_track_is_confirmed_once_its_frames_together_are_sure_of_it(self, existence, frames):
        tracker = Tracker()
        seen = [tracker.update([doubtful(wave(), existence)])[0] for _ in range(6)]
        assert states(seen) == [TENTATIVE] * (frames - 1) + [CONFIRMED] * (7 - frames)
        assert [track.hits for track in seen] == [1, 2, 3, 4, 5, 6]
        assert ids(seen) == [1] * 6

    @pytest.mark.parametrize(("frames", "outlived"), [(1, 1), (3, 2)])
    def test_a_tentative_track_outlives_more_misses_the_oftener_it_was_seen(self, frames, outlived):
        for misses in (outlived, outlived + 1):
            tracker = Tracker()
            for _ in range(frames):
                tracker.update([doubtful(wave(), 0.7)])
            for _ in range(misses):
                assert see(tracker) == ()
                assert states(tracker.lost) in ([], [TENTATIVE])
            (track,) = tracker.update([doubtful(wave(), 0.7)])
            assert (track.id, track.hits) == ((1, frames + 1) if misses == outlived else (2, 1))
            assert track.state is TENTATIVE

    def test_one_that_is_no_cable_for_all_its_frames_say_ends_with_the_first_miss(self):
        tracker = Tracker()
        for _ in range(5):
            tracker.update([doubtful(wave(), 0.4)])
        assert see(tracker) == ()
        assert tracker.lost == ()

    @pytest.mark.parametrize("frames", [0, 1, 5])
    def test_what_is_missing_is_kept_exactly_as_long_as_it_may(self, frames):
        tracker = Tracker(TrackingConfig(keep_lost_s=frames * FRAME_S))
        (last,) = see(tracker, wave())
        for misses in range(1, frames + 1):
            assert see(tracker) == ()
            (track,) = tracker.lost
            assert (track.id, track.state, track.hits, track.misses) == (1, HIDDEN, 1, misses)
            assert track.curve is last.curve
            assert track.detection is None
            assert track.inferred == ((0.0, 1.0),)
        assert see(tracker) == ()
        assert tracker.lost == ()
        assert ids(see(tracker, wave())) == [2]

    def test_what_comes_back_is_the_same_and_may_be_missing_as_long_again(self):
        tracker = Tracker(TrackingConfig(keep_lost_s=2 * FRAME_S))
        for _ in range(2):
            see(tracker, wave())
        for hits in (3, 4):
            see(tracker)
            assert see(tracker) == ()
            assert states(tracker.lost) == [HIDDEN]
            (track,) = see(tracker, wave((3.0, 0.0)))
            assert (track.id, track.state, track.hits, track.misses) == (1, CONFIRMED, hits, 0)

    def test_the_confidence_in_what_is_not_seen_decays(self):
        tracker = Tracker()
        (seen,) = see(tracker, wave())
        confidence = []
        for _ in range(10):
            see(tracker)
            confidence.append(tracker.lost[0].confidence)
        assert confidence[0] < seen.confidence
        assert (np.diff(confidence) < 0.0).all()
        assert see(tracker, wave())[0].confidence == pytest.approx(seen.confidence, abs=1e-3)

    def test_a_track_carries_this_frame_s_detection(self):
        tracker = Tracker()
        curve_3d = line((0.0, 0.0, 1.0), (0.5, 0.0, 1.0))
        detection = detection_of(wave(), curve_3d)
        (track,) = tracker.update([detection])
        assert track.detection is detection
        assert (track.curve, track.curve_3d) == (detection.curve, curve_3d)
        assert tracker.update([]) == ()
        (hidden,) = tracker.lost
        assert hidden.curve_3d is curve_3d

    def test_what_was_published_does_not_change_afterwards(self):
        tracker = Tracker()
        first = see(tracker, wave())
        before = through_json([track.to_dict() for track in first])
        assert tracker.tracks is first
        second = see(tracker, wave((5.0, 5.0)))
        assert tracker.tracks is second
        assert through_json([track.to_dict() for track in first]) == before

    def test_reset_forgets_the_tracks_and_uses_no_id_twice(self):
        tracker = Tracker()
        see(tracker, level(0), level(200))
        tracker.reset()
        assert tracker.tracks == ()
        assert see(tracker) == ()
        assert ids(see(tracker, level(0))) == [3]

    def test_trackers_count_for_themselves(self):
        first, second = Tracker(), Tracker()
        see(first, level(0), level(200))
        assert ids(see(second, level(0))) == [1]


def test_nothing_is_predicted_for_a_time_before_the_last_frame():
    tracker = Tracker()
    for k in range(5):
        tracker.update([line((20.0, 50.0), (220.0, 50.0))], k / 30)
    assert len(tracker.predict(4 / 30 - 1e-9)) == len(tracker.predict(5 / 30)) == 1
    assert tracker.predict(0.0) == ()


def test_a_width_of_nothing_is_not_known():
    tracker = Tracker()
    for _ in range(3):
        tracker.update([line((20.0, 50.0), (220.0, 50.0))], widths=[0.0])
    parts = [line((20.0, 50.0), (110.0, 50.0)), line((130.0, 50.0), (220.0, 50.0))]
    (track,) = tracker.update(parts, widths=[0.0, 0.0])
    assert track.width_px is None


def test_the_same_frames_give_the_same_tracks():
    def frames() -> list[list[Detection]]:
        rng = np.random.default_rng(3)
        shown = []
        for step in range(30):
            curves = [wave((float(step), 150.0 * k)) for k in range(3) if rng.random() < 0.7]
            rng.shuffle(curves)
            shown.append([detection_of(c.reversed() if rng.random() < 0.5 else c) for c in curves])
        return shown

    def run() -> list:
        tracker = Tracker()
        return [through_json([track.to_dict() for track in tracker.update(seen)]) for seen in frames()]

    first = run()
    assert any(len(tracks) == 3 for tracks in first)
    assert run() == first


class TestTime:
    def test_the_same_frame_again_changes_nothing(self):
        tracker = Tracker()
        first = tracker.update([wave()], stamp=1.0)
        assert tracker.update([], stamp=1.0) is first

    def test_time_counts_not_frames(self):
        tracker = Tracker(TrackingConfig(keep_lost_s=1.0))
        tracker.update([wave()], stamp=0.0)
        tracker.update([], stamp=0.9)
        assert ids(tracker.lost) == [1]
        tracker.update([], stamp=1.1)
        assert tracker.lost == ()

    def test_a_steady_motion_goes_on_over_dropped_frames(self):
        tracker = Tracker()
        for step in range(10):
            tracker.update([wave((900.0 * step / 30.0, 0.0))], stamp=step / 30.0)
        (prediction,) = tracker.predict(12.0 / 30.0)
        assert prediction.id == 1
        np.testing.assert_allclose(prediction.curve(0.5), wave((360.0, 0.0))(0.5), atol=2.0)
        before = tracker.tracks
        assert tracker.predict(12.0 / 30.0)[0].curve == prediction.curve
        assert tracker.tracks is before

    @pytest.mark.parametrize("frames", [2, 5])
    @pytest.mark.parametrize(("pause_s", "later"), [(1.9, 1), (2.5, 2), (7200.0, 2)])
    def test_a_pause_ends_a_track_as_empty_frames_would(self, frames, pause_s, later):
        tracker = Tracker(TrackingConfig(keep_lost_s=2.0))
        for step in range(frames):
            tracker.update([wave()], step * FRAME_S)
        stamp = (frames - 1) * FRAME_S + pause_s
        assert ids(tracker.predict(stamp)) == [1] * (later == 1)
        (track,) = tracker.update([wave()], stamp)
        assert (track.id, tracker.lost) == (later, ())

    def test_a_pause_adds_to_the_time_that_a_track_was_not_seen(self):
        tracker = Tracker(TrackingConfig(keep_lost_s=1.0))
        for step in range(20):
            tracker.update([wave()] if step < 5 else [], step * FRAME_S)
        assert ids(tracker.predict(19 * FRAME_S + 0.4)) == [1]
        assert tracker.predict(19 * FRAME_S + 0.7) == ()
        assert ids(tracker.update([wave()], 19 * FRAME_S + 0.7)) == [2]

    def test_a_steady_motion_is_measured_where_every_second_frame_has_a_stamp(self):
        tracker = Tracker()
        for step in range(20):
            (track,) = tracker.update([level(180.0 * step * FRAME_S)], None if step % 2 else step * FRAME_S)
            if step >= 10:
                assert track.velocity[:, 1] == pytest.approx(180.0, rel=1e-3)

    @pytest.mark.parametrize("frames", [2, 5])
    @pytest.mark.parametrize("are_dropped", [True, False])
    def test_dropped_frames_widen_the_gate_as_empty_ones_do(self, frames, are_dropped):
        tracker = Tracker()
        for step in range(frames):
            tracker.update([level(0.0, 400.0), level(300.0, 400.0)], step * FRAME_S)
        for step in range(0 if are_dropped else 29):
            tracker.update([], (frames + step) * FRAME_S)
        tracks = tracker.update([level(60.0, 400.0), level(360.0, 400.0)], (frames + 29) * FRAME_S)
        assert ids(tracks) == [1, 2]
        assert [track.curve(0.5)[1] for track in tracks] == pytest.approx([60.0, 360.0])

    def test_a_prediction_is_the_less_sure_the_longer_the_stream_pauses(self):
        tracker = Tracker()
        for step in range(6):
            tracker.update([wave()], step * FRAME_S)
        (soon,), (later,) = tracker.predict(6 * FRAME_S), tracker.predict(6 * FRAME_S + 1.0)
        for step in range(6, 36):
            tracker.update([], step * FRAME_S)
        (unseen,) = tracker.predict(36 * FRAME_S)
        assert later.confidence == pytest.approx(0.25 * soon.confidence, rel=1e-6)
        assert later.confidence == pytest.approx(unseen.confidence, rel=1e-6)

    @pytest.mark.parametrize("what", ["stamp", "size"])
    def test_what_does_not_follow_on_the_last_frame_is_a_reset_or_an_error(self, what, caplog):
        other = {"stamp": {"stamp": 0.5}, "size": {"stamp": 1.5, "size": (20, 10)}}[what]
        tracker = Tracker()
        tracker.update([wave()], stamp=1.0, size=(10, 20))
        assert ids(tracker.update([wave()], **other)) == [2]
        (told,) = caplog.messages
        assert what in told
        assert told.endswith("all tracks are forgotten")
        strict = Tracker(TrackingConfig(on_new_size="error", on_old_stamp="error"))
        strict.update([wave()], stamp=1.0, size=(10, 20))
        with pytest.raises(InputError, match="reset"):
            strict.update([wave()], **other)
        assert len(strict.tracks) == 1

    def test_a_stamp_must_be_finite(self):
        with pytest.raises(InputError, match="finite"):
            Tracker().update([], stamp=float("nan"))

    def test_after_a_cut_nothing_keeps_its_id(self):
        tracker = Tracker(TrackingConfig(keep_lost_s=5 * FRAME_S))
        shown_for(tracker, 10, level(0.0), level(100.0))
        tracks = shown_for(tracker, 6, line((900.0, 0.0), (900.0, 600.0)), line((1100.0, 0.0), (1100.0, 600.0)))
        assert ids(tracks) == [3, 4]

    def test_memory_does_not_grow(self):
        tracker = Tracker(TrackingConfig(keep_lost_s=0.1, smoothing_s=0.1))
        sizes = []
        for step in range(400):
            see(tracker, level(0.0), wave((0.0, 200.0 + 300.0 * (step % 3))))
            sizes.append(len(pickle.dumps(tracker)))
        assert max(sizes[200:]) < max(sizes[:200]) + 64  # numbers of more digits


class TestSmoothing:
    def test_it_lags_behind_a_steady_motion_by_as_much_as_it_says(self):
        tracker = Tracker(TrackingConfig(smoothing_s=0.2))
        for step in range(120):
            (track,) = tracker.update([level(100.0 * step / 30.0)], stamp=step / 30.0)
        assert track.curve(0.5)[1] == pytest.approx(100.0 * (119 / 30.0 - 0.2), abs=0.1)

    @pytest.mark.parametrize("shape", [wave(), loop(60.0)], ids=["open", "closed"])
    def test_what_stands_still_is_not_changed(self, shape):
        tracker = Tracker(TrackingConfig(smoothing_s=0.2))
        (track,) = shown_for(tracker, 10, shape)
        assert error_px(track.curve, shape) < 0.1

    @pytest.mark.parametrize("turns", [2, 6, 14])
    def test_a_coil_that_stands_still_is_not_changed(self, turns):
        angle = np.linspace(0.0, 2.0 * np.pi * turns, 60 * turns)
        coil = np.stack((60.0 * np.cos(angle) + 4.0 * angle, 60.0 * np.sin(angle)), axis=1)
        for shape in (
            curve_through(coil),
            curve_through(np.vstack((coil, [(500.0, 300.0), (-100.0, 300.0)])), closed=True),
        ):
            (track,) = shown_for(Tracker(TrackingConfig(smoothing_s=0.1)), 5, shape)
            assert error_px(track.curve, shape) < 1e-6

    def test_it_takes_the_noise_of_a_curve_that_stands_still(self):
        tracker, rng = Tracker(TrackingConfig(smoothing_s=0.3)), np.random.default_rng(0)
        still = wave().sample(25)
        errors = []
        for _ in range(100):
            seen = curve_through(still + rng.normal(0.0, 0.7, still.shape))
            (track,) = tracker.update([seen])
            errors.append((error_px(seen, wave()), error_px(track.curve, wave())))
        before, after = np.mean(errors[40:], axis=0)
        assert after < 0.3 * before

    def test_it_begins_anew_in_space_after_frames_without_a_curve_there(self):
        tracker = Tracker(TrackingConfig(smoothing_s=0.2))
        for step in range(60):
            y = 4.0 * step
            curve_3d = None if 20 <= step < 50 else line((0.0, 0.002 * y, 1.0), (1.0, 0.002 * y, 1.0))
            (track,) = tracker.update([detection_of(level(y), curve_3d)], stamp=step / 30.0)
            if step == 50:
                assert track.curve_3d.start[1] == pytest.approx(0.002 * y)

    def test_it_begins_anew_where_a_curve_jumps(self):
        """One object is seen alone: however far it moves, it is the same."""
        tracker = Tracker(TrackingConfig(smoothing_s=0.2))
        shown_for(tracker, 10, wave())
        (track,) = see(tracker, wave((0.0, 300.0)))
        assert track.id == 1
        assert error_px(track.curve, wave((0.0, 300.0))) < 0.1


class TestBareCurves:
    def test_curves_with_and_without_widths_are_followed(self):
        tracker = Tracker()
        for step in range(5):
            tracks = tracker.update([wave((step, 0.0)), wave((step, 200.0))], widths=[6.0, float("nan")])
        assert ids(tracks) == [1, 2]
        assert [track.width_px for track in tracks] == [6.0, None]
        assert all(track.detection is None for track in tracks)

    def test_a_thin_one_is_not_taken_for_a_thick_one(self):
        tracker = Tracker()
        tracker.update([wave()], widths=[4.0])
        assert ids(tracker.update([wave()], widths=[20.0])) == [2]
        assert ids(tracker.lost) == [1]

    @pytest.mark.parametrize("bad", [[line((0.0, 0.0, 1.0), (1.0, 0.0, 1.0))], [[(0.0, 0.0), (1.0, 1.0)]]])
    def test_anything_else_is_refused(self, bad):
        with pytest.raises(InputError, match="in the image"):
            Tracker().update(bad)

    def test_widths_are_one_for_each(self):
        with pytest.raises(InputError, match="one for each of 1"):
            Tracker().update([wave()], widths=[])
