"""The nearest surface in sections across a curve, and steps along it, against slow twins."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.lifting.kernels.surfaces import DEPTH_TYPES, find_surface, strike_steps

SLIM = 0.01  # radius over focal length
LIMITS = (0.1, 5.0)
RULES = (0.6, 1.0, 0.3)


def straight(angle: float, n: int, spacing: float) -> tuple[np.ndarray, np.ndarray]:
    """Return points and tangents of a straight line through (60, 60)."""
    way = np.array([math.cos(angle), math.sin(angle)])
    return 60.0 + spacing * (np.arange(n) - n / 2.0)[:, None] * way, np.tile(way, (n, 1))


def literal_pixels(
    points: np.ndarray, tangents: np.ndarray, radius: float, i: int, mask: np.ndarray, left: int, top: int
) -> list[tuple[int, int]]:
    """Return the pixels of a section, in the image."""
    share, border, least = RULES
    a, b = max(i - 1, 0), min(i + 1, len(points) - 1)
    spacing = np.linalg.norm(points[b] - points[a]) / (b - a)
    half = max(min(share * radius, radius - border), least * radius)
    side = min(int(half), 2)
    lines = min(max(round(spacing), 1), 15 // (2 * side + 1))
    way, beside = tangents[i], np.array([-tangents[i, 1], tangents[i, 0]])
    found = []
    for along in spacing * ((np.arange(lines) + 0.5) / lines - 0.5):
        for off in np.arange(-side, side + 1) * (half / 2 if half > 3.0 else 1.0):
            column, row = np.floor(points[i] + along * way + off * beside + 0.5).astype(int)
            r, c = row - top, column - left
            if 0 <= r < mask.shape[0] and 0 <= c < mask.shape[1] and mask[r, c]:
                found.append((row, column))
    return found


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


def scene(seed: int) -> tuple[np.ndarray, np.ndarray, float, np.ndarray, np.ndarray, np.ndarray]:
    """Return sections on a line: points, tangents, radius, which are used; and a ragged mask and depth with holes."""
    rng = np.random.default_rng(seed)
    points, tangents = straight(rng.uniform(0.0, 6.3), 9, rng.uniform(1.0, 6.0))
    used, mask = rng.random(9) < 0.8, (rng.random((70, 80)) < 0.8).astype(np.uint8)
    depth = rng.normal(1.0, 0.01, mask.shape)
    depth[rng.random(depth.shape) < 0.3] += 0.2
    bad = rng.random(depth.shape) < 0.2
    depth[bad] = rng.choice([0.0, np.nan, np.inf, -1.0, 9.0], bad.sum())
    return points, tangents, rng.uniform(0.6, 15.0), used, mask, depth


@given(st.integers(0, 2**31), st.sampled_from(DEPTH_TYPES))
def test_the_surface_agrees_with_the_literal_twin(seed: int, kind: np.dtype) -> None:
    points, tangents, radius, used, mask, metres = scene(seed)
    unit = 1.0 if kind.kind == "f" else 0.001
    depth = metres.astype(kind) if unit == 1.0 else np.nan_to_num(1e3 * metres.clip(0.0, 60.0)).astype(kind)
    focal = radius / SLIM
    inverse, counts, led, known = find_surface(
        points, tangents, np.full(9, radius), used, mask, depth, 20, 25, unit, *LIMITS, focal, *RULES, 0
    )
    for i in range(9):
        pixels = literal_pixels(points, tangents, radius, i, mask, 20, 25) if used[i] else []
        own = np.array([depth[row - 25, column - 20] * unit for row, column in pixels])
        offset = np.array([(column, row) for row, column in pixels]).reshape(-1, 2) - points[i]
        across = np.clip((offset[:, 1] * tangents[i, 0] - offset[:, 0] * tangents[i, 1]) / radius, -1.0, 1.0)
        expected = literal_surface(own, across, SLIM, *LIMITS)
        np.testing.assert_allclose((1.0 / inverse[i], counts[i]), expected, atol=1e-9)
    assert 0.0 <= led <= 1.0
    assert known == np.count_nonzero(counts)


@given(st.integers(0, 2**31))
def test_what_lies_off_the_mask_and_at_its_borders_does_not_matter(seed: int) -> None:
    points, tangents, radius, used, mask, depth = scene(seed)
    rows, columns = np.mgrid[25 : 25 + 70, 20 : 20 + 80]
    # A pixel is no farther than half a diagonal from where it was looked for.
    reach = max(min(0.6 * radius, radius - 1.0), 0.3 * radius) + 0.71
    beside = (rows - points[0, 1]) * tangents[0, 0] - (columns - points[0, 0]) * tangents[0, 1]
    other = np.where((mask == 1) & (np.abs(beside) <= reach), depth, 2.0)
    sections = points, tangents, np.full(9, radius), used, mask
    rest = 20, 25, 1.0, *LIMITS, radius / SLIM, *RULES, 0
    for ours, theirs in zip(find_surface(*sections, depth, *rest), find_surface(*sections, other, *rest), strict=True):
        np.testing.assert_array_equal(ours, theirs)


@given(st.integers(0, 2**31))
def test_a_transposed_image_gives_the_same_surface(seed: int) -> None:
    points, tangents, radius, used, mask, depth = scene(seed)
    rest = 1.0, *LIMITS, radius / SLIM, *RULES, 0
    inverse, counts, led, known = find_surface(points, tangents, np.full(9, radius), used, mask, depth, 20, 25, *rest)
    turned = find_surface(points[:, ::-1], tangents[:, ::-1], np.full(9, radius), used, mask.T, depth.T, 25, 20, *rest)
    np.testing.assert_allclose(turned[0], inverse, atol=1e-9)
    assert turned[3] == known
    np.testing.assert_array_equal(turned[1], counts)
    assert turned[2] == pytest.approx(led)


def test_noise_does_not_bring_the_surface_nearer_and_flying_pixels_not_farther() -> None:
    rng = np.random.default_rng(0)
    sections, radius = 1500, 4.0
    points = np.stack((4.0 + 3.0 * np.arange(sections), np.full(sections, 10.0)), axis=1)
    tangents = np.tile([1.0, 0.0], (sections, 1))
    size = (21, 3 * sections + 8)
    across = np.clip((np.arange(21) - 10.0) / radius, -1.0, 1.0)[:, None]
    depth = 1.0 + SLIM * (1.0 - np.sqrt(1.0 - across**2)) + rng.normal(0.0, 0.002, size)
    flying = rng.random(size) < 0.3
    depth[flying] += rng.uniform(0.0, 0.5, flying.sum())
    inverse, _, _, _ = find_surface(
        points, tangents, np.full(sections, radius), np.ones(sections, bool), np.ones(size, np.uint8), depth,
        0, 0, 1.0, 0.0, 9.0, radius / SLIM, *RULES, 0,
    )  # fmt: skip
    assert np.median(1.0 / inverse) == pytest.approx(1.0, abs=0.0005)


@pytest.mark.parametrize("slim", [1.0, 3.0, 30.0, 1e6])
def test_an_object_wider_than_it_is_far_has_no_surface_behind_the_camera(slim: float) -> None:
    points, tangents = straight(0.0, 9, 2.0)
    depth, mask, used = np.full((70, 80), 0.7), np.ones((70, 80), np.uint8), np.ones(9, bool)
    inverse, counts, _, known = find_surface(
        points, tangents, np.full(9, 6.0), used, mask, depth, 20, 25, 1.0, *LIMITS, 6.0 / slim, *RULES, 0
    )
    assert known == np.isfinite(inverse).sum() == (counts > 0).sum()
    assert (inverse[np.isfinite(inverse)] > 0.0).all()


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
