"""Doubts about a rig: when it is named, when it is not, and how often."""

from __future__ import annotations

import logging
import math
from dataclasses import replace

import numpy as np
import pytest
from stereo_views import BENT, CAMERA, OTHER, angular_mask, beside, masks, rig

from dloftbs import CameraRig, PinholeCamera, StereoPipeline
from dloftbs.stereo.doubts import RigDoubts

HD = PinholeCamera(900.0, 900.0, 639.5, 359.5, size=(720, 1280))


@pytest.mark.parametrize("axis", [BENT, OTHER])
def test_exchanged_views_of_converging_cameras_are_named(axis, caplog):
    r = rig(0.06, math.atan2(0.06, 0.65), HD)
    pairs = zip(r.cameras, r.poses, strict=True)
    views = [angular_mask(HD, HD.size, (axis - pose[:3, 3]) @ pose[:3, :3], 0.006) for _, pose in pairs]
    with caplog.at_level(logging.WARNING):
        assert r.detect(views)[0].curve_3d is not None
        assert not caplog.records
        assert all("left and right" in one.no_3d_reason for one in r.detect(views[::-1]))
    assert "left and right" in caplog.text


def test_a_rig_that_has_fitted_stays_out_of_doubt(caplog):
    r = rig()
    pipeline = StereoPipeline(r)
    for _ in range(3):
        pipeline.process(masks(r, BENT))
    with caplog.at_level(logging.WARNING):
        result = pipeline.process(masks(r, OTHER)[::-1])  # each view shows another cable
    assert not caplog.records
    assert all("one view alone" in one.no_3d_reason for one in result)


def test_a_doubt_is_said_once(caplog):
    r = rig()
    pipeline = StereoPipeline(r)
    with caplog.at_level(logging.WARNING):
        for _ in range(3):
            result = pipeline.process(masks(r, BENT)[::-1])
            assert "left and right" in result.objects[0].no_3d_reason
    assert caplog.text.count("left and right") == 1


def test_a_rig_in_another_unit_is_asked_about_once(caplog):
    in_squares = CameraRig([CAMERA, CAMERA], [np.eye(4), beside(4.0)])
    pipeline = StereoPipeline(in_squares)
    with caplog.at_level(logging.WARNING):
        for _ in range(3):
            assert pipeline.process(masks(rig(), BENT)).objects[0].width_m > 0.3
    assert caplog.text.count("are the poses in metres?") == 1


def test_a_rig_in_metres_is_not_asked_about(caplog):
    with caplog.at_level(logging.WARNING):
        rig().detect(masks(rig(), BENT, OTHER))
    assert not caplog.records


def test_one_wrong_pair_is_no_wrong_unit(caplog):
    one = rig().detect(masks(rig(), BENT))[0]
    far = replace(one, width_m=0.5)
    doubts = RigDoubts(lasting=True)
    with caplog.at_level(logging.WARNING):
        doubts.about_unit([far, one])
        assert not caplog.records
        doubts.about_unit([far, far])
    assert "0.5 m wide" in caplog.text
