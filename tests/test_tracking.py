"""The tracker: identity, direction, and the life of a track, on curves built by hand."""

from __future__ import annotations

import numpy as np
import pytest
from builders import curve_through, detection_of, line, loop, part, through_json, wave
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.config import TrackingConfig
from dloftbs.curve import BSplineCurve
from dloftbs.frame import Detection, TrackState
from dloftbs.tracking import Tracker

TENTATIVE, CONFIRMED, COASTING = TrackState.TENTATIVE, TrackState.CONFIRMED, TrackState.COASTING
AT_ONCE = TrackingConfig(min_hits=1)

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

    @pytest.mark.parametrize("max_misses", [0, 1, 5])
    def test_a_confirmed_track_coasts_exactly_as_long_as_it_may(self, max_misses):
        tracker = Tracker(TrackingConfig(min_hits=1, max_misses=max_misses))
        (last,) = see(tracker, wave())
        for misses in range(1, max_misses + 1):
            (track,) = see(tracker)
            assert (track.id, track.state, track.hits, track.misses) == (1, COASTING, 1, misses)
            assert track.curve is last.curve
            assert track.detection is None
        assert see(tracker) == ()
        assert ids(see(tracker, wave())) == [2]

    def test_what_comes_back_is_the_same_and_may_coast_as_long_again(self):
        tracker = Tracker(TrackingConfig(min_hits=2, max_misses=2))
        for _ in range(2):
            see(tracker, wave())
        for hits in (3, 4):
            see(tracker)
            assert states(see(tracker)) == [COASTING]
            (track,) = see(tracker, wave((3.0, 0.0)))
            assert (track.id, track.state, track.hits, track.misses) == (1, CONFIRMED, hits, 0)

    def test_a_track_carries_this_frame_s_detection(self):
        tracker = Tracker(AT_ONCE)
        curve_3d = line((0.0, 0.0, 1.0), (0.5, 0.0, 1.0))
        detection = detection_of(wave(), curve_3d)
        (track,) = tracker.update([detection])
        assert track.detection is detection
        assert (track.curve, track.curve_3d) == (detection.curve, curve_3d)
        (coasting,) = tracker.update([])
        assert coasting.curve_3d is curve_3d

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

    @pytest.mark.parametrize(("step", "expected"), [(49.0, [1]), (51.0, [1, 2])])
    def test_what_is_farther_than_the_gate_is_another(self, step, expected):
        tracker = Tracker(TrackingConfig(gate=0.1, min_hits=1))  # 50 px
        see(tracker, level(0))
        tracks = see(tracker, level(step))
        assert ids(tracks) == expected
        assert tracks[-1].curve == level(step)

    @pytest.mark.parametrize("lengths", [(500.0, 100.0), (100.0, 500.0)])
    def test_the_gate_is_a_share_of_the_longer_one(self, lengths):
        tracker = Tracker(TrackingConfig(gate=0.1, min_hits=1))
        see(tracker, level(0, lengths[0]))
        assert ids(see(tracker, level(40, lengths[1]))) == [1]

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
        tracker = Tracker(TrackingConfig(min_hits=1, max_misses=1))
        see(tracker, level(0), level(200))
        assert states(see(tracker, level(200))) == [COASTING, CONFIRMED]
        assert ids(see(tracker, level(200))) == [2]

    @pytest.mark.parametrize("span", [(0.0, 0.05), (0.45, 0.55), (0.2, 0.7)])
    def test_a_piece_does_not_take_the_track_of_the_whole(self, span):
        tracker = Tracker(AT_ONCE)
        see(tracker, wave())
        whole, piece = wave((0.0, 5.0)), part(wave(), *span)  # the whole one moved, the piece lies where it was
        tracks = see(tracker, piece, whole)
        assert ids(tracks) == [1, 2]
        assert (tracks[0].curve, tracks[1].curve) == (whole, piece)

    def test_the_longest_piece_takes_the_track_of_a_cable_hidden_in_the_middle(self):
        tracker = Tracker(AT_ONCE)
        see(tracker, wave())
        short, long = part(wave(), 0.0, 0.3), part(wave((0.0, 2.0)), 0.4, 1.0)
        first, second = see(tracker, short, long)
        assert (first.curve, second.curve) == (long, short)

    def test_a_detection_of_no_length_disturbs_no_other(self):
        tracker = Tracker(AT_ONCE)
        point = BSplineCurve([0.0] * 4 + [1.0] * 4, np.zeros((4, 2)))
        see(tracker, level(300))
        for _ in range(3):
            assert see(tracker, point, level(300))[0].curve == level(300)

    @given(st.lists(st.tuples(st.permutations([0, 1, 2]), st.tuples(*[st.booleans()] * 6)), max_size=25))
    def test_cables_that_come_and_go(self, frames):
        """Three cables far apart, seen or not, in any order and direction: the tracks live by the rules."""
        config = TrackingConfig(min_hits=2, max_misses=2)
        tracker = Tracker(config)
        alive: dict[int, list[int]] = {}  # per cable: id, hits, misses, whether confirmed
        newest = 0
        for order, flags in frames:
            visible, flipped = flags[:3], flags[3:]
            curves = {cable: level(200.0 * cable) for cable in order if visible[cable]}
            tracks = see(tracker, *(c.reversed() if flipped[cable] else c for cable, c in curves.items()))
            for cable in list(alive):
                number, hits, misses, confirmed = alive[cable]
                if visible[cable]:
                    alive[cable] = [number, hits + 1, 0, confirmed or hits + 1 >= config.min_hits]
                elif confirmed and misses < config.max_misses:
                    alive[cable] = [number, hits, misses + 1, True]
                else:
                    del alive[cable]
            for cable in order:
                if visible[cable] and cable not in alive:
                    newest += 1
                    alive[cable] = [newest, 1, 0, False]
            expected = sorted((number, hits, misses) for number, hits, misses, _ in alive.values())
            assert [(t.id, t.hits, t.misses) for t in tracks] == expected
            assert all((t.detection is None) == (t.state is COASTING) == (t.misses > 0) for t in tracks)


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
