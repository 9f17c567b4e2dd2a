"""What depth shows beside objects, and where its edges lie against the mask's, which frames tell together."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tubes import CAMERA, RADIUS_M, SIZE, draw_tubes, straight

from dloftbs import PinholeCamera
from dloftbs.cleaning import clean
from dloftbs.config import CleaningConfig, LiftingConfig
from dloftbs.data.depth import ReadableDepth
from dloftbs.data.mask_crop import MaskCrop
from dloftbs.lifting.beside import Beside, DepthEdges, look_beside
from dloftbs.lifting.kernels.profiles import lay_profiles, read_profiles

LYING = straight((-0.3, -0.03, 0.9), (0.3, 0.04, 0.9))
UPRIGHT = straight((0.04, -0.2, 0.9), (-0.03, 0.2, 0.9))
BEND = np.linspace(-1.0, 1.0, 400)
ARC = np.stack((0.3 * BEND, 0.15 * BEND**2 - 0.08, np.full(400, 0.9)), axis=1)
WALL_M = 1.1

Sections = tuple[np.ndarray, np.ndarray, np.ndarray]


def sections_of(axis: np.ndarray, every: int = 6) -> Sections:
    """Return points, tangents and radius of sections along a level tube, a few px apart."""
    points = CAMERA.project(axis[10:-10:every])
    way = np.gradient(points, axis=0)
    radius = np.full(len(points), RADIUS_M * CAMERA.fx / 0.9)
    return points, way / np.linalg.norm(way, axis=1, keepdims=True), radius


def drawn(*axes: np.ndarray, dx: float = 0.0, dy: float = 0.0) -> tuple[MaskCrop, np.ndarray]:
    """Return the mask of tubes, cut out, and their depth image, displaced."""
    displaced = PinholeCamera(CAMERA.fx, CAMERA.fy, CAMERA.cx + dx, CAMERA.cy + dy)
    crop = clean(draw_tubes(axes)[0], CleaningConfig())
    assert crop is not None
    return crop, draw_tubes(axes, camera=displaced, behind_m=WALL_M)[1]


def as_read(depth: np.ndarray, config: LiftingConfig | None = None, unit_m: float = 0.001) -> ReadableDepth:
    """Return depth as the kernels take it."""
    return ReadableDepth.of(depth, unit_m, config or LiftingConfig())


def told(angle: float, dx: float, dy: float, n: int = 20, noise: float = 0.0, seed: int = 0) -> Beside:
    """Return what an object of one direction tells of a displacement."""
    tangents = np.tile([math.cos(angle), math.sin(angle)], (n, 1))
    aside = -tangents[:, 1] * dx + tangents[:, 0] * dy + np.random.default_rng(seed).normal(0.0, noise, n)
    return Beside(np.full(5 * n, WALL_M), 1e-3, tangents, aside, np.zeros(n))


class TestLooking:
    def test_every_fifth_section_has_a_profile_and_the_ground_is_led_on_between(self) -> None:
        crop, depth = drawn(LYING)
        depth += 0.002 * np.arange(SIZE[1])  # another ground from profile to profile
        points, tangents, radius = sections_of(LYING)
        (found,) = look_beside([(points, tangents, radius)], crop, as_read(depth))
        some = points[::5], tangents[::5], radius[::5]
        (h, w), (left, top) = crop.size, crop.origin
        read = lay_profiles(*some, crop.pixels[1 : h + 1, 1 : w + 1], left, top, *as_read(depth))
        ground, noise, aside, wider = read_profiles(*read, some[2])
        np.testing.assert_allclose(
            found.ground_m, np.interp(np.arange(len(points)), np.arange(0, len(points), 5), ground)
        )
        np.testing.assert_array_equal(found.aside_px, aside)
        np.testing.assert_array_equal(found.wider_px, wider)
        np.testing.assert_array_equal(found.tangents, some[1])
        assert found.noise_per_m == noise

    @pytest.mark.parametrize("n", [1, 2, 3, 4, 5, 30])
    def test_there_is_a_ground_for_every_section(self, n: int) -> None:
        crop, depth = drawn(LYING)
        points, tangents, radius = sections_of(LYING)
        (found,) = look_beside([(points[:n], tangents[:n], radius[:n])], crop, as_read(depth))
        np.testing.assert_allclose(found.ground_m, np.full(n, WALL_M))
        assert len(found.tangents) == len(found.aside_px) == len(found.wider_px) == math.ceil(n / 5)

    def test_objects_come_in_their_order_and_none_gives_none(self) -> None:
        crop, depth = drawn(LYING, UPRIGHT)
        both = [sections_of(LYING), sections_of(UPRIGHT)]
        found = look_beside(both, crop, as_read(depth))
        for sections, one in zip(both, found, strict=True):
            (alone,) = look_beside([sections], crop, as_read(depth))
            np.testing.assert_array_equal(one.tangents, sections[1][::5])
            np.testing.assert_array_equal(one.ground_m, alone.ground_m)
            np.testing.assert_array_equal(one.aside_px, alone.aside_px)
        assert look_beside([], crop, as_read(depth)) == []

    def test_another_object_is_not_the_ground(self) -> None:
        # It covers most of what would show the ground on one side.
        other = LYING + np.array([0.0, 11.0 * 0.9 / CAMERA.fy, 0.0])
        crop, depth = drawn(LYING, other)
        (found,) = look_beside([sections_of(LYING)], crop, as_read(depth))
        np.testing.assert_allclose(found.ground_m, WALL_M)
        assert np.isnan(found.aside_px).mean() > 0.8

    def test_counts_are_metres_in_their_unit(self) -> None:
        crop, depth = drawn(ARC)
        sections = [sections_of(ARC)]
        (expected,) = look_beside(sections, crop, as_read(depth))
        counts = np.rint(1e4 * depth).astype(np.uint16)
        (found,) = look_beside(sections, crop, as_read(counts, unit_m=1e-4))
        np.testing.assert_allclose(found.ground_m, expected.ground_m, atol=1e-4)
        np.testing.assert_allclose(found.aside_px, expected.aside_px)
        (found,) = look_beside(sections, crop, as_read(depth.astype(np.float32)))
        np.testing.assert_allclose(found.ground_m, expected.ground_m, atol=1e-6)

    @pytest.mark.parametrize("missing", [0.0, np.nan, np.inf, -1.0, 25.0, 0.05])
    def test_what_is_no_depth_is_no_ground(self, missing: float) -> None:
        crop, depth = drawn(LYING)
        points, tangents, radius = sections_of(LYING)
        depth[:, :160] = missing
        config = LiftingConfig(min_depth_m=0.1)
        (found,) = look_beside([(points, tangents, radius)], crop, as_read(depth, config))
        left, right = points[:, 0] < 115.0, points[:, 0] > 205.0
        assert np.isnan(found.ground_m[left]).all()
        np.testing.assert_allclose(found.ground_m[right], WALL_M)
        assert np.isnan(found.aside_px[left[::5]]).all()

    def test_beyond_the_image_nothing_is_known(self) -> None:
        # Not even what the pixel in the last row and column shows, which has the number -1.
        height = (5.0 - CAMERA.cy) * 0.9 / CAMERA.fy
        at_the_border = straight((-0.3, height, 0.9), (0.3, height, 0.9))
        crop, depth = drawn(at_the_border)
        sections = [sections_of(at_the_border)]
        (expected,) = look_beside(sections, crop, as_read(depth))
        depth[-1, -1] = 0.3
        (found,) = look_beside(sections, crop, as_read(depth))
        np.testing.assert_array_equal(found.ground_m, expected.ground_m)
        np.testing.assert_allclose(found.ground_m, WALL_M)
        assert np.isnan(found.aside_px).all()

    def test_it_changes_nothing_that_it_is_given(self) -> None:
        crop, depth = drawn(LYING)
        sections = sections_of(LYING)
        for array in (depth, *sections):
            array.flags.writeable = False
        look_beside([sections], crop, as_read(depth))


class TestDisplacement:
    def test_without_frames_there_is_none(self) -> None:
        assert DepthEdges().displacement_px == (0.0, 0.0)

    @pytest.mark.parametrize(("dx", "dy"), [(1.5, 0.0), (0.0, -1.5), (-1.2, 1.6), (2.0, 2.0)])
    def test_it_is_told_from_what_is_seen(self, dx: float, dy: float) -> None:
        crop, depth = drawn(ARC, dx=dx, dy=dy)
        edges = DepthEdges()
        edges.add(look_beside([sections_of(ARC, 2)], crop, as_read(depth)))
        assert math.dist(edges.displacement_px, (dx, dy)) < 0.25

    def test_frames_with_objects_of_several_directions_add_up(self) -> None:
        edges = DepthEdges()
        edges.add([told(0.0, 1.5, -1.0)])
        np.testing.assert_allclose(edges.displacement_px, (0.0, -1.0), atol=0.05)  # along the object nothing is known
        edges.add([told(math.pi / 2.0, 1.5, -1.0)])
        np.testing.assert_allclose(edges.displacement_px, (1.5, -1.0), atol=0.05)

    def test_so_do_the_objects_of_a_frame(self) -> None:
        edges = DepthEdges()
        edges.add([told(0.0, 1.5, -1.0, 5), told(math.pi / 2.0, 1.5, -1.0, 30)])
        np.testing.assert_allclose(edges.displacement_px, (1.5, -1.0), atol=0.1)

    def test_many_frames_tell_it_better_than_one(self) -> None:
        first, last = [], []
        for seed in range(50):
            edges = DepthEdges()
            for frame in range(15):
                angle = 0.7 * frame
                edges.add([told(angle, 1.5, -1.0, 8, 0.5, 100 * seed + frame)])
                if frame == 1:
                    first.append(math.dist(edges.displacement_px, (1.5, -1.0)))
            last.append(math.dist(edges.displacement_px, (1.5, -1.0)))
        assert np.mean(last) < 0.6 * np.mean(first)
        assert np.max(last) < 0.5

    def test_one_wrong_frame_after_many_hardly_matters(self) -> None:
        edges = DepthEdges()
        for frame in range(10):
            edges.add([told(0.7 * frame, 1.5, -1.0)])
        edges.add([told(0.3, -4.0, 4.0)])
        assert math.dist(edges.displacement_px, (1.5, -1.0)) < 0.3

    def test_the_latest_frames_count_most(self) -> None:
        edges = DepthEdges()
        for dx in (2.0, -2.0):
            for frame in range(40):
                edges.add([told(0.7 * frame, dx, 1.0)])
        assert math.dist(edges.displacement_px, (-2.0, 1.0)) < 0.2

    @pytest.mark.parametrize("size", [0.3, 0.45])
    def test_less_than_half_a_pixel_is_none(self, size: float) -> None:
        edges = DepthEdges()
        for frame in range(10):
            edges.add([told(0.7 * frame, size, 0.0, 50)])
        assert edges.displacement_px == (0.0, 0.0)

    def test_no_objects_change_nothing(self) -> None:
        edges = DepthEdges()
        edges.add([])
        assert edges.displacement_px == (0.0, 0.0)
        edges.add([told(0.0, 1.5, -1.0), told(1.0, 1.5, -1.0)])
        before = edges.displacement_px
        for _ in range(100):
            edges.add([])
        assert edges.displacement_px == before

    @pytest.mark.parametrize(("wider", "told_px"), [(2.5, 2.5), (0.9, 0.9), (0.6, 0.0), (-2.0, 0.0)])
    def test_edges_farther_out_are_fattened_and_those_farther_in_are_not(self, wider: float, told_px: float) -> None:
        edges = DepthEdges()
        assert edges.fattening_px == 0.0
        for frame in range(10):
            edges.add([told(0.7 * frame, 0.0, 0.0)._replace(wider_px=np.full(20, wider))])
        assert edges.fattening_px == pytest.approx(told_px, abs=0.02)

    def test_reset_forgets_all(self) -> None:
        edges, other = DepthEdges(), DepthEdges()
        for frame in range(10):
            edges.add([told(0.7 * frame, 2.0, 2.0)])
        edges.reset()
        assert edges.displacement_px == (0.0, 0.0)
        for one in (edges, other):
            one.add([told(0.0, -1.0, 1.0, noise=0.3), told(1.0, -1.0, 1.0, noise=0.3)])
        assert edges.displacement_px == other.displacement_px != (0.0, 0.0)


def test_frames_in_which_nothing_stands_out_forget_nothing() -> None:
    edges = DepthEdges()
    edges.add([told(0.0, 1.5, -1.0), told(1.5, 1.5, -1.0)])
    before = edges.displacement_px
    assert math.hypot(*before) > 1.5
    flat = told(0.0, 1.5, -1.0)._replace(aside_px=np.full(20, np.nan))
    for _ in range(100):
        edges.add([flat])
    assert edges.displacement_px == before
