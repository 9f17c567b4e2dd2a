"""Sequences before two cameras."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

from dloftbs import CameraRig, InputError
from dloftbs_lab.commands.methods import method_of
from dloftbs_lab.evaluation import match_curves
from dloftbs_lab.synthetic import TWO_CAMERA_VARIANTS, TwoCameraSequence, two_cameras

SIZE = (180, 320)


def test_each_variant_has_a_sequence_and_frames_are_the_same_again():
    sequences = two_cameras(0.05, 0, SIZE)
    assert [sequence.family for sequence in sequences] == list(TWO_CAMERA_VARIANTS)
    again = pickle.loads(pickle.dumps(sequences[0])).frame(3)
    assert np.array_equal(again.second.mask, sequences[0].frame(3).second.mask)
    with pytest.raises(InputError, match="variant must be one of"):
        TwoCameraSequence("one eye")


def test_both_views_see_the_true_axes():
    sequence = TwoCameraSequence("300 mm, 0.8 m", size=SIZE)
    frame, (axis,) = sequence.frame(5), sequence.truth(5).curves_3d
    rig = CameraRig([frame.camera, frame.second.camera], frame.poses)
    for view, places in zip((frame, frame.second), rig.project(axis.sample(50)), strict=True):
        columns, rows = np.rint(places).astype(int).T
        inside = (columns >= 0) & (columns < SIZE[1]) & (rows >= 0) & (rows < SIZE[0])
        assert inside.sum() > 20
        assert view.mask[rows[inside], columns[inside]].all()


def test_what_is_believed_is_wrong_where_the_variant_says_so_and_right_elsewhere():
    exact = TwoCameraSequence("60 mm, 0.8 m", size=SIZE).frame(0)
    wrong = TwoCameraSequence("60 mm, 0.8 m, rig off by 0.1 degree and 0.2 px", size=SIZE).frame(0)
    assert np.array_equal(exact.poses[1][:3, :3], np.eye(3))
    assert 0.0 < np.abs(wrong.poses[1][:3, :3] - np.eye(3)).max() < 0.01
    assert exact.camera == exact.second.camera
    assert wrong.camera.cx != wrong.second.camera.cx
    late = TwoCameraSequence("60 mm, 0.8 m, 5 ms apart", size=SIZE)
    assert late.frame(1).second.stamp == pytest.approx(late.frame(1).stamp + 0.005)


def test_the_method_follows_in_space():
    sequence = TwoCameraSequence("300 mm, 0.8 m", number=2, frames=3, size=(360, 640))
    process = method_of("stereo").factory()
    for frame in sequence:
        result = process(frame)
        assert [track.id for track in result.tracks] == [1]
    curves = [detection.curve_3d for detection in result]
    assert match_curves(curves, sequence.truth(2).curves_3d).pairs[0].l3 < 0.02
