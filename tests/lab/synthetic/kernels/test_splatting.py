"""Splatting: the slow twin, and what geometry says of cylinders."""

from __future__ import annotations

import numpy as np
import pytest

from dloftbs_lab.synthetic.kernels.splatting import splat_spheres

SIZE = (48, 64)
CAMERA = (90.0, 84.0, 30.3, 24.6)


def splatted(centers, radius, camera=CAMERA, size=SIZE, behind=np.inf):
    depth = np.full(size, behind, np.float32)
    sample = np.full(size, -1, np.int32)
    splat_spheres(np.asarray(centers, float), np.asarray(radius, float), *camera, depth, sample)
    return depth, sample


def slow_splat(centers, radius, camera=CAMERA, size=SIZE, behind=np.inf):
    """Every pixel against every sphere: the foot of the perpendicular from the centre, and half a chord back."""
    fx, fy, cx, cy = camera
    depth, sample = np.full(size, behind), np.full(size, -1)
    for row in range(size[0]):
        for column in range(size[1]):
            ray = np.array([(column - cx) / fx, (row - cy) / fy, 1.0])
            ray /= np.linalg.norm(ray)
            for number, (center, r) in enumerate(zip(centers, radius, strict=True)):
                foot = center @ ray
                off = np.linalg.norm(center - foot * ray)
                if off <= r:
                    z = (foot - np.sqrt(r * r - off * off)) * ray[2]
                    if z < depth[row, column]:
                        depth[row, column], sample[row, column] = z, number
    return depth, sample


@pytest.mark.parametrize("seed", range(4))
def test_spheres_agree_with_the_slow_twin(seed):
    rng = np.random.default_rng(seed)
    centers = rng.uniform((-0.5, -0.4, 0.6), (0.5, 0.4, 1.4), (12, 3))
    radius = rng.uniform(0.005, 0.12, 12)
    depth, sample = splatted(centers, radius, behind=1.3)
    slow_depth, slow_sample = slow_splat(centers, radius, behind=1.3)
    np.testing.assert_array_equal(sample, slow_sample)
    np.testing.assert_allclose(depth, slow_depth, rtol=0, atol=1e-6)
    assert len(np.unique(sample)) > 6


def test_what_lies_outside_the_image_leaves_it_alone():
    depth, sample = splatted([[5.0, 0.0, 1.0], [0.0, -5.0, 1.0], [-5.0, 5.0, 0.2]], [0.1, 0.1, 0.1], behind=2.0)
    assert (depth == 2.0).all()
    assert (sample == -1).all()


@pytest.mark.parametrize("angle", [0.0, 0.4, np.pi / 2])
def test_a_cylinder_parallel_to_the_image_has_its_surface_and_its_outline(angle):
    """The nearer root of the ray through each pixel with an infinite cylinder, for pixels away from the round ends."""
    radius, distance, focal, size = 0.005, 0.8, 900.0, (240, 240)
    camera = (focal, focal, 119.7, 119.2)
    along = np.arange(-0.08, 0.08, radius / 8.0)
    axis = np.array([np.cos(angle), np.sin(angle)])
    centers = np.column_stack((along[:, None] * axis, np.full(len(along), distance)))
    depth, sample = splatted(centers, np.full(len(along), radius), camera, size)
    y, x = np.indices(size)
    x, y = (x - camera[2]) / focal, (y - camera[3]) / focal
    across, lengthwise = -x * axis[1] + y * axis[0], x * axis[0] + y * axis[1]
    # across^2 t^2 + (t - distance)^2 = radius^2
    a, b, c = across**2 + 1.0, -2.0 * distance, distance**2 - radius**2
    inside = b * b - 4.0 * a * c
    exact = (-b - np.sqrt(np.maximum(inside, 0.0))) / (2.0 * a)
    middle = np.abs(lengthwise) * distance < 0.06
    half_width = np.arctan(np.abs(across)) * distance
    seen = sample >= 0
    half_pixel = 0.5 * distance / focal
    assert seen[middle & (half_width < radius - half_pixel)].all()
    assert not seen[middle & (half_width > radius + half_pixel)].any()
    well_inside = middle & (half_width < radius - half_pixel)
    np.testing.assert_allclose(depth[well_inside], exact[well_inside], rtol=0, atol=5e-5)
    assert well_inside.sum() > 800


def test_the_nearer_of_two_is_seen():
    centers = [[0.0, 0.0, 1.0], [0.0, 0.0, 0.9]]
    for order in ([0, 1], [1, 0]):
        depth, sample = splatted(np.asarray(centers)[order], [0.05, 0.05])
        assert depth[25, 30] == pytest.approx(0.85, abs=1e-3)
        assert sample[25, 30] == order.index(1)
