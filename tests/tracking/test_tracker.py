"""The tracker: identity, direction, and the life of a track, on curves built by hand."""

from __future__ import annotations

import itertools
import pickle

import numpy as np
import pytest
from builders import curve_through, detection_of, line, loop, part, through_json, wave
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.centerline import Joint, JointKind
from dloftbs.config import TrackingConfig
from dloftbs.curve import BSplineCurve
from dloftbs.detection import Detection
from dloftbs.errors import InputError
from dloftbs.tracking import Tracker
from dloftbs.tracks import TrackState

TENTATIVE, CONFIRMED, HIDDEN = TrackState.TENTATIVE, TrackState.CONFIRMED, TrackState.HIDDEN
AT_ONCE = TrackingConfig(min_hits=1)
FRAME_S = TrackingConfig().frame_s

_T = np.linspace(0.0, 1.0, 80)[:, None]
OMEGA = np.hstack((np.cos(1.8 * np.pi * _T), np.sin(1.8 * np.pi * _T))) * 100.0
SPIRAL = np.hstack((np.cos(5.0 * np.pi * _T), np.sin(5.0 * np.pi * _T))) * (20.0 + 60.0 * _T)
HAIRPIN = np.vstack((np.linspace((0, 0), (400, 0), 40), [(415, 20)], np.linspace((400, 40), (0, 40), 40)))
SHAPES = {
    "wave": wave(),
    **{k: curve_through(v) for k, v in (("omega", OMEGA), ("spiral", SPIRAL), ("hairpin", HAIRPIN))},
}


def level(y: float, length: float = 500.0) -> BSplineCurve:
    """Return a straight cable at a height, so that two of them are exactly as far apart as their heights."""
    return line((0.0, y), (length, y))


def see(tracker: Tracker, *curves: BSplineCurve):
    """Show the tracker one frame and return its tracks."""
    return tracker.update([detection_of(curve) for curve in curves])


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
    tracker = Tracker(AT_ONCE)
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
    tracker = Tracker(AT_ONCE)
    before = tracker.update([wave()], 0.0)
    assert tracker.update([wave((3.0, 0.0))], later) is before
    (track,) = tracker.update([wave((6.0, 0.0))], 0.1)
    assert track.hits == 2
    assert np.abs(tracker.predict(0.2)[0].curve.control_points - wave((12.0, 0.0)).control_points).max() < 3.0


def ids(tracks) -> list[int]:
    return [track.id for track in tracks]


def states(tracks) -> list[TrackState]:
    return [track.state for track in tracks]


def runs_like(curve: BSplineCurve, truth: BSplineCurve) -> bool:
    """Tell whether an open curve starts where the truth starts, a closed one whether it turns the same way."""
    if truth.closed:
        return turning(curve) * turning(truth) > 0
    return np.linalg.norm(curve(0.0) - truth(0.0)) < np.linalg.norm(curve(1.0) - truth(0.0))


def turning(curve: BSplineCurve) -> float:
    points = curve.sample(200)
    middle = points - points.mean(axis=0)
    return float((middle[:-1, 0] * middle[1:, 1] - middle[:-1, 1] * middle[1:, 0]).sum())


class TestLife:
    def test_nothing_seen_is_no_track(self):
        tracker = Tracker()
        assert tracker.tracks == ()
        assert tracker.update([]) == ()
        assert tracker.update(()) == ()

    @pytest.mark.parametrize("min_hits", [1, 2, 4])
    def test_a_track_is_confirmed_by_as_many_frames_as_it_takes(self, min_hits):
        tracker = Tracker(TrackingConfig(min_hits=min_hits))
        seen = [see(tracker, wave())[0] for _ in range(6)]
        assert states(seen) == [TENTATIVE] * (min_hits - 1) + [CONFIRMED] * (7 - min_hits)
        assert [track.hits for track in seen] == [1, 2, 3, 4, 5, 6]
        assert ids(seen) == [1] * 6

    def test_a_tentative_track_does_not_outlive_a_miss(self):
        tracker = Tracker(TrackingConfig(min_hits=3))
        see(tracker, wave())
        see(tracker, wave())
        assert see(tracker) == ()
        assert ids(see(tracker, wave())) == [2]

    @pytest.mark.parametrize("frames", [0, 1, 5])
    def test_what_is_missing_is_kept_exactly_as_long_as_it_may(self, frames):
        tracker = Tracker(TrackingConfig(min_hits=1, keep_lost_s=frames * FRAME_S))
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
        tracker = Tracker(TrackingConfig(min_hits=2, keep_lost_s=2 * FRAME_S))
        for _ in range(2):
            see(tracker, wave())
        for hits in (3, 4):
            see(tracker)
            assert see(tracker) == ()
            assert states(tracker.lost) == [HIDDEN]
            (track,) = see(tracker, wave((3.0, 0.0)))
            assert (track.id, track.state, track.hits, track.misses) == (1, CONFIRMED, hits, 0)

    def test_the_confidence_in_what_is_not_seen_decays(self):
        tracker = Tracker(AT_ONCE)
        assert see(tracker, wave())[0].confidence == 1.0
        confidence = []
        for _ in range(10):
            see(tracker)
            confidence.append(tracker.lost[0].confidence)
        assert confidence[0] < 1.0
        assert (np.diff(confidence) < 0.0).all()
        assert see(tracker, wave())[0].confidence == 1.0

    def test_a_track_carries_this_frame_s_detection(self):
        tracker = Tracker(AT_ONCE)
        curve_3d = line((0.0, 0.0, 1.0), (0.5, 0.0, 1.0))
        detection = detection_of(wave(), curve_3d)
        (track,) = tracker.update([detection])
        assert track.detection is detection
        assert (track.curve, track.curve_3d) == (detection.curve, curve_3d)
        assert tracker.update([]) == ()
        (hidden,) = tracker.lost
        assert hidden.curve_3d is curve_3d

    def test_what_was_published_does_not_change_afterwards(self):
        tracker = Tracker(AT_ONCE)
        first = see(tracker, wave())
        before = through_json([track.to_dict() for track in first])
        assert tracker.tracks is first
        second = see(tracker, wave((5.0, 5.0)))
        assert tracker.tracks is second
        assert through_json([track.to_dict() for track in first]) == before

    def test_reset_forgets_the_tracks_and_uses_no_id_twice(self):
        tracker = Tracker(AT_ONCE)
        see(tracker, level(0), level(200))
        tracker.reset()
        assert tracker.tracks == ()
        assert see(tracker) == ()
        assert ids(see(tracker, level(0))) == [3]

    def test_trackers_count_for_themselves(self):
        first, second = Tracker(), Tracker()
        see(first, level(0), level(200))
        assert ids(see(second, level(0))) == [1]


class TestIdentity:
    def test_two_cables_keep_theirs_while_they_move_and_come_in_any_order(self):
        tracker = Tracker()
        see(tracker, level(0), level(120))
        for step in range(1, 40):
            upper, lower = level(2.0 * step), level(120.0 + 3.0 * step)
            tracks = see(tracker, *((upper, lower) if step % 2 else (lower, upper)))
            assert ids(tracks) == [1, 2]
            assert [track.curve for track in tracks] == [upper, lower]

    def test_the_sum_of_the_distances_decides_not_the_nearest_pair(self):
        tracker = Tracker()
        see(tracker, level(0), level(10))
        first, second = see(tracker, level(20), level(8))  # 10 -> 8 is nearest, but would leave 0 -> 20
        assert (first.curve, second.curve) == (level(8), level(20))

    def test_as_many_tracks_as_possible_go_on(self):
        tracker = Tracker(TrackingConfig(gate=0.02, min_hits=1))  # 10 px
        see(tracker, level(0), level(9))
        first, second = see(tracker, level(9), level(18))  # 9 -> 9 is free, but would lose both 0 and 18
        assert (first.id, first.curve) == (1, level(9))
        assert (second.id, second.curve) == (2, level(18))

    @pytest.mark.parametrize(("step", "expected"), [(49.0, 1), (51.0, 2)])
    def test_what_is_farther_than_the_gate_is_another(self, step, expected):
        tracker = Tracker(TrackingConfig(gate=0.1, min_hits=1))  # 50 px
        see(tracker, level(0))
        tracks = see(tracker, level(step), level(900))
        assert [tracks[0].id, tracks[0].curve == level(step)] == [expected, True]

    @pytest.mark.parametrize("lengths", [(500.0, 125.0), (125.0, 500.0)])
    @pytest.mark.parametrize(("step", "expected"), [(24.0, 1), (26.0, 2)])
    def test_the_gate_is_a_share_of_the_mean_of_both_lengths(self, lengths, step, expected):
        tracker = Tracker(TrackingConfig(gate=0.1, min_hits=1))  # 25 px
        see(tracker, level(0, lengths[0]))
        assert ids(see(tracker, level(step, lengths[1])))[0] == expected

    @pytest.mark.parametrize("shape", SHAPES)
    def test_a_visible_part_is_still_the_same(self, shape):
        tracker = Tracker(TrackingConfig(gate=0.02, min_hits=1))
        whole = SHAPES[shape]
        see(tracker, whole)
        assert ids(see(tracker, part(whole, 0.6, 1.0))) == [1]
        assert ids(see(tracker, whole)) == [1]

    def test_a_newcomer_gets_the_next_id_and_the_others_keep_theirs(self):
        tracker = Tracker(AT_ONCE)
        see(tracker, level(100))
        assert ids(see(tracker, level(0), level(100), level(200))) == [1, 2, 3]
        assert [track.curve for track in tracker.tracks] == [level(100), level(0), level(200)]

    def test_one_of_two_leaves_and_the_other_stays(self):
        tracker = Tracker(TrackingConfig(min_hits=1, keep_lost_s=FRAME_S))
        see(tracker, level(0), level(200))
        assert ids(see(tracker, level(200))) == [2]
        assert ids(tracker.lost) == [1]
        assert ids(see(tracker, level(200))) == [2]
        assert tracker.lost == ()

    @pytest.mark.parametrize("span", [(0.0, 0.05), (0.45, 0.55), (0.2, 0.7)])
    def test_a_piece_does_not_take_the_track_of_the_whole(self, span):
        tracker = Tracker(AT_ONCE)
        see(tracker, wave())
        whole, piece = wave((0.0, 5.0)), part(wave(), *span)  # the whole one moved, the piece lies where it was
        tracks = see(tracker, piece, whole)
        assert ids(tracks) == [1, 2]
        assert (tracks[0].curve, tracks[1].curve) == (whole, piece)

    def test_a_detection_of_no_length_disturbs_no_other(self):
        tracker = Tracker(AT_ONCE)
        point = BSplineCurve([0.0] * 4 + [1.0] * 4, np.zeros((4, 2)))
        see(tracker, level(300))
        for _ in range(3):
            assert see(tracker, point, level(300))[0].curve == level(300)

    @given(st.lists(st.tuples(st.permutations([0, 1, 2]), st.tuples(*[st.booleans()] * 6)), max_size=25))
    def test_cables_that_come_and_go(self, frames):
        """Three cables far apart, none as long as another, seen or not, in any order and direction."""
        config, most_misses = TrackingConfig(min_hits=2, keep_lost_s=2 * FRAME_S), 2
        tracker = Tracker(config)
        alive: dict[int, list[int]] = {}  # per cable: id, hits, misses, whether confirmed
        newest = 0
        for order, flags in frames:
            visible, flipped = flags[:3], flags[3:]
            curves = {cable: level(200.0 * cable, 200.0 * 2.0**cable) for cable in order if visible[cable]}
            tracks = see(tracker, *(c.reversed() if flipped[cable] else c for cable, c in curves.items()))
            for cable in list(alive):
                number, hits, misses, confirmed = alive[cable]
                if visible[cable]:
                    alive[cable] = [number, hits + 1, 0, confirmed or hits + 1 >= config.min_hits]
                elif confirmed and misses < most_misses:
                    alive[cable] = [number, hits, misses + 1, True]
                else:
                    del alive[cable]
            for cable in order:
                if visible[cable] and cable not in alive:
                    newest += 1
                    alive[cable] = [newest, 1, 0, False]
            expected = sorted((number, hits, misses) for number, hits, misses, _ in alive.values())
            assert sorted((t.id, t.hits, t.misses) for t in (*tracks, *tracker.lost)) == expected
            assert all(t.detection is not None and t.state is not HIDDEN and not t.misses for t in tracks)
            assert all(t.detection is None and t.state is HIDDEN and t.misses for t in tracker.lost)


class TestDirection:
    @pytest.mark.parametrize("shape", SHAPES)
    def test_a_detector_that_flips_for_good_does_not_flip_the_track(self, shape):
        """The published direction counts, not the last detection's: that would hold for one frame only."""
        tracker = Tracker(AT_ONCE)
        truth = SHAPES[shape]
        see(tracker, truth)
        for _ in range(30):
            (track,) = see(tracker, truth.reversed())
            assert runs_like(track.curve, truth)

    @pytest.mark.parametrize("seed", range(5))
    def test_a_detector_that_flips_at_random_does_not_flip_a_moving_track(self, seed):
        rng = np.random.default_rng(seed)
        tracker = Tracker(AT_ONCE)
        for step in range(60):
            truth = wave((4.0 * step, -3.0 * step), phase=0.1 * step)
            (track,) = see(tracker, truth.reversed() if step and rng.random() < 0.5 else truth)
            assert track.id == 1
            np.testing.assert_allclose(track.curve([0.0, 1.0]), truth([0.0, 1.0]), atol=1e-9)

    def test_the_first_direction_published_is_the_one_kept(self):
        tracker = Tracker(AT_ONCE)
        backwards = wave().reversed()
        (first,) = see(tracker, backwards)
        assert first.curve is backwards
        (second,) = see(tracker, wave())
        assert runs_like(second.curve, backwards)

    def test_curve_in_space_and_detection_turn_with_the_curve(self):
        tracker = Tracker(AT_ONCE)
        curve, curve_3d = wave(), line((0.0, 0.0, 1.0), (0.5, 0.0, 1.0))
        forwards = detection_of(curve, curve_3d)
        tracker.update([forwards])
        (track,) = tracker.update([forwards.reversed()])
        np.testing.assert_allclose(track.curve_3d(0.0), curve_3d(0.0), atol=1e-9)
        assert track.detection.curve is track.curve
        assert track.detection.curve_3d is track.curve_3d
        np.testing.assert_array_equal(track.detection.centerline.points, forwards.centerline.points)

    def test_it_is_kept_over_frames_in_which_nothing_was_seen(self):
        tracker = Tracker(AT_ONCE)
        see(tracker, wave())
        for _ in range(5):
            see(tracker)
        (track,) = see(tracker, wave((6.0, 0.0)).reversed())
        assert runs_like(track.curve, wave())

    def test_each_of_two_cables_keeps_its_own(self):
        tracker = Tracker(AT_ONCE)
        rightwards, leftwards = level(0), level(100).reversed()
        see(tracker, rightwards, leftwards)
        for _ in range(4):
            first, second = see(tracker, leftwards.reversed(), rightwards.reversed())
            assert runs_like(first.curve, rightwards)
            assert runs_like(second.curve, leftwards)

    @pytest.mark.parametrize("flip", [False, True])
    @pytest.mark.parametrize("span", [(0.0, 0.3), (0.2, 0.6), (0.7, 1.0), (0.0, 0.9)])
    @pytest.mark.parametrize("shape", SHAPES)
    def test_it_is_kept_while_only_a_part_is_seen(self, shape, span, flip):
        tracker = Tracker(AT_ONCE)
        whole, visible = SHAPES[shape], part(SHAPES[shape], *span)
        see(tracker, whole)
        (track,) = see(tracker, visible.reversed() if flip else visible)
        np.testing.assert_allclose(track.curve([0.0, 1.0]), visible([0.0, 1.0]), atol=1e-9)
        (track,) = see(tracker, whole.reversed() if flip else whole)
        np.testing.assert_allclose(track.curve([0.0, 1.0]), whole([0.0, 1.0]), atol=1e-9)

    @pytest.mark.parametrize("flip", [False, True])
    @pytest.mark.parametrize("seam", [0.0, 1.0, np.pi, 5.0])
    @pytest.mark.parametrize("sense", [False, True])
    def test_a_loop_goes_round_the_same_way_wherever_it_starts(self, sense, seam, flip):
        tracker = Tracker(AT_ONCE)
        truth = loop(60.0).reversed() if sense else loop(60.0)
        see(tracker, truth)
        for step in range(1, 5):
            moved = loop(60.0, (2.0 * step, 0.0), start=seam * step)
            (track,) = see(tracker, moved.reversed() if flip else moved)
            assert track.id == 1
            assert track.curve.closed
            assert runs_like(track.curve, truth)

    @pytest.mark.parametrize("flip", [False, True])
    @pytest.mark.parametrize(("start", "turns"), [(0.0, 0.8), (0.3, 0.8), (0.8, 0.9), (0.9, 0.2), (0.35, 1.05)])
    def test_a_loop_with_a_break_still_goes_round_the_same_way(self, start, turns, flip):
        tracker = Tracker(AT_ONCE)
        ring = loop(60.0)
        broken = part(ring, start, start + turns)  # beyond one turn where the ends lie side by side
        see(tracker, ring)
        (track,) = see(tracker, broken.reversed() if flip else broken)
        assert not track.curve.closed
        assert turning(track.curve) > 0
        (track,) = see(tracker, ring.reversed() if flip else ring)
        assert turning(track.curve) > 0


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


def shown_for(tracker: Tracker, frames: int, *curves: BSplineCurve):
    """Show the tracker the same curves for some frames, and return its tracks."""
    for _ in range(frames):
        tracks = see(tracker, *curves)
    return tracks


def error_px(found: BSplineCurve, true: BSplineCurve) -> float:
    """Return the mean distance of points at equal parameters."""
    u = np.linspace(0.0, 1.0, 101)
    return float(np.linalg.norm(found(u) - true(u), axis=1).mean())


def is_covered(intervals, u: float) -> bool:
    return any(low <= u <= high for low, high in intervals)


class TestHidden:
    @pytest.mark.parametrize("flip", [False, True])
    @pytest.mark.parametrize("hidden", [(0.3, 0.5), (0.45, 0.75)])
    def test_two_parts_of_one_cable_are_one_track(self, hidden, flip):
        tracker = Tracker(AT_ONCE)
        shown_for(tracker, 10, wave())
        whole = wave((4.0, 2.0))
        first, second = part(whole, 0.0, hidden[0]), part(whole, hidden[1], 1.0)
        (track,) = see(tracker, second.reversed() if flip else second, first)
        assert (track.id, track.state) == (1, CONFIRMED)
        assert error_px(track.curve, whole) < 2.0
        ((low, high),) = track.inferred
        assert (low, high) == pytest.approx(hidden, abs=0.02)

    @pytest.mark.parametrize("shape", SHAPES)
    @pytest.mark.parametrize("span", [(0.0, 0.75), (0.25, 1.0)])
    def test_a_hidden_end_is_where_the_rest_says(self, shape, span):
        """The cable is carried and turned while a part of it is hidden."""
        tracker = Tracker(AT_ONCE)
        for step in range(10):
            see(tracker, turned(SHAPES[shape], 0.004 * step))
        for step in range(10, 16):
            whole = turned(SHAPES[shape], 0.004 * step)
            (track,) = see(tracker, part(whole, *span))
            assert track.id == 1
            assert error_px(track.curve, whole) < 0.02 * whole.length
            assert track.curve.length == pytest.approx(whole.length, rel=0.02)
            assert is_covered(track.inferred, 0.01) == (span[0] > 0.0)
            assert is_covered(track.inferred, 0.99) == (span[1] < 1.0)
            assert 0.5 < track.confidence < 1.0

    @pytest.mark.parametrize("flip", [False, True])
    @pytest.mark.parametrize("end", [0, 1])
    def test_an_end_that_goes_little_by_little_is_not_made_up(self, end, flip):
        """With a mask alone that is what a cable looks like that tilts."""
        tracker = Tracker(AT_ONCE)
        shown_for(tracker, 10, wave())
        for step in range(40):
            gone = 0.006 * step
            seen = part(wave(), *((gone, 1.0) if end == 0 else (0.0, 1.0 - gone)))
            (track,) = see(tracker, seen.reversed() if flip and step else seen)
            assert track.curve == (seen.reversed().reversed() if flip and step else seen)
            assert track.inferred == ()

    def test_what_is_seen_whole_is_published_as_it_was_detected(self):
        tracker = Tracker(AT_ONCE)
        for step in range(20):
            curve = wave((3.0 * step, step), phase=0.05 * step)
            (track,) = see(tracker, curve)
            assert track.curve is curve
            assert track.inferred == ()

    @pytest.mark.parametrize("shape", SHAPES)
    @pytest.mark.parametrize("rate", [0.998, 0.99])
    def test_an_object_that_goes_away_from_the_camera_is_not_taken_for_hidden(self, shape, rate):
        tracker = Tracker(AT_ONCE)
        shown_for(tracker, 10, SHAPES[shape])
        for step in range(1, 60):
            curve = SHAPES[shape].transformed(np.eye(2) * rate**step, [0.5 * step, 0.0])
            (track,) = see(tracker, curve)
            assert error_px(track.curve, curve) < 0.01 * curve.length

    def test_a_curve_in_space_is_whole_too(self):
        tracker = Tracker(AT_ONCE)
        curve, axis = level(0.0), line((0.0, 0.0, 1.0), (0.5, 0.0, 1.2))
        for _ in range(10):
            tracker.update([detection_of(curve, axis)])
        (track,) = tracker.update(
            [
                detection_of(part(curve, 0.0, 0.4), part(axis, 0.0, 0.4)),
                detection_of(part(curve, 0.6, 1.0), part(axis, 0.6, 1.0)),
            ]
        )
        assert error_px(track.curve_3d, axis) < 0.002
        (track,) = tracker.update([detection_of(part(curve, 0.0, 0.4)), detection_of(part(curve, 0.6, 1.0))])
        assert track.curve_3d is None

    def test_a_cable_hidden_for_a_second_is_found_again(self):
        tracker = Tracker(AT_ONCE)
        for step in range(10):
            see(tracker, wave((2.0 * step, 0.0)))
        shown_for(tracker, 30)
        (track,) = see(tracker, wave((40.0, 10.0)).reversed())
        assert (track.id, track.state) == (1, CONFIRMED)
        assert runs_like(track.curve, wave())

    def test_what_leaves_the_image_ends_where_it_leaves_it_and_comes_back_as_the_same(self):
        tracker, size = Tracker(AT_ONCE), (400, 300)
        for step in [*range(12), *range(11, -1, -1)]:
            whole = line((50.0 + 5.0 * step, 200.0), (290.0 + 5.0 * step, 200.0))
            seen = part(whole, 0.0, min(1.0, (249.0 - 5.0 * step) / 240.0))
            (track,) = tracker.update([detection_of(seen)], size=size)
            assert (track.id, track.curve, track.inferred) == (1, seen, ())


class TestPlainSight:
    """What is seen outranks what is believed."""

    @pytest.mark.parametrize("flip", [False, True])
    @pytest.mark.parametrize("shape", SHAPES)
    def test_a_cable_that_tilts_is_as_long_as_it_looks(self, shape, flip):
        rng = np.random.default_rng(7)
        tracker, truth = Tracker(AT_ONCE), SHAPES[shape]
        for step in range(60):
            angle = np.radians(65.0) * np.sin(np.pi * step / 60.0) ** 2
            seen = truth.transformed([[np.cos(angle), 0.0], [0.0, 1.0]], [0.5 * step, 0.0])
            axis = line((0.0, 0.0, 1.0), (0.5, 0.0, 1.0 + step))
            backwards = flip and step and rng.random() < 0.5
            found = detection_of(seen, axis)
            (track,) = tracker.update([found.reversed() if backwards else found])
            assert (track.id, track.inferred) == (1, ())
            expected = found.reversed().reversed() if backwards else found
            assert track.curve == expected.curve
            assert track.curve_3d == expected.curve_3d

    @pytest.mark.parametrize("step", [30.0, 80.0, 150.0])
    def test_the_only_object_is_the_same_however_fast_it_moves(self, step):
        tracker = Tracker(AT_ONCE)
        for number in range(12):
            seen = wave((step * number, (-1.0) ** number * step))
            (track,) = see(tracker, seen.reversed() if number % 2 else seen)
            assert (track.id, track.curve) == (1, seen.reversed().reversed() if number % 2 else seen)

    @pytest.mark.parametrize("other", [wave((300.0, 400.0)).transformed(2.0 * np.eye(2), [0, 0]), loop(60.0)])
    def test_unless_it_clearly_differs(self, other):
        tracker = Tracker(AT_ONCE)
        see(tracker, wave())
        assert ids(see(tracker, other.transformed(np.eye(2), [900.0, 900.0]))) == [2]

    def test_by_its_length_in_space_where_there_is_one(self):
        tracker = Tracker(AT_ONCE)
        axis = line((0.0, 0.0, 1.0), (0.5, 0.0, 1.0))
        tracker.update([detection_of(wave(), axis)])
        nearer = wave().transformed(1.7 * np.eye(2), [900.0, 0.0])
        assert ids(tracker.update([detection_of(nearer, axis)])) == [1]
        longer = line((0.0, 0.0, 1.0), (1.0, 0.0, 1.0))
        assert ids(tracker.update([detection_of(nearer.transformed(np.eye(2), [0.0, 900.0]), longer)])) == [2]

    def test_one_that_is_taken_away_does_not_hang_in_the_air(self):
        tracker = Tracker(TrackingConfig(keep_lost_s=20 * FRAME_S))
        shown_for(tracker, 10, level(0.0), level(200.0))
        for _ in range(20):
            assert ids(see(tracker, level(0.0))) == [1]
            assert ids(tracker.lost) == [2]
        assert ids(see(tracker, level(0.0), level(500.0))) == [1, 3]
        assert tracker.lost == ()

    def test_what_was_lost_is_found_again_under_its_id(self):
        tracker = Tracker(AT_ONCE)
        shown_for(tracker, 10, level(0.0), level(200.0))
        shown_for(tracker, 20, level(0.0))
        assert ids(see(tracker, level(0.0), level(210.0))) == [1, 2]
        assert tracker.lost == ()

    @pytest.mark.parametrize("end", [0, 1])
    def test_an_end_that_something_covers_at_once_is_hidden(self, end):
        """What is left of it stays where it was: it did not tilt."""
        tracker = Tracker(AT_ONCE)
        for step in range(10):
            see(tracker, turned(wave(), 0.004 * step))
        whole = turned(wave(), 0.04)
        (track,) = see(tracker, part(whole, *((0.2, 1.0) if end == 0 else (0.0, 0.8))))
        assert error_px(track.curve, whole) < 5.0
        assert is_covered(track.inferred, float(end))
        assert not is_covered(track.inferred, 0.5)

    @pytest.mark.parametrize("end", [0, 1])
    def test_a_cable_that_snaps_back_has_no_end_that_is_not_there(self, end):
        """It is shorter than before, but the rest of it left its place."""
        tracker = Tracker(AT_ONCE)
        shown_for(tracker, 10, wave())
        width = detection_of(wave()).width
        seen = part(wave(), *((0.2, 1.0) if end == 0 else (0.0, 0.8)))
        for _ in range(5):
            seen = seen.transformed(np.eye(2), [0.0, 1.5 * width])
            (track,) = see(tracker, seen)
            assert (track.id, track.curve, track.inferred) == (1, seen, ())


class TestNeverSeen:
    """A stretch that every frame inferred is no reason to believe in it."""

    WHOLE_CABLE = level(0.0, 600.0)
    GAP = (0.45, 0.55)
    JOINED = detection_of(WHOLE_CABLE, joints=(Joint(JointKind.GAP, GAP, 1.0, 1.0),))
    PARTS = (part(WHOLE_CABLE, 0.0, 0.45), part(WHOLE_CABLE, 0.55, 1.0))

    def joined_for(self, frames: int) -> Tracker:
        tracker = Tracker(AT_ONCE)
        for _ in range(frames):
            (track,) = tracker.update([self.JOINED])
        assert track.inferred == (self.GAP,)
        return tracker

    def test_the_frames_so_far_say_which_it_is(self):
        tracker = self.joined_for(20)
        ((low, high),) = tracker.predict()[0].unseen
        assert (low, high) == (pytest.approx(0.45, abs=0.02), pytest.approx(0.55, abs=0.02))
        see(tracker, self.WHOLE_CABLE)
        assert tracker.predict()[0].unseen == ()

    @pytest.mark.parametrize("flip", [False, True])
    def test_a_frame_with_two_cables_has_two_tracks(self, flip):
        tracker = self.joined_for(20)
        parts = [one.reversed() for one in self.PARTS[::-1]] if flip else self.PARTS
        tracks = see(tracker, *parts)
        assert ids(tracks) == [1, 2]
        assert [track.inferred for track in tracks] == [(), ()]

    @pytest.mark.parametrize("stays", [0, 1])
    def test_beyond_it_nothing_is_assumed_hidden(self, stays):
        tracker = self.joined_for(20)
        (track,) = see(tracker, self.PARTS[stays])
        assert (track.id, track.inferred) == (1, ())
        assert track.curve.length == pytest.approx(self.PARTS[stays].length, rel=0.02)

    @pytest.mark.parametrize("stays", [0, 1])
    def test_once_seen_it_may_be_hidden(self, stays):
        tracker = self.joined_for(20)
        shown_for(tracker, 10, self.WHOLE_CABLE)
        (track,) = see(tracker, self.PARTS[stays])
        assert track.curve.length == pytest.approx(600.0, rel=0.02)
        assert is_covered(track.inferred, 0.5)


def turned(curve: BSplineCurve, angle: float) -> BSplineCurve:
    c, s = np.cos(angle), np.sin(angle)
    return curve.transformed([[c, -s], [s, c]], [200.0 * angle, 100.0 * angle])


def bent(*corners: tuple[float, float]) -> BSplineCurve:
    """Return a curve along the sides between corners."""
    sides = [np.linspace(a, b, 30, endpoint=False) for a, b in itertools.pairwise(corners)]
    return curve_through(np.vstack([*sides, corners[-1:]]))


class TestSplitAndMerge:
    def test_two_cables_that_touch_end_to_end_stay_two(self):
        tracker = Tracker(AT_ONCE)
        for gap in np.linspace(120.0, 0.0, 25):
            see(tracker, line((0.0, gap), (300.0, gap)), line((301.0, -gap), (500.0, -gap)))
        for _ in range(60):
            tracks = see(tracker, line((0.0, 0.0), (500.0, 0.0)))
            assert ids(tracks) == [1, 2]
            assert tracks[0].curve.length == pytest.approx(300.0, abs=5.0)
            assert tracks[1].curve.length == pytest.approx(200.0, abs=5.0)
        for gap in np.linspace(0.0, 60.0, 12):
            upper, lower = line((0.0, gap), (300.0, gap)), line((301.0, -gap), (500.0, -gap))
            tracks = see(tracker, lower, upper)
        assert [track.curve for track in tracks] == [upper, lower]

    def test_what_grows_together_is_one(self):
        """An occluder goes; its two sides, seen as two from the first frame on, were never two."""
        tracker = Tracker(AT_ONCE)
        for right in np.linspace(200.0, 395.0, 40):
            see(tracker, line((0.0, 0.0), (right, 0.0)), line((400.0, 0.0), (500.0, 0.0)))
        tracks = shown_for(tracker, 10, level(0.0))
        assert [track.curve for track in tracks if track.state is CONFIRMED] == [level(0.0)]

    def test_a_new_cable_beside_a_hidden_one_is_new(self):
        tracker = Tracker(AT_ONCE)
        shown_for(tracker, 10, wave())
        tracks = shown_for(tracker, 2, part(wave(), 0.0, 0.6), wave((0.0, 200.0)))
        assert ids(tracks) == [1, 2]

    def test_what_two_frames_took_for_one_comes_apart(self):
        tracker = Tracker(AT_ONCE)
        shown_for(tracker, 2, level(0.0))
        first, second = part(level(0.0), 0.0, 0.45), part(level(0.0), 0.55, 1.0)
        tracks = shown_for(tracker, 2, first, second)
        assert sorted(float(track.curve(0.5)[0]) for track in tracks) == pytest.approx([112.5, 387.5], abs=1.0)
        assert all(track.inferred == () for track in tracks)


class TestWrongPast:
    """A track that was forced wrong is right again after ten frames of clear view, however long it was wrong."""

    CLEAR = 10

    @pytest.mark.parametrize("wrong", [1, 2, 5, 20, 60])
    @pytest.mark.parametrize("span", [(0.0, 0.6), (0.4, 1.0), (0.2, 0.8)])
    def test_that_was_too_long(self, wrong, span):
        tracker = Tracker(AT_ONCE)
        shown_for(tracker, wrong, level(0.0))
        truth = part(level(0.0), *span)
        (track,) = shown_for(tracker, self.CLEAR, truth)
        assert track.curve == truth

    @pytest.mark.parametrize("wrong", [1, 2, 5, 20, 60])
    def test_that_was_too_short(self, wrong):
        tracker = Tracker(AT_ONCE)
        shown_for(tracker, wrong, part(level(0.0), 0.0, 0.5))
        (track,) = shown_for(tracker, self.CLEAR, level(0.0))
        assert track.curve == level(0.0)

    @pytest.mark.parametrize("wrong", [1, 2, 5, 20, 60])
    def test_that_took_two_cables_for_one(self, wrong):
        tracker = Tracker(AT_ONCE)
        shown_for(tracker, wrong, line((0.0, 0.0), (500.0, 0.0)))
        upper, lower = line((0.0, 0.0), (240.0, 0.0)), line((260.0, 0.0), (500.0, 0.0))
        tracks = shown_for(tracker, self.CLEAR, upper, lower)
        assert {tuple(track.curve(0.0)) for track in tracks} == {(0.0, 0.0), (260.0, 0.0)}
        assert all(track.curve in (upper, lower) for track in tracks)

    @pytest.mark.parametrize("wrong", [1, 2, 5, 20, 60])
    def test_that_took_one_cable_for_two(self, wrong):
        tracker = Tracker(AT_ONCE)
        shown_for(tracker, wrong, part(level(0.0), 0.0, 0.5), part(level(0.0), 0.5, 1.0))
        tracks = shown_for(tracker, self.CLEAR, level(0.0))
        assert level(0.0) in [track.curve for track in tracks if track.state is CONFIRMED]

    @pytest.mark.parametrize("wrong", [1, 2, 5, 20, 60])
    def test_that_took_the_wrong_turn_at_a_crossing(self, wrong):
        a, b = bent((0.0, 0.0), (400.0, 400.0)), bent((0.0, 400.0), (400.0, 0.0))
        up, down = bent((0.0, 0.0), (200.0, 200.0), (400.0, 0.0)), bent((0.0, 400.0), (200.0, 200.0), (400.0, 400.0))
        tracker = Tracker(AT_ONCE)
        shown_for(tracker, wrong, up, down)
        tracks = shown_for(tracker, self.CLEAR, a, b)
        assert ids(tracks) == [1, 2]
        assert {track.curve for track in tracks} <= {a, b, a.reversed(), b.reversed()}


class TestLoops:
    @pytest.mark.parametrize("flip", [False, True])
    def test_the_start_of_a_loop_stays_where_it_was(self, flip):
        squashed = [[1.5, 0.0], [0.0, 0.7]]
        tracker = Tracker(AT_ONCE)
        (first,) = see(tracker, loop(60.0).transformed(squashed, [0.0, 0.0]))
        for step in range(1, 20):
            seen = loop(60.0, start=0.7 * step).transformed(squashed, [1.0 * step, 0.0])
            (track,) = see(tracker, seen.reversed() if flip else seen)
            np.testing.assert_allclose(track.curve(0.0), first.curve(0.0) + np.array([step, 0.0]), atol=2.0)
            np.testing.assert_allclose(track.curve(0.25), first.curve(0.25) + np.array([step, 0.0]), atol=2.0)

    def test_the_ends_pass_close_by_each_other(self):
        """The ends of an almost closed ring pass each other to and fro, and it is found from either end."""
        rng = np.random.default_rng(5)
        tracker = Tracker(AT_ONCE)
        for step in range(60):
            t = np.linspace(0.0, 1.0, 80)[:, None]
            angle = 1.98 * np.pi * t
            truth = curve_through(np.hstack((np.cos(angle), np.sin(angle))) * (100.0 + 15.0 * np.cos(0.1 * step) * t))
            (track,) = see(tracker, truth.reversed() if rng.random() < 0.5 else truth)
            assert track.id == 1
            np.testing.assert_allclose(track.curve([0.0, 1.0]), truth([0.0, 1.0]), atol=1e-6)


class TestTime:
    def test_the_same_frame_again_changes_nothing(self):
        tracker = Tracker(AT_ONCE)
        first = tracker.update([wave()], stamp=1.0)
        assert tracker.update([], stamp=1.0) is first

    def test_time_counts_not_frames(self):
        tracker = Tracker(TrackingConfig(min_hits=1, keep_lost_s=1.0))
        tracker.update([wave()], stamp=0.0)
        tracker.update([], stamp=0.9)
        assert ids(tracker.lost) == [1]
        tracker.update([], stamp=1.1)
        assert tracker.lost == ()

    def test_a_steady_motion_goes_on_over_dropped_frames(self):
        tracker = Tracker(AT_ONCE)
        for step in range(10):
            tracker.update([wave((900.0 * step / 30.0, 0.0))], stamp=step / 30.0)
        (prediction,) = tracker.predict(12.0 / 30.0)
        assert prediction.id == 1
        np.testing.assert_allclose(prediction.curve(0.5), wave((360.0, 0.0))(0.5), atol=2.0)
        before = tracker.tracks
        assert tracker.predict(12.0 / 30.0)[0].curve == prediction.curve
        assert tracker.tracks is before

    @pytest.mark.parametrize("what", ["stamp", "size"])
    def test_what_does_not_follow_on_the_last_frame_is_a_reset_or_an_error(self, what):
        other = {"stamp": {"stamp": 0.5}, "size": {"stamp": 1.5, "size": (20, 10)}}[what]
        tracker = Tracker(AT_ONCE)
        tracker.update([wave()], stamp=1.0, size=(10, 20))
        assert ids(tracker.update([wave()], **other)) == [2]
        strict = Tracker(TrackingConfig(on_new_size="error", on_old_stamp="error"))
        strict.update([wave()], stamp=1.0, size=(10, 20))
        with pytest.raises(InputError, match="reset"):
            strict.update([wave()], **other)
        assert len(strict.tracks) == 1

    def test_a_stamp_must_be_finite(self):
        with pytest.raises(InputError, match="finite"):
            Tracker().update([], stamp=float("nan"))

    def test_after_a_cut_nothing_keeps_its_id(self):
        tracker = Tracker(TrackingConfig(min_hits=1, keep_lost_s=5 * FRAME_S))
        shown_for(tracker, 10, level(0.0), level(100.0))
        tracks = shown_for(tracker, 6, line((900.0, 0.0), (900.0, 600.0)), line((1100.0, 0.0), (1100.0, 600.0)))
        assert ids(tracks) == [3, 4]

    def test_memory_does_not_grow(self):
        tracker = Tracker(TrackingConfig(min_hits=1, keep_lost_s=0.1, smoothing_s=0.1))
        sizes = []
        for step in range(400):
            see(tracker, level(0.0), wave((0.0, 200.0 + 300.0 * (step % 3))))
            sizes.append(len(pickle.dumps(tracker)))
        assert max(sizes[200:]) < max(sizes[:200]) + 64  # numbers of more digits


class TestSmoothing:
    def test_it_lags_behind_a_steady_motion_by_as_much_as_it_says(self):
        tracker = Tracker(TrackingConfig(min_hits=1, smoothing_s=0.2))
        for step in range(120):
            (track,) = tracker.update([level(100.0 * step / 30.0)], stamp=step / 30.0)
        assert track.curve(0.5)[1] == pytest.approx(100.0 * (119 / 30.0 - 0.2), abs=0.1)

    @pytest.mark.parametrize("shape", [wave(), loop(60.0)], ids=["open", "closed"])
    def test_what_stands_still_is_not_changed(self, shape):
        tracker = Tracker(TrackingConfig(min_hits=1, smoothing_s=0.2))
        (track,) = shown_for(tracker, 10, shape)
        assert error_px(track.curve, shape) < 0.1


class TestBareCurves:
    def test_curves_with_and_without_widths_are_followed(self):
        tracker = Tracker(AT_ONCE)
        for step in range(5):
            tracks = tracker.update([wave((step, 0.0)), wave((step, 200.0))], widths=[6.0, float("nan")])
        assert ids(tracks) == [1, 2]
        assert [track.width for track in tracks] == [6.0, None]
        assert all(track.detection is None for track in tracks)

    def test_a_thin_one_is_not_taken_for_a_thick_one(self):
        tracker = Tracker(AT_ONCE)
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
