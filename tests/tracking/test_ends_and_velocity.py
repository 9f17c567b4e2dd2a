"""Ends and velocities of published tracks."""

from __future__ import annotations

import numpy as np
import pytest
from builders import detection_of, line, loop, part, wave

from dloftbs import BSplineCurve, EndKind, InputError, Track, Tracker, TrackState
from dloftbs.data.curve_samples import SAMPLES, U
from dloftbs.tracking.track_motion import Motion

FREE, BORDER, HIDDEN = EndKind.FREE, EndKind.BORDER, EndKind.HIDDEN
SIZE = (480, 640)
FRAME_S = 1 / 30


def follow(curves: list[BSplineCurve], size: tuple[int, int] | None = SIZE) -> list[Track]:
    """Return the only track of each frame."""
    tracker = Tracker()
    result = []
    for k, curve in enumerate(curves):
        (track,) = tracker.update([detection_of(curve)], k * FRAME_S, size)
        result.append(track)
    return result


def test_what_ends_in_the_image_has_free_ends() -> None:
    (track,) = follow([line((100, 200), (500, 240))])
    assert track.ends == (FREE, FREE)
    assert track.to_dict()["ends"] == ["free", "free"]


def test_what_leaves_the_image_ends_at_its_border_if_the_size_is_known() -> None:
    leaving = line((200, 200), (639, 210))
    assert follow([leaving])[0].ends == (FREE, BORDER)
    assert follow([leaving], None)[0].ends == (FREE, FREE)


def test_the_ends_of_a_track_are_in_its_direction() -> None:
    leaving = line((200, 200), (639, 210))
    assert follow([leaving, leaving.reversed()])[1].ends == (FREE, BORDER)


def test_a_loop_has_no_ends() -> None:
    (track,) = follow([loop(80.0, (300.0, 240.0))])
    assert track.ends is None
    assert track.to_dict()["ends"] is None


def test_an_end_that_is_covered_is_hidden() -> None:
    whole = line((60, 240), (560, 240))
    last = follow([*[whole] * 12, part(whole, 0.0, 0.7)])[-1]
    assert last.inferred
    assert last.ends == (FREE, HIDDEN)


def test_all_of_a_lost_track_is_hidden() -> None:
    tracker = Tracker()
    for k in range(3):
        tracker.update([wave((2.0 * k, 0.0))], k * FRAME_S)
    assert tracker.update([], 3 * FRAME_S) == ()
    (lost,) = tracker.lost
    assert lost.ends == (HIDDEN, HIDDEN)
    assert lost.velocity is not None
    assert lost.velocity_3d is None


@pytest.mark.parametrize("backwards", [False, True])
def test_a_curve_that_moves_as_a_whole_has_one_velocity(backwards: bool) -> None:
    curves = [wave((3.0 * k, -1.0 * k)) for k in range(8)]
    shown = [curve.reversed() if backwards and k % 2 else curve for k, curve in enumerate(curves)]
    first, *_, last = follow(shown, None)
    assert first.velocity is None
    assert last.velocity is not None
    np.testing.assert_allclose(last.velocity, np.tile((90.0, -30.0), (len(last.velocity), 1)), rtol=1e-3)
    assert not last.velocity.flags.writeable


def test_a_curve_that_turns_about_its_start_moves_fastest_at_its_end() -> None:
    rate = 0.3  # rad/s
    angles = rate * FRAME_S * np.arange(8)
    curves = [line((100, 100), (100 + 300 * np.cos(a), 100 + 300 * np.sin(a))) for a in angles]
    last = follow(curves)[-1]
    assert last.velocity is not None
    speed = np.hypot(*last.velocity.T)
    np.testing.assert_allclose(speed, rate * 300.0 * np.linspace(0.0, 1.0, len(speed)), atol=0.5)


def test_the_velocity_is_that_of_the_curve_as_published() -> None:
    # It turns about its end outside of the image, so that the speed tells the place along it.
    rate, size = 0.1, (480, 400)
    angles = rate * FRAME_S * np.arange(20)
    whole = [line((100, 240), (390, 240))] * 10
    tips = [(395 - 295 * np.cos(a), 240 + 295 * np.sin(a)) for a in angles]
    last = follow([*whole, *(line(tip, (395, 240)) for tip in tips)], size)[-1]
    assert last.velocity is not None
    away = np.hypot(*(last.curve(np.linspace(0.0, 1.0, len(last.velocity))) - (395, 240)).T)
    np.testing.assert_allclose(np.hypot(*last.velocity.T), rate * away, atol=0.5)


def test_the_velocity_is_at_even_shares_of_the_length() -> None:
    """A spline that is fast at one end and slow at the other, turned about its start."""
    rate = 0.2
    along = [(100.0 + 300.0 * x, 200.0) for x in (0.0, 0.02, 0.1, 0.3, 1.0)]
    curve = BSplineCurve([0, 0, 0, 0, 0.5, 1, 1, 1, 1], along)
    angles = rate * FRAME_S * np.arange(8)
    pivot = np.array((100.0, 200.0))
    turns = [np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]]) for a in angles]
    last = follow([curve.transformed(turn, pivot - turn @ pivot) for turn in turns])[-1]
    assert last.velocity is not None
    speed = np.hypot(*last.velocity.T)
    np.testing.assert_allclose(speed, rate * 300.0 * np.linspace(0.0, 1.0, len(speed)), atol=0.5)


def test_what_changes_its_length_at_once_has_no_velocity_until_it_moves_on() -> None:
    here, longer = line((60, 100), (460, 100)), line((60, 300), (560, 300))
    tracks = follow([here, here, here, longer, longer])
    assert [track.id for track in tracks] == [1] * 5
    assert [track.velocity is None for track in tracks] == [True, False, False, True, False]


def test_to_find_a_cable_elsewhere_along_itself_after_its_ends_were_hidden_is_no_motion() -> None:
    """The middle of a straight cable looks the same wherever its hidden ends are."""
    here, pulled = line((40, 200), (440, 200)), line((140, 200), (540, 200))
    middle = line((180, 200), (380, 200))
    tracks = follow([*[here] * 12, *[middle] * 3, pulled, pulled])
    assert [track.id for track in tracks] == [1] * 17
    assert tracks[14].curve.length == pytest.approx(400.0, abs=1.0)
    assert tracks[15].curve.length == pytest.approx(400.0, abs=1.0)
    assert [track.velocity is None for track in tracks[14:]] == [False, True, False]
    np.testing.assert_allclose(tracks[16].velocity, 0.0, atol=1e-6)


def test_the_velocity_in_space_is_unknown_after_a_cut_until_two_frames_show_the_rest() -> None:
    motion = Motion(is_known=True, velocity_3d=np.zeros((SAMPLES, 3)), points_3d=np.zeros((SAMPLES, 3)))
    motion.resample(0.5 * U)
    half = line((0.0, 0.0, 1.0), (0.5, 0.0, 1.0))
    motion.measure_in_space(half, 0.5, FRAME_S)
    assert motion.velocity_3d is None
    motion.measure_in_space(half, 0.5, FRAME_S)
    np.testing.assert_allclose(motion.velocity_3d, np.zeros((SAMPLES, 3)), atol=1e-12)


def test_depth_that_jumps_is_no_motion() -> None:
    motion = Motion(is_known=True)
    for z in (1.0, 1.0, 1.3):
        motion.measure_in_space(line((0.0, 0.0, z), (0.5, 0.0, z)), 0.5, FRAME_S)
    assert motion.velocity_3d is None


def test_stamps_that_come_in_bursts_make_no_velocity() -> None:
    """A cable moves by 3.3 px a frame; the stamps of two frames are nearly the same."""
    tracker, curve_3d = Tracker(), line((0.0, 0.0, 1.0), (0.5, 0.0, 1.0))
    for k, stamp in enumerate((0.0, 1 / 30, 2 / 30, 2 / 30 + 1e-4)):
        moved = detection_of(wave((3.3 * k, 0.0)), curve_3d.transformed(np.eye(3), (0.005 * k, 0.0, 0.0)))
        (track,) = tracker.update([moved], stamp)
    assert np.abs(track.velocity - (99.0, 0.0)).max() < 5.0
    assert np.abs(track.velocity_3d - (0.15, 0.0, 0.0)).max() < 0.01
    (predicted,) = tracker.predict(3 / 30)
    assert np.abs(predicted.curve.start - track.curve.start).max() < 5.0


def test_the_velocity_in_space_is_in_metres() -> None:
    tracker = Tracker()
    tracks = []
    for k in range(8):
        z = 1.0 + 0.02 * k
        curve_3d = line((0.0, 0.01 * k, z), (0.5, 0.01 * k, z))
        tracks += tracker.update([detection_of(wave((2.0 * k, 0.0)), curve_3d)], k * FRAME_S)
    assert tracks[0].velocity_3d is None
    velocity = tracks[-1].velocity_3d
    assert velocity is not None
    np.testing.assert_allclose(velocity, np.tile((0.0, 0.3, 0.6), (len(velocity), 1)), atol=1e-9)
    (last,) = tracker.update([detection_of(wave((16.0, 0.0)))], 8 * FRAME_S)
    assert last.velocity is not None
    assert last.velocity_3d is None


@pytest.mark.parametrize(
    ("field", "value"),
    [("ends", (FREE,)), ("ends", ("free", "free")), ("velocity", np.zeros((4, 3))), ("velocity_3d", np.zeros((4, 2)))],
)
def test_what_is_no_end_or_velocity_is_refused(field: str, value: object) -> None:
    with pytest.raises(InputError, match=r"end|velocity"):
        Track(1, TrackState.CONFIRMED, wave(), None, 1, 0, None, **{field: value})


def test_a_way_between_frames_follows_the_change_of_the_velocity() -> None:
    """A line falls as a stone does: its place between two frames is known from the last three."""

    def at(second: float) -> float:
        return 100.0 + 60.0 * second + 0.5 * 900.0 * second * second

    tracks = follow([line((100, at(k * FRAME_S)), (500, at(k * FRAME_S))) for k in range(8)])
    assert tracks[0]._way(0.01) is None
    first, change = tracks[1]._way(0.01)
    assert np.array_equal(first, change)
    now = 7 * FRAME_S
    for seconds in (-0.012, 0.008):
        way, change = tracks[7]._way(seconds)
        np.testing.assert_allclose(way[:, 1], at(now + seconds) - at(now), atol=0.06)
        assert np.abs(change[:, 1]).min() > 0.05
