"""What of a track is hidden and what is in plain sight, on curves built by hand."""

from __future__ import annotations

import numpy as np
import pytest
from builders import bent, curve_through, detection_of, line, loop, part, wave
from tracked_curves import CONFIRMED, FRAME_S, SHAPES, error_px, ids, level, runs_like, see, shown_for

from dloftbs.camera import PinholeCamera
from dloftbs.config import TrackingConfig
from dloftbs.data.centerline import Joint, JointKind
from dloftbs.data.curve import BSplineCurve
from dloftbs.data.tracks import Track
from dloftbs.evidence import OcclusionEvidence
from dloftbs.tracking import Tracker

KNOWN = 8
"""Frames from which on tests call a track well known."""


def is_covered(intervals, u: float) -> bool:
    return any(low <= u <= high for low, high in intervals)


class TestHidden:
    def test_its_width_is_that_of_what_was_seen_last(self):
        tracker = Tracker()
        for _ in range(KNOWN):
            tracker.update([detection_of(wave(), radius=4.0)])
        for radius in (4.0, 4.4, 4.8, 5.3):
            parts = [detection_of(part(wave(), *span), radius=radius) for span in ((0.0, 0.3), (0.5, 1.0))]
            (track,) = tracker.update(parts)
            assert track.width_px == pytest.approx(2.0 * radius)

    @pytest.mark.parametrize("flip", [False, True])
    @pytest.mark.parametrize("hidden", [(0.3, 0.5), (0.45, 0.75)])
    def test_two_parts_of_one_cable_are_one_track(self, hidden, flip):
        tracker = Tracker()
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
        tracker = Tracker()
        for step in range(10):
            see(tracker, turned(SHAPES[shape], 0.004 * step))
        surest = 0.95
        for step in range(10, 14):
            whole = turned(SHAPES[shape], 0.004 * step)
            (track,) = see(tracker, part(whole, *span))
            assert track.id == 1
            assert error_px(track.curve, whole) < 0.02 * whole.length
            assert track.curve.length == pytest.approx(whole.length, rel=0.02)
            assert is_covered(track.inferred, 0.01) == (span[0] > 0.0)
            assert is_covered(track.inferred, 0.99) == (span[1] < 1.0)
            assert 0.2 < track.confidence < surest  # nothing shows what hides it, and each frame is clear
            surest = track.confidence

    @pytest.mark.parametrize("flip", [False, True])
    @pytest.mark.parametrize("end", [0, 1])
    def test_an_end_that_goes_little_by_little_is_not_made_up(self, end, flip):
        """With a mask alone that is what a cable looks like that tilts."""
        tracker = Tracker()
        shown_for(tracker, 10, wave())
        for step in range(40):
            gone = 0.006 * step
            seen = part(wave(), *((gone, 1.0) if end == 0 else (0.0, 1.0 - gone)))
            (track,) = see(tracker, seen.reversed() if flip and step else seen)
            assert track.curve == (seen.reversed().reversed() if flip and step else seen)
            assert track.inferred == ()

    def test_what_is_seen_whole_is_published_as_it_was_detected(self):
        tracker = Tracker()
        for step in range(20):
            curve = wave((3.0 * step, step), phase=0.05 * step)
            (track,) = see(tracker, curve)
            assert track.curve is curve
            assert track.inferred == ()

    @pytest.mark.parametrize("shape", SHAPES)
    @pytest.mark.parametrize("rate", [0.998, 0.99])
    def test_an_object_that_goes_away_from_the_camera_is_not_taken_for_hidden(self, shape, rate):
        tracker = Tracker()
        shown_for(tracker, 10, SHAPES[shape])
        for step in range(1, 60):
            curve = SHAPES[shape].transformed(np.eye(2) * rate**step, [0.5 * step, 0.0])
            (track,) = see(tracker, curve)
            assert error_px(track.curve, curve) < 0.01 * curve.length

    def test_a_curve_in_space_is_whole_too(self):
        tracker = Tracker()
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
        tracker = Tracker()
        for step in range(10):
            see(tracker, wave((2.0 * step, 0.0)))
        shown_for(tracker, 30)
        (track,) = see(tracker, wave((40.0, 10.0)).reversed())
        assert (track.id, track.state) == (1, CONFIRMED)
        assert runs_like(track.curve, wave())

    def test_what_leaves_the_image_ends_where_it_leaves_it_and_comes_back_as_the_same(self):
        tracker, size = Tracker(), (400, 300)
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
        tracker, truth = Tracker(), SHAPES[shape]
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
        tracker = Tracker()
        for number in range(12):
            seen = wave((step * number, (-1.0) ** number * step))
            (track,) = see(tracker, seen.reversed() if number % 2 else seen)
            assert (track.id, track.curve) == (1, seen.reversed().reversed() if number % 2 else seen)

    @pytest.mark.parametrize("other", [wave((300.0, 400.0)).transformed(2.0 * np.eye(2), [0, 0]), loop(60.0)])
    def test_unless_it_clearly_differs(self, other):
        tracker = Tracker()
        see(tracker, wave())
        assert ids(see(tracker, other.transformed(np.eye(2), [900.0, 900.0]))) == [2]

    def test_a_loop_keeps_its_start(self):
        tracker = Tracker()
        for k in range(8):
            (track,) = see(tracker, loop(95.0, (300.0, 300.0), 0.3 * k))
        start = track.curve.start
        (track,) = see(tracker, loop(95.0, (370.0, 300.0), 2.0))
        assert track.id == 1
        np.testing.assert_allclose(track.curve.start - start, (70.0, 0.0), atol=5.0)
        np.testing.assert_allclose(track.velocity, np.tile((70.0 / FRAME_S, 0.0), (len(track.velocity), 1)), atol=500.0)

    def test_by_its_length_in_space_where_there_is_one(self):
        tracker = Tracker()
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
        tracker = Tracker()
        shown_for(tracker, 10, level(0.0), level(200.0))
        shown_for(tracker, 20, level(0.0))
        assert ids(see(tracker, level(0.0), level(210.0))) == [1, 2]
        assert tracker.lost == ()

    @pytest.mark.parametrize("end", [0, 1])
    def test_an_end_that_something_covers_at_once_is_hidden(self, end):
        """What is left of it stays where it was: it did not tilt."""
        tracker = Tracker()
        for step in range(10):
            see(tracker, turned(wave(), 0.004 * step))
        whole = turned(wave(), 0.04)
        (track,) = see(tracker, part(whole, *((0.2, 1.0) if end == 0 else (0.0, 0.8))))
        assert error_px(track.curve, whole) < 5.0
        assert is_covered(track.inferred, float(end))
        assert not is_covered(track.inferred, 0.5)

    @pytest.mark.parametrize("end", [0, 1])
    def test_an_end_that_is_covered_as_the_cable_darts_away_is_hidden(self, end):
        """The rest of it has kept its shape."""
        tracker = Tracker()
        shown_for(tracker, 10, wave())
        whole = wave((0.0, 1.5 * detection_of(wave()).width_px))
        (track,) = see(tracker, part(whole, *((0.2, 1.0) if end == 0 else (0.0, 0.8))))
        assert error_px(track.curve, whole) < 5.0
        assert is_covered(track.inferred, float(end))

    @pytest.mark.parametrize("end", [0, 1])
    def test_a_cable_that_snaps_back_has_no_end_that_is_not_there(self, end):
        """It is shorter than before, but all of it left its place."""
        tracker = Tracker()
        shown_for(tracker, 10, wave())
        for step in range(1, 6):
            share = 0.8**step
            seen = wave().transformed([[share, 0.0], [0.0, 1.0]], [0.0 if end else 500.0 * (1.0 - share), 0.0])
            (track,) = see(tracker, seen)
            assert (track.id, track.curve, track.inferred) == (1, seen, ())

    @pytest.mark.parametrize("scale", [0.7, 0.85, 1.2])
    @pytest.mark.parametrize("sagitta", [10.0, 60.0, 150.0])
    def test_a_cable_that_comes_nearer_or_goes_away_at_once_is_whole(self, sagitta, scale):
        """A part of a smooth arc is like a smaller one, but as wide as before."""
        tracker, x = Tracker(), np.linspace(-300.0, 300.0, 60)
        arc = curve_through(np.stack((x, sagitta * (1.0 - (x / 300.0) ** 2)), axis=1) + 400.0)
        for _ in range(10):
            tracker.update([detection_of(arc, radius=6.0)])
        seen = arc.transformed(scale * np.eye(2), [400.0 - 400.0 * scale] * 2)
        (track,) = tracker.update([detection_of(seen, radius=6.0 * scale)])
        assert (track.id, track.curve, track.inferred) == (1, seen, ())


class TestNeverSeen:
    """A stretch that every frame inferred is no reason to believe in it."""

    WHOLE_CABLE = level(0.0, 600.0)
    GAP = (0.45, 0.55)
    JOINED = detection_of(WHOLE_CABLE, joints=(Joint(JointKind.GAP, GAP, 1.0, 1.0),))
    PARTS = (part(WHOLE_CABLE, 0.0, 0.45), part(WHOLE_CABLE, 0.55, 1.0))

    def joined_for(self, frames: int) -> Tracker:
        tracker = Tracker()
        for _ in range(frames):
            (track,) = tracker.update([self.JOINED])
        assert track.inferred == (pytest.approx(self.GAP),)
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


class TestSplitAndMerge:
    def test_two_cables_that_touch_end_to_end_stay_two(self):
        tracker = Tracker()
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
        tracker = Tracker()
        for right in np.linspace(200.0, 395.0, 40):
            see(tracker, line((0.0, 0.0), (right, 0.0)), line((400.0, 0.0), (500.0, 0.0)))
        tracks = shown_for(tracker, 10, level(0.0))
        assert [track.curve for track in tracks if track.state is CONFIRMED] == [level(0.0)]

    def test_a_new_cable_beside_a_hidden_one_is_new(self):
        tracker = Tracker()
        shown_for(tracker, 10, wave())
        tracks = shown_for(tracker, 2, part(wave(), 0.0, 0.6), wave((0.0, 200.0)))
        assert ids(tracks) == [1, 2]

    def test_what_two_frames_took_for_one_comes_apart(self):
        tracker = Tracker()
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
        tracker = Tracker()
        shown_for(tracker, wrong, level(0.0))
        truth = part(level(0.0), *span)
        (track,) = shown_for(tracker, self.CLEAR, truth)
        assert track.curve == truth

    @pytest.mark.parametrize("wrong", [1, 2, 5, 20, 60])
    def test_that_was_too_short(self, wrong):
        tracker = Tracker()
        shown_for(tracker, wrong, part(level(0.0), 0.0, 0.5))
        (track,) = shown_for(tracker, self.CLEAR, level(0.0))
        assert track.curve == level(0.0)

    @pytest.mark.parametrize("wrong", [1, 2, 5, 20, 60])
    def test_that_took_two_cables_for_one(self, wrong):
        """From a mask alone that is what a cable looks like that something stays on: it takes evidence to tell."""
        tracker, camera = Tracker(), PinholeCamera(500.0, 500.0, 260.0, 20.0)
        upper, lower = line((10.0, 20.0), (250.0, 20.0)), line((270.0, 20.0), (510.0, 20.0))
        ground = OcclusionEvidence(depth=np.full((40, 520), 1.5, np.float32), camera=camera)

        def show(*curves: BSplineCurve) -> tuple[Track, ...]:
            in_space = [camera.deproject(curve.control_points, np.ones(len(curve.control_points))) for curve in curves]
            splines = [BSplineCurve(curve.knots, points) for curve, points in zip(curves, in_space, strict=True)]
            return tracker.update([detection_of(*pair) for pair in zip(curves, splines, strict=True)], occlusion=ground)

        for _ in range(wrong):
            show(line((10.0, 20.0), (510.0, 20.0)))
        for _ in range(self.CLEAR + KNOWN):
            tracks = show(upper, lower)
        assert {tuple(track.curve(0.0)) for track in tracks} == {(10.0, 20.0), (270.0, 20.0)}
        assert all(track.curve in (upper, lower) for track in tracks)

    @pytest.mark.parametrize("wrong", [1, 2, 5, 20, 60])
    def test_that_took_one_cable_for_two(self, wrong):
        tracker = Tracker()
        shown_for(tracker, wrong, part(level(0.0), 0.0, 0.5), part(level(0.0), 0.5, 1.0))
        tracks = shown_for(tracker, self.CLEAR, level(0.0))
        assert level(0.0) in [track.curve for track in tracks if track.state is CONFIRMED]

    @pytest.mark.parametrize("wrong", [1, 2, 5, 20, 60])
    def test_that_took_the_wrong_turn_at_a_crossing(self, wrong):
        a, b = bent((0.0, 0.0), (400.0, 400.0)), bent((0.0, 400.0), (400.0, 0.0))
        up, down = bent((0.0, 0.0), (200.0, 200.0), (400.0, 0.0)), bent((0.0, 400.0), (200.0, 200.0), (400.0, 400.0))
        tracker = Tracker()
        shown_for(tracker, wrong, up, down)
        tracks = shown_for(tracker, self.CLEAR, a, b)
        assert ids(tracks) == [1, 2]
        assert {track.curve for track in tracks} <= {a, b, a.reversed(), b.reversed()}

    def test_that_grew_by_a_part_of_another_is_not_believed_in_once_frames_are_right(self):
        first, second = ((0.0, 0.0), (200.0, 200.0)), ((-100.0, 400.0), (200.0, 200.0))
        a, b = bent(*first, (400.0, 400.0)), bent(*second, (520.0, 120.0))
        longer, shorter = bent(*first, (520.0, 120.0)), bent(*second, (400.0, 400.0))
        tracker = Tracker()
        shown_for(tracker, 12, a, b)
        shown_for(tracker, 12, longer, shorter)
        tracks = shown_for(tracker, self.CLEAR, a, b)
        assert {track.curve for track in tracks} <= {a, b, a.reversed(), b.reversed()}


class TestComingOut:
    """Of a cable that was covered as a whole, or for the most part, and bent or moved meanwhile."""

    CABLE = line((0.0, 0.0), (400.0, 0.0))

    def covered(self, *seen: BSplineCurve) -> Tracker:
        tracker = Tracker()
        shown_for(tracker, 10, self.CABLE)
        shown_for(tracker, 5, *seen)
        return tracker

    @pytest.mark.parametrize("piece", [(0.0, 0.05), (0.95, 1.0)])
    def test_the_whole_is_not_taken_for_a_piece_of_it_that_came_out_before(self, piece):
        moved = self.CABLE.transformed(np.eye(2), (0.0, 38.0))
        tracker = self.covered()
        assert ids(see(tracker, part(moved, *piece))) == [2]  # too far away for so short a piece
        (track,) = see(tracker, moved)
        assert track.id == 1

    def test_what_no_hidden_length_reaches_is_another(self):
        start = part(self.CABLE, 0.0, 0.3)
        tracks = see(self.covered(start), start, line((280.0, 380.0), (340.0, 430.0)))
        assert ids(tracks) == [1, 2]

    def test_where_either_of_two_could_come_out_it_is_a_new_one(self):
        other = self.CABLE.transformed(np.eye(2), (0.0, 300.0))
        tracker, parts = Tracker(), [part(one, 0.0, 0.3) for one in (self.CABLE, other)]
        shown_for(tracker, 10, self.CABLE, other)
        shown_for(tracker, 5, *parts)
        assert ids(see(tracker, *parts, line((260.0, 150.0), (330.0, 150.0)))) == [1, 2, 3]


class TestCutInTwo:
    @pytest.mark.parametrize("share", [0.4, 0.5, 0.65])
    def test_two_parts_that_move_away_from_each_other_are_two(self, share):
        tracker, cable = Tracker(), line((0.0, 0.0), (400.0, 0.0))
        shown_for(tracker, 10, cable)
        for step in range(60):
            away = part(cable, share, 1.0).transformed(np.eye(2), (2.0 * step, 0.0))
            tracks = see(tracker, part(cable, 0.0, share), away)
        assert len(tracks) == 2
        assert sum(track.curve.length for track in tracks) == pytest.approx(400.0, abs=2.0)
        assert [track.inferred for track in tracks] == [(), ()]
        longer = max(tracks, key=lambda track: track.curve.length)
        assert longer.id == 1 or share == 0.5

    def test_so_are_two_that_were_taken_for_one_with_a_hidden_middle(self):
        tracker, cable = Tracker(), line((0.0, 0.0), (400.0, 0.0))
        shown_for(tracker, 10, cable)
        for step in range(60):
            away = part(cable, 0.5, 1.0).transformed(np.eye(2), (4.0 * step, 0.0))
            tracks = see(tracker, part(cable, 0.0, 0.4), away)
            if sum(track.curve.length for track in tracks) < 361.0:
                break
        assert step < 12 + KNOWN
        assert [round(track.curve.length) for track in tracks] in ([200, 160], [160, 200])
