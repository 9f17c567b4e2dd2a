"""Sections across a curve, their pixels and the nearest surface, against slow twins."""

from __future__ import annotations

import math

import numpy as np
import pytest
from builders import random_curve
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.kernels.sections import (
    choose_pixels,
    find_rays,
    lay_sections,
    nearest_surface,
    settle,
    strike_steps,
)

SLIM = 0.01  # radius over focal length


@given(st.integers(0, 2**31), st.booleans())
def test_sections_lie_on_the_curve_at_even_parameters(seed: int, closed: bool) -> None:
    curve = random_curve(seed, closed=closed)
    u, radius = np.linspace(0.0, 1.0, 50), np.full(50, 4.0)
    at, points, tangents, radii, length = lay_sections(
        curve.knots, curve.control_points, u, radius, closed, 10.0, 8, 20
    )
    n = len(at)
    polygon = np.linalg.norm(np.diff(curve.control_points, axis=0), axis=1).sum()
    assert length == pytest.approx(polygon)
    assert n == max(round(polygon / 10.0), 8)
    np.testing.assert_allclose(at, np.linspace(0.0, 1.0, n, endpoint=not closed))
    np.testing.assert_allclose(points, curve(at), atol=1e-7)
    np.testing.assert_allclose(tangents, curve.tangent(at), atol=1e-5)
    np.testing.assert_allclose(radii, 4.0)


@given(st.integers(0, 2**31))
def test_crossings_do_not_show_in_the_radius(seed: int) -> None:
    rng = np.random.default_rng(seed)
    curve = random_curve(seed)
    u = np.linspace(0.0, 1.0, 400)
    radius = 4.0 + 2.0 * u
    start = int(rng.integers(0, 380))
    radius[start : start + 15] *= 2.0
    at, _, _, radii, _ = lay_sections(curve.knots, curve.control_points, u, radius, False, 5.0, 8, 80)
    # As the medians of blocks have it, which are a fifth of the curve long.
    np.testing.assert_allclose(radii, 4.0 + 2.0 * at, atol=0.35)


def test_rays_lie_the_radius_to_either_side() -> None:
    points, tangents = np.array([[10.0, 20.0], [30.0, 40.0]]), np.array([[1.0, 0.0], [0.0, 1.0]])
    expected = [[10, 20], [30, 40], [10, 17], [34, 40], [10, 23], [26, 40]]
    rays = find_rays(points, tangents, np.array([3.0, 4.0]), 2.0, 5.0, 7.0, -1.0)
    np.testing.assert_allclose(rays[:, :2] * (2.0, 5.0) + (7.0, -1.0), expected)
    assert (rays[:, 2] == 1.0).all()


def straight(angle: float, n: int, spacing: float) -> tuple[np.ndarray, np.ndarray]:
    """Return points and tangents of a straight line through (60, 60)."""
    way = np.array([math.cos(angle), math.sin(angle)])
    return 60.0 + spacing * (np.arange(n) - n / 2.0)[:, None] * way, np.tile(way, (n, 1))


@given(st.floats(0.0, 2.0 * math.pi), st.floats(0.6, 15.0), st.floats(1.0, 6.0), st.integers(0, 2**31))
def test_pixels_lie_in_the_mask_and_off_its_borders(angle: float, radius: float, spacing: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    n = 9
    points, tangents = straight(angle, n, spacing)
    used, mask = rng.random(n) < 0.8, (rng.random((70, 80)) < 0.8).astype(np.uint8)
    rows, columns, across, first = choose_pixels(
        points, tangents, np.full(n, radius), used, mask, 20, 25, 0.6, 1.0, 0.3
    )
    assert (mask[rows - 25, columns - 20] == 1).all()
    assert first[0] == 0
    assert first[-1] == len(rows)
    section = np.repeat(np.arange(n), np.diff(first))
    assert used[section].all()
    offset = np.stack((columns, rows), axis=1) - points[section]
    along = (offset * tangents[section]).sum(axis=1)
    beside = offset[:, 1] * tangents[section, 0] - offset[:, 0] * tangents[section, 1]
    np.testing.assert_allclose(across, np.clip(beside / radius, -1.0, 1.0), atol=1e-9)
    # A pixel is no farther than half a diagonal from where it was looked for.
    half = max(min(0.6 * radius, radius - 1.0), 0.3 * radius)
    assert (np.abs(beside) <= half + 0.71).all()
    assert (np.abs(along) <= 0.5 * spacing + 0.71).all()


@given(st.integers(0, 2**31))
def test_pixels_of_a_transposed_mask_are_transposed(seed: int) -> None:
    rng = np.random.default_rng(seed)
    points, tangents = straight(rng.uniform(0.0, 6.0), 12, 3.0)
    mask = (rng.random((120, 120)) < 0.9).astype(np.uint8)
    used, radius = np.ones(12, bool), np.full(12, 5.0)
    rows, columns, across, first = choose_pixels(points, tangents, radius, used, mask, 0, 0, 0.6, 1.0, 0.3)
    flipped = choose_pixels(points[:, ::-1], tangents[:, ::-1], radius, used, mask.T, 0, 0, 0.6, 1.0, 0.3)
    for i in range(12):
        own, other = slice(first[i], first[i + 1]), slice(flipped[3][i], flipped[3][i + 1])
        a = sorted(zip(rows[own], columns[own], across[own].round(9), strict=True))
        b = sorted(zip(flipped[1][other], flipped[0][other], -flipped[2][other].round(9), strict=True))
        assert a == b


def literal_surface(depth: np.ndarray, across: np.ndarray, slim: float, low: float, high: float) -> tuple[float, int]:
    valid = np.isfinite(depth) & (depth > 0) & (depth >= low) & (depth <= high)
    z, beside = depth[valid], np.minimum(np.abs(across[valid]), 0.95)
    if len(z) == 0 or len(z) < 0.25 * len(depth):
        return math.nan, 0
    level = np.sort(z - slim * z * (1.0 - np.sqrt(1.0 - beside**2)))
    half = len(level) // 3 + 1
    lengths = [level[k + half - 1] - level[k] for k in range(len(level) - half + 1)]
    start = int(np.argmin(lengths))
    middle = level[start : start + half].mean()
    kept = level[np.abs(level - middle) <= 3.0 * lengths[start] + 0.1 * slim * middle]
    return float(kept.mean()), len(kept)


@given(st.integers(0, 2**31))
def test_the_surface_agrees_with_the_literal_twin(seed: int) -> None:
    rng = np.random.default_rng(seed)
    sizes = rng.integers(0, 12, 6)
    first = np.concatenate(([0], np.cumsum(sizes)))
    depth = rng.normal(1.0, 0.01, first[-1])
    depth[rng.random(len(depth)) < 0.3] += 0.2
    bad = rng.random(len(depth)) < 0.3
    depth[bad] = rng.choice([0.0, np.nan, np.inf, -1.0, 9.0], bad.sum())
    across, slim = rng.uniform(-1.0, 1.0, len(depth)), rng.uniform(0.005, 0.02, 6)
    surface, counts, led = nearest_surface(depth, across, first, slim, 0.1, 5.0)
    for i in range(6):
        own = slice(first[i], first[i + 1])
        expected = literal_surface(depth[own], across[own], slim[i], 0.1, 5.0)
        np.testing.assert_allclose((surface[i], counts[i]), expected, atol=1e-9)
    assert 0.0 <= led <= 1.0


def test_noise_does_not_bring_the_surface_nearer_and_flying_pixels_not_farther() -> None:
    rng = np.random.default_rng(0)
    sections, each = 2000, 15
    across = np.tile(np.linspace(-0.6, 0.6, each), sections)
    depth = 1.0 + SLIM * (1.0 - np.sqrt(1.0 - across**2)) + rng.normal(0.0, 0.002, len(across))
    flying = rng.random(len(depth)) < 0.3
    depth[flying] += rng.uniform(0.0, 0.5, flying.sum())
    first = np.arange(0, sections * each + 1, each)
    surface, _, _ = nearest_surface(depth, across, first, np.full(sections, SLIM), 0.0, 9.0)
    assert np.median(surface) == pytest.approx(1.0, abs=0.0005)


class TestSteps:
    N = 60

    def slope(self, seed: int, steepness: float) -> np.ndarray:
        rng = np.random.default_rng(seed)
        t = np.linspace(0.0, 1.0, self.N)
        return 1.0 + steepness * t + 0.02 * np.sin(9.0 * t) + rng.normal(0.0, 0.0005, self.N)

    @given(st.integers(0, 2**31), st.floats(-0.8, 0.8), st.integers(5, 40), st.integers(1, 9), st.booleans())
    def test_a_stretch_between_two_steps_goes(self, seed: int, steep: float, start: int, n: int, nearer: bool) -> None:
        depth = self.slope(seed, steep)
        depth[start : start + n] += -0.06 if nearer else 0.06
        assert strike_steps(depth, np.full(self.N, SLIM), 10) == np.count_nonzero(~np.isnan(depth))
        assert np.flatnonzero(np.isnan(depth)).tolist() == list(range(start, start + n))

    @given(st.integers(0, 2**31), st.floats(-0.8, 0.8))
    def test_what_is_only_steep_stays(self, seed: int, steep: float) -> None:
        depth = self.slope(seed, steep)
        depth[20:24] = np.nan
        expected = depth.copy()
        assert strike_steps(depth, np.full(self.N, SLIM), 10) == np.count_nonzero(~np.isnan(depth))
        np.testing.assert_array_equal(depth, expected)

    def test_a_long_stretch_stays(self) -> None:
        depth = self.slope(0, 0.1)
        depth[20:40] -= 0.05
        assert strike_steps(depth, np.full(self.N, SLIM), 10) == np.count_nonzero(~np.isnan(depth))
        assert not np.isnan(depth).any()

    @pytest.mark.parametrize("n", [0, 1, 5])
    def test_a_handful_of_sections_stays(self, n: int) -> None:
        depth = np.linspace(1.0, 2.0, n)
        assert strike_steps(depth, np.full(n, SLIM), 10) == np.count_nonzero(~np.isnan(depth))
        assert not np.isnan(depth).any()


def literal_settle(explained: list[bool], closed: bool, least: int) -> tuple[list[bool], list[tuple[int, int]]]:
    n = len(explained)
    near = [[k % n for k in (i - 1, i + 1) if closed or 0 <= k < n] for i in range(n)]
    seen = [explained[i] and any(explained[k] for k in near[i]) for i in range(n)]
    stretches = []
    for start in range(n):
        before = seen[start - 1] if closed or start > 0 else True
        if seen[start] or not before:
            continue
        stop = start
        while stop < (start + n if closed else n) and not seen[stop % n]:
            stop += 1
        if stop - start >= least:
            stretches.append((start, stop))
    return seen, stretches


@given(st.lists(st.booleans(), min_size=3, max_size=30), st.booleans(), st.integers(1, 4))
def test_stretches_agree_with_the_literal_twin(explained: list[bool], closed: bool, least: int) -> None:
    line = np.cos(np.arange(float(len(explained))))
    seen, stretches, count, first, last, lowest, lowest_seen = settle(np.array(explained), closed, least, line)
    expected_seen, expected = literal_settle(explained, closed, least)
    assert seen.tolist() == expected_seen
    assert (count, lowest) == (sum(expected_seen), line.min())
    assert lowest_seen == line[seen].min(initial=np.inf)
    assert not any(expected_seen) or [first, last] == np.flatnonzero(seen)[[0, -1]].tolist()
    found = sorted((int(a) % len(seen), int(b - a)) for a, b in stretches)
    assert not any(expected_seen) or found == sorted((a, b - a) for a, b in expected)
