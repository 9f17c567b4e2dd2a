"""Identities of a rig from moment to moment."""

from __future__ import annotations

import numpy as np
import pytest
from stereo_views import BENT, CAMERA, OTHER, masks, rig

from dloftbs import CameraRig, InputError, StereoPipeline


def moved(axis: np.ndarray, step: int) -> np.ndarray:
    return axis + np.array([0.004, -0.002, 0.003]) * step


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


def test_a_reset_forgets_but_uses_no_id_twice():
    r = rig()
    pipeline = StereoPipeline(r)
    views = masks(r, BENT)
    assert pipeline.process(views).tracks[0].id == 1
    pipeline.reset()
    assert pipeline.process(views).tracks[0].id == 2


def test_what_is_refused():
    with pytest.raises(InputError, match="rig must be a CameraRig"):
        StereoPipeline("rig.yaml")
    with pytest.raises(InputError, match="two cameras or more"):
        StereoPipeline(CameraRig([CAMERA]))
    with pytest.raises(InputError, match="as many as the rig's cameras"):
        StereoPipeline(rig()).process([np.zeros((240, 320), bool)] * 3)
