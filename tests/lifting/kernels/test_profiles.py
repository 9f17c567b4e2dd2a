"""Depth across objects and beyond their borders, against slow twins."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tubes import CAMERA, RADIUS_M, draw_tubes, straight

from dloftbs.camera import PinholeCamera
from dloftbs.lifting.kernels.profiles import PLACES, add_edges, edges_of, lay_profiles, read_profiles, spread

GROUND = 6  # places on either side that show the ground
NOTHING = np.zeros(7)
METRES = 1.0, 1e-30, 1e30  # unit and range


def literal_places(
    points: np.ndarray, tangents: np.ndarray, radius: np.ndarray, mask: np.ndarray, left: int, top: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return offsets, pixels (n, PLACES, 2) as (column, row), and whether the mask has them."""
    half = PLACES // 2
    offsets, pixels, on = [], [], []
    for point, (tx, ty), around in zip(points, tangents, radius, strict=True):
        outer = around + 6.0 + GROUND - 0.5
        inner = max(around - 4.0 + 0.5, outer / (2 * half - 1))  # else the two sides meet, evenly spaced
        right = np.linspace(inner, outer, half)
        offset = np.concatenate((-right[::-1], right))
        pixel = np.floor(point + offset[:, None] * np.array([-ty, tx]) + 0.5).astype(int)
        offsets.append(offset)
        pixels.append(pixel)
        inside = [0 <= r - top < mask.shape[0] and 0 <= c - left < mask.shape[1] for c, r in pixel]
        on.append([ok and mask[r - top, c - left] != 0 for ok, (c, r) in zip(inside, pixel, strict=True)])
    return np.array(offsets), np.array(pixels), np.array(on)


@given(st.integers(0, 2**31))
def test_places_agree_with_the_literal_twin(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n = 5
    points, angle = rng.uniform(-5.0, 65.0, (n, 2)), rng.uniform(0.0, 6.3, n)
    tangents, radius = np.stack((np.cos(angle), np.sin(angle)), axis=1), rng.uniform(0.6, 20.0, n)
    mask, (left, top) = rng.integers(0, 2, (30, 35)).astype(np.uint8), rng.integers(0, 25, 2).tolist()
    stored = rng.integers(0, 3000, (50, 60)).astype(rng.choice(["f4", "f8", "u2"]))
    if stored.dtype.kind == "f":
        stored[rng.random(stored.shape) < 0.2] = rng.choice([np.nan, np.inf, -np.inf, -3.0, 0.0])
    metres, offsets, on = lay_profiles(points, tangents, radius, mask, left, top, stored, 0.001, 0.4, 2.5)
    expected, pixels, masked = literal_places(points, tangents, radius, mask, left, top)
    np.testing.assert_allclose(offsets, expected, atol=1e-9)
    inside = ((pixels >= 0) & (pixels < (60, 50))).all(axis=2)
    np.testing.assert_array_equal(on, masked & inside)
    depth = np.full((n, PLACES), np.nan)
    depth[inside] = 0.001 * stored[pixels[inside][:, 1], pixels[inside][:, 0]].astype(np.float64)
    np.testing.assert_allclose(metres, np.where((depth >= 0.4) & (depth <= 2.5), depth, np.nan))


@pytest.mark.parametrize("radius", [0.5, 1.5, 4.0, 8.0, 30.0])
def test_places_go_from_inside_of_both_borders_to_beyond_fattened_ones_about_a_pixel_apart(radius: float) -> None:
    straight_on = np.array([[50.0, 50.0]]), np.array([[1.0, 0.0]]), np.array([radius])
    numbered = 1.0 + np.arange(101.0 * 101.0).reshape(101, 101)
    (metres,), (offset,), _ = lay_profiles(*straight_on, np.zeros((1, 1), np.uint8), 0, 0, numbered, *METRES)
    rows, columns = np.divmod(metres - 1.0, 101.0)
    assert offset[-1] == -offset[0] == pytest.approx(radius + 11.5)
    assert offset[GROUND - 1] < -radius - 6.0
    assert offset[GROUND] > -radius - 7.0
    right = offset[PLACES // 2 :]
    assert 0.0 < right[0] <= max(radius - 3.5, 0.5)
    assert (np.diff(offset) > 0.7).all()
    assert (np.diff(right) < 1.01).all()
    np.testing.assert_array_equal(rows, np.floor(50.5 + offset))  # heading right, the right is below
    np.testing.assert_array_equal(columns, 50)


def literal_profiles(
    metres: np.ndarray, offsets: np.ndarray, on: np.ndarray, radius: np.ndarray
) -> tuple[np.ndarray, float, np.ndarray, np.ndarray]:
    """Return ground, noise, and distances aside and farther out."""
    n = len(metres)
    outside = np.where(on, np.nan, metres)
    ends = outside[:, :GROUND], outside[:, -GROUND:]

    changes = np.concatenate([(np.abs(np.diff(end)) / (end[:, 1:] * end[:, :-1])).ravel() for end in ends])
    changes = np.sort(changes[~np.isnan(changes)])
    noise = 1e-4
    if len(changes):
        uneven = changes[changes > 0.0]
        step = uneven[len(uneven) // 4] if len(uneven) else 0.0
        noise = max(noise, step, changes[len(changes) // 2] / (math.sqrt(2.0) * 0.6745))

    sides = np.full((n, 2), np.nan)
    for i in range(n):
        for side, end in enumerate(ends):
            known = end[i][~np.isnan(end[i])]
            if len(known) >= 3:
                sides[i, side] = np.median(known)
    middles = [side[~np.isnan(side)].mean() if not np.isnan(side).all() else np.nan for side in sides]
    ground = np.array(middles)
    around = np.array([np.nan, *middles, np.nan])
    if n > 2:  # the way on in a straight line
        around[[0, -1]] = 2.0 * around[[2, -3]] - around[[3, -4]]
    for i in range(n):
        three = around[i : i + 3]
        if not np.isnan(three).any():
            ground[i] = np.median(three)
        elif np.isnan(middles[i]) and not np.isnan(three).all():
            ground[i] = np.nanmean(three)

    aside, wider = np.full(n, np.nan), np.full(n, np.nan)
    for i in range(n):
        offset, depth = offsets[i], metres[i]
        near = np.sort(depth[(np.abs(offset) <= radius[i] + 6.0) & ~np.isnan(depth)])
        if len(near) < 3 or np.isnan(sides[i]).any() or sides[i].min() - near[2] <= 6.0 * noise * near[2] ** 2:
            continue
        middle = slice(GROUND, -GROUND)
        if np.isnan(depth[middle]).any() or (on[i] & (np.abs(offset) > radius[i] + 1.0))[middle].any():
            continue
        edge = 0.5 * (near[2] + np.where(offset < 0.0, *sides[i]))
        step = offset[1] - offset[0]
        nearer = offset[middle][depth[middle] < edge[middle]]
        length = len(nearer) * step + max(offset[PLACES // 2] - offset[PLACES // 2 - 1] - step, 0.0)
        if length > 0.0:
            aside[i] = nearer.sum() * step / length
            wider[i] = 0.5 * length - radius[i]
    return ground, noise, aside, wider


def made_profiles(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return depth in places across an object, displaced, noisy, in steps or with holes, and another object beside."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 8))
    radius = rng.uniform(0.6, 12.0, n)
    points, tangents = np.zeros((n, 2)), np.tile([1.0, 0.0], (n, 1))
    _, offsets, _ = lay_profiles(points, tangents, radius, np.zeros((1, 1), np.uint8), 0, 0, np.zeros((1, 1)), *METRES)
    on = np.abs(offsets) <= radius[:, None]
    height = rng.choice([0.002, 0.05])
    metres = np.where(np.abs(offsets - rng.uniform(-2.0, 2.0)) <= radius[:, None], 1.0 - height, 1.0)
    metres += rng.uniform(-0.001, 0.001) * offsets + rng.normal(0.0, rng.choice([0.0, 1e-5, 1e-3]), (n, PLACES))
    if rng.random() < 0.5:
        metres = np.round(metres, 3)
    metres[rng.random((n, PLACES)) < rng.choice([0.0, 0.02, 0.5])] = np.nan
    on |= rng.random((n, PLACES)) < rng.choice([0.0, 0.02])
    return rng.uniform(0.4, 1.6) * metres, offsets, on, radius


@given(st.integers(0, 2**31))
def test_what_profiles_show_agrees_with_the_literal_twin(seed: int) -> None:
    made = made_profiles(seed)
    for found, expected in zip(read_profiles(*made), literal_profiles(*made), strict=True):
        np.testing.assert_allclose(found, expected, atol=1e-9)


@given(st.integers(0, 2**31))
def test_from_the_other_side_the_object_is_as_far_aside_and_as_wide(seed: int) -> None:
    metres, offsets, on, radius = made_profiles(seed)
    ground, noise, aside, wider = read_profiles(metres, offsets, on, radius)
    turned = read_profiles(metres[:, ::-1], offsets, on[:, ::-1], radius)
    np.testing.assert_allclose(turned[0], ground)
    assert turned[1] == pytest.approx(noise)
    np.testing.assert_allclose(turned[2], -aside, atol=1e-9)
    np.testing.assert_allclose(turned[3], wider, atol=1e-9)


def seen_along(
    axis: np.ndarray, dx: float = 0.0, dy: float = 0.0, fattened: float = 0.0
) -> tuple[tuple[np.ndarray, ...], np.ndarray, np.ndarray]:
    """Return the arguments of `read_profiles` along a level tube, its tangents, and its places (row, column).

    The depth image is displaced, and shows the tube wider by a number of px to either side.
    """
    mask, _ = draw_tubes([axis])
    wider = RADIUS_M + fattened * 0.9 / CAMERA.fx
    _, depth = draw_tubes([axis], wider, PinholeCamera(CAMERA.fx, CAMERA.fy, CAMERA.cx + dx, CAMERA.cy + dy))
    line = CAMERA.project(axis[20:-20:4])
    way = np.gradient(line, axis=0)
    tangents = way / np.linalg.norm(way, axis=1, keepdims=True)
    radius = np.full(len(line), RADIUS_M * CAMERA.fx / axis[:, 2].mean())
    metres, offsets, on = lay_profiles(line, tangents, radius, mask.astype(np.uint8), 0, 0, depth, *METRES)
    across = np.stack((tangents[:, 0], -tangents[:, 1]), axis=1)
    return (metres, offsets, on, radius), tangents, line[:, None, ::-1] + offsets[:, :, None] * across[:, None]


WAYS = {
    "level": straight((-0.3, 0.02, 0.9), (0.3, 0.02, 0.9)),
    "upright": straight((0.03, 0.2, 0.9), (0.03, -0.2, 0.9)),
    "slanted": straight((-0.3, -0.15, 0.9), (0.3, 0.15, 0.9)),
}


class TestGround:
    @pytest.mark.parametrize("way", WAYS)
    @pytest.mark.parametrize("slope", [(0.0, 0.0), (2e-3, 0.0), (1e-3, -2e-3)])
    def test_a_plane_s_depth_under_the_object_is_told(self, way: str, slope: tuple[float, float]) -> None:
        (metres, offsets, on, radius), _, pixels = seen_along(WAYS[way])
        plane = 1.2 + pixels @ slope[::-1]  # from beyond the object
        behind = np.where(metres > 2.0, plane, metres)
        ground, *_ = read_profiles(behind, offsets, on, radius)
        expected = 1.2 + CAMERA.project(WAYS[way][20:-20:4]) @ slope
        # A pixel's centre is up to half a pixel away, and at the ends there are profiles to one side only.
        steepest = math.hypot(*slope)
        np.testing.assert_allclose(ground[1:-1], expected[1:-1], atol=0.5 * steepest + 1e-12)
        assert np.abs(ground - expected).max() <= 3.0 * steepest + 1e-12

    def test_one_side_is_enough(self) -> None:
        metres, offsets, on, radius = made_profiles(3)
        metres = np.where(np.abs(offsets) <= radius[:, None], 0.9, 1.1)
        metres[:, :GROUND] = np.nan
        ground, _, aside, _ = read_profiles(metres, offsets, on & False, radius)
        np.testing.assert_array_equal(ground, 1.1)
        assert np.isnan(aside).all()

    def test_two_places_are_too_few_and_so_is_the_mask(self) -> None:
        metres, offsets, on, radius = made_profiles(3)
        metres, on = np.full_like(metres, 1.1), on & False
        sparse = metres.copy()
        sparse[:, 2:-2] = np.nan
        ground, _, aside, _ = read_profiles(sparse, offsets, on, radius)
        assert np.isnan(ground).all()
        on[:, 3:-2] = True
        ground, *_ = read_profiles(metres, offsets, on, radius)
        np.testing.assert_array_equal(ground, 1.1)
        on[:, 2] = True
        ground, _, aside, _ = read_profiles(metres, offsets, on, radius)
        assert np.isnan(ground).all()
        assert np.isnan(aside).all()

    def test_neighbours_help_where_it_is_not_known_and_outvote_where_it_differs(self) -> None:
        metres, on = np.full((8, PLACES), 1.1), np.zeros((8, PLACES), bool)
        offsets = np.tile(np.linspace(-15.5, 15.5, PLACES), (8, 1))
        metres[1] = metres[7] = np.nan
        metres[4] = 0.7
        ground, *_ = read_profiles(metres, offsets, on, np.full(8, 4.0))
        np.testing.assert_allclose(ground, 1.1)
        metres[6] = np.nan
        ground, *_ = read_profiles(metres, offsets, on, np.full(8, 4.0))
        assert np.flatnonzero(np.isnan(ground)).tolist() == [7]


class TestNoise:
    N = 60

    def told(self, metres: np.ndarray) -> float:
        offsets = np.tile(np.linspace(-15.5, 15.5, PLACES), (self.N, 1))
        return read_profiles(metres, offsets, np.abs(offsets) <= 4.0, np.full(self.N, 4.0))[1]

    @pytest.mark.parametrize("level", [0.4, 1.0, 1.5])
    @pytest.mark.parametrize("sigma", [0.001, 0.004, 0.01])
    def test_it_is_the_deviation_over_the_depth_squared(self, level: float, sigma: float) -> None:
        rng = np.random.default_rng(0)
        metres = level + sigma * level**2 * rng.normal(0.0, 1.0, (self.N, PLACES))
        assert self.told(metres) == pytest.approx(sigma, rel=0.1)

    @pytest.mark.parametrize("quantum", [0.002, 0.005])
    def test_steps_above_the_noise_count_as_such(self, quantum: float) -> None:
        rng = np.random.default_rng(0)
        slanted = 1.0 + 0.05 * quantum * np.arange(PLACES) + 0.3 * quantum * np.arange(self.N)[:, None]
        inverse = 1.0 / (slanted + 0.02 * quantum * rng.normal(0.0, 1.0, slanted.shape))
        assert self.told(1.0 / (quantum * np.rint(inverse / quantum))) == pytest.approx(quantum, rel=0.01)

    def test_holes_the_object_and_a_step_to_another_surface_do_not_matter(self) -> None:
        rng = np.random.default_rng(0)
        metres = 1.0 + rng.normal(0.0, 0.002, (self.N, PLACES))
        expected = self.told(metres)
        metres[:, GROUND:-GROUND] -= rng.uniform(0.0, 0.5, (self.N, PLACES - 2 * GROUND))
        assert self.told(metres) == expected
        metres[:, :3] += 0.3
        metres[rng.random(metres.shape) < 0.2] = np.nan
        assert self.told(metres) == pytest.approx(expected, rel=0.3)

    @pytest.mark.parametrize("depth", [1.0, np.nan])
    def test_there_is_a_least(self, depth: float) -> None:
        assert self.told(np.full((self.N, PLACES), depth)) == 1e-4


BEND = np.linspace(-1.0, 1.0, 400)
ARCS = {
    "level": np.stack((0.3 * BEND, 0.15 * BEND**2 - 0.08, np.full(400, 0.9)), axis=1),
    "upright": np.stack((0.08 * BEND**2 - 0.03, 0.2 * BEND, np.full(400, 0.9)), axis=1),
}
"""Of many directions, and so they meet the pixels in many ways."""

DISPLACED = [(0.0, 0.0), (1.5, 0.0), (0.0, -1.5), (-1.2, 1.6), (2.0, 2.0)]


class TestAside:
    @pytest.mark.parametrize("way", ARCS)
    @pytest.mark.parametrize(("dx", "dy"), DISPLACED)
    @pytest.mark.parametrize("fattened", [0.0, 3.0])
    def test_it_is_the_part_of_the_displacement_across(self, way: str, dx: float, dy: float, fattened: float) -> None:
        made, tangents, _ = seen_along(ARCS[way], dx, dy, fattened)
        _, _, aside, wider = read_profiles(*made)
        off = aside - (dx * -tangents[:, 1] + dy * tangents[:, 0])
        assert np.abs(off).max() < 1.0  # both edges lie somewhere between pixels
        assert abs(off.mean()) < 0.1
        assert np.abs(wider - fattened).max() < 1.0
        *displaced, told = edges_of(add_edges(tangents, aside, wider, NOTHING, 1.0))
        assert math.dist(displaced, (dx, dy)) < 0.2
        assert abs(told - fattened) < 0.2

    def test_over_another_object_it_is_not_told(self) -> None:
        made, _, _ = seen_along(WAYS["level"])
        metres, offsets, on, radius = made
        assert not np.isnan(read_profiles(*made)[2]).any()
        other = on.copy()
        place = np.flatnonzero(offsets[3] > radius[3] + 1.0)[1]
        other[3, place] = True
        aside = read_profiles(metres, offsets, other, radius)[2]
        assert np.flatnonzero(np.isnan(aside)).tolist() == [3]

    def test_next_to_a_hole_it_is_not_told(self) -> None:
        metres, offsets, on, radius = seen_along(WAYS["level"])[0]
        metres = metres.copy()
        metres[2, PLACES // 2] = metres[5, GROUND] = metres[7, -GROUND - 1] = np.nan
        metres[8, 0] = np.nan  # of the ground there is enough
        aside = read_profiles(metres, offsets, on, radius)[2]
        assert np.flatnonzero(np.isnan(aside)).tolist() == [2, 5, 7]

    @pytest.mark.parametrize(("height", "told"), [(0.005, False), (0.02, True)])
    def test_without_contrast_it_is_not_told(self, height: float, told: bool) -> None:
        metres, offsets, on, radius = seen_along(WAYS["level"])[0]
        rng = np.random.default_rng(0)
        metres = np.where(metres > 2.0, 1.0, 1.0 - height) + rng.normal(0.0, 0.002, metres.shape)
        assert (np.isfinite(read_profiles(metres, offsets, on, radius)[2]).mean() > 0.5) == told

    def test_nothing_near_tells_nothing(self) -> None:
        metres, offsets, on, radius = seen_along(WAYS["level"])[0]
        assert np.isnan(read_profiles(np.full_like(metres, 1.0), offsets, on, radius)[2]).all()


class TestSpreading:
    @given(st.lists(st.floats(0.4, 2.0), min_size=1, max_size=6), st.integers(1, 7), st.integers(0, 9))
    def test_known_values_are_led_on_in_straight_lines(self, values: list[float], every: int, more: int) -> None:
        count = (len(values) - 1) * every + 1 + more
        expected = np.interp(np.arange(count), every * np.arange(len(values)), values)
        np.testing.assert_allclose(spread(np.array(values), count, every), expected)

    def test_beside_an_unknown_one_the_nearer_counts(self) -> None:
        found = spread(np.array([1.0, np.nan, 3.0]), 11, 4)
        np.testing.assert_array_equal(found, [1.0, 1.0, *[np.nan] * 4, *[3.0] * 5])


def literal_edges(sums: np.ndarray) -> np.ndarray:
    xx, xy, yy, x, y, weights, weighted = sums
    return np.array([*np.linalg.solve([[xx + 1.0, xy], [xy, yy + 1.0]], [x, y]), weighted / (weights + 1.0)])


def literal_sums(tangents: np.ndarray, aside: np.ndarray, wider: np.ndarray, past: np.ndarray) -> np.ndarray:
    known = ~np.isnan(aside)
    (nx, ny), told, out = np.stack((-tangents[known, 1], tangents[known, 0])), aside[known], wider[known]
    sums = past
    for _ in range(6):
        x, y, fattened = literal_edges(sums)
        weight = 1.0 / np.maximum(np.abs(told - nx * x - ny * y), 0.5) / 0.5
        products = [weight * product for product in (nx * nx, nx * ny, ny * ny, nx * told, ny * told)]
        weight = 1.0 / np.maximum(np.abs(out - fattened), 0.5) / 0.5
        sums = past + [product.sum() for product in (*products, weight, weight * out)]
    return sums


def evidence(
    seed: int, dx: float, dy: float, n: int = 60, sigma: float = 0.3, fattened: float = 0.0
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return tangents about two directions, how far aside a displacement is seen there, and how wide."""
    rng = np.random.default_rng(seed)
    angle = rng.choice(rng.uniform(0.0, 3.1) + np.array([0.0, 1.2]), n) + rng.normal(0.0, 0.05, n)
    tangents = np.stack((np.cos(angle), np.sin(angle)), axis=1)
    aside = -tangents[:, 1] * dx + tangents[:, 0] * dy + rng.normal(0.0, sigma, n)
    return tangents, aside, fattened + rng.normal(0.0, sigma, n)


class TestEdges:
    @given(st.integers(0, 2**31))
    def test_they_agree_with_the_literal_twins(self, seed: int) -> None:
        rng = np.random.default_rng(seed)
        tangents, aside, wider = evidence(seed, rng.uniform(-2.0, 2.0), 1.0, int(rng.integers(1, 9)), 1.0, 2.0)
        aside[rng.random(len(aside)) < 0.3] = np.nan
        aside[0] = 1.0
        past, memory = add_edges(*evidence(seed + 1, 1.0, -1.0), NOTHING, 1.0), rng.uniform(0.0, 1.0)
        sums = add_edges(tangents, aside, wider, past, memory)
        np.testing.assert_allclose(sums, literal_sums(tangents, aside, wider, memory * past), atol=1e-9)
        np.testing.assert_allclose(edges_of(sums), literal_edges(sums), atol=1e-9)

    @pytest.mark.parametrize(("dx", "dy"), DISPLACED)
    def test_they_come_out_in_spite_of_a_fifth_of_outliers(self, dx: float, dy: float) -> None:
        for seed in range(50):
            tangents, aside, wider = evidence(seed, dx, dy, 200, 0.2, 2.5)
            aside[::5] += np.random.default_rng(seed).uniform(-4.0, 4.0, 40)
            wider[::5] += np.random.default_rng(seed + 1).uniform(-4.0, 4.0, 40)
            assert math.dist(edges_of(add_edges(tangents, aside, wider, NOTHING, 1.0)), (dx, dy, 2.5)) < 0.25

    def test_if_all_of_them_lie_to_one_side_it_is_hardly_worse(self) -> None:
        for seed in range(50):
            tangents, aside, wider = evidence(seed, 1.5, -1.0, 200, 0.2)
            aside[::5] += 3.0
            wider[::5] += 3.0
            assert math.dist(edges_of(add_edges(tangents, aside, wider, NOTHING, 1.0)), (1.5, -1.0, 0.0)) < 0.3

    def test_without_evidence_there_are_none(self) -> None:
        for n in (0, 10):
            unknown = np.full(n, np.nan)
            sums = add_edges(np.tile([1.0, 0.0], (n, 1)), unknown, unknown, NOTHING, 1.0)
            np.testing.assert_array_equal(sums, NOTHING)
            assert edges_of(sums) == (0.0, 0.0, 0.0)

    def test_along_an_object_nothing_is_known_of_the_displacement(self) -> None:
        sums = add_edges(np.tile([0.6, 0.8], (100, 1)), np.full(100, 1.5), np.full(100, 2.0), NOTHING, 1.0)
        np.testing.assert_allclose(edges_of(sums), (-0.8 * 1.5, 0.6 * 1.5, 2.0), atol=0.01)

    def test_a_single_profile_is_not_quite_believed(self) -> None:
        # It is good to half a pixel, and a pixel is what is expected without it.
        x, y, fattened = edges_of(add_edges(np.array([[1.0, 0.0]]), np.array([2.0]), np.array([2.0]), NOTHING, 1.0))
        assert x == 0.0
        assert y == pytest.approx(2.0 * 4.0 / (4.0 + 1.0))
        assert fattened == pytest.approx(2.0 * 4.0 / (4.0 + 1.0))

    def test_what_was_known_counts_on(self) -> None:
        told = evidence(0, 1.5, -1.0, fattened=2.0)
        sums = add_edges(*told, NOTHING, 1.0)
        again = add_edges(np.zeros((0, 2)), np.zeros(0), np.zeros(0), sums, 0.5)
        np.testing.assert_array_equal(again, sums)  # nothing told, nothing forgotten
        wrong = add_edges(told[0][:5], np.full(5, 4.0), np.full(5, 5.0), sums, 1.0)
        assert math.dist(edges_of(wrong), (1.5, -1.0, 2.0)) < 0.3
        np.testing.assert_array_equal(sums, add_edges(*told, NOTHING, 1.0))  # and is left alone

    def test_memory_is_the_share_of_it_that_stays(self) -> None:
        past, told = add_edges(*evidence(0, 1.5, -1.0), NOTHING, 1.0), evidence(1, -1.0, 1.0)
        np.testing.assert_allclose(add_edges(*told, past, 0.3), add_edges(*told, 0.3 * past, 1.0))
