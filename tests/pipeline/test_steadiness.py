"""Tracks that are those of objects, and tracks of a mask that breaks up."""

from __future__ import annotations

from builders import line

from dloftbs import Track, TrackState
from dloftbs.pipeline import steadiness as module
from dloftbs.pipeline.steadiness import Steadiness


def tracks(*ids, state=TrackState.CONFIRMED):
    return [Track(number, state, line((0, 0), (9, 0)), None, 1, 0, None) for number in ids]


def counted(frames):
    steadiness = Steadiness()
    for ids in frames:
        steadiness.add(tracks(*ids), len(ids))
    return steadiness


def test_cables_that_come_stay_and_go_are_as_usual():
    assert Steadiness().warning() is None
    assert counted([(1, 2)] * 100 + [(1,)] * 100 + [(1, 3)] * 100).warning() is None
    conveyor = [(i // 40 + 1, i // 40 + 2) for i in range(400)]
    assert counted(conveyor).tracks == 11
    assert counted(conveyor).warning() is None


def test_what_is_shorter_than_the_stream_is_not_short_while_it_lasts():
    assert counted([(1, 2, 3, 4, 5, 6)] * 5).warning() is None


def test_many_short_tracks_are_a_broken_mask():
    broken = counted([(1, i // 8 + 2) for i in range(240)])
    assert broken.warning() == (
        "31 tracks in 240 frames, 29 of them for less than 30 frames: the mask is probably broken"
    )


def test_an_object_that_flickers_is_a_broken_mask():
    flickering = counted([(1,) if i % 2 else (1, 2) for i in range(100)])
    assert flickering.warning() == ("the number of objects changes in 99 of 100 frames: the mask is probably broken")
    assert counted([(1,) if i % 20 else (1, 2) for i in range(100)]).warning() is None
    assert counted([(1,) if i % 2 else (1, 2) for i in range(10)]).warning() is None  # too few to tell


def test_tentative_tracks_are_counted_when_they_are_confirmed():
    steadiness = Steadiness()
    for state in (TrackState.TENTATIVE, TrackState.CONFIRMED):
        steadiness.add(tracks(1, state=state), 1)
        assert steadiness.tracks == (state is TrackState.CONFIRMED)


def test_its_size_is_bounded(monkeypatch):
    monkeypatch.setattr(module, "_MAX_IDS", 10)
    steadiness = counted([(i + 1,) for i in range(500)])
    assert len(steadiness._lives) == 10
    assert steadiness.tracks == 500
    assert "500 tracks in 500 frames, 499 of them for less" in str(steadiness.warning())


def test_the_usual_number_has_its_evidence():
    usual = (1, "1 object in 95 of 100 frames, more in 5; if there is one cable")
    assert counted([(1,) if i % 20 else (1, 2) for i in range(100)]).usual_number() == usual
    assert counted([(1,)] * 100).usual_number() is None
    assert Steadiness().usual_number() is None


def test_a_number_that_is_known_is_not_asked_for():
    steadiness = Steadiness(objects=2)
    for i in range(60):
        steadiness.add(tracks(1), 2 if i == 30 else 1)
    assert steadiness.usual_number() is None


def test_the_numbers_of_objects_are_bounded(monkeypatch):
    monkeypatch.setattr(module, "_MAX_COUNTS", 10)
    steadiness = Steadiness()
    for number in range(500):
        steadiness.add((), number)
    assert len(steadiness._found) == 11
