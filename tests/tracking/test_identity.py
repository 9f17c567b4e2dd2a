"""Identity and direction of tracks, on curves built by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from builders import curve_through, detection_of, line, loop, part, wave
from hypothesis import given
from hypothesis import strategies as st
from tracked_curves import FRAME_S, HIDDEN, SHAPES, doubtful, ids, level, runs_like, see, shown_for, turning

from dloftbs.camera import PinholeCamera
from dloftbs.config import TrackingConfig
from dloftbs.data.curve import BSplineCurve
from dloftbs.data.frame_result import FrameResult
from dloftbs.tracking import Tracker
from dloftbs.tracking.loop_start import restart_loop
from dloftbs.tracking.observation import Observation


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
        tracker = Tracker(TrackingConfig(gate=0.02))  # 10 px
        see(tracker, level(0), level(9))
        first, second = see(tracker, level(9), level(18))  # 9 -> 9 is free, but would lose both 0 and 18
        assert (first.id, first.curve) == (1, level(9))
        assert (second.id, second.curve) == (2, level(18))

    @pytest.mark.parametrize(("step", "expected"), [(49.0, 1), (51.0, 2)])
    def test_what_is_farther_than_the_gate_is_another(self, step, expected):
        tracker = Tracker(TrackingConfig(gate=0.1))  # 50 px
        see(tracker, level(0))
        tracks = see(tracker, level(step), level(900))
        assert [tracks[0].id, tracks[0].curve == level(step)] == [expected, True]

    @pytest.mark.parametrize("lengths", [(500.0, 125.0), (125.0, 500.0)])
    @pytest.mark.parametrize(("step", "expected"), [(24.0, 1), (26.0, 2)])
    def test_the_gate_is_a_share_of_the_mean_of_both_lengths(self, lengths, step, expected):
        tracker = Tracker(TrackingConfig(gate=0.1))  # 25 px
        see(tracker, level(0, lengths[0]))
        assert ids(see(tracker, level(step, lengths[1])))[0] == expected

    @pytest.mark.parametrize("shape", SHAPES)
    def test_a_visible_part_is_still_the_same(self, shape):
        tracker = Tracker(TrackingConfig(gate=0.02))
        whole = SHAPES[shape]
        see(tracker, whole)
        assert ids(see(tracker, part(whole, 0.6, 1.0))) == [1]
        assert ids(see(tracker, whole)) == [1]

    def test_a_newcomer_gets_the_next_id_and_the_others_keep_theirs(self):
        tracker = Tracker()
        see(tracker, level(100))
        assert ids(see(tracker, level(0), level(100), level(200))) == [1, 2, 3]
        assert [track.curve for track in tracker.tracks] == [level(100), level(0), level(200)]

    def test_one_of_two_leaves_and_the_other_stays(self):
        tracker = Tracker(TrackingConfig(keep_lost_s=FRAME_S))
        see(tracker, level(0), level(200))
        assert ids(see(tracker, level(200))) == [2]
        assert ids(tracker.lost) == [1]
        assert ids(see(tracker, level(200))) == [2]
        assert tracker.lost == ()

    def test_two_that_the_second_frame_joins_are_two_again(self):
        tracker = Tracker()
        one, other = line((0.0, 0.0), (300.0, 0.0)), line((310.0, 0.0), (500.0, 0.0))
        assert ids(see(tracker, one, other)) == [1, 2]
        see(tracker, line((0.0, 0.0), (500.0, 0.0)))
        assert ids(see(tracker, one, other)) == [1, 2]

    def test_one_that_was_hardly_seen_takes_nothing_that_fits_a_lost_one(self):
        tracker = Tracker()
        shown_for(tracker, 3, level(0.0))
        see(tracker)
        assert ids(tracker.update([doubtful(line((200.0, 25.0), (250.0, 25.0)), 0.9)])) == [2]
        assert see(tracker) == ()
        assert ids(see(tracker, line((200.0, 20.0), (300.0, 20.0)))) == [1]

    @pytest.mark.parametrize("span", [(0.0, 0.05), (0.45, 0.55), (0.2, 0.7)])
    def test_a_piece_does_not_take_the_track_of_the_whole(self, span):
        tracker = Tracker()
        see(tracker, wave())
        whole, piece = wave((0.0, 5.0)), part(wave(), *span)  # the whole one moved, the piece lies where it was
        tracks = see(tracker, piece, whole)
        assert ids(tracks) == [1, 2]
        assert (tracks[0].curve, tracks[1].curve) == (whole, piece)

    def test_a_detection_of_no_length_disturbs_no_other(self):
        tracker = Tracker()
        point = BSplineCurve([0.0] * 4 + [1.0] * 4, np.zeros((4, 2)))
        see(tracker, level(300))
        for _ in range(3):
            assert see(tracker, point, level(300))[0].curve == level(300)

    @given(st.lists(st.tuples(st.permutations([0, 1, 2]), st.tuples(*[st.booleans()] * 6)), max_size=25))
    def test_cables_that_come_and_go(self, frames):
        """Three cables far apart, none as long as another, seen or not, in any order and direction."""
        config, most_misses = TrackingConfig(keep_lost_s=2 * FRAME_S), 2
        tracker = Tracker(config)
        alive: dict[int, list[int]] = {}  # per cable: id, hits, misses
        newest = 0
        for order, flags in frames:
            visible, flipped = flags[:3], flags[3:]
            curves = {cable: level(200.0 * cable, 200.0 * 2.0**cable) for cable in order if visible[cable]}
            tracks = see(tracker, *(c.reversed() if flipped[cable] else c for cable, c in curves.items()))
            for cable in list(alive):
                number, hits, misses = alive[cable]
                if visible[cable]:
                    alive[cable] = [number, hits + 1, 0]
                elif misses < most_misses:
                    alive[cable] = [number, hits, misses + 1]
                else:
                    del alive[cable]
            for cable in order:
                if visible[cable] and cable not in alive:
                    newest += 1
                    alive[cable] = [newest, 1, 0]
            expected = sorted(map(tuple, alive.values()))
            assert sorted((t.id, t.hits, t.misses) for t in (*tracks, *tracker.lost)) == expected
            assert all(t.detection is not None and t.state is not HIDDEN and not t.misses for t in tracks)
            assert all(t.detection is None and t.misses for t in tracker.lost)
            assert all(t.state is HIDDEN for t in tracker.lost)


class TestDirection:
    @pytest.mark.parametrize("shape", SHAPES)
    def test_a_detector_that_flips_for_good_does_not_flip_the_track(self, shape):
        """The published direction counts, not the last detection's: that would hold for one frame only."""
        tracker = Tracker()
        truth = SHAPES[shape]
        see(tracker, truth)
        for _ in range(30):
            (track,) = see(tracker, truth.reversed())
            assert runs_like(track.curve, truth)

    @pytest.mark.parametrize("seed", range(5))
    def test_a_detector_that_flips_at_random_does_not_flip_a_moving_track(self, seed):
        rng = np.random.default_rng(seed)
        tracker = Tracker()
        for step in range(60):
            truth = wave((4.0 * step, -3.0 * step), phase=0.1 * step)
            (track,) = see(tracker, truth.reversed() if step and rng.random() < 0.5 else truth)
            assert track.id == 1
            np.testing.assert_allclose(track.curve([0.0, 1.0]), truth([0.0, 1.0]), atol=1e-9)

    def test_the_first_direction_published_is_the_one_kept(self):
        tracker = Tracker()
        backwards = wave().reversed()
        (first,) = see(tracker, backwards)
        assert first.curve is backwards
        (second,) = see(tracker, wave())
        assert runs_like(second.curve, backwards)

    def test_curve_in_space_and_detection_turn_with_the_curve(self):
        tracker = Tracker()
        curve, curve_3d = wave(), line((0.0, 0.0, 1.0), (0.5, 0.0, 1.0))
        forwards = detection_of(curve, curve_3d)
        tracker.update([forwards])
        (track,) = tracker.update([forwards.reversed()])
        np.testing.assert_allclose(track.curve_3d(0.0), curve_3d(0.0), atol=1e-9)
        assert track.detection.curve is track.curve
        assert track.detection.curve_3d is track.curve_3d
        np.testing.assert_array_equal(track.detection.centerline.points, forwards.centerline.points)

    def test_it_is_kept_over_frames_in_which_nothing_was_seen(self):
        tracker = Tracker()
        see(tracker, wave())
        for _ in range(5):
            see(tracker)
        (track,) = see(tracker, wave((6.0, 0.0)).reversed())
        assert runs_like(track.curve, wave())

    def test_each_of_two_cables_keeps_its_own(self):
        tracker = Tracker()
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
        tracker = Tracker()
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
        tracker = Tracker()
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
        tracker = Tracker()
        ring = loop(60.0)
        broken = part(ring, start, start + turns)  # beyond one turn where the ends lie side by side
        see(tracker, ring)
        (track,) = see(tracker, broken.reversed() if flip else broken)
        assert not track.curve.closed
        assert turning(track.curve) > 0
        (track,) = see(tracker, ring.reversed() if flip else ring)
        assert turning(track.curve) > 0


class TestLoops:
    @pytest.mark.parametrize("flip", [False, True])
    def test_the_start_of_a_loop_stays_where_it_was(self, flip):
        squashed = [[1.5, 0.0], [0.0, 0.7]]
        tracker = Tracker()
        (first,) = see(tracker, loop(60.0).transformed(squashed, [0.0, 0.0]))
        for step in range(1, 20):
            seen = loop(60.0, start=0.7 * step).transformed(squashed, [1.0 * step, 0.0])
            (track,) = see(tracker, seen.reversed() if flip else seen)
            np.testing.assert_allclose(track.curve(0.0), first.curve(0.0) + np.array([step, 0.0]), atol=2.0)
            np.testing.assert_allclose(track.curve(0.25), first.curve(0.25) + np.array([step, 0.0]), atol=2.0)

    @pytest.mark.parametrize("flip", [False, True])
    def test_a_loop_keeps_its_detection_and_starts_alike_in_space_wherever_that_starts(self, flip):
        camera = PinholeCamera(500.0, 500.0, 320.0, 240.0)
        tracker, starts = Tracker(), []
        for step in range(6):
            angles = 0.7 * step + 2.0 * np.pi * np.arange(80) / 80
            ring = np.stack((0.2 * np.cos(angles), 0.1 * np.sin(angles), 1.0 + 0.1 * np.cos(angles)), axis=1)
            deep = curve_through(ring + np.array([0.001 * step, 0.0, 0.0]), closed=True)
            found = detection_of(curve_through(camera.project(deep.sample(81)[:-1]), closed=True), deep)
            found = replace(found, camera=camera)
            (track,) = tracker.update([found.reversed() if flip and step % 2 else found])
            result = FrameResult((found,), (track,), None, (480, 640))
            assert result._place_of(track)[0] == 0
            starts.append(np.append(track.curve(0.0), 500.0 * track.curve_3d(0.0)))
        assert np.linalg.norm(np.diff(starts, axis=0), axis=1).max() < 3.0

    def test_gaps_of_a_loop_lie_where_they_are_when_it_starts_elsewhere(self):
        ring = loop(60.0)
        one = Observation(ring, ring.sample(10), 1.0, 3.0, None, (0.0, 1.0), 0, 1.0, True, ((0.1, 0.3), (0.5, 0.6)))
        turned = restart_loop(one, 0.2)
        np.testing.assert_allclose(turned.gaps, [(0.0, 0.1), (0.3, 0.4), (0.9, 1.0)], atol=1e-12)

    def test_the_ends_pass_close_by_each_other(self):
        """The ends of an almost closed ring pass each other to and fro, and it is found from either end."""
        rng = np.random.default_rng(5)
        tracker = Tracker()
        for step in range(60):
            t = np.linspace(0.0, 1.0, 80)[:, None]
            angle = 1.98 * np.pi * t
            truth = curve_through(np.hstack((np.cos(angle), np.sin(angle))) * (100.0 + 15.0 * np.cos(0.1 * step) * t))
            (track,) = see(tracker, truth.reversed() if rng.random() < 0.5 else truth)
            assert track.id == 1
            np.testing.assert_allclose(track.curve([0.0, 1.0]), truth([0.0, 1.0]), atol=1e-6)
