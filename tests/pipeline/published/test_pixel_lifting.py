"""Depth to metres as published: each pixel by itself."""

from __future__ import annotations

import numpy as np
import pytest

from dloftbs import PinholeCamera
from dloftbs.config import PixelLiftingConfig
from dloftbs.pipeline.published import lift_pixels

CAMERA = PinholeCamera(fx=500.0, fy=510.0, cx=32.0, cy=24.0)
POINTS = np.array([[10.0, 20.0], [30.0, 5.0], [63.0, 47.0], [0.0, 0.0]])


def test_metres_and_millimetres_agree() -> None:
    metres = np.random.default_rng(0).uniform(0.5, 2.0, (48, 64))
    millimetres = np.rint(metres * 1000).astype(np.uint16)
    from_float, seen = lift_pixels(POINTS, millimetres / 1000.0, 0.001, CAMERA, PixelLiftingConfig())
    from_integer, _ = lift_pixels(POINTS, millimetres, 0.001, CAMERA, PixelLiftingConfig())
    assert seen.all()
    np.testing.assert_allclose(from_float, from_integer)
    np.testing.assert_allclose(CAMERA.project(from_float), POINTS)
    np.testing.assert_allclose(from_float[0, 2], millimetres[20, 10] / 1000.0)


@pytest.mark.parametrize("missing", [0.0, np.nan, np.inf, -np.inf, -1.0, 25.0, 0.05])
def test_missing_depth_is_left_out(missing: float) -> None:
    depth = np.full((48, 64), 1.0)
    depth[5, 30] = missing
    points, seen = lift_pixels(POINTS, depth, 0.001, CAMERA, PixelLiftingConfig(min_depth_m=0.1))
    assert seen.tolist() == [True, False, True, True]
    assert len(points) == 3


def test_the_unit_of_integers_is_the_frame_s() -> None:
    depth = np.full((48, 64), 10_000, dtype=np.uint16)
    points, _ = lift_pixels(POINTS, depth, 0.0001, CAMERA, PixelLiftingConfig())
    np.testing.assert_allclose(points[:, 2], 1.0)
