"""Lens distortion against the formulas as OpenCV's documentation prints them, and against itself."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.camera.kernels.lens_projection import FISHEYE, NO_LENS, POLYNOMIAL, distort, splat_depth, undistort

coefficients = st.lists(st.floats(-0.1, 0.1), min_size=12, max_size=12).map(np.array)
points = st.lists(st.tuples(st.floats(-0.6, 0.6), st.floats(-0.6, 0.6)), min_size=1, max_size=6).map(np.array)
tilts = st.tuples(st.floats(-0.05, 0.05), st.floats(-0.05, 0.05)).map(
    lambda w: np.array([[1.0, 0.02, 0.01], [-0.01, 1.0, 0.0], [*w, 1.0]])
)


def textbook(point, model, k, tilt):
    x, y = point
    if model == FISHEYE:
        r = math.hypot(x, y)
        theta = math.atan(r)
        bent = theta * (1 + k[0] * theta**2 + k[1] * theta**4 + k[2] * theta**6 + k[3] * theta**8)
        return (x, y) if r == 0 else (bent / r * x, bent / r * y)
    k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4 = k
    r2 = x**2 + y**2
    radial = (1 + k1 * r2 + k2 * r2**2 + k3 * r2**3) / (1 + k4 * r2 + k5 * r2**2 + k6 * r2**3)
    xx = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x**2) + s1 * r2 + s2 * r2**2
    yy = y * radial + p1 * (r2 + 2 * y**2) + 2 * p2 * x * y + s3 * r2 + s4 * r2**2
    u, v, w = tilt @ (xx, yy, 1.0)
    return u / w, v / w


def through(kernel, xy, model, k, tilt, field=math.inf):
    out = np.full(xy.shape, -7.0)
    kernel(np.ascontiguousarray(xy), model, k, np.ascontiguousarray(tilt), field, out)
    return out


@pytest.mark.parametrize("model", [POLYNOMIAL, FISHEYE])
@given(xy=points, k=coefficients, tilt=tilts)
def test_distortion_is_the_textbooks(model, xy, k, tilt):
    expected = [textbook(point, model, k, tilt) for point in xy]
    np.testing.assert_allclose(through(distort, xy, model, k, tilt), expected, rtol=0, atol=1e-13)


@pytest.mark.parametrize(("model", "field"), [(POLYNOMIAL, 1.0), (FISHEYE, 1.2)])
@given(xy=points, k=coefficients, tilt=tilts)
def test_undistorting_finds_where_a_point_came_from(model, field, xy, k, tilt):
    # Radial, prism and tangential terms of a tenth keep the map one to one within these fields.
    k = k / 2
    tilt = np.eye(3) if model == FISHEYE else tilt
    back = through(undistort, through(distort, xy, model, k, tilt, field), model, k, np.linalg.inv(tilt), field)
    np.testing.assert_allclose(back, xy, rtol=0, atol=1e-10)


@given(xy=points, k=coefficients)
def test_transposing_the_plane_transposes_the_lens(xy, k):
    turned = k[[0, 1, 3, 2, 4, 5, 6, 7, 10, 11, 8, 9]]
    for kernel in (distort, undistort):
        expected = through(kernel, xy, POLYNOMIAL, k / 4, np.eye(3), 1.0)[:, ::-1]
        got = through(kernel, xy[:, ::-1], POLYNOMIAL, turned / 4, np.eye(3), 1.0)
        np.testing.assert_allclose(got, expected, rtol=0, atol=1e-11)


@given(xy=points, k=coefficients)
def test_mirroring_the_plane_mirrors_the_fisheye(xy, k):
    for kernel in (distort, undistort):
        expected = through(kernel, xy, FISHEYE, k, np.eye(3), 1.0) * (-1, 1)
        np.testing.assert_array_equal(through(kernel, xy * (-1, 1), FISHEYE, k, np.eye(3), 1.0), expected)


@pytest.mark.parametrize("model", [POLYNOMIAL, FISHEYE])
def test_outside_of_the_field_there_is_nothing(model):
    xy = np.array([[0.0, 0.0], [0.3, 0.0], [0.9, 0.0], [np.nan, 0.0]])
    for kernel in (distort, undistort):
        out = through(kernel, xy, model, np.zeros(12), np.eye(3), 0.4)
        assert np.isfinite(out).all(axis=1).tolist() == [True, True, False, False]


def test_a_pixel_is_drawn_over_its_footprint():
    # One ray straight ahead, half a footprint of 2 px in width and 1 in height at infinite range.
    table = np.array([[0.0, 0.0, 1.0, 2.0, 1.0]], np.float32)
    out = np.full((9, 11), np.inf, np.float32)
    intrinsics = np.array([10.0, 10.0, 5.0, 4.0])
    splat_depth(np.float32([2.0]), table, np.zeros(3), intrinsics, NO_LENS, np.zeros(12), np.eye(3), math.inf, out)
    drawn = np.zeros((9, 11), bool)
    drawn[3:6, 3:8] = True
    np.testing.assert_array_equal(out, np.where(drawn, 2.0, np.inf))
    # Nearer to the other camera by half, the footprint is twice as large; farther is drawn behind.
    splat_depth(
        np.float32([2.0]), table, np.array([0, 0, -1.0]), intrinsics, NO_LENS, np.zeros(12), np.eye(3), 1.0, out
    )
    assert ((out == 1.0).sum(axis=1) == [0, 0, 9, 9, 9, 9, 9, 0, 0]).all()
    splat_depth(np.float32([9.0]), table, np.zeros(3), intrinsics, NO_LENS, np.zeros(12), np.eye(3), math.inf, out)
    assert (out[out < np.inf] == 1.0).all()
