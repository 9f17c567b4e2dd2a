"""Pixels that bodies cover, against a slow twin that asks each pixel's ray."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dloftbs.camera import PinholeCamera
from dloftbs.robot.bodies import Body, cover

SIZE = (120, 160)
CAMERAS = {
    "pinhole": PinholeCamera(150.0, 140.0, 81.0, 57.0),
    "webcam": PinholeCamera(150.0, 140.0, 81.0, 57.0, (-0.2, 0.05, 0.001, -0.002, 0.0)),
    "fisheye": PinholeCamera(70.0, 70.0, 81.0, 57.0, (-0.02, 0.006, -0.003, 0.0005), "fisheye"),
}
WITHIN_PX = 2


def twin(capsule: Body, camera: PinholeCamera) -> np.ndarray:
    """Return the pixels whose ray comes as near to the segment as the radius, ahead of the near plane."""
    pixels = np.stack(np.meshgrid(np.arange(SIZE[1]), np.arange(SIZE[0])), axis=-1)
    rays = camera.deproject(pixels, np.ones(SIZE)).reshape(-1, 3)
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    places = capsule.points[0] + np.linspace(0.0, 1.0, 400)[:, None] * (capsule.points[-1] - capsule.points[0])
    dots = rays @ places.T
    along = np.maximum(dots, 0.01)
    squared = (along * (along - 2.0 * dots) + (places**2).sum(axis=1)).min(axis=1)
    off = np.sqrt(np.maximum(squared, 0.0))  # NaN where the lens has no ray
    return (np.nan_to_num(off, nan=9.0) <= capsule.radius_m).reshape(SIZE)


def check(found: np.ndarray, expected: np.ndarray) -> None:
    grow = np.ones((2 * WITHIN_PX + 1,) * 2, np.uint8)
    inner = (slice(8, -8), slice(8, -8))  # at the border, both see only a part of what is near
    for one, other in ((found, expected), (expected, found)):
        assert not (one & (cv2.dilate(other.astype(np.uint8), grow) == 0))[inner].any()


@pytest.mark.parametrize("name", CAMERAS)
@settings(max_examples=15, deadline=None)
@given(st.integers(0, 10_000))
def test_a_capsule_covers_the_pixels_whose_rays_meet_it(name, seed):
    rng = np.random.default_rng(seed)
    ends = rng.uniform((-0.6, -0.5, 0.4), (0.6, 0.5, 1.2), (2, 3))
    capsule = Body("a", ends, float(rng.uniform(0.01, 0.2)))
    check(cover([capsule], CAMERAS[name], SIZE), twin(capsule, CAMERAS[name]))


@pytest.mark.parametrize("name", ["pinhole", "webcam"])
@pytest.mark.parametrize(
    "ends",
    [((0.1, 0.1, 0.5), (0.3, 0.2, -0.6)), ((-0.3, 0.0, -0.2), (0.2, 0.1, 0.6)), ((0.2, 0.0, 0.02), (0.2, 0.5, 0.5))],
)
def test_a_capsule_that_reaches_behind_the_camera_is_cut_at_it(name, ends):
    capsule = Body("a", np.array(ends), 0.05)
    check(cover([capsule], CAMERAS[name], SIZE), twin(capsule, CAMERAS[name]))


def test_what_lies_behind_the_camera_or_beside_the_image_covers_nothing():
    for z, x in ((-1.0, 0.0), (1.0, 3.0)):
        assert not cover([Body("a", np.array([[x, 0.0, z], [x, 0.1, z]]), 0.1)], CAMERAS["pinhole"], SIZE).any()


def test_a_camera_within_a_body_sees_nothing_else():
    assert cover([Body("a", np.array([[0.0, 0.0, 0.0]]), 0.3)], CAMERAS["pinhole"], SIZE).all()


def test_a_box_covers_its_corners_hull():
    corners = np.stack(np.meshgrid((-0.1, 0.2), (-0.2, 0.1), (0.8, 0.8)), axis=-1).reshape(-1, 3)
    found = np.argwhere(cover([Body("a", corners, 0.0)], PinholeCamera(160.0, 160.0, 80.0, 60.0), SIZE))
    assert found.min(axis=0) == pytest.approx([20, 60], abs=1)
    assert found.max(axis=0) == pytest.approx([80, 120], abs=1)


def test_bodies_together_cover_what_each_covers():
    bodies = [Body("a", np.array([[x, 0.0, 1.0]]), 0.1) for x in (-0.2, 0.2)]
    each = [cover([body], CAMERAS["pinhole"], SIZE) for body in bodies]
    np.testing.assert_array_equal(cover(bodies, CAMERAS["pinhole"], SIZE), each[0] | each[1])
    assert not cover([], CAMERAS["webcam"], SIZE).any()
