"""What is hidden, gone or in plain sight, where a frame tells what hides cables."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from builders import bent, detection_of, line, part, wave
from tracked_curves import CONFIRMED, HIDDEN, error_px, ids, shown_for

from dloftbs.camera import PinholeCamera
from dloftbs.data.curve import BSplineCurve
from dloftbs.data.detection import Detection
from dloftbs.data.frame import Frame
from dloftbs.data.tracks import EndKind, Track
from dloftbs.errors import InputError
from dloftbs.evidence import OcclusionEvidence
from dloftbs.pipeline import Pipeline
from dloftbs.tracking import Tracker

SIZE = (400, 700)
CABLE = line((100.0, 200.0), (600.0, 200.0))
CAMERA = PinholeCamera(500.0, 500.0, 350.0, 200.0)
NOWHERE = np.zeros(SIZE, np.bool_)
KNOWN = 8
"""Frames from which on tests call a track well known."""


def between(left: int, right: int) -> np.ndarray:
    """Return occluders between two columns."""
    occluders = NOWHERE.copy()
    occluders[:, left:right] = True
    return occluders


def see(tracker: Tracker, occluders: np.ndarray | None, *curves):
    occlusion = None if occluders is None else OcclusionEvidence(occluders=occluders)
    return tracker.update([detection_of(curve) for curve in curves], size=SIZE, occlusion=occlusion)


def see_depth(tracker: Tracker, occluders: np.ndarray, *curves):
    """Show a frame whose depth has the occluders before the cables, and the ground in plain sight elsewhere."""
    occlusion = OcclusionEvidence(depth=np.where(occluders, np.float32(0.5), np.float32(1.5)), camera=CAMERA)
    return tracker.update([in_space(curve) for curve in curves], size=SIZE, occlusion=occlusion)


def in_space(curve: BSplineCurve) -> Detection:
    """Return a detection of a curve at a distance of one metre."""
    metres = CAMERA.deproject(curve.control_points, np.ones(len(curve.control_points)))
    return detection_of(curve, curve_3d=BSplineCurve(curve.knots, metres))


def known_cable(curve=CABLE) -> Tracker:
    tracker = Tracker()
    shown_for(tracker, 10, curve)
    return tracker


def known_in_space() -> Tracker:
    tracker = Tracker()
    for _ in range(10):
        see_depth(tracker, NOWHERE, CABLE)
    return tracker


class TestWholeObjects:
    def test_one_under_an_occluder_is_hidden_and_has_its_id_again(self):
        tracker, confidence = known_cable(), []
        for _ in range(10):
            (track,) = see(tracker, between(0, 700))
            assert (track.id, track.state, track.inferred, track.detection) == (1, HIDDEN, ((0.0, 1.0),), None)
            assert track.ends == (EndKind.HIDDEN, EndKind.HIDDEN)
            assert error_px(track.curve, CABLE) < 1.0
            assert tracker.lost == ()
            confidence.append(track.confidence)
        assert confidence == sorted(confidence, reverse=True)
        assert confidence[-1] < 0.8
        (track,) = see(tracker, NOWHERE, CABLE)
        assert (track.id, track.state) == (1, CONFIRMED)

    def test_two_sides_of_an_occluder_were_never_seen_apart(self):
        tracker, sides = Tracker(), (part(CABLE, 0.0, 0.3), part(CABLE, 0.7, 1.0))
        for _ in range(20):
            tracks = see(tracker, between(250, 450), *sides)
        assert ids(tracks) == [1, 2]
        for _ in range(20):
            tracks = see(tracker, NOWHERE, CABLE)
        assert [track.curve for track in tracks] == [CABLE]

    @pytest.mark.parametrize("backwards", [False, True])
    def test_one_that_moved_far_under_an_occluder_has_its_id_again(self, backwards):
        tracker, bent = Tracker(), wave((180.0, 330.0))
        shown_for(tracker, 10, wave((30.0, 60.0)))
        for _ in range(10):
            see(tracker, between(0, 700))
        (track,) = see(tracker, NOWHERE, bent.reversed() if backwards else bent)
        assert track.id == 1
        assert error_px(track.curve, bent) < 1.0

    @pytest.mark.parametrize("other", [line((350.0, 350.0), (600.0, 350.0)), wave((180.0, 330.0))])
    def test_another_one_than_that_under_an_occluder_is_another_one(self, other):
        """A shorter one, or one as long that appears while nothing has hidden the first one."""
        tracker = known_cable(wave((30.0, 60.0)))
        occluders = NOWHERE if other.length > 300.0 else between(0, 300)
        see(tracker, occluders)
        assert 2 in ids(see(tracker, occluders, other))

    @pytest.mark.parametrize("occluders", [NOWHERE, between(0, 90), between(0, 300), None])
    def test_one_that_is_gone_is_not_published(self, occluders):
        tracker = known_cable()
        assert see(tracker, occluders) == ()
        assert ids(tracker.lost) == [1]

    def test_it_does_not_enter_plain_sight(self):
        (track,) = see_depth(known_in_space(), between(0, 500))
        assert 480.0 < track.curve(1.0)[0] < 520.0
        assert track.curve(0.0) == pytest.approx(CABLE(0.0), abs=1.0)

    def test_beside_what_is_known_to_hide_it_something_else_may(self):
        (track,) = see(known_cable(), between(0, 500))
        assert track.curve.length == pytest.approx(CABLE.length, rel=0.01)

    def test_it_is_not_kept_for_ever(self):
        tracker = known_cable()
        for _ in range(200):
            tracks = see(tracker, between(0, 700))
        assert tracks == tracker.lost == ()

    def test_its_curve_in_space_moves_with_it(self):
        tracker = Tracker()
        for step in range(10):
            shift = np.array([0.004 * step, 0.0, 0.0])
            axis = line((-0.3, 0.0, 1.0), (0.1, 0.0, 1.0)).transformed(np.eye(3), shift)
            seen = line(*CAMERA.project(axis(np.array([0.0, 1.0]))))
            tracker.update([detection_of(seen, curve_3d=axis)], size=SIZE)
        for _ in range(3):
            (track,) = see(tracker, between(0, 700))
        np.testing.assert_allclose(CAMERA.project(track.curve_3d.sample(9)), track.curve.sample(9), atol=1.0)
        assert track.curve_3d(0.0)[0] > axis(0.0)[0] + 0.006


class TestParts:
    def test_an_end_of_a_new_object_under_an_occluder_is_no_free_end(self):
        (track,) = see(Tracker(), between(400, 500), part(CABLE, 0.0, 0.6))
        assert (track.ends, track.inferred) == ((EndKind.FREE, EndKind.HIDDEN), ())

    @pytest.mark.parametrize("flip", [False, True])
    def test_an_end_that_goes_under_little_by_little_is_kept(self, flip):
        """With a mask alone it would look like a cable that tilts."""
        tracker, alone = known_cable(wave((100.0, 200.0))), known_cable(wave((100.0, 200.0)))
        cable = wave((100.0, 200.0))
        for left in range(700, 380, -4):
            u = np.linspace(0.0, 1.0, 2001)
            edge = float(u[np.searchsorted(cable(u)[:, 0], left) - 1])
            if edge < 1.0:
                seen = part(cable, 0.0, edge)
                (track,) = see(tracker, between(left, 700), seen.reversed() if flip else seen)
                (other,) = see(alone, None, seen)
                assert track.id == 1
        assert edge < 0.7
        assert track.curve.length == pytest.approx(cable.length, rel=0.02)
        assert track.ends == (EndKind.FREE, EndKind.HIDDEN)
        assert error_px(track.curve, cable) < 3.0
        assert other.curve.length < 0.8 * cable.length

    def test_a_missing_end_in_plain_sight_is_not_inferred(self):
        seen = part(CABLE, 0.0, 0.6)
        for occluders, inferred in ((between(400, 700), True), (NOWHERE, False), (between(500, 700), False)):
            (track,) = see_depth(known_in_space(), occluders, seen)
            assert bool(track.inferred) == inferred
            assert track.curve.length == pytest.approx((1.0 if inferred else 0.6) * CABLE.length, rel=0.02)

    @pytest.mark.parametrize("occluders", [None, NOWHERE, between(400, 700), between(500, 700)])
    def test_a_missing_end_is_inferred_wherever_something_is_known_to_hide_cables(self, occluders):
        (track,) = see(known_cable(), occluders, part(CABLE, 0.0, 0.6))
        assert track.inferred
        assert track.curve.length == pytest.approx(CABLE.length, rel=0.02)

    def test_an_inferred_end_is_published_as_far_as_something_hides_it(self):
        (track,) = see_depth(known_in_space(), between(400, 500), part(CABLE, 0.0, 0.6))
        assert 485.0 < track.curve(1.0)[0] < 515.0
        assert track.ends == (EndKind.FREE, EndKind.HIDDEN)
        (again,) = see(known_cable(), NOWHERE, CABLE)
        assert again.curve.length == pytest.approx(CABLE.length)

    def test_a_stretch_between_two_parts_that_stays_in_plain_sight_is_given_up(self):
        tracker = known_in_space()
        parts = part(CABLE, 0.0, 0.4), part(CABLE, 0.5, 1.0)
        counts = [len(see_depth(tracker, NOWHERE, *parts)) for _ in range(12)]
        assert (counts[0], counts[-1]) == (1, 2)
        hidden = known_in_space()
        assert {len(see_depth(hidden, between(300, 350), *parts)) for _ in range(12)} == {1}

    def test_a_part_whose_ends_are_both_in_plain_sight_is_an_object(self):
        """Something covers the middle, but what is left of it ends clear of that: the cable was cut."""
        tracker, left, right = known_in_space(), part(CABLE, 0.0, 0.35), part(CABLE, 0.6, 1.0)
        for _ in range(4 * KNOWN):
            tracks = see_depth(tracker, between(300, 400), left, right)
        assert len(tracks) == 2
        for track, seen in zip(sorted(tracks, key=lambda track: track.curve(0.5)[0]), (left, right), strict=True):
            assert error_px(track.curve, seen) < 1.0


class TestInput:
    def test_evidence_of_another_size_is_refused(self):
        occlusion = OcclusionEvidence(occluders=NOWHERE)
        with pytest.raises(InputError, match=r"must have the frame's size \(300, 700\), got \(400, 700\)"):
            Tracker().update([], size=(300, 700), occlusion=occlusion)

    def test_anything_else_is_refused(self):
        with pytest.raises(InputError, match="occlusion must be"):
            Tracker().update([], occlusion=NOWHERE)


def test_frames_bring_their_evidence():
    pipeline, mask = Pipeline(), NOWHERE.copy()
    mask[196:205, 100:600] = True
    for second in range(5):  # so slow that a mask without a cable is believed
        pipeline.process(Frame(mask=mask, stamp=second))
    (track,) = pipeline.process(Frame(mask=NOWHERE, occluders=between(0, 700), stamp=5)).tracks
    assert (track.id, track.state) == (1, HIDDEN)
    assert pipeline.process(Frame(mask=NOWHERE, occluders=NOWHERE, stamp=6)).tracks == ()


class TestImage:
    """The image alone tells nothing of what hides: a hand looks like the table as often as not."""

    GROUND, COLOUR, HAND, GLOVE = (120, 160, 180), (200, 90, 20), (124, 157, 184), (60, 120, 60)

    def see(self, tracker: Tracker, cover: slice | None, *curves, colour=GLOVE) -> tuple[Track, ...]:
        """Show a frame of the curves with columns covered by something of a colour."""
        image, mask = np.full((*SIZE, 3), self.GROUND, np.uint8), np.zeros(SIZE, np.uint8)
        for curve in curves:
            cv2.polylines(mask, [np.rint(curve.sample(300)).astype(np.int32)], False, 1, 6)
        image[mask > 0] = self.COLOUR
        if cover is not None:
            image[:, cover] = colour
        image = cv2.add(image, self.noise)
        evidence = OcclusionEvidence(image=image, mask=mask)
        return tracker.update([detection_of(curve) for curve in curves], size=SIZE, occlusion=evidence)

    noise = np.random.default_rng(0).integers(0, 8, (*SIZE, 3), dtype=np.uint8)

    def known(self) -> Tracker:
        tracker = Tracker()
        for _ in range(10):
            self.see(tracker, None, CABLE)
        return tracker

    @pytest.mark.parametrize("cover", [slice(0, 700), None])
    def test_one_that_is_missing_as_a_whole_is_not_published_and_has_its_id_again(self, cover):
        tracker = self.known()
        for _ in range(5):
            assert self.see(tracker, cover) == ()
        assert ids(self.see(tracker, None, CABLE)) == [1]

    @pytest.mark.parametrize("colour", [HAND, GLOVE])
    @pytest.mark.parametrize("span", [(0.0, 0.34), (0.33, 0.67), (0.66, 1.0)])
    def test_a_cable_is_as_long_as_ever_while_a_hand_covers_a_third_of_it(self, span, colour):
        """Also if the hand has nearly the table's colour; of an end, for four frames that contradict it."""
        tracker, (low, high) = self.known(), span
        cover = slice(round(100.0 + 500.0 * low), round(100.0 + 500.0 * high))
        seen = [part(CABLE, *ends) for ends in ((0.0, low), (high, 1.0)) if ends[0] < ends[1]]
        for _ in range(30 if len(seen) == 2 else KNOWN // 2):
            (track,) = self.see(tracker, cover, *seen, colour=colour)
            assert track.id == 1
            assert track.curve.length == pytest.approx(CABLE.length, rel=0.02)
            assert sum(end - start for start, end in track.inferred) == pytest.approx(high - low, abs=0.02)

    def test_an_end_where_the_ground_changes_is_free(self):
        (track,) = self.see(self.known(), slice(604, 700), CABLE)
        assert track.ends == (EndKind.FREE, EndKind.FREE)


def test_a_wrong_turn_is_given_up_where_cables_are_seen_whole_although_something_lies_beyond_their_ends():
    """As long as ever, neither goes on below it."""
    frame = ~between(96, 604)
    cables = line((100.0, 100.0), (600.0, 350.0)), line((100.0, 350.0), (600.0, 100.0))
    swapped = bent((100.0, 100.0), (350.0, 225.0), (600.0, 100.0)), bent((100.0, 350.0), (350.0, 225.0), (600.0, 350.0))
    tracker = Tracker()
    for curves in [*[cables] * 12, *[swapped] * 12]:
        see(tracker, NOWHERE, *curves)
    for _ in range(KNOWN + 1):
        tracks = see(tracker, frame, *cables)
    assert max(min(error_px(track.curve, cable) for cable in cables) for track in tracks) < 1.0
