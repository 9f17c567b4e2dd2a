"""The pinhole camera against its matrix, against OpenCV, and against itself."""

from __future__ import annotations

import pickle
from dataclasses import FrozenInstanceError
from pathlib import Path

import cv2
import numpy as np
import pytest
from builders import through_json
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.camera import PinholeCamera, as_camera
from dloftbs.errors import InputError

CAMERA = PinholeCamera(fx=600.0, fy=610.0, cx=319.5, cy=239.5)

focal = st.floats(1.0, 5000.0)
pixel = st.floats(-3000.0, 3000.0)
depth = st.floats(0.01, 100.0)
cameras = st.builds(PinholeCamera, focal, focal, pixel, pixel)

LENSES = {
    "barrel": ("polynomial", (-0.3, 0.1, 0.001, -0.002)),
    "webcam": ("polynomial", (-0.42, 0.21, 0.0008, 0.0011, -0.05)),
    "pincushion": ("polynomial", (0.15, 0.04, -0.001, 0.0005, 0.01)),
    "rational": ("polynomial", (0.55, -2.61, 0.0006, -0.0002, 1.51, 0.43, -2.43, 1.43)),
    "prism": ("polynomial", (-0.2, 0.05, 0.001, 0.002, 0.0, 0.01, 0.0, 0.0, 0.002, -0.001, 0.001, 0.0005)),
    "tilted": ("polynomial", (-0.2, 0.05, 0.001, 0.002, 0, 0.01, 0, 0, 0.002, -0.001, 0.001, 0.0005, 0.03, -0.02)),
    "fisheye": ("fisheye", (-0.02, 0.006, -0.003, 0.0005)),
    "equidistant": ("fisheye", (0.0, 0.0, 0.0, 0.0)),
}


def camera_with(lens):
    model, distortion = LENSES[lens]
    return PinholeCamera(600.0, 610.0, 319.5, 239.5, distortion, model, (480, 640))


def opencv_projection(camera, points_m):
    nothing, distortion = np.zeros(3), np.array(camera.distortion)
    if camera.model == "fisheye":
        return cv2.fisheye.projectPoints(points_m[:, None], nothing, nothing, camera.matrix, distortion)[0][:, 0]
    return cv2.projectPoints(points_m, nothing, nothing, camera.matrix, distortion)[0].reshape(-1, 2)


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
@pytest.mark.parametrize(
    "value", [np.nan, np.inf, None, "600", True, [600.0], 1e300, 10**400, 600j, np.timedelta64(600), np.True_]
)
def test_an_intrinsic_must_be_a_finite_number(name, value):
    intrinsics = {"fx": 1.0, "fy": 1.0, "cx": 0.0, "cy": 0.0, name: value}
    with pytest.raises(InputError, match=f"{name} must be a finite number"):
        PinholeCamera(**intrinsics)


@pytest.mark.parametrize(("fx", "fy"), [(0.0, 1.0), (1.0, 0.0), (-1.0, 1.0), (1.0, 1e-300)])
def test_a_focal_length_must_be_positive(fx, fy):
    with pytest.raises(InputError, match=f"must be positive, got fx={fx}, fy={fy}"):
        PinholeCamera(fx, fy, 0.0, 0.0)


def test_numpy_numbers_become_plain_ones():
    camera = PinholeCamera(np.float32(600), np.int64(610), 320, np.float64(240.0))
    assert [type(v) for v in (camera.fx, camera.fy, camera.cx, camera.cy)] == [float] * 4
    assert camera == PinholeCamera(600.0, 610.0, 320.0, 240.0)
    assert hash(camera) == hash(PinholeCamera(600.0, 610.0, 320.0, 240.0))


def test_a_camera_cannot_be_changed():
    with pytest.raises(FrozenInstanceError):
        CAMERA.fx = 1.0
    matrix = CAMERA.matrix
    matrix[0, 0] = 0.0
    assert CAMERA.matrix[0, 0] == 600.0


@pytest.mark.parametrize("lens", LENSES)
@given(rows=st.lists(st.tuples(st.floats(0, 639), st.floats(0, 479), depth), min_size=1, max_size=5))
def test_a_lens_is_undone_and_done_again(lens, rows):
    camera, (x, y, z) = camera_with(lens), np.array(rows).T
    points_m = camera.deproject(np.stack((x, y), axis=-1), z)
    np.testing.assert_array_equal(points_m[:, 2], z)
    np.testing.assert_allclose(camera.project(points_m), np.stack((x, y), axis=-1), rtol=0, atol=1e-6)


@pytest.mark.parametrize("lens", LENSES)
def test_a_lens_is_opencvs(lens):
    camera = camera_with(lens)
    rng = np.random.default_rng(3)
    points_m = rng.uniform((-0.5, -0.4, 0.9), (0.5, 0.4, 1.5), (500, 3))
    np.testing.assert_allclose(camera.project(points_m), opencv_projection(camera, points_m), rtol=0, atol=1e-8)
    pixels = rng.uniform((0, 0), (639, 479), (500, 2))
    back = opencv_projection(camera, camera.deproject(pixels, np.ones(500)))
    np.testing.assert_allclose(back, pixels, rtol=0, atol=1e-6)


@given(
    st.tuples(*[st.floats(-0.5, 0.5)] * 3, *[st.floats(-0.01, 0.01)] * 2), st.floats(-2.0, 2.0), st.floats(-2.0, 2.0)
)
def test_what_can_be_projected_through_any_lens_comes_back(coefficients, x, y):
    k1, k2, k3, p1, p2 = coefficients
    camera = PinholeCamera(500.0, 500.0, 320.0, 240.0, (k1, k2, p1, p2, k3))
    pixel = camera.project((x, y, 1.0))
    back = camera.deproject(pixel, 1.0)
    if not np.isnan(back).any():
        np.testing.assert_allclose(camera.project(back), pixel, rtol=0, atol=1e-6)
    if x * x + y * y < 0.01:  # near the axis every lens is well-behaved
        np.testing.assert_allclose(back, (x, y, 1.0), rtol=0, atol=1e-8)


def test_where_the_image_folds_back_there_is_nothing():
    camera = PinholeCamera(500.0, 500.0, 320.0, 240.0, (-0.3, 0.0, 0.0, 0.0))
    # r (1 - 0.3 r^2) grows until r^2 = 1 / 0.9, to 2 / 3 of that r.
    edge = np.sqrt(1 / 0.9)
    just_in, just_out = edge * 0.999, edge * 1.001
    assert np.isfinite(camera.project((just_in, 0.0, 1.0))).all()
    assert np.isnan(camera.project((just_out, 0.0, 1.0))).all()
    widest = 320.0 + 500.0 * edge * 2 / 3
    points_m = camera.deproject([(widest - 0.01, 240.0), (widest + 0.01, 240.0)], [2.0, 2.0])
    assert np.isfinite(points_m[0]).all()
    np.testing.assert_array_equal(points_m[1], (np.nan, np.nan, 2.0))


def test_a_fisheye_ends_at_a_right_angle():
    camera = PinholeCamera(300.0, 300.0, 0.0, 0.0, (0.0, 0.0, 0.0, 0.0), "fisheye")
    at = 300.0 * np.radians([[30.0, 0.0], [0.0, 60.0], [91.0, 0.0]])
    points_m = camera.deproject(at, np.ones(3))
    np.testing.assert_allclose(points_m[:2, :2], [(np.tan(np.pi / 6), 0), (0, np.tan(np.pi / 3))], atol=1e-12)
    assert np.isnan(points_m[2, :2]).all()
    np.testing.assert_array_equal(camera.project((0.0, 0.0, 1.0)), (0.0, 0.0))
    np.testing.assert_array_equal(camera.deproject((0.0, 0.0), 1.0), (0.0, 0.0, 1.0))


@pytest.mark.parametrize("lens", LENSES)
def test_a_lens_keeps_leading_axes_and_missing_depth(lens):
    camera = camera_with(lens)
    points_m = camera.deproject(np.full((4, 5, 2), 200.0), np.full((4, 5), np.nan))
    assert points_m.shape == (4, 5, 3)
    assert np.isnan(points_m).all()
    assert camera.deproject(np.zeros((0, 2)), np.zeros(0)).shape == (0, 3)
    assert camera.project(np.ones((4, 5, 3))).shape == (4, 5, 2)


def test_pixels_that_are_no_numbers_give_none():
    assert np.isnan(camera_with("webcam").deproject([np.nan, 3.0], 1.0)[:2]).all()
    assert np.isnan(camera_with("fisheye").deproject([np.inf, 3.0], 1.0)[:2]).all()


def test_no_distortion_written_as_zeros_is_none():
    assert PinholeCamera(1, 1, 0, 0, np.zeros((5, 1))) == PinholeCamera(1, 1, 0, 0)
    assert PinholeCamera(1, 1, 0, 0, [0, 0, 0, 0], "fisheye").distortion == (0.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize("count", [1, 2, 3, 6, 7, 9, 13, 15])
def test_coefficients_must_be_as_many_as_a_model_has(count):
    with pytest.raises(InputError, match=f"polynomial model has .* 4 or 5 .* coefficients, got {count}"):
        PinholeCamera(1, 1, 0, 0, (0.1,) * count)
    with pytest.raises(InputError, match=f"fisheye model has 4 .* got {count}"):
        PinholeCamera(1, 1, 0, 0, (0.1,) * count, "fisheye")


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"distortion": (0.1, np.nan, 0, 0)}, "distortion must be a finite number in .*, got nan"),
        ({"distortion": ("a", 0, 0, 0)}, "distortion must be a finite number"),
        ({"distortion": [[1, 2], [3]]}, "distortion must be"),
        ({"distortion": (1e300, 0, 0, 0)}, r"distortion must be a finite number in -1e\+06\.\.1e\+06, got 1e\+300"),
        ({"distortion": (10**400, 0, 0, 0)}, "distortion must be a finite number"),
        ({"distortion": "0.1 0 0 0"}, "distortion must be"),
        ({"distortion": None}, "distortion must be"),
        ({"distortion": {"k1": 1}}, "distortion must be"),
        ({"distortion": (0,) * 12 + (1.6, 0.0)}, "the tilt of the sensor must be a finite number in -1.5..1.5"),
        ({"model": ["fisheye"]}, "model must be one of polynomial, fisheye, got"),
        ({"model": None}, "model must be one of"),
        ({"size": (10**400, 640)}, "two positive integers"),
        ({"size": (True, 640)}, "two positive integers"),
        ({"size": (2**31, 640)}, "two positive integers .* 1000000 at most"),
        ({"model": "fisheye"}, "fisheye model has 4 distortion coefficients, got 0"),
        ({"model": "omni"}, "model must be one of polynomial, fisheye, got 'omni'"),
        ({"size": (480, 0)}, r"two positive integers \(H, W\), got \(480, 0\)"),
        ({"size": 480}, "two positive integers"),
        ({"size": (480.0, 640)}, "two positive integers"),
    ],
)
def test_a_wrong_lens_or_size_is_refused(fields, message):
    with pytest.raises(InputError, match=message):
        PinholeCamera(**{"fx": 1, "fy": 1, "cx": 0, "cy": 0, **fields})


@pytest.mark.parametrize("lens", [None, *LENSES])
def test_cameras_are_values(lens):
    camera = CAMERA if lens is None else camera_with(lens)
    camera.deproject((1.0, 2.0), 1.0)  # what it keeps for itself makes no difference
    again = pickle.loads(pickle.dumps(camera))
    from_values = PinholeCamera.from_dict(camera.to_dict())
    assert again == from_values == camera
    assert hash(again) == hash(from_values) == hash(camera)
    np.testing.assert_array_equal(again.deproject((1.0, 2.0), 1.0), camera.deproject((1.0, 2.0), 1.0))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"fx": None}, "missing: fx"),
        ({"distorsion": []}, "unknown: distorsion"),
        ({"k1": 1, "k2": 2}, "unknown: k1, k2"),
    ],
)
def test_a_dictionary_must_have_the_keys_and_no_others(changes, message):
    values = {**CAMERA.to_dict(), **changes}
    with pytest.raises(InputError, match=message):
        PinholeCamera.from_dict({key: value for key, value in values.items() if value is not None or key == "size"})


@pytest.mark.parametrize("data", [None, 5, "fx", [1, 1, 0, 0], [("fx", 1)]])
def test_what_is_no_dictionary_is_refused(data):
    with pytest.raises(InputError, match="a camera needs a dictionary as of to_dict, got"):
        PinholeCamera.from_dict(data)


def test_numbers_of_numpy_become_plain_ones():
    camera = PinholeCamera(
        np.float32(600),
        np.int64(500),
        np.float16(1),
        np.uint8(2),
        np.float32([0.5, 0, 0, 0]),
        size=(np.int64(48), np.uint16(64)),
    )
    assert through_json(camera.to_dict()) == camera.to_dict()
    assert {type(value) for value in (camera.fx, camera.fy, camera.cx, camera.cy, *camera.distortion)} == {float}
    assert [type(side) for side in camera.size] == [int, int]


def test_a_camera_from_its_matrix():
    camera = camera_with("webcam")
    distortion = np.array(camera.distortion)
    assert PinholeCamera.from_matrix(camera.matrix, distortion, size=(480, 640)) == camera


def test_a_matrix_that_is_a_product_may_be_rounded():
    camera = camera_with("webcam")
    for place, error in (((0, 1), 1e-13), ((0, 1), -5e-4), ((1, 0), 1e-13), ((2, 0), -1e-16), ((2, 2), 1e-12)):
        matrix = camera.matrix
        matrix[place] += error
        assert PinholeCamera.from_matrix(matrix, camera.distortion, size=(480, 640)) == camera


@pytest.mark.parametrize(
    ("matrix", "message"),
    [
        ([[600, 1.5, 320], [0, 600, 240], [0, 0, 1]], r"skew is not supported: K\[0, 1\] must be 0, got 1.5"),
        ([[600, 0, 320], [0, 600, 240], [0, 0, 2]], "must be \\[\\[fx, 0, cx\\]"),
        ([[600, 0, 320], [1, 600, 240], [0, 0, 1]], "must be"),
        ([[600, 1e-3, 320], [0, 600, 240], [0, 0, 1]], "skew is not supported"),
        ([[600, 0, 320], [0, 600, 240], [0, 1e-8, 1]], "must be"),
        (np.eye(4), r"shape \(3, 3\), got \(4, 4\)"),
        ([[1, 2], [3]], "must be an array of numbers"),
        (None, "must be an array of numbers"),
        ([[10**400] * 3] * 3, "must be an array of numbers"),
    ],
)
def test_another_matrix_is_refused(matrix, message):
    with pytest.raises(InputError, match=message):
        PinholeCamera.from_matrix(matrix)


@pytest.mark.parametrize("lens", LENSES)
@pytest.mark.parametrize("size", [(240, 320), (960, 1280), (300, 900)])
def test_a_scaled_camera_sees_the_resized_image(lens, size):
    camera = camera_with(lens)
    points_m = np.random.default_rng(1).uniform((-0.4, -0.3, 0.9), (0.4, 0.3, 1.5), (50, 3))
    # The image begins half a pixel before 0: its corner stays its corner.
    by = np.array((size[1] / 640, size[0] / 480))
    expected = (camera.project(points_m) + 0.5) * by - 0.5
    scaled = camera.scaled(size)
    np.testing.assert_allclose(scaled.project(points_m), expected, rtol=0, atol=1e-9)
    assert scaled.size == size


def test_a_camera_without_a_size_cannot_be_scaled_and_takes_every_image():
    with pytest.raises(InputError, match=r"only if it has a size: PinholeCamera\(\.\.\., size="):
        CAMERA.scaled((240, 320))
    CAMERA.check_size((1, 2))


def test_another_size_is_refused_with_the_remedy():
    camera = camera_with("webcam")
    camera.check_size((480, 640))
    with pytest.raises(
        InputError, match=r"of size \(480, 640\).* got one of \(240, 320\).*camera.scaled\(\(240, 320\)\)"
    ):
        camera.check_size((240, 320))


K = np.array([[300.0, 0.0, 100.0], [0.0, 310.0, 60.0], [0.0, 0.0, 1.0]])


class TestCameraLike:
    CAMERA = PinholeCamera(300, 310, 100, 60)

    def test_a_camera_is_taken_as_it_is(self):
        assert as_camera(self.CAMERA) is self.CAMERA

    @pytest.mark.parametrize("given", [K, K.tolist(), K.ravel(), K.astype(np.float32), (300, 310, 100, 60)])
    def test_numbers_are_taken(self, given):
        assert as_camera(given) == self.CAMERA

    @pytest.mark.parametrize("make", [str, Path])
    def test_a_file_is_read(self, make, tmp_path):
        path = tmp_path / "camera.yaml"
        path.write_text("fx: 300\nfy: 310\ncx: 100\ncy: 60\n", encoding="utf-8")
        assert as_camera(make(path)) == self.CAMERA

    def test_a_dictionary_is_taken(self):
        assert as_camera(self.CAMERA.to_dict()) == self.CAMERA

    @pytest.mark.parametrize(
        ("given", "message"),
        [
            ((K, np.zeros(5)), r"got \(array \(3, 3\) of float64, .*from_matrix\(K, distortion\)"),
            (np.zeros((3, 4)), r"got array \(3, 4\) of float64"),
            ((300, 310), r"got \(300, 310\)"),
            (5, "camera must be a PinholeCamera, .* got 5"),
            (np.diag([300.0, 310.0, 2.0]), "a camera matrix must be"),
            ((300, 310, "x", 60), r"camera must be a PinholeCamera, .* got \(300, 310, 'x', 60\)"),
            ((300, 310, 100, np.nan), "cy must be a finite number"),
        ],
    )
    def test_the_rest_is_refused_with_the_call(self, given, message):
        with pytest.raises(InputError, match=message):
            as_camera(given)


@pytest.mark.parametrize(
    ("size", "remedy"),
    [
        ((240, 320), r"resized as a whole, use camera\.scaled\(\(240, 320\)\)"),
        ((361, 481), r"camera\.scaled\(\(361, 481\)\)"),
        ((640, 480), r"turned by 90 degrees.*cv2\.IMREAD_IGNORE_ORIENTATION"),
        ((1280, 960), "turned by 90 degrees"),
        ((480, 480), "cropped.*cx and cy less"),
        ((400, 640), "cropped"),
    ],
)
def test_the_remedy_for_another_size_suits_it(size, remedy):
    with pytest.raises(InputError, match=remedy) as caught:
        PinholeCamera(500, 500, 320, 240, size=(480, 640)).check_size(size)
    assert ("scaled" in str(caught.value)) == ("scaled" in remedy)
