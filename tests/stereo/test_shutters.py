"""Views whose shutters opened one after the other."""

from __future__ import annotations

import numpy as np
import pytest
from stereo_views import BENT, OTHER, distances_m, masks, rig

from dloftbs import CameraRig, Frame, StereoPipeline

FRAME_S = 1.0 / 30.0
LATE_S = 0.01
SWAY = np.array([0.6, -0.2, 0.0])
"""Velocity of the cable when it passes the middle, m/s."""


def swaying(axis: np.ndarray, second: float, hertz: float = 1.0) -> np.ndarray:
    turn = 2.0 * np.pi * hertz
    return axis + SWAY * np.sin(turn * (second - 0.1)) / turn


def followed(r: CameraRig, *axes: np.ndarray, stamped: bool = True, hidden_rows: int = 0, frames: int = 7):
    """Return the result of the last moment of a stream whose second view is late, and the axes there and then."""
    pipeline = StereoPipeline(r)
    for number in range(frames):
        now = number * FRAME_S
        left = masks(r, *(swaying(axis, now) for axis in axes))[0]
        right = masks(r, *(swaying(axis, now + LATE_S) for axis in axes))[1]
        if number > 3:
            right[:hidden_rows] = False
        stamps = now, now + LATE_S if stamped else now
        views = [Frame(mask=mask, index=number, stamp=at) for mask, at in zip((left, right), stamps, strict=True)]
        result = pipeline.process(views)
    return result, [swaying(axis, now) for axis in axes]


def with_options(**options) -> CameraRig:
    plain = rig()
    return CameraRig(plain.cameras, plain.poses, **options)


def test_what_moves_is_brought_to_the_time_of_the_first_view():
    result, (axis,) = followed(rig(), BENT)
    without, _ = followed(rig(), BENT, stamped=False)
    (one,), (off,) = result.objects, without.objects
    assert np.median(distances_m(off.curve_3d, axis)) > 0.01
    assert np.median(distances_m(one.curve_3d, axis)) < 0.0015
    assert result.views[1].detections[one.members[1]].curve == without.views[1].detections[off.members[1]].curve


def test_each_object_moves_by_its_own_track():
    result, axes = followed(rig(), BENT, OTHER)
    assert len(result.objects) == 2
    for one in result.objects:
        assert min(np.median(distances_m(one.curve_3d, axis)) for axis in axes) < 0.002


def test_a_part_of_a_track_moves_with_it():
    result, (axis,) = followed(rig(), BENT, hidden_rows=90)
    without, _ = followed(rig(), BENT, hidden_rows=90, stamped=False)
    (one,), (off,) = result.objects, without.objects
    assert one.curve_3d.length < 0.8 * np.linalg.norm(np.diff(axis, axis=0), axis=1).sum()
    assert np.median(distances_m(one.curve_3d, axis)) < 0.25 * np.median(distances_m(off.curve_3d, axis))


def test_cameras_that_are_triggered_need_no_step():
    result, _ = followed(with_options(triggered=True), BENT)
    plain, _ = followed(rig(), BENT, stamped=False)
    assert result.objects[0].curve_3d == plain.objects[0].curve_3d


def test_a_change_of_the_velocity_and_stamps_that_err_are_in_the_deviation():
    calm, _ = followed(with_options(triggered=True), BENT)
    moved, _ = followed(rig(), BENT)
    unsure, _ = followed(with_options(triggered=True, time_std_s=0.005), BENT)
    surer, _ = followed(with_options(triggered=True, time_std_s=0.0025), BENT)
    least, changed, most, half = (run.objects[0].curve_3d_std(0.5) for run in (calm, moved, unsure, surer))
    assert least < changed < most
    assert most**2 - least**2 == pytest.approx(4.0 * (half**2 - least**2), rel=0.02)


def test_nothing_moves_before_its_motion_is_known_and_after_a_reset():
    r = rig()
    pipeline = StereoPipeline(r)

    def view(number: int, stamped: bool):
        now = number * FRAME_S
        pictures = [masks(r, swaying(BENT, now + late))[place] for place, late in ((0, 0.0), (1, LATE_S))]
        stamps = now, now + LATE_S if stamped else now
        frames = [Frame(mask=one, index=number, stamp=at) for one, at in zip(pictures, stamps, strict=True)]
        return pipeline.process(frames).objects[0].curve_3d

    assert view(0, stamped=True) == r.detect(masks_of(r)).objects[0].curve_3d
    view(1, stamped=True)
    pipeline.reset()
    after = view(2, stamped=True)
    pipeline.reset()
    assert after == view(2, stamped=False)


def masks_of(r: CameraRig):
    return [masks(r, swaying(BENT, late))[place] for place, late in ((0, 0.0), (1, LATE_S))]
