"""Curves of one view: where their observations lie."""

from __future__ import annotations

import numpy as np
from stereo_views import CAMERA, axis_through, depths_m, masks, rig

from dloftbs import Frame, Pipeline
from dloftbs.stereo.view_curves import _depth_rows


def test_depth_lies_where_the_curve_in_the_image_shows_it():
    r = rig()
    turns = axis_through([(0.05 * number - 0.15, 0.1 * (-1.0) ** number, 0.6) for number in range(6)])
    frame = Frame(mask=masks(r, turns)[0], depth=depths_m(r, turns, 0), camera=CAMERA)
    (detection,) = Pipeline().detect(frame)
    t, rows = _depth_rows(detection)
    apart = np.linalg.norm(detection.curve.spline(t) - CAMERA.project(np.c_[rows[:, :2], np.ones(len(t))]), axis=1)
    assert apart.max() < 0.6
