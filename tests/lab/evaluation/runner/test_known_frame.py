import numpy as np
import pytest

from dloftbs.camera import PinholeCamera
from dloftbs.data.frame import Frame
from dloftbs_lab.evaluation.runner.known_frame import KnownFrame
from dloftbs_lab.truth import Truth

CAMERA = PinholeCamera(100.0, 100.0, 20.0, 5.0)


def cloud_of(depth, **others):
    mask = np.zeros((10, 40), bool)
    mask[4:7] = True
    return KnownFrame(Frame(mask=mask, depth=depth, camera=CAMERA, **others), Truth((), (), ())).cloud


@pytest.mark.parametrize("kind", [np.float32, np.float64])
@pytest.mark.parametrize("missing", [0.0, -1.0, np.nan, np.inf, -np.inf, 20.5])
def test_pixels_without_depth_have_no_place_in_space(kind, missing):
    depth = np.full((10, 40), 0.5, kind)
    depth[5, 10:30] = missing
    points = cloud_of(depth).points
    assert len(points) == 3 * 40 - 20
    assert points[:, 2].tolist() == [0.5] * len(points)


@pytest.mark.parametrize("unit_m", [1e-3, 5e-4])
def test_a_saturated_sensor_has_measured_nothing(unit_m):
    depth = np.full((10, 40), 500, np.uint16)
    depth[:, ::2] = 65535
    points = cloud_of(depth, depth_unit_m=unit_m).points
    assert np.unique(points[:, 2]).tolist() == [500 * unit_m]


@pytest.mark.parametrize("missing", [0.0, np.inf])
def test_where_no_pixel_has_depth_there_is_no_cloud(missing):
    assert cloud_of(np.full((10, 40), missing)) is None
