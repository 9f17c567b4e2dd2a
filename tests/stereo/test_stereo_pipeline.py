"""Identities of a rig from moment to moment."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest
from stereo_views import BENT, CAMERA, OTHER, masks, rig

from dloftbs import CameraRig, Frame, FrameResult, InputError, StereoPipeline
from dloftbs.stereo.rig_tracker import _gain, _Known

CROSSED = {1: {0: 1, 1: 2}, 2: {0: 2, 1: 1}}
"""Tracks by view of two objects, each of the other one's in the second view."""


def moved(axis: np.ndarray, step: int) -> np.ndarray:
    return axis + np.array([0.004, -0.002, 0.003]) * step


def turn_tracks(monkeypatch: pytest.MonkeyPatch, pipeline: StereoPipeline, view: int, number: int) -> None:
    """Let the track of a view have a number and run the other way from now on."""
    own = pipeline._pipelines[view]
    process = own.process

    def turned(frame: Frame) -> FrameResult:
        result = process(frame)
        return replace(result, tracks=tuple(replace(track.reversed(), id=number) for track in result.tracks))

    monkeypatch.setattr(own, "process", turned)


def test_ids_and_directions_stay():
    r = rig()
    pipeline = StereoPipeline(r)
    ids, starts = [], []
    for step in range(8):
        result = pipeline.process(masks(r, moved(BENT, step), moved(OTHER, -step)))
        assert [track.object is None for track in result.tracks] == [False, False]
        ids.append([track.id for track in result.tracks])
        starts.append([track.curve_3d.start for track in result.tracks])
    assert ids == [[1, 2]] * 8
    steps = np.linalg.norm(np.diff(np.array(starts), axis=0), axis=2)
    assert steps.max() < 0.03
    assert result.tracks[0].hits == 8


def test_pairs_that_fit_as_well_as_others_stay_as_they_were():
    r = rig()
    pipeline = StereoPipeline(r)
    views = masks(r, BENT, np.add(BENT, (0.03, 0.0, 0.0)))
    for _ in range(14):
        result = pipeline.process(views)
        assert [one.members for one in result] == [(0, 0), (1, 1)]
        assert all(0.4 < one.confidence < 0.9 for one in result)


def test_what_one_view_loses_for_a_moment_keeps_its_id():
    r = rig()
    pipeline = StereoPipeline(r)
    for step in range(6):
        left, right = masks(r, moved(BENT, step))
        if step == 3:
            right[:] = False
        result = pipeline.process([left, right])
        shown = [track for track in result.tracks if track.object is not None]
        assert [track.id for track in shown] == [1]
        assert (result.objects[shown[0].object].curve_3d is None) == (step == 3)


def test_a_view_that_takes_it_for_another_one_does_not_change_its_id():
    r = rig()
    pipeline = StereoPipeline(r)
    assert pipeline.process(masks(r, BENT)).tracks[0].id == 1
    for own in pipeline._pipelines:
        own.process(np.zeros((240, 320), bool))
        own.reset()
    result = pipeline.process(masks(r, moved(BENT, 1)))
    assert [track.id for track in result.tracks if track.object is not None] == [1]


def test_the_first_view_decides_where_two_say_opposite_things():
    """Views whose tracks were paired wrongly at first: the object keeps the id that the first view's track had."""
    shown = {(0, 1), (0, 2), (1, 1), (1, 2)}
    first, second = (_Known(number, members, {}, None, None, 0.0, 1, 0) for number, members in CROSSED.items())
    assert _gain((1, 1), None, first, shown) > 0.0
    assert _gain((1, 1), None, second, shown) < 0.0


def test_a_cable_laid_far_away_is_another_one():
    r = rig()
    pipeline = StereoPipeline(r)
    assert pipeline.process(masks(r, BENT)).tracks[0].id == 1
    for own in pipeline._pipelines:
        own.reset()
    (track,) = pipeline.process(masks(r, np.add(BENT, (0.0, 0.0, 0.5)))).tracks
    assert (track.id, track.hits) == (2, 1)


@pytest.mark.parametrize("view", [0, 1])
def test_the_view_that_followed_a_cable_says_its_direction(monkeypatch, view):
    r = rig()
    pipeline = StereoPipeline(r)
    seen = masks(r, BENT)
    (before,) = pipeline.process(seen).tracks
    turn_tracks(monkeypatch, pipeline, view, 1)  # as if the cable was turned end for end, to lie as before
    covered = list(seen)
    covered[1 - view] = np.zeros_like(seen[0])
    pipeline.process(covered)
    (after,) = pipeline.process(seen).tracks
    assert after.id == before.id
    assert np.allclose(after.curve_3d.start, before.curve_3d.end, atol=0.01)


def test_the_first_view_is_published_in_the_direction_of_the_rig(monkeypatch):
    r = rig()
    pipeline = StereoPipeline(r)
    left, right = masks(r, BENT)
    (before,) = pipeline.process([left, right]).as_frame_result().tracks
    turn_tracks(monkeypatch, pipeline, 0, 2)  # as if it lost the cable and found it again
    for second in (right, np.zeros_like(right), right):
        result = pipeline.process([left, second])
        (own,), (track,) = result.tracks, result.as_frame_result().tracks
        assert (own.id, track.id) == (1, 1)
        assert np.allclose(track.curve.start, before.curve.start, atol=2.0)
        assert (track.curve_3d is None) == (second is not right)
        if track.curve_3d is not None:
            assert np.allclose(track.curve_3d.start, own.curve_3d.start)
        assert own.backwards == (True, False)


def test_a_part_of_what_is_seen_is_no_hidden_object():
    r = rig()
    pipeline = StereoPipeline(r)
    parts = masks(r, BENT[:500], BENT[1000:])
    for _ in range(3):
        result = pipeline.process(parts)
    assert [track.id for track in result.tracks] == [1, 2]
    for _ in range(3):
        result = pipeline.process([masks(r, BENT)[0], parts[1]])
    (one,) = result.objects
    assert len(one.pieces[1]) == 2
    assert all(track.members[1] is None for track in result.tracks if track.object is None)


def test_tracks_of_the_views_have_the_curves_in_space():
    r = rig()
    result = StereoPipeline(r).process(masks(r, BENT))
    for view in result.views:
        (track,), (detection,) = view.tracks, view.detections
        assert track.detection is detection
        assert track.curve_3d is detection.curve_3d
        assert track.velocity_3d is None


def test_a_reset_forgets_but_uses_no_id_twice():
    r = rig()
    pipeline = StereoPipeline(r)
    views = masks(r, BENT)
    assert pipeline.process(views).tracks[0].id == 1
    pipeline.reset()
    assert pipeline.process(views).tracks[0].id == 2


def test_a_loop_keeps_its_id_and_its_direction_wherever_the_views_begin_it():
    r = rig()
    pipeline = StereoPipeline(r)
    angles = np.linspace(0.0, 2.0 * np.pi, 1500)
    ring = np.stack((0.09 * np.cos(angles), 0.06 * np.sin(angles), np.full(1500, 0.7)), axis=1)
    turns = []
    for step in range(6):
        turn = 0.5 * step
        spin = np.array([[np.cos(turn), -np.sin(turn), 0.0], [np.sin(turn), np.cos(turn), 0.0], [0.0, 0.0, 1.0]])
        (track,) = pipeline.process(masks(r, moved(ring @ spin.T, step))).tracks
        assert (track.id, track.object) == (1, 0)
        assert track.curve_3d.closed
        points = track.curve_3d.sample(100)
        ahead = np.roll(points, -1, axis=0)
        turns.append(np.sign((points[:, 0] * ahead[:, 1] - points[:, 1] * ahead[:, 0]).sum()))
    assert len(set(turns)) == 1


def test_moments_from_files_are_numbered(tmp_path):
    r = rig()
    paths = [tmp_path / f"{number}.png" for number in range(2)]
    for path, mask in zip(paths, masks(r, BENT), strict=True):
        cv2.imwrite(str(path), 255 * mask.astype(np.uint8))
    pipeline = StereoPipeline(r)
    assert [pipeline.process(paths).index for _ in range(3)] == [0, 1, 2]


def test_what_is_refused():
    with pytest.raises(InputError, match="rig must be a CameraRig"):
        StereoPipeline("rig.yaml")
    with pytest.raises(InputError, match="two cameras or more"):
        StereoPipeline(CameraRig([CAMERA]))
    with pytest.raises(InputError, match="as many as the rig's cameras"):
        StereoPipeline(rig()).process([np.zeros((240, 320), bool)] * 3)
