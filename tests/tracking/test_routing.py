"""Known tracks routed through frames that the detector linked wrongly, on curves built by hand."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from builders import curve_through, detection_of, line, part, random_curve, wave
from hypothesis import given
from hypothesis import strategies as st
from properties import few_examples

from dloftbs.config import TrackingConfig
from dloftbs.data.centerline import Joint, JointKind
from dloftbs.data.curve import BSplineCurve
from dloftbs.data.detection import Detection
from dloftbs.data.tracks import Track, TrackState
from dloftbs.tracking import Tracker
from dloftbs.tracking.hypotheses import MAX_HYPOTHESES
from dloftbs.tracking.length_record import MIN_SEEN_FRAMES

KNOWN = 8
"""Frames from which on tests call a track well known."""
CLEAR = KNOWN + 4
BELIEVED = 4
"""Frames, each sure of something else, that a well known track outweighs."""
WIDTH = 6.0


def shown(
    curve: BSplineCurve, *spans: tuple[float, float], kind: JointKind = JointKind.GAP, confidence: float = 1.0
) -> Detection:
    """Return the detection of a curve, with spans of it inferred, each with a probability to be right."""
    joints = tuple(Joint(kind, span, 1.0, 1.0, confidence) for span in spans)
    return detection_of(curve, joints=joints, radius=WIDTH / 2.0)


def see(tracker: Tracker, *curves: BSplineCurve | Detection, size: tuple[int, int] | None = None) -> tuple[Track, ...]:
    return tracker.update([c if isinstance(c, Detection) else shown(c) for c in curves], size=size)


def tracked(*curves: BSplineCurve, size: tuple[int, int] | None = None, frames: int = CLEAR) -> Tracker:
    """Return a tracker that knows these well."""
    tracker = Tracker()
    for _ in range(frames):
        see(tracker, *curves, size=size)
    return tracker


def far(found: BSplineCurve, true: BSplineCurve) -> float:
    """Return the largest distance of points at equal shares of the lengths, px: direction and place along count."""
    u = np.linspace(0.0, 1.0, 101)
    return float(np.linalg.norm(evenly(found, u) - evenly(true, u), axis=1).max())


def aside(found: BSplineCurve, true: BSplineCurve) -> float:
    """Return how far points of one curve lie from another one at most, px."""
    u = np.linspace(0.0, 1.0, 101)
    points, line = found(u), true(np.linspace(0.0, 1.0, 2001))
    return float(np.linalg.norm(points[:, None] - line[None], axis=2).min(axis=1).max())


def evenly(curve: BSplineCurve, share: np.ndarray) -> np.ndarray:
    fine = curve(np.linspace(0.0, 1.0, 2001))
    along = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(fine, axis=0), axis=1))))
    return np.stack([np.interp(share * along[-1], along, column) for column in fine.T], axis=1)


def followed(tracks: tuple[Track, ...], truth: list[BSplineCurve], px: float) -> None:
    """Check that the tracks have kept their ids and directions, and lie on the truth."""
    assert [track.id for track in tracks] == list(range(1, len(truth) + 1))
    for track, true in zip(tracks, truth, strict=True):
        assert track.state is TrackState.CONFIRMED
        assert far(track.curve, true) < px


def rounded(*corners: tuple[float, float]) -> BSplineCurve:
    """Return a curve along the sides between corners, the corners cut a little."""
    sides = [np.linspace(a, b, 30, endpoint=False)[1:] for a, b in itertools.pairwise(corners)]
    return curve_through(np.vstack([corners[:1], *sides, corners[-1:]]))


def joined(*curves: BSplineCurve) -> BSplineCurve:
    """Return one curve along several, one after the other."""
    points = [c(np.linspace(0.0, 1.0, max(int(c.length / 6.0), 4))) for c in curves]
    kept = [points[0]]
    for more in points[1:]:
        kept.append(more[1:] if np.linalg.norm(more[0] - kept[-1][-1]) < 3.0 else more)
    return curve_through(np.vstack(kept))


def at_joint(first: BSplineCurve, second: BSplineCurve) -> tuple[float, float]:
    """Return the span, a hundredth long, in which one curve goes on along another in what joins both."""
    at = first.length / (first.length + second.length)
    return at - 0.005, at + 0.005


def is_believed(confidence: float, frame: int) -> bool:
    """Return whether tracks may follow what `KNOWN` frames show wrongly, in one of these or after them."""
    return confidence == 1.0 and BELIEVED <= frame < KNOWN + BELIEVED


def shifted(curve: BSplineCurve, x: float, y: float) -> BSplineCurve:
    return curve.transformed(np.eye(2), [x, y])


def highest(curve: BSplineCurve) -> float:
    """Return how high up the image a curve's higher end lies, px from its top."""
    return float(curve(np.array([0.0, 1.0]))[:, 1].min())


def crossing(a: BSplineCurve, b: BSplineCurve) -> tuple[float, float]:
    """Return where two curves come closest, in the parameter of each."""
    u = np.linspace(0.0, 1.0, 501)
    away = np.linalg.norm(a(u)[:, None] - b(u)[None], axis=2)
    i, j = np.unravel_index(away.argmin(), away.shape)
    return float(u[i]), float(u[j])


def swapped(a: BSplineCurve, b: BSplineCurve) -> list[BSplineCurve]:
    """Return what a detector finds that leaves the crossing of two curves along the other one."""
    i, j = crossing(a, b)
    return [joined(part(a, 0.0, i), part(b, j, 1.0)), joined(part(b, 0.0, j), part(a, i, 1.0))]


def turned_back(a: BSplineCurve, b: BSplineCurve) -> list[BSplineCurve]:
    """Return what it finds that goes back along the other one."""
    i, j = crossing(a, b)
    return [joined(part(a, 0.0, i), part(b, 0.0, j).reversed()), joined(part(b, j, 1.0).reversed(), part(a, i, 1.0))]


SLOPES = (line((0.0, 0.0), (400.0, 300.0)), line((0.0, 280.0), (400.0, -20.0)))
WAVES = (wave(), wave((0.0, 40.0)).transformed([[0.6, -0.8], [0.8, 0.6]], [200.0, -220.0]))


@pytest.mark.parametrize("misread", [swapped, turned_back])
@pytest.mark.parametrize("pair", [SLOPES, WAVES], ids=["slopes", "waves"])
class TestWrongTurnAtACrossing:
    def test_for_some_frames_changes_nothing(self, pair, misread):
        """Wrong readings as long as the tracks count twice: these are fewer than half of those that it takes."""
        tracker = tracked(*pair)
        for step in range(1, 41):
            truth = [shifted(pair[0], step, 0.5 * step), shifted(pair[1], -step, 0.3 * step)]
            wrong = 4 < step % 10 < 4 + KNOWN // 2
            tracks = see(tracker, *(misread(*truth) if wrong else truth))
            followed(tracks, truth, 2.0)
            assert all(track.inferred == () for track in tracks)

    def test_changes_no_young_track_of_which_all_frames_were_alike(self, pair, misread):
        tracker = tracked(*pair, frames=MIN_SEEN_FRAMES + 1)
        for _ in range(2):
            followed(see(tracker, *misread(*pair)), list(pair), 2.0)

    def test_is_given_up_at_once_while_frames_disagree(self, pair, misread):
        """Which of them was right nobody knows yet."""
        tracker = tracked(*misread(*pair), frames=1)
        for _ in range(MIN_SEEN_FRAMES + 1):
            tracks = see(tracker, *pair)
        found = sorted((track.curve for track in tracks), key=highest)
        truth = sorted(pair, key=highest)
        assert all(aside(one, true) < 1.0 for one, true in zip(found, truth, strict=True))

    def test_with_which_a_track_began_is_believed_no_longer_than_it_was_seen(self, pair, misread):
        tracker = tracked(*misread(*pair), frames=MIN_SEEN_FRAMES + 1)
        for _ in range(MIN_SEEN_FRAMES + 3):
            tracks = see(tracker, *pair)
        found = [track.curve for track in tracks]
        assert all(min(far(curve, t) for t in (one, one.reversed())) < 2.0 for one, curve in self.pairs(pair, found))

    def test_for_long_is_adopted_and_given_up_again(self, pair, misread):
        """Three times the frames where one is believed first: the other one's way changes by that, and counts anew."""
        tracker = tracked(*pair)
        found = misread(*pair)
        for _ in range(3 * KNOWN + 2):
            tracks = see(tracker, *found)
        believed = [track.curve for track in tracks if track.state is TrackState.CONFIRMED]
        assert len(believed) == 2
        assert all(
            min(far(curve, f) for f in (one, one.reversed())) < 2.0 for one, curve in self.pairs(found, believed)
        )
        for _ in range(KNOWN + 2):
            tracks = see(tracker, *pair)
        right = [track.curve for track in tracks if track.state is TrackState.CONFIRMED]
        assert all(min(far(curve, t) for t in (one, one.reversed())) < 2.0 for one, curve in self.pairs(pair, right))

    @staticmethod
    def pairs(expected, found):
        return [(one, min(found, key=lambda c: aside(c, one))) for one in expected]


@pytest.mark.xfail(strict=True, raises=AssertionError, reason="two parts with a gap between speak neither way")
def test_two_that_began_as_one_are_two_once_more_frames_read_them_apart():
    """The gap is narrower than the samples of the one lie apart, and its lengths tell nothing, as an end is covered."""
    pair, frames = (line((600.0, -100.0), (0.0, 0.0)), line((0.0, 10.0), (680.0, 70.0))), MIN_SEEN_FRAMES + 2
    tracker = tracked(joined(*pair), frames=frames)
    for step in range(2 * frames):
        covered = [part(pair[1], 0.0, 0.55), part(pair[1], 0.66, 1.0)] if step < 2 else [pair[1]]
        tracks = see(tracker, pair[0], *covered)
    assert len(tracks) == 2
    assert all(min(aside(track.curve, one) for one in pair) < 1.0 for track in tracks)


def test_a_speck_is_laid_through_a_curve_of_any_length():
    """The samples of a frame are as far apart as the nodes of the coarsest track, but not without bound."""
    endless = line((1.0, 0.0), (1e6, 0.0))
    tracker = Tracker()
    tracker.update([line((0.0, 0.0), (1e-12, 0.0))])
    assert [track.curve for track in tracker.update([endless])] == [endless]


def test_what_hides_a_stretch_between_two_parts_of_a_known_cable_may_stay():
    tracker = tracked(line((0.0, 0.0), (620.0, 0.0)), frames=CLEAR)
    for _ in range(4 * KNOWN):
        (track,) = see(tracker, line((0.0, 0.0), (300.0, 0.0)), line((330.0, 0.0), (620.0, 0.0)))
    assert aside(track.curve, line((0.0, 0.0), (620.0, 0.0))) < 1.0


_T = np.linspace(0.0, 1.0, 80)[:, None]
SHAPES = {
    "wave": wave(),
    "omega": curve_through(150.0 * np.hstack((np.cos(1.8 * np.pi * _T), np.sin(1.8 * np.pi * _T)))),
    "hairpin": curve_through(
        np.vstack((np.linspace((0, 0), (400, 0), 40), [(415, 20)], np.linspace((400, 40), (0, 40), 40)))
    ),
    "spiral": curve_through(np.hstack((np.cos(5 * np.pi * _T), np.sin(5 * np.pi * _T))) * (40.0 + 120.0 * _T)),
}


class TestOccluded:
    @pytest.mark.parametrize("flip", [False, True])
    @pytest.mark.parametrize("confidence", [0.5, 1.0])
    def test_what_is_cut_and_linked_to_another_cable_is_still_a_part_of_its_own(self, confidence, flip):
        """Beside a crossing one cable is hidden, and what is left of it is linked to the other one's far half."""
        tracker = tracked(*SLOPES)
        for step in range(1, 20):
            a, b = truth = [shifted(SLOPES[0], step, 0.5 * step), shifted(SLOPES[1], -step, 0.3 * step)]
            i, j = crossing(a, b)
            ends = part(a, i, 1.0).reversed(), part(b, j, 1.0)
            linked = shown(joined(*ends), at_joint(*ends), kind=JointKind.CROSSING, confidence=confidence)
            found = [part(a, 0.0, i - 0.1), linked.reversed() if flip else linked, part(b, 0.0, j)]
            wrong = 4 <= step < 4 + KNOWN
            tracks = see(tracker, *(found if wrong else truth))
            if is_believed(confidence, step - 4):
                continue
            followed(tracks, truth, WIDTH)
            hidden = sum(high - low for low, high in tracks[0].inferred)
            assert hidden == pytest.approx(0.1 if wrong else 0.0, abs=0.03)

    @pytest.mark.parametrize("flip", [False, True])
    @pytest.mark.parametrize("confidence", [0.5, 1.0])
    def test_what_is_linked_across_a_gap_comes_apart_there(self, confidence, flip):
        """At once, if frames are unsure of the link; if they are sure, tracks follow them in the end, and back."""
        first, second = wave(), line((60.0, 160.0), (420.0, 160.0))
        tracker = tracked(first, second)
        for step in range(1, 20):
            w, s = truth = [shifted(first, step, 0.5 * step), shifted(second, 0.0, 0.3 * step)]
            ends = part(w, 0.62, 1.0).reversed(), part(s, 0.5, 1.0)
            whole = joined(*ends)
            low, high = (crossing(whole, line(tuple(p), tuple(p + 0.1)))[0] for p in (ends[0](1.0), ends[1](0.0)))
            linked = shown(whole, (low, high), confidence=confidence)
            found = [part(w, 0.0, 0.45), linked.reversed() if flip else linked, part(s, 0.0, 0.5)]
            wrong = 4 <= step < 4 + KNOWN
            tracks = see(tracker, *(found if wrong else truth))
            if not is_believed(confidence, step - 4):
                followed(tracks, truth, WIDTH)

    @pytest.mark.parametrize("second_gap", [0.0, 0.04])
    @pytest.mark.parametrize("shape", SHAPES)
    def test_an_occluder_that_moves_along_does_not_move_the_rest(self, shape, second_gap):
        def truth(step: int) -> BSplineCurve:
            c, s = np.cos(0.006 * step), np.sin(0.006 * step)
            return SHAPES[shape].transformed([[c, -s], [s, c]], [1.5 * step, -step])

        tracker = Tracker()
        for step in range(-CLEAR, 0):
            see(tracker, truth(step))
        for step in range(31):
            whole, low = truth(step), 0.1 + 0.02 * step
            parts = [part(whole, second_gap, low), part(whole, low + 0.2, 1.0)]
            (track,) = see(tracker, *parts[:: -1 if step % 2 else 1])
            assert track.id == 1
            assert far(track.curve, whole) < 2.0 * WIDTH
            assert track.inferred[-1] == pytest.approx((low, low + 0.2), abs=0.02)


class TestTouching:
    CORNER_DEG = (60.0, 90.0, 120.0)

    @staticmethod
    def cables(corner_deg: float, gap: float) -> list[BSplineCurve]:
        angle = np.deg2rad(corner_deg)
        start = np.array([300.0, 100.0]) + gap * np.array([np.cos(0.5 * angle), np.sin(0.5 * angle)])
        stop = start + 240.0 * np.array([np.cos(angle), np.sin(angle)])
        return [line((0.0, 100.0), (300.0, 100.0)), line(tuple(start), tuple(stop))]

    @pytest.mark.parametrize("corner_deg", CORNER_DEG)
    def test_two_that_were_never_apart_are_one_with_a_sharp_bend(self, corner_deg):
        """What is seen outranks what is believed: a detector that cut the cable at its bend found it out."""
        tracker = Tracker()
        truth = self.cables(corner_deg, 0.0)
        for _ in range(15):
            see(tracker, *truth)
        for step in range(20):
            tracks = see(tracker, joined(*truth) if step % 2 else joined(*truth).reversed())
        followed(tracks, [joined(*truth)], 1e-6)

    @pytest.mark.parametrize("corner_deg", CORNER_DEG)
    def test_two_ends_that_make_a_corner_stay_two(self, corner_deg):
        """They were seen apart before, so one detection in whichever direction shows both."""
        tracker = Tracker()
        for gap in np.linspace(40.0, 0.0, 15):
            see(tracker, *self.cables(corner_deg, gap))
        truth = self.cables(corner_deg, 0.0)
        one = joined(*truth)
        for step in range(20):
            tracks = see(tracker, one if step % 2 else one.reversed())
            followed(tracks, truth, 0.5 * WIDTH)
        for gap in np.linspace(0.0, 40.0, 15):
            truth = self.cables(corner_deg, gap)
            tracks = see(tracker, *truth)
        followed(tracks, truth, 1e-6)

    @pytest.mark.parametrize("corner_deg", [10.0, 30.0])
    def test_where_they_touch_stays_where_it_is(self, corner_deg):
        """One runs into the other and stops there; only their lengths tell where, and they do in every frame."""
        tracker = Tracker()
        for gap in np.linspace(60.0, 0.0, 20):
            see(tracker, *self.cables(corner_deg, gap))
        truth = self.cables(corner_deg, 0.0)
        one = joined(*truth)
        for step in range(20):
            followed(see(tracker, one if step % 2 else one.reversed()), truth, 0.5 * WIDTH)

    @pytest.mark.parametrize("flip", [False, True])
    def test_a_short_one_beside_long_ones_is_followed_from_either_side(self, flip):
        """Its nodes are denser than the samples, which are made for the longest track."""
        long, longest = line((0.0, 0.0), (1000.0, 0.0)), line((0.0, 500.0), (2400.0, 500.0))
        tracker = Tracker()
        for gap in np.linspace(60.0, 0.0, 25):
            short = line((1003.0 + 0.7 * gap, 0.7 * gap), (1045.0 + 0.7 * gap, 42.0 + 0.7 * gap))
            tracker.update([long, short, longest], widths=[3.0] * 3)
        one = joined(long, short)
        for step in range(12):
            moved = shifted(longest, 0.0, 20.0 * (step % 2))
            tracks = tracker.update([one.reversed() if flip else one, moved], widths=[3.0] * 2)
            followed(tracks, [long, short, moved], 4.0)

    @pytest.mark.parametrize("flip", [False, True])
    @pytest.mark.parametrize("known", [False, True])
    def test_another_one_s_end_does_not_change_the_usual_length(self, known, flip):
        start = wave()(1.0)
        base = (wave(), line((start[0] + 8.0, start[1] + 4.0), (start[0] + 180.0, start[1] + 120.0)))
        tracker = tracked(*(base if known else base[:1]))
        for step in range(1, 10):
            a, b = (shifted(c, 0.5 * step, step) for c in base)
            long, rest = joined(a, part(b, 0.0, 0.35)), part(b, 0.35, 1.0)
            found = [long.reversed(), rest.reversed()] if flip else [long, rest]
            wrong, many = step <= 3, 2 if known else 1
            truth = [a, b][:many]
            tracks = see(tracker, *(found[:many] if wrong else truth))
            if known:
                followed(tracks, truth, WIDTH)
            if not wrong:
                assert [track.curve for track in tracks] == truth
                assert all(track.inferred == () for track in tracks)


def hairpin(gap: float, right: float, bottom: float, top: float) -> BSplineCurve:
    """Return a curve that comes down at the right, turns, and goes up a gap beside itself."""
    turn, radius = np.linspace(0.0, np.pi, 20)[1:-1], gap / 2.0
    down = np.stack((np.full(30, right), np.linspace(95.0, bottom - radius, 30)), axis=1)
    around = np.stack((right - radius + radius * np.cos(turn), bottom - radius + radius * np.sin(turn)), axis=1)
    up = np.stack((np.full(20, right - gap), np.linspace(bottom - radius, top, 20)), axis=1)
    return curve_through(np.vstack((down, around, up)))


class TestHairpin:
    """A detection that shows one track alone is read as it is, not by the part of it that lies where it was expected.

    The second leg, moved sideways by more than the gap, finds the first one where it was.
    """

    @pytest.mark.parametrize("top", [160.0, 175.0, 185.0])
    @pytest.mark.parametrize("aside", [-10.0, -3.0, 3.0, 10.0])
    @pytest.mark.parametrize("opened", [20.0, 30.0, 40.0])
    @pytest.mark.parametrize("gap", [10.0, 14.0, 18.0])
    def test_opens_at_once(self, gap, opened, aside, top):
        tracker = tracked(hairpin(gap, 250.0, 240.0, top))
        opened_up = hairpin(opened, 250.0 + aside, 245.0, 160.0)
        (track,) = see(tracker, opened_up)
        assert track.id == 1
        assert track.inferred == ()
        assert far(track.curve, opened_up) < 1e-6


class TestAtTheBorder:
    SIZE = (300, 400)

    def inside(self, curve: BSplineCurve) -> BSplineCurve:
        """Return what the image shows of a curve that leaves it at its right."""
        u = np.linspace(0.0, 1.0, 4001)
        out = np.flatnonzero(curve(u)[:, 0] > self.SIZE[1] - 2)
        return part(curve, 0.0, u[out[0]]) if len(out) else curve

    @pytest.mark.parametrize(
        "curve",
        [
            line((120.0, 150.0), (380.0, 120.0)),
            curve_through(np.stack((np.linspace(100, 385, 40), 150 + 30 * np.sin(np.linspace(0, 5, 40))), 1)),
        ],
        ids=["straight", "wavy"],
    )
    def test_what_left_comes_back_as_it_is_seen(self, curve):
        tracker = tracked(curve, size=self.SIZE)
        for step, out in enumerate([*range(25), *range(24, -1, -1), 0]):
            whole = shifted(curve, 5.0 * out, 0.0)
            seen = self.inside(whole)
            (track,) = see(tracker, seen if step % 2 else seen.reversed(), size=self.SIZE)
            assert (track.id, track.inferred) == (1, ())
            assert far(track.curve, seen) < 1e-9
        assert far(track.curve, curve) < 1e-9


class TestScale:
    @pytest.mark.parametrize("rate", [1.01, 0.99])
    @pytest.mark.parametrize("shape", SHAPES)
    def test_nearer_and_farther_is_not_hidden(self, shape, rate):
        tracker = tracked(SHAPES[shape])
        for step in range(1, 61):
            scale = rate ** (step if step <= 30 else 60 - step)
            truth = SHAPES[shape].transformed(np.eye(2) * scale, [0.3 * step, 0.0])
            (track,) = see(tracker, truth.reversed() if step % 3 == 0 else truth)
            assert track.id == 1
            assert track.inferred == ()
            assert far(track.curve, truth) < 1e-6


@few_examples
@given(st.integers(0, 10**6))
@pytest.mark.slow
def test_order_and_direction_of_the_detections_do_not_matter(seed):
    """Crossing, cut, wrongly linked and partly hidden cables, one of them long and thin."""
    rng = np.random.default_rng(seed)
    thin = curve_through(np.stack((np.linspace(-200, 1400, 60), 350 + 60 * np.sin(np.linspace(0, 9, 60))), axis=1))
    cables = (*SLOPES, shifted(WAVES[0], 500.0, 60.0), thin)
    kinds = [rng.integers(0, 4, len(cables)) for _ in range(12)]

    def run(shuffled: bool) -> list[list[Track]]:
        tracker, result = tracked(*cables), []
        for step, kind in enumerate(kinds):
            now = [shifted(c, step, 0.5 * step * (k - 1)) for k, c in enumerate(cables)]
            found = swapped(*now[:2]) if kind[0] == 1 else list(now[:2])
            for curve, how in zip(now[2:], kind[2:].tolist(), strict=True):
                low = 0.2 + 0.03 * step
                if how == 1:
                    found += [shown(curve, (low, low + 0.15))]
                elif how == 2:
                    found += [part(curve, 0.0, low), part(curve, low + 0.15, 1.0)]
                else:
                    found += [curve]
            if shuffled:
                order = rng.permutation(len(found))
                found = [found[k].reversed() if rng.random() < 0.5 else found[k] for k in order]
            result.append(list(see(tracker, *found)))
        return result

    u = np.linspace(0.0, 1.0, 41)
    for one, other in zip(run(False), run(True), strict=True):
        assert one
        assert [track.id for track in one] == [track.id for track in other]
        for a, b in zip(one, other, strict=True):
            np.testing.assert_allclose(a.curve(u), b.curve(u), atol=1e-6)
            np.testing.assert_allclose(np.ravel(a.inferred), np.ravel(b.inferred), atol=1e-9)


@st.composite
def frames(draw: st.DrawFn) -> list[list[tuple[BSplineCurve | Detection, float]]]:
    """Any curves: they come, go, jump, are cut, cross, open and close, and lie outside of the image."""
    rng = np.random.default_rng(draw(st.integers(0, 10**6)))
    count = draw(st.integers(1, 6))
    shapes = [int(rng.integers(10**6)) for _ in range(count)]
    shift = rng.uniform(-100.0, 300.0, (count, 2))
    result = []
    for _ in range(draw(st.integers(1, 25))):
        shift += rng.normal(0.0, 3.0, shift.shape)
        frame: list[tuple[BSplineCurve | Detection, float]] = []
        for k in rng.permutation(count).tolist():
            if rng.random() < 0.03:
                shapes[k], shift[k] = int(rng.integers(10**6)), rng.uniform(-500.0, 500.0, 2)
            closed = shapes[k] % 4 == 0
            curve = shifted(random_curve(shapes[k], closed=closed), *shift[k].tolist())
            how = int(rng.integers(0, 8))
            if how == 0:
                continue
            low, high = np.sort(rng.uniform(0.0, 1.0, 2)).tolist()
            if how == 1:
                frame += [(part(curve, 0.0, low), 6.0), (part(curve, high, 1.0), 6.0)] if 0.0 < low < high < 1.0 else []
            elif how == 2:
                frame.append((part(curve, max(low - 1e-3, 0.0), high), float("nan")))
            elif how == 3 and not closed:
                frame.append((shown(curve, (low, high)), 6.0))
            elif how == 4 and frame:
                other = frame[-1][0]
                other = other.curve if isinstance(other, Detection) else other
                frame[-1] = (joined(other, curve), 6.0)
            else:
                frame.append((curve.reversed() if how == 5 else curve, [6.0, 2.0, float("nan")][k % 3]))
        result.append(frame)
    return result


@given(frames(), st.booleans())
def test_whatever_is_shown_tracks_are_well_formed(shown_frames, sized):
    tracker = Tracker(TrackingConfig(keep_lost_s=0.2))
    u, begun = np.linspace(0.0, 1.0, 33), 0
    for frame in shown_frames:
        tracks = tracker.update(
            [one for one, _ in frame], size=(480, 640) if sized else None, widths=[width for _, width in frame]
        )
        assert [track.id for track in tracks] == sorted({track.id for track in tracks})
        ids = [track.id for track in (*tracks, *tracker.lost)]
        assert len(ids) == len(set(ids))
        # A detection begins one object in whatever hypotheses, and two that show one track may begin another one.
        begun += len(frame) + len(frame) // 2 * MAX_HYPOTHESES
        assert set(ids) <= set(range(1, begun + 1))
        for track in tracks:
            assert np.isfinite(track.curve(u)).all()
            assert track.curve.length > 0.0
            assert 0.0 <= track.confidence <= 1.0
            edges = [edge for span in track.inferred for edge in span]
            assert edges == sorted(edges)
            assert all(low < high for low, high in track.inferred)
            assert all(-1e-9 <= edge <= 1.0 + 1e-9 for edge in edges)


def test_a_track_follows_its_detection_as_far_as_it_is_long_where_another_one_shares_it():
    """Its tail swings away faster than expected while the detector joins its other end with another cable."""
    still, other = line((0.0, 200.0), (400.0, 200.0)), line((-300.0, 350.0), (-12.0, 206.0))
    swung = rounded((0.0, 200.0), (200.0, 200.0), (385.0, 270.0))
    tracker = tracked(still, other)
    first, second = see(tracker, joined(other, swung))
    assert (first.inferred, second.inferred) == ((), ())
    assert far(first.curve, swung) < WIDTH
    assert far(second.curve, other) < WIDTH
