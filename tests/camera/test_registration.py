"""Depth in the pixels of another camera, against a slow twin that projects the corners of every pixel."""

from __future__ import annotations

import pickle

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from properties import few_examples

from dloftbs.camera import DepthRegistration, PinholeCamera
from dloftbs.errors import InputError

DEPTH = PinholeCamera(20.0, 20.0, 9.5, 7.5, size=(16, 20))
COLOUR = PinholeCamera(43.0, 42.0, 16.0, 12.5, size=(26, 34))
BESIDE = DepthRegistration(DEPTH, COLOUR, np.eye(3), (0.05, 0.0, 0.0))
WEBCAM = (-0.2, 0.05, 0.001, -0.002, 0.0)
FISHEYE = (-0.02, 0.006, -0.003, 0.0005)


def rotation(*vector):
    return cv2.Rodrigues(np.array(vector, np.float64))[0]


def twin(registration, depth_m, size, slack_px=0.0):
    """Lay each depth pixel over the box around its corners, as they are seen; nearest wins, infinity is nothing."""
    seen = np.full(size, np.inf)
    turn, shift = np.array(registration.rotation), np.array(registration.translation_m)
    for row, column in np.ndindex(*depth_m.shape):
        z = float(depth_m[row, column])
        if not 0.0 < z < np.inf:
            continue
        at = [(column, row), *((column + dx, row + dy) for dx in (-0.5, 0.5) for dy in (-0.5, 0.5))]
        points = registration.depth_camera.deproject(at, np.full(5, z)) @ turn.T + shift
        if np.isnan(points).any() or not (points[:, 2] > 0).all():
            continue
        centre, *corners = registration.colour_camera.project(points)
        half = np.maximum(0.5, np.ptp(corners, axis=0) / 2 + 0.25) + slack_px
        for r, c in np.ndindex(*size):
            if abs(c - centre[0]) <= half[0] and abs(r - centre[1]) <= half[1]:
                seen[r, c] = min(seen[r, c], points[0, 2])
    return seen


def assert_is_between_twins(registration, depth_m, size):
    """A larger footprint lets more of the near through: what the kernel makes lies between two sizes of it.

    The kernel takes the footprint that a pixel far off has, which these lenses and shifts change by up to 0.1 px.
    """
    got = registration.register(depth_m, size).astype(np.float64)
    got[got == 0] = np.inf
    tolerance = 1e-6 * np.where(np.isinf(got), 0.0, got)
    assert (got >= twin(registration, depth_m, size, 0.15) - tolerance).all()
    assert (got <= twin(registration, depth_m, size, -0.15) + tolerance).all()


small = st.floats(-0.15, 0.15)


@few_examples
@given(
    seed=st.integers(0, 2**32 - 1),
    turn=st.tuples(small, small, small),
    shift=st.tuples(small, small, small),
    lenses=st.tuples(*[st.sampled_from([((), "polynomial"), (WEBCAM, "polynomial"), (FISHEYE, "fisheye")])] * 2),
)
def test_every_pixel_covers_its_footprint_and_the_nearest_wins(seed, turn, shift, lenses):
    rng = np.random.default_rng(seed)
    depth = PinholeCamera(10.0, 11.0, 4.5, 3.5, *lenses[0])
    colour = PinholeCamera(*rng.uniform(6.0, 25.0, 2), 8.0, 6.0, *lenses[1])
    depth_m = rng.uniform(0.8, 2.0, (8, 10))
    depth_m[rng.random((8, 10)) < 0.2] = 0.0
    depth_m = np.where(rng.random((8, 10)) < 0.5, 1.5, depth_m)
    assert_is_between_twins(DepthRegistration(depth, colour, rotation(*turn), shift), depth_m, (13, 17))


@pytest.mark.parametrize("angle", [90, 180, 270])
def test_cameras_may_be_mounted_on_their_side(angle):
    turned = DepthRegistration(DEPTH, COLOUR, rotation(0, 0, np.radians(angle)), (0.0, 0.0, 0.0))
    depth_m = np.random.default_rng(angle).uniform(0.9, 1.1, (16, 20))
    assert_is_between_twins(turned, depth_m, (26, 34))


@pytest.mark.parametrize("dtype", [np.uint16, np.int32, np.float32, np.float64, np.float16])
def test_the_same_camera_sees_the_same(dtype):
    counts = np.random.default_rng(2).integers(0, 60000, (16, 20))
    depth = counts.astype(dtype) if dtype().dtype.kind in "iu" else (counts / 8192).astype(dtype)
    registered = DepthRegistration(DEPTH, DEPTH, np.eye(3), (0, 0, 0)).register(depth)
    assert registered.dtype == depth.dtype
    np.testing.assert_allclose(registered.astype(float), depth.astype(float), rtol=1e-6)


def test_the_last_count_survives():
    counts = np.full((16, 20), 65535, np.uint16)
    np.testing.assert_array_equal(DepthRegistration(DEPTH, DEPTH, np.eye(3), (0, 0, 0)).register(counts), counts)
    behind = DepthRegistration(DEPTH, DEPTH, np.eye(3), (0, 0, 0.1)).register(counts)
    assert (behind == 0).all()  # farther off than the type can say


def test_counts_have_a_unit():
    tenths = DepthRegistration(DEPTH, COLOUR, np.eye(3), (0.05, 0, 0), depth_unit_m=1e-4)
    counts = np.full((16, 20), 10000, np.uint16)
    np.testing.assert_array_equal(tenths.register(counts), (BESIDE.register(counts // 10) // 10) * 100)
    np.testing.assert_array_equal(tenths.register(counts) > 0, BESIDE.register(np.ones((16, 20))) > 0)


def test_a_slanted_wall_is_whole():
    depth = PinholeCamera(105.0, 105.0, 53.0, 29.5, size=(60, 106))
    colour = PinholeCamera(430.0, 430.0, 159.5, 89.5, WEBCAM, size=(180, 320))
    registration = DepthRegistration(depth, colour, rotation(0.01, -0.02, 0.01), (-0.06, 0.002, 0.001))
    rays = depth.deproject(np.stack(np.meshgrid(np.arange(106.0), np.arange(60.0)), axis=-1), np.ones((60, 106)))
    normal = np.array((0.7, 0.1, 0.7))
    wall = 0.8 / (rays @ normal)
    seen = registration.register(wall)
    # The same plane in the colour camera's frame.
    turn, shift = np.array(registration.rotation), np.array(registration.translation_m)
    own = colour.deproject(np.stack(np.meshgrid(np.arange(320.0), np.arange(180.0)), axis=-1), np.ones((180, 320)))
    true = (0.8 + normal @ turn.T @ shift) / (own @ turn @ normal)
    inside = np.s_[8:-8, 8:-8]
    assert (seen[inside] > 0).all()
    # A footprint has one depth, and so is wrong by less than what the wall recedes over it.
    np.testing.assert_allclose(seen[inside], true[inside], atol=0.04)
    assert abs(np.mean(seen[inside] - true[inside])) < 0.004


def test_what_is_near_hides_what_is_behind():
    depth_m = np.full((16, 20), 2.0)
    depth_m[:, 8:12] = 0.5
    seen = BESIDE.register(depth_m)
    row = seen[13]
    near = np.flatnonzero(row == np.float64(np.float32(0.5)))
    assert len(near) >= 8
    assert (np.diff(near) == 1).all()  # no wall shows through
    # The cable moved against the wall: on one side, nobody sees what is behind it.
    assert (row[near[0] - 3 : near[0]] == 0).any() or (row[near[-1] + 1 : near[-1] + 4] == 0).any()


@pytest.mark.parametrize("missing", [0.0, 1e300, np.nan, np.inf, -np.inf, -1.0])
def test_missing_stays_missing(missing):
    assert not BESIDE.register(np.full((16, 20), missing)).any()


def test_what_lies_behind_the_colour_camera_is_not_seen():
    back = DepthRegistration(DEPTH, COLOUR, rotation(0, np.pi, 0), (0, 0, 0))
    assert not back.register(np.ones((16, 20))).any()
    ahead = DepthRegistration(DEPTH, COLOUR, np.eye(3), (0, 0, -2.0))
    assert not ahead.register(np.ones((16, 20))).any()


def test_the_result_is_the_same_bit_for_bit_and_ones_own():
    depth_m = np.random.default_rng(5).uniform(0.5, 2.0, (16, 20)).astype(np.float32)
    depth_m.flags.writeable = False
    first, second = BESIDE.register(depth_m), BESIDE.register(depth_m[:, :, None])
    assert first.tobytes() == second.tobytes()
    assert not np.shares_memory(first, second)
    assert first.flags.writeable


def test_registrations_are_values():
    again = pickle.loads(pickle.dumps(BESIDE))
    same = DepthRegistration(DEPTH, COLOUR, [[1, 0, 0], [0, 1, 0], [0, 0, 1]], [0.05, 0, 0])
    assert again == same == BESIDE
    assert hash(again) == hash(same) == hash(BESIDE)


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"depth_camera": None}, "depth_camera must be a PinholeCamera, got None"),
        ({"rotation": np.eye(4)}, r"rotation must have shape \(3, 3\), got \(4, 4\)"),
        ({"rotation": 2 * np.eye(3)}, "rotation must be a rotation"),
        ({"rotation": np.diag((1.0, 1.0, -1.0))}, "rotation must be a rotation"),
        ({"rotation": np.full((3, 3), np.nan)}, "rotation must be finite"),
        ({"translation_m": (1, 2)}, r"translation_m must have shape \(3,\), got \(2,\)"),
        ({"depth_unit_m": 0.0}, "depth_unit_m must be a finite number in 1e-09..1000, got 0.0"),
        ({"depth_unit_m": 1e-300}, "depth_unit_m must be a finite number in 1e-09"),
        ({"depth_unit_m": "mm"}, "depth_unit_m must be a finite number"),
    ],
)
def test_a_wrong_registration_is_refused(fields, message):
    given = {
        "depth_camera": DEPTH,
        "colour_camera": COLOUR,
        "rotation": np.eye(3),
        "translation_m": (0, 0, 0),
        **fields,
    }
    with pytest.raises(InputError, match=message):
        DepthRegistration(**given)


def test_images_must_have_the_cameras_sizes():
    with pytest.raises(InputError, match=r"camera is for images of size \(16, 20\) .* got one of \(20, 16\)"):
        BESIDE.register(np.ones((20, 16)))
    with pytest.raises(InputError, match=r"camera is for images of size \(26, 34\) .* got one of \(52, 68\)"):
        BESIDE.register(np.ones((16, 20)), (52, 68))
    with pytest.raises(InputError, match=r"depth must have shape \(H, W\)"):
        BESIDE.register(np.ones(5))
    sizeless = DepthRegistration(DEPTH, PinholeCamera(40, 40, 16, 12), np.eye(3), (0, 0, 0))
    with pytest.raises(InputError, match=r"colour camera has no size: register\(depth, size\)"):
        sizeless.register(np.ones((16, 20)))
    assert sizeless.register(np.ones((16, 20)), (24, 32)).shape == (24, 32)


def test_depth_pixels_outside_of_a_lens_field_see_nothing():
    narrow = PinholeCamera(8.0, 8.0, 9.5, 7.5, (-0.4, 0.0, 0.0, 0.0))
    registration = DepthRegistration(narrow, PinholeCamera(8.0, 8.0, 9.5, 7.5), np.eye(3), (0.0, 0.0, 0.0))
    seen = registration.register(np.ones((16, 20)), (16, 20)) > 0
    assert seen[7, 6:13].all()
    assert not seen[0].any()
    backwards = DepthRegistration(PinholeCamera(8.0, 8.0, 9.5, 7.5), narrow, np.eye(3), (0.0, 0.0, 0.0))
    seen = backwards.register(np.ones((16, 20)), (16, 20)) > 0
    assert seen[7, 6:13].all()
    assert not seen[0, 0]
