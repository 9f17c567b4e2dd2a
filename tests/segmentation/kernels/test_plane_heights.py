"""Heights above a plane against numpy in double precision."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.segmentation.kernels import plane_heights as kernels

SEEDS = st.integers(0, 10_000)


def heights_of(depth_m, rays, plane):
    heights = np.empty(len(depth_m), np.uint16)
    kernels.measure_heights(depth_m.astype(np.float32), rays.astype(np.float32), plane, heights)
    return heights


def metres(heights):
    return (heights.astype(float) - kernels.ON_PLANE) * kernels.QUANTUM_M


@given(seed=SEEDS)
def test_a_height_is_the_distance_from_the_plane_towards_the_camera(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rays = np.vstack((rng.uniform(-0.7, 0.7, (2, 50)), np.ones(50)))
    normal = rng.normal((0.0, 0.0, 1.0), 0.3)
    plane = normal / np.linalg.norm(normal) / rng.uniform(0.3, 2.0)
    depth_m = (1.0 + rng.uniform(-0.1, 0.2, 50)) / (plane @ rays)
    true = (1.0 - plane @ (rays * depth_m)) / np.linalg.norm(plane)
    inside = np.abs(true) < 0.35
    np.testing.assert_allclose(metres(heights_of(depth_m, rays, plane))[inside], true[inside], atol=3e-5)


def test_what_is_too_high_or_too_low_is_kept_in_range_and_no_depth_is_missing() -> None:
    rays = np.array([[0.0] * 4, [0.0] * 4, [1.0] * 4])
    found = heights_of(np.array([100.0, 0.1, 2.0, np.nan]), rays, np.array([0.0, 0.0, 0.5]))
    assert found.tolist() == [kernels.MISSING + 1, 65535, kernels.ON_PLANE, kernels.MISSING]


@given(seed=SEEDS, share=st.sampled_from([0.0, 0.4, 1.0]), least=st.sampled_from([0.001, 0.01]))
def test_what_stands_is_high_by_itself_and_beside_the_highest(seed: int, share: float, least: float) -> None:
    rng = np.random.default_rng(seed)
    heights = rng.integers(19_000, 23_000, 200).astype(np.uint16)
    highest = np.maximum(heights, rng.integers(19_000, 24_000, 200)).astype(np.uint16)
    limit = np.uint16(kernels.ON_PLANE + least / kernels.QUANTUM_M)
    mask = np.empty(200, np.uint8)
    kernels.mark_standing(heights, highest, limit, share, mask)
    bound = share * (highest.astype(float) - kernels.ON_PLANE)
    above = heights.astype(float) - kernels.ON_PLANE
    clear = np.abs(above - bound) > 0.01  # what differs by rounding may be either
    expected = (heights > limit) & (above > bound)
    np.testing.assert_array_equal(mask[clear], expected[clear].astype(np.uint8))
    assert mask[clear].any() == expected[clear].any()


@pytest.mark.parametrize("height_mm", [-5.0, 0.0, 5.0])
def test_heights_are_rounded_to_the_nearest(height_mm: float) -> None:
    rays = np.array([[0.0], [0.0], [1.0]])
    depth_m = np.array([0.7 - 1e-3 * height_mm])
    found = metres(heights_of(depth_m, rays, np.array([0.0, 0.0, 1.0 / 0.7])))
    assert found[0] == pytest.approx(1e-3 * height_mm, abs=1.1e-5)
