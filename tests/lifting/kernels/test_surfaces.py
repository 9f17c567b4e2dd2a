"""The nearest surface in sections across a curve, against a slow twin."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.lifting.kernels.surfaces import find_surface

SLIM = 0.01  # radius over focal length
LIMITS = (0.1, 5.0)
RULES = (0.6, 1.0, 0.3)
NO_GROUND = np.full(9, np.nan)


def straight(angle: float, n: int, spacing: float, middle: tuple[float, float]) -> tuple[np.ndarray, np.ndarray]:
    """Return points and tangents of a straight line."""
    way = np.array([math.cos(angle), math.sin(angle)])
    return np.array(middle) + spacing * (np.arange(n) - n / 2.0)[:, None] * way, np.tile(way, (n, 1))


def literal_pixels(
    points: np.ndarray,
    tangents: np.ndarray,
    radius: float,
    i: int,
    mask: np.ndarray,
    corner: tuple[int, int],
    size: tuple[int, int],
    displaced: np.ndarray,
) -> np.ndarray:
    """Return the pixels (column, row) of a section in a depth image of a size, those on the mask."""
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
            place = points[i] + along * way + off * beside
            c, r = np.floor(place + 0.5).astype(int) - corner
            column, row = np.floor(place + 0.5 + displaced).astype(int)
            on = 0 <= r < mask.shape[0] and 0 <= c < mask.shape[1] and mask[r, c]
            if on and 0 <= row < size[0] and 0 <= column < size[1]:
                found.append((column, row))
    return np.array(found, int).reshape(-1, 2)


def literal_surface(
    depth: np.ndarray, across: np.ndarray, slim: float, low: float, high: float, ground: float, noise: float
) -> tuple[float, int, np.ndarray]:
    """Return a section's surface, the number of its pixels, and how far each with depth was moved, radii."""
    valid = np.isfinite(depth) & (depth > 0) & (depth >= low) & (depth <= high)
    z, beside = depth[valid], np.minimum(across[valid], 0.95)
    back = 1.0 - np.sqrt(1.0 - beside**2)
    if len(z) == 0 or len(z) < 0.25 * len(depth):
        return math.nan, 0, back
    level = np.sort(z - slim * z * back)
    if len(level) >= 2 and ground - level[1] > max(slim * ground, 6.0 * noise * ground**2):
        above = level[level < 0.5 * (ground + level[1])]
        if len(above) >= len(level) / 5:
            level = above
    crowd = len(level) // 3 + 1
    lengths = [level[k + crowd - 1] - level[k] for k in range(len(level) - crowd + 1)]
    start = int(np.argmin(lengths))
    middle = level[start : start + crowd].mean()
    kept = level[np.abs(level - middle) <= 3.0 * lengths[start] + 0.1 * slim * middle]
    return float(kept.mean()), len(kept), back


class Scene:
    """Sections on a line over a ragged mask, cut out at a corner, and depth with holes, some of it the ground's."""

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng(seed)
        self.left, self.top = rng.integers(0, 30, 2).tolist()
        middle = self.left + 40.0, self.top + 35.0
        self.points, self.tangents = straight(rng.uniform(0.0, 6.3), 9, rng.uniform(1.0, 6.0), middle)
        self.used, self.mask = rng.random(9) < 0.8, (rng.random((70, 80)) < 0.8).astype(np.uint8)
        self.radius = rng.uniform(0.6, 15.0)
        self.depth = rng.normal(1.0, 0.01, (self.top + 70, self.left + 80))
        self.depth[rng.random(self.depth.shape) < rng.choice([0.0, 0.3, 0.7])] += 0.2
        bad = rng.random(self.depth.shape) < 0.2
        self.depth[bad] = rng.choice([0.0, np.nan, np.inf, -1.0, 9.0], bad.sum())
        self.ground = np.where(rng.random(9) < 0.3, np.nan, rng.normal(1.2, 0.1, 9))
        self.noise = rng.choice([1e-4, 0.01, 0.05])
        scale = rng.uniform(0.4, 1.6)
        self.depth, self.ground = scale * self.depth, scale * self.ground
        self.displaced = rng.choice([0.0, 1.0, 2.0]) * rng.uniform(-1.0, 1.0, 2)
        self.fattened = rng.choice([0.0, 1.5, 4.0])

    def find(self, unit: float = 1.0, **other: Any) -> tuple[Any, Any, Any]:
        """Return what the kernel does, with some of the scene replaced."""
        s: dict[str, Any] = vars(self) | other
        dx, dy = s["displaced"]
        return find_surface(
            s["points"], s["tangents"], np.full(9, s["radius"]), s["used"], s["mask"], s["depth"], s["left"], s["top"],
            unit, *LIMITS, s["radius"] / SLIM, dx, dy, s["fattened"], s["ground"], s["noise"],
        )  # fmt: skip


@given(st.integers(0, 2**31), st.sampled_from(["f4", "f8", "u2"]))
def test_the_surface_agrees_with_the_literal_twin(seed: int, kind: str) -> None:
    s = Scene(seed)
    unit = 1.0 if kind[0] == "f" else 0.001
    depth = s.depth.astype(kind) if unit == 1.0 else np.nan_to_num(1e3 * s.depth.clip(0.0, 60.0)).astype(kind)
    surface, counts, shift = s.find(depth=depth, unit=unit)
    moved = []
    for i in np.flatnonzero(s.used).tolist():
        corner = s.left, s.top
        pixels = literal_pixels(s.points, s.tangents, s.radius, i, s.mask, corner, depth.shape, s.displaced)
        metres = depth[pixels[:, 1], pixels[:, 0]] * unit
        offset = pixels - s.displaced - s.points[i]
        across = np.abs(offset[:, 1] * s.tangents[i, 0] - offset[:, 0] * s.tangents[i, 1])
        across = np.maximum(across - s.fattened, 0.0) / s.radius
        *expected, back = literal_surface(metres, across, SLIM, *LIMITS, s.ground[i], s.noise)
        np.testing.assert_allclose((surface[i], counts[i]), expected, atol=1e-9)
        moved.append(back)
    assert np.isnan(surface[~s.used]).all()
    assert not counts[~s.used].any()
    known = np.concatenate([*moved, np.zeros(0)])
    assert shift == pytest.approx(known.mean() if len(known) else 0.0)


@given(st.integers(0, 2**31))
def test_what_lies_off_the_mask_and_at_its_borders_does_not_matter(seed: int) -> None:
    s = Scene(seed)
    rows, columns = np.mgrid[: s.depth.shape[0], : s.depth.shape[1]]
    # A pixel is no farther than half a diagonal from where it was looked for.
    reach = max(min(0.6 * s.radius, s.radius - 1.0), 0.3 * s.radius) + 0.71
    beside = (rows - s.points[0, 1]) * s.tangents[0, 0] - (columns - s.points[0, 0]) * s.tangents[0, 1]
    on = np.zeros(s.depth.shape, bool)
    on[s.top :, s.left :] = s.mask == 1
    other = np.where(on & (np.abs(beside) <= reach), s.depth, 2.0)
    still = np.zeros(2)
    for ours, theirs in zip(s.find(displaced=still), s.find(displaced=still, depth=other), strict=True):
        np.testing.assert_array_equal(ours, theirs)


@given(st.integers(0, 2**31))
def test_a_transposed_image_gives_the_same_surface(seed: int) -> None:
    s = Scene(seed)
    surface, counts, shift = s.find()
    turned = s.find(
        points=s.points[:, ::-1], tangents=s.tangents[:, ::-1], mask=s.mask.T, depth=s.depth.T,
        left=s.top, top=s.left, displaced=s.displaced[::-1],
    )  # fmt: skip
    np.testing.assert_allclose(turned[0], surface, atol=1e-9)
    np.testing.assert_array_equal(turned[1], counts)
    assert turned[2] == pytest.approx(shift)


class TestDisplacement:
    @given(st.integers(0, 2**31), st.integers(-3, 3), st.integers(-3, 3))
    def test_depth_moved_by_whole_pixels_gives_the_same_surface(self, seed: int, dx: int, dy: int) -> None:
        s = Scene(seed)
        wide = {"points": s.points + 3.0, "left": s.left + 3, "top": s.top + 3}  # nothing gets out of the image
        depth = np.pad(s.depth, 3)
        expected = s.find(depth=depth, displaced=(0.0, 0.0), **wide)
        moved = s.find(depth=np.roll(depth, (dy, dx), axis=(0, 1)), displaced=(dx, dy), **wide)
        for ours, theirs in zip(moved, expected, strict=True):
            np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-9)

    def test_a_displaced_cable_is_round_about_its_middle_once_the_displacement_is_known(self) -> None:
        n, radius, dy = 9, 6.0, 1.7
        points, tangents = straight(0.0, n, 4.0, (40.0, 30.0))
        rows, columns = np.mgrid[:60, :80]
        mask = (np.abs(rows - 30.0) <= radius).astype(np.uint8)
        across = np.abs(rows - 30.0 - dy) / radius
        depth = 1.0 + SLIM * (1.0 - np.sqrt(1.0 - np.minimum(across, 1.0) ** 2)) + 0.0 * columns
        known, ignored = (
            find_surface(
                points, tangents, np.full(n, radius), np.ones(n, bool), mask, depth, 0, 0, 1.0, *LIMITS, radius / SLIM,
                0.0, used, 0.0, NO_GROUND, 1e-4,
            )[0]
            for used in (dy, 0.0)
        )  # fmt: skip
        np.testing.assert_allclose(known, 1.0, rtol=0, atol=1e-5)
        assert (np.abs(ignored - 1.0) > 5e-5).all()

    @pytest.mark.parametrize("fattened", [1.5, 2.0, 3.5])
    def test_a_fattened_cable_is_round_about_its_middle_once_that_is_known(self, fattened: float) -> None:
        n, radius = 9, 8.0
        points, tangents = straight(0.0, n, 4.0, (40.0, 30.0))
        rows, columns = np.mgrid[:60, :80]
        mask = (np.abs(rows - 30.0) <= radius).astype(np.uint8)
        across = np.maximum(np.abs(rows - 30.0) - fattened, 0.0) / radius
        depth = 1.0 + SLIM * (1.0 - np.sqrt(1.0 - np.minimum(across, 1.0) ** 2)) + 0.0 * columns
        known, ignored = (
            find_surface(
                points, tangents, np.full(n, radius), np.ones(n, bool), mask, depth, 0, 0, 1.0, *LIMITS, radius / SLIM,
                0.0, 0.0, used, NO_GROUND, 1e-4,
            )[0]
            for used in (fattened, 0.0)
        )  # fmt: skip
        np.testing.assert_allclose(known, 1.0, rtol=0, atol=1e-5)
        assert (ignored < 1.0 - 5e-5).all()

    def test_what_comes_to_lie_outside_of_the_image_is_left_out(self) -> None:
        n = 9
        points, tangents = straight(0.0, n, 4.0, (40.0, 2.0))
        mask, depth = np.ones((60, 80), np.uint8), np.ones((60, 80))
        sections = points, tangents, np.full(n, 3.5), np.ones(n, bool), mask, depth
        rest = 1.0, *LIMITS, 1e6, 0.0  # five pixels across, by three along
        counts = [find_surface(*sections, 0, 0, *rest, dy, 4.0, NO_GROUND, 1e-4)[1] for dy in (0.0, -1.0, -3.0, -9.0)]
        np.testing.assert_array_equal(counts, np.outer([15, 12, 6, 0], np.ones(n)))


class TestGround:
    """Sections of 15 pixels each on a level object at 1 m; its ground lies at 1.1 m."""

    N, RADIUS, GROUND = 30, 8.0, 1.1

    def find(self, shares: float, ground: float = GROUND, noise: float = 1e-3, height: float = 0.1) -> np.ndarray:
        """Return the surface where a share of the object's pixels show the ground."""
        rng = np.random.default_rng(0)
        points = np.stack((10.0 + 5.0 * np.arange(self.N), np.full(self.N, 15.0)), axis=1)
        depth = self.GROUND - height + rng.normal(0.0, 0.0005, (30, 170))
        depth[rng.random(depth.shape) < shares] += height
        surface, _, _ = find_surface(
            points, np.tile([1.0, 0.0], (self.N, 1)), np.full(self.N, self.RADIUS), np.ones(self.N, bool),
            np.ones(depth.shape, np.uint8), depth, 0, 0, 1.0, *LIMITS, 1e4 * self.RADIUS, 0.0, 0.0, 0.0,
            np.full(self.N, ground), noise,
        )  # fmt: skip
        return surface

    @pytest.mark.parametrize("share", [0.1, 0.3, 0.5])
    def test_pixels_of_the_ground_do_not_count_where_others_stand_out(self, share: float) -> None:
        np.testing.assert_allclose(self.find(share), 1.0, atol=0.001)

    def test_without_a_known_ground_the_most_crowded_depth_counts(self) -> None:
        assert (self.find(0.8, ground=np.nan) > 1.09).mean() > 0.8

    @pytest.mark.parametrize("ground", [1.1, np.nan])
    def test_where_next_to_nothing_stands_out_it_is_the_ground_that_is_seen(self, ground: float) -> None:
        # One or two of 15 pixels are rather noise than an object.
        surface = self.find(0.97, ground=ground)
        assert (surface > 1.09).all()

    def test_what_hardly_stands_out_from_the_noise_is_no_reason_to_strike_pixels(self) -> None:
        # Halfway to the ground would be within the noise of both.
        low = {"height": 0.01, "noise": 0.01}
        np.testing.assert_array_equal(self.find(0.5, **low), self.find(0.5, ground=np.nan, **low))
        assert not np.array_equal(self.find(0.5, height=0.01), self.find(0.5, ground=np.nan, height=0.01))

    @given(st.integers(0, 2**31))
    def test_an_unknown_ground_is_like_one_that_all_is_far_behind(self, seed: int) -> None:
        s = Scene(seed)
        for ours, theirs in zip(s.find(ground=NO_GROUND), s.find(ground=np.full(9, 0.2)), strict=True):
            np.testing.assert_array_equal(ours, theirs)


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
    for ground in (np.nan, 1.5):
        surface, _, _ = find_surface(
            points, tangents, np.full(sections, radius), np.ones(sections, bool), np.ones(size, np.uint8), depth,
            0, 0, 1.0, 0.0, 9.0, radius / SLIM, 0.0, 0.0, 0.0, np.full(sections, ground), 0.002,
        )  # fmt: skip
        assert np.median(surface) == pytest.approx(1.0, abs=0.0005)


@pytest.mark.parametrize("slim", [1.0, 3.0, 30.0, 1e6])
def test_an_object_wider_than_it_is_far_has_no_surface_behind_the_camera(slim: float) -> None:
    points, tangents = straight(0.0, 9, 2.0, (60.0, 60.0))
    depth, mask, used = np.full((95, 100), 0.7), np.ones((70, 80), np.uint8), np.ones(9, bool)
    surface, counts, _ = find_surface(
        points, tangents, np.full(9, 6.0), used, mask, depth, 20, 25, 1.0, *LIMITS, 6.0 / slim, 0.0, 0.0, 0.0,
        np.full(9, 0.8), 1e-3,
    )  # fmt: skip
    assert np.isfinite(surface).sum() == (counts > 0).sum()
    assert (surface[np.isfinite(surface)] > 0.0).all()
