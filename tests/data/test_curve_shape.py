"""Bends, slack, distances, poses and polygons, against lines, circles and helices."""

from __future__ import annotations

import numpy as np
import pytest
from builders import arc, curve_through, line, loop, random_curve, wave
from hypothesis import given
from hypothesis import strategies as st
from properties import few_examples
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from dloftbs.data.curve import BSplineCurve
from dloftbs.errors import InputError

RADIUS, RISE = 0.05, 0.01
ANGLES = np.linspace(0.0, 12.0, 400)
HELIX = curve_through(np.stack((RADIUS * np.cos(ANGLES), RADIUS * np.sin(ANGLES), RISE * ANGLES), axis=1))
HELIX_BEND = (RADIUS**2 + RISE**2) / RADIUS
SQUARE = [(-20.0, -20.0), (20.0, -20.0), (20.0, 20.0), (-20.0, 20.0)]


class TestBends:
    @pytest.mark.parametrize("over", [None, 0.0, 20.0])
    @pytest.mark.parametrize("curve", [loop(50.0), arc(50.0, 4.0)])
    def test_a_circle_has_its_radius_everywhere(self, curve, over):
        np.testing.assert_allclose(curve.bend_radius(np.linspace(0.1, 0.9, 30), over), 50.0, rtol=1e-3)
        assert curve.tightest_bend(over)[1] == pytest.approx(50.0, rel=0.01)

    def test_a_helix_has_the_bend_of_its_rise(self):
        np.testing.assert_allclose(HELIX.bend_radius(np.linspace(0.0, 1.0, 20)), HELIX_BEND, rtol=0.01)

    def test_a_line_does_not_bend(self):
        assert line((0.0, 0.0), (100.0, 40.0)).tightest_bend()[1] > 1e6
        assert np.isinf(line((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)).bend_radius(0.5, 0.0))

    def test_a_loop_bends_whatever_its_length_rounds_to(self):
        circle = loop(0.10980245061265317)  # a window of its whole length has more than the 13 points, by rounding
        assert circle.tightest_bend(2.0)[1] == pytest.approx(0.11, rel=0.1)
        assert circle.bend_radius(0.5, 2.0) == pytest.approx(0.11, rel=0.1)

    def test_the_tightest_bend_is_found_where_it_is(self):
        curve = wave()
        u, radius = curve.tightest_bend(0.0)
        assert radius == pytest.approx(80.0**2 / 50.0, rel=0.01)
        assert 1.0 / curve.curvature(u) == pytest.approx(radius)

    def test_short_waves_are_no_bends_and_long_ones_are(self):
        x = np.linspace(0.0, 500.0, 400)
        ripple = curve_through(np.stack((x, 50.0 * np.sin(x / 80.0) + 0.5 * np.sin(2.0 * np.pi * x / 15.0)), axis=1))
        assert ripple.tightest_bend(0.0)[1] < 20.0
        assert ripple.tightest_bend(50.0)[1] == pytest.approx(128.0, rel=0.03)

    @pytest.mark.parametrize("straight", [30.0, 120.0])
    @pytest.mark.parametrize("radius", [40.0, 80.0])
    def test_an_arc_between_straight_parts_has_its_radius(self, radius, straight):
        turns = np.concatenate(
            (np.zeros(int(straight)), np.arange(0.0, 2.0, 1.0 / radius), np.full(int(straight), 2.0))
        )
        curve = curve_through(np.cumsum(np.stack((np.cos(turns), np.sin(turns)), axis=1), axis=0))
        for over in (None, 20.0):
            u, found = curve.tightest_bend(over)
            assert found == pytest.approx(radius, rel=0.03)
            assert abs(u - 0.5) * curve.length < radius
            assert curve.bend_radius(np.linspace(0.0, 1.0, 200), over).min() >= found * (1.0 - 1e-9)

    @pytest.mark.parametrize("over", [1e-6, 1e6])
    def test_waves_of_any_length_are_asked(self, over):
        assert 0.0 < wave().tightest_bend(over)[1] < np.inf

    def test_a_length_below_zero_and_a_place_beyond_the_end_are_refused(self):
        with pytest.raises(InputError, match="over must be"):
            wave().bend_radius(0.5, -1.0)
        with pytest.raises(InputError, match=r"u must be within 0\.\.1"):
            wave().bend_radius(1.5)


class TestSlack:
    def test_half_a_circle_has_more_length_than_its_diameter(self):
        assert arc(50.0, np.pi).slack(0.0, 1.0) == pytest.approx(50.0 * np.pi - 100.0, rel=1e-3)
        assert arc(50.0, np.pi).slack(1.0, 0.0) == pytest.approx(50.0 * np.pi - 100.0, rel=1e-3)

    def test_a_loop_is_walked_towards_growing_u(self):
        assert loop(50.0).slack(0.75, 0.25) == pytest.approx(50.0 * np.pi - 100.0, rel=1e-3)

    def test_a_taut_line_has_none(self):
        assert line((0.0, 0.0), (100.0, 40.0)).slack(0.2, 0.7) == pytest.approx(0.0, abs=1e-6)

    def test_a_place_that_is_no_number_is_refused(self):
        with pytest.raises(InputError, match="u_a must be"):
            wave().slack("a", 0.5)  # type: ignore[arg-type]


class TestDistance:
    def test_a_line_beside_a_circle(self):
        u, u_line, d = loop(50.0).distance(line((-100.0, 60.0), (100.0, 60.0)))
        assert (u, u_line, d) == pytest.approx((0.25, 0.5, 10.0), abs=1e-3)

    def test_a_place_beyond_the_seam_of_a_loop_is_one_of_its_first_turn(self):
        angle = -0.002
        away = 80.0 * np.array([np.cos(angle), np.sin(angle)])
        ring, ray = loop(50.0), line(away, 1.1 * away)
        for u in (ring.distance(ray)[0], ray.distance(ring)[1]):
            assert u == pytest.approx(1.0 + angle / (2.0 * np.pi), abs=1e-5)
        ring.poses([u])

    def test_curves_that_cross_are_no_distance_apart(self):
        curve, other = loop(50.0), line((-100.0, 10.0), (100.0, 10.0))
        u, u_other, d = curve.distance(other)
        assert d == pytest.approx(0.0, abs=1e-5)
        np.testing.assert_allclose(curve(u), other(u_other), atol=1e-5)

    def test_points_are_joined_by_lines(self):
        u, share, d = loop(50.0).distance([(80.0, -5.0), (80.0, 5.0)])
        beside_the_seam = (u + 0.5) % 1.0 - 0.5
        assert (beside_the_seam, share, d) == pytest.approx((0.0, 0.5, 30.0), abs=1e-3)

    @few_examples
    @given(st.integers(0, 1000), st.sampled_from([2, 3]), st.booleans())
    def test_no_two_samples_are_nearer_and_the_order_does_not_matter(self, seed, ndim, closed):
        curve, other = (
            random_curve(seed, ndim, closed),
            random_curve(seed + 5000, ndim).transformed(np.eye(ndim), [400.0] * ndim),
        )
        u, u_other, d = curve.distance(other)
        sampled = np.linalg.norm(curve.sample(400)[:, None] - other.sample(400)[None], axis=2).min()
        assert d <= sampled + 1e-9
        assert d == pytest.approx(float(np.linalg.norm(curve(u) - other(u_other))), abs=1e-3)
        assert other.distance(curve)[2] == pytest.approx(d, abs=0.05 * (1.0 + d))

    def test_a_dip_that_is_short_beside_a_long_side_is_found(self):
        x = np.linspace(0.0, 1000.0, 1500)
        dip = curve_through(np.stack((x, 20.0 - 18.0 * np.exp(-(((x - 93.75) / 6.0) ** 2))), axis=1))
        side = [(0.0, 0.0), (1000.0, 0.0)]
        flat = BSplineCurve([0.0, 0.0, 1.0, 1.0], side, 1)
        lowest = dip.sample(20_000)[:, 1].min()
        for u, d in (dip.distance(side)[::2], dip.distance(flat)[::2], flat.distance(dip)[1:]):
            assert d == pytest.approx(lowest, abs=1e-3)
            assert dip(u)[0] == pytest.approx(93.75, abs=0.5)

    @pytest.mark.parametrize("at", [(0.0, 0.0), (5000.0, 0.0)])
    def test_curves_of_other_sizes_and_points_have_a_distance(self, at):
        dot, stroke = BSplineCurve([0.0, 0.0, 1.0, 1.0], [at, at], 1), line(at, np.add(at, (0.0, 0.01)))
        for one in (dot, stroke):
            assert one.distance(line((-1e4, 3.0), (1e4, 3.0)))[2] == pytest.approx(3.0, abs=0.011)
        assert dot.distance(dot.transformed(np.eye(2), [3.0, 4.0]))[2] == pytest.approx(5.0)

    def test_one_point_and_a_curve_of_other_dimensions_are_refused(self):
        with pytest.raises(InputError, match="`nearest` takes one point"):
            wave().distance([(0.0, 0.0)])
        with pytest.raises(InputError, match="other must be a BSplineCurve with 2 dimensions"):
            wave().distance(HELIX)

    def test_the_nearest_pixel_of_a_mask(self):
        mask = np.zeros((100, 200), np.uint8)
        mask[30, 90], mask[80, 150] = 1, 1
        u, pixel, d = line((10.0, 10.0), (190.0, 10.0)).nearest_pixel(mask)
        assert (u, *pixel, d) == pytest.approx((80.0 / 180.0, 90.0, 30.0, 20.0))
        assert wave().nearest_pixel(np.zeros((5, 5), bool)) is None
        with pytest.raises(InputError, match="nearest_pixel takes a curve in the image"):
            HELIX.nearest_pixel(mask)

    @pytest.mark.parametrize("rows", [slice(0, 100), slice(90, 95), slice(20, 21)])
    def test_of_many_pixels_few_are_looked_at_closely(self, monkeypatch, rows):
        x = np.linspace(0.0, 300.0, 400)
        curve = curve_through(np.stack((x, 50.0 + 20.0 * np.sin(x / 40.0)), axis=1))
        mask = np.zeros((100, 300), bool)
        mask[rows] = True
        least = cKDTree(curve.sample(30_000)).query(np.argwhere(mask)[:, ::-1])[0].min()
        asked = []
        exact = BSplineCurve.nearest
        monkeypatch.setattr(BSplineCurve, "nearest", lambda *given: asked.append(given) or exact(*given))
        u, pixel, d = curve.nearest_pixel(mask)
        assert len(asked) < 20
        assert d <= least + 1e-9
        assert d == pytest.approx(float(np.linalg.norm(curve(u) - pixel)), abs=1e-6)
        assert mask[int(pixel[1]), int(pixel[0])]


class TestPoses:
    def test_frames_of_a_helix_turn_about_it_as_little_as_its_torsion_allows(self):
        us = np.linspace(0.0, 1.0, 60)
        poses = HELIX.poses(us)
        angle = 12.0 * us
        inwards = np.stack((-np.cos(angle), -np.sin(angle), 0.0 * angle), axis=1)
        upwards = np.cross(poses[:, :3, 0], inwards)
        z = poses[:, :3, 2]
        turned = np.unwrap(np.arctan2((z * upwards).sum(1), (z * inwards).sum(1)))
        torsion = RISE / (RADIUS**2 + RISE**2)
        np.testing.assert_allclose(turned - turned[0], -torsion * np.hypot(RADIUS, RISE) * angle, atol=1e-6)

    @given(st.integers(0, 300), st.booleans())
    def test_they_are_rigid_and_lie_on_the_curve_however_many_are_asked_for(self, seed, closed):
        curve, us = random_curve(seed, 3, closed), np.array([0.0, 0.3, 0.31, 0.9])
        poses = curve.poses(us)
        assert poses.shape == (4, 4, 4)
        np.testing.assert_allclose(poses[:, :3, 3], curve(us), atol=1e-9)
        np.testing.assert_allclose(
            poses[:, :3, :3] @ poses[:, :3, :3].transpose(0, 2, 1), np.eye(3) + np.zeros((4, 3, 3)), atol=1e-9
        )
        np.testing.assert_allclose(np.linalg.det(poses), 1.0)
        np.testing.assert_allclose(poses[:, :3, 0], curve.tangent(us), atol=1e-9)
        np.testing.assert_allclose(curve.poses([0.9])[0], poses[3], atol=1e-6)

    def test_z_begins_as_near_as_may_be_to_the_line_of_sight_or_another_direction(self):
        across = line((0.0, 0.0, 1.0), (0.5, 0.0, 1.0))
        np.testing.assert_allclose(across.poses([0.0, 1.0])[:, :3, 2], [[0.0, 0.0, 1.0]] * 2, atol=1e-9)
        np.testing.assert_allclose(across.poses([0.5], (3.0, -2.0, 0.0))[0, :3, 2], [0.0, -1.0, 0.0], atol=1e-9)
        assert Rotation.from_matrix(line((0.0, 0.0, 1.0), (0.0, 0.0, 2.0)).poses([0.5])[0, :3, :3]).magnitude() > 0.0

    def test_in_the_plane_they_are_of_three_numbers(self):
        pose = line((0.0, 0.0), (0.0, 10.0)).poses([0.5])[0]
        np.testing.assert_allclose(pose, [[0.0, -1.0, 0.0], [1.0, 0.0, 5.0], [0.0, 0.0, 1.0]], atol=1e-9)

    def test_places_beyond_the_ends_and_no_direction_are_refused(self):
        with pytest.raises(InputError, match=r"us must be in 0\.\.1"):
            HELIX.poses([0.5, 1.2])
        with pytest.raises(InputError, match="towards must be a direction"):
            HELIX.poses([0.5], (0.0, 0.0, 0.0))


class TestInside:
    def test_of_a_line(self):
        (span,) = line((-100.0, 0.0), (100.0, 0.0)).inside(SQUARE)
        assert span == pytest.approx((0.4, 0.6))

    def test_a_loop_that_begins_inside_has_two_spans(self):
        spans = loop(50.0).inside([(0.0, -100.0), (100.0, -100.0), (100.0, 100.0), (0.0, 100.0)])
        np.testing.assert_allclose(spans, [(0.0, 0.25), (0.75, 1.0)], atol=1e-4)

    def test_all_and_nothing(self):
        assert loop(10.0).inside(SQUARE) == ((0.0, 1.0),)
        assert loop(10.0, (100.0, 0.0)).inside(SQUARE) == ()

    @few_examples
    @given(st.integers(0, 1000), st.booleans())
    def test_places_within_the_spans_are_inside(self, seed, closed):
        curve, corners = random_curve(seed, 2, closed), np.random.default_rng(seed).normal(0.0, 100.0, (5, 2))
        spans = curve.inside(corners)
        crossed = [curve.distance([a, b])[2] for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True)]
        if spans not in ((), ((0.0, 1.0),)):
            assert min(crossed) == pytest.approx(0.0, abs=1e-3)
        for low, high in spans:
            middle = BSplineCurve([0.0, 0.0, 1.0, 1.0], [curve(0.5 * (low + high)), (1e6, 1.7e5)], 1)
            sides = zip(corners, np.roll(corners, -1, axis=0), strict=True)
            assert sum(_cross(*middle.control_points, a, b) for a, b in sides) % 2 == 1

    def test_two_corners_and_a_curve_in_space_are_refused(self):
        with pytest.raises(InputError, match="three corners or more, got 2"):
            wave().inside(SQUARE[:2])
        with pytest.raises(InputError, match="inside takes a curve in the image"):
            HELIX.inside(SQUARE)


def _cross(a, b, c, d) -> bool:
    def side(p, q, r) -> float:
        return float((q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]))

    return side(a, b, c) * side(a, b, d) < 0.0 and side(c, d, a) * side(c, d, b) < 0.0
