"""The pinhole camera against its matrix and against itself."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.camera import PinholeCamera
from dloftbs.errors import InputError

CAMERA = PinholeCamera(fx=600.0, fy=610.0, cx=319.5, cy=239.5)

focal = st.floats(1.0, 5000.0)
pixel = st.floats(-3000.0, 3000.0)
depth = st.floats(0.01, 100.0)
cameras = st.builds(PinholeCamera, focal, focal, pixel, pixel)


@given(cameras, st.lists(st.tuples(pixel, pixel, depth), max_size=5))
def test_projecting_undoes_deprojecting(camera, rows):
    xyz = np.array(rows).reshape(-1, 3)
    points_m = camera.deproject(xyz[:, :2], xyz[:, 2])
    np.testing.assert_array_equal(points_m[:, 2], xyz[:, 2])
    np.testing.assert_allclose(camera.project(points_m), xyz[:, :2], rtol=0, atol=1e-9)


@given(cameras, st.tuples(st.floats(-10, 10), st.floats(-10, 10), depth))
def test_deprojecting_undoes_projecting(camera, point_m):
    back = camera.deproject(camera.project(point_m), point_m[2])
    np.testing.assert_allclose(back, point_m, rtol=1e-9, atol=1e-9)


@given(cameras, st.tuples(st.floats(-10, 10), st.floats(-10, 10), depth))
def test_projecting_is_the_camera_matrix(camera, point_m):
    x, y, z = camera.matrix @ point_m
    np.testing.assert_allclose(camera.project(point_m), (x / z, y / z), rtol=1e-9, atol=1e-9)


def test_the_optical_axis_meets_the_image_at_the_principal_point():
    np.testing.assert_array_equal(CAMERA.project([0.0, 0.0, 2.0]), [319.5, 239.5])


def test_x_points_right_and_y_points_down():
    np.testing.assert_array_equal(CAMERA.project([0.5, 0.25, 0.5]), [919.5, 544.5])


@pytest.mark.parametrize("shape", [(), (0,), (4,), (2, 3)])
def test_leading_axes_are_kept(shape):
    points_px = np.ones((*shape, 2))
    points_m = CAMERA.deproject(points_px, np.ones(shape))
    assert points_m.shape == (*shape, 3)
    assert CAMERA.project(points_m).shape == (*shape, 2)


def test_missing_depth_stays_missing():
    points_m = CAMERA.deproject([[1.0, 2.0], [3.0, 4.0]], [np.nan, 1.0])
    assert np.isnan(points_m).all(axis=1).tolist() == [True, False]


@pytest.mark.parametrize("z", [0.0, -1.0, np.nan])
def test_a_point_that_is_not_in_front_is_refused(z):
    with pytest.raises(InputError, match="in front of the camera"):
        CAMERA.project([[0.0, 0.0, 1.0], [0.0, 0.0, z]])


@pytest.mark.parametrize("shape", [(), (2,), (5, 2), (3, 4)])
def test_project_states_the_shape_it_needs(shape):
    with pytest.raises(InputError, match=r"points_m must have shape \(\.\.\., 3\), got \(") as caught:
        CAMERA.project(np.ones(shape))
    assert str(shape) in str(caught.value)


@pytest.mark.parametrize("shape", [(), (3,), (2, 3)])
def test_deproject_states_the_shape_it_needs(shape):
    with pytest.raises(InputError, match=r"points_px must have shape \(\.\.\., 2\), got \(") as caught:
        CAMERA.deproject(np.ones(shape), 1.0)
    assert str(shape) in str(caught.value)


@pytest.mark.parametrize("shape", [(), (4,), (5, 1)])
def test_deproject_wants_a_depth_for_each_pixel(shape):
    with pytest.raises(InputError, match=r"depth_m must have shape \(5,\), got \(") as caught:
        CAMERA.deproject(np.ones((5, 2)), np.ones(shape))
    assert str(shape) in str(caught.value)


@pytest.mark.parametrize("name", ["fx", "fy", "cx", "cy"])
@pytest.mark.parametrize("value", [np.nan, np.inf, None, "600", True, [600.0]])
def test_an_intrinsic_must_be_a_finite_number(name, value):
    intrinsics = {"fx": 1.0, "fy": 1.0, "cx": 0.0, "cy": 0.0, name: value}
    with pytest.raises(InputError, match=f"{name} must be a finite number"):
        PinholeCamera(**intrinsics)


@pytest.mark.parametrize(("fx", "fy"), [(0.0, 1.0), (1.0, 0.0), (-1.0, 1.0)])
def test_a_focal_length_must_be_positive(fx, fy):
    with pytest.raises(InputError, match=f"must be positive, got fx={fx}, fy={fy}"):
        PinholeCamera(fx, fy, 0.0, 0.0)


def test_numpy_numbers_become_plain_ones():
    camera = PinholeCamera(np.float32(600), np.int64(610), 320, np.float64(240.0))
    assert [type(v) for v in (camera.fx, camera.fy, camera.cx, camera.cy)] == [float] * 4
    assert camera == PinholeCamera(600.0, 610.0, 320.0, 240.0)
    assert hash(camera) == hash(PinholeCamera(600.0, 610.0, 320.0, 240.0))


def test_a_camera_cannot_be_changed():
    with pytest.raises(AttributeError):
        CAMERA.fx = 1.0
    matrix = CAMERA.matrix
    matrix[0, 0] = 0.0
    assert CAMERA.matrix[0, 0] == 600.0
