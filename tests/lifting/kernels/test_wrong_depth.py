"""Depth along an object that is not the object's: steps that strike it off, against slow twins."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.lifting.kernels.wrong_depth import strike_ground, strike_steps

N = 60
SLIM = np.full(N, 0.01)  # radius over focal length
SPACING = 0.012
MAX = 10
NOISE = 0.0005  # 1 / m


def slope(seed: int, steepness: float, noise: float = NOISE) -> np.ndarray:
    """Return the depth of a cable that is nearly straight, about 1 m away."""
    rng = np.random.default_rng(seed)
    t = np.linspace(0.0, 1.0, N)
    return 1.0 + steepness * t + 0.02 * np.sin(9.0 * t) + rng.normal(0.0, noise, N)


def bend(steepest: float, over: float, at: int = 30, noise: float = NOISE, seed: int = 0) -> np.ndarray:
    """Return the depth of a cable that is level, and from a section on comes nearer, by so much of the way beside."""
    rates = steepest * SPACING * np.clip((np.arange(N - 1) - at) / over, 0.0, 1.0)
    depth = np.concatenate(([1.0], np.cumprod(1.0 - rates)))
    return depth * (1.0 + np.random.default_rng(seed).normal(0.0, noise, N))


def struck(
    depth: np.ndarray, most: int = MAX, slim: np.ndarray = SLIM, spacing: float = SPACING, most_at_end: int = N
) -> list[int]:
    """Return which of the known sections are struck by steps; the others stay as they are."""
    left = depth.copy()
    known = strike_steps(left, slim, spacing, most, most_at_end)
    kept = ~np.isnan(left)
    assert known == kept.sum()
    np.testing.assert_array_equal(left[kept], depth[kept])
    return np.flatnonzero(np.isnan(left) & ~np.isnan(depth)).tolist()


def grounded(
    depth: np.ndarray,
    ground: np.ndarray | float,
    slim: np.ndarray = SLIM,
    noise: float = NOISE,
    spacing: float = SPACING,
) -> list[int]:
    """Return which of the known sections are struck as the ground; the others stay as they are."""
    left = depth.copy()
    assert strike_ground(left, np.broadcast_to(ground, N), slim, noise, spacing) is None
    kept = ~np.isnan(left)
    np.testing.assert_array_equal(left[kept], depth[kept])
    return np.flatnonzero(np.isnan(left) & ~np.isnan(depth)).tolist()


def literal_excess(change: float, before: np.ndarray, after: np.ndarray, gap: int) -> float:
    """Return the change of depth over a gap beyond the usual ones before and after it."""
    sides = [np.median(side) * gap for side in (before, after) if len(side)] or [0.0]
    return float(change - np.clip(change, min(sides), max(sides)))


def literal_steps(surface: np.ndarray, slim: np.ndarray, spacing: float, most: int, most_at_end: int) -> list[int]:
    """Return which sections go."""
    own = np.flatnonzero(~np.isnan(surface))
    z = surface[own]
    if len(own) < 10:
        return []
    gap = np.diff(own)
    rate = np.diff(z) / gap
    nearer = np.minimum(z[:-1], z[1:])
    size, unusual = np.zeros(len(rate)), np.zeros(len(rate))
    for k in range(len(rate)):
        before, after = rate[max(k - 4, 0) : k], rate[k + 1 : k + 5]
        size[k] = literal_excess(rate[k] * gap[k], before, after, gap[k])
        unusual[k] = abs(rate[k] - np.mean([np.median(side) for side in (before, after) if len(side)])) * gap[k]
    limit = np.maximum(slim[own[:-1]] * nearer, 6.0 * np.median(unusual) / 0.6745)
    steep = np.abs(rate) > 3.0 * spacing * nearer
    first = [0, *(np.flatnonzero(np.abs(size) > limit) + 1).tolist(), len(own)]
    pieces = list(pairwise(first))

    def go_on(i: int, j: int) -> bool:
        (low, last), (start, stop) = pieces[i], pieces[j]
        before, after = rate[max(last - 5, low) : last - 1], rate[start : min(start + 4, stop - 1)]
        off = abs(literal_excess(z[start] - z[last - 1], before, after, own[start] - own[last - 1]))
        return start - last <= most and off <= max(limit[start - 1], 0.5 * abs(size[[last - 1, start - 1]]).min())

    chains: list[tuple[float, list[int]]] = []
    for j, (start, stop) in enumerate(pieces):
        ways: list[tuple[float, list[int]]] = []
        if j == 0 or (steep[start - 1] and own[start] <= most_at_end):
            ways.append((0.0, []))
        if j > 0:
            ways.append((chains[j - 1][0] - 0.5 * most, chains[j - 1][1]))
        ways += [chains[i] for i in range(j - 2, -1, -1) if go_on(i, j)]
        worth, chain = max(enumerate(ways), key=lambda way: (way[1][0], way[0]))[1]
        chains.append((worth + stop - start, [*chain, j]))
    last = len(surface) - 1
    ends = [j for j, (_, k) in enumerate(pieces[:-1]) if steep[k - 1] and last - own[k - 1] <= most_at_end]
    _, best = max((chains[j] for j in (len(pieces) - 1, *ends)), key=lambda chain: chain[0])
    return [k for j, (start, stop) in enumerate(pieces) if j not in best for k in own[start:stop].tolist()]


def literal_ground(
    surface: np.ndarray, ground: np.ndarray, slim: np.ndarray, noise: float, spacing: float
) -> list[int]:
    """Return which sections go."""
    own = np.flatnonzero(~np.isnan(surface))
    z = surface[own]
    like = ground[own] - z < np.maximum(slim[own] * z, 3.0 * noise * z**2)
    gone = set()
    for turned in (False, True):
        at, depth, low = (own[::-1], z[::-1], like[::-1]) if turned else (own, z, like)
        for k in range(1, len(at)):
            if low[k] and not low[k - 1]:
                way = spacing * abs(at[k] - at[k - 1]) * min(depth[k], depth[k - 1])
                if abs(depth[k] - depth[k - 1]) > max(3.0 * way, 6.0 * noise * depth[k] ** 2):
                    after = np.flatnonzero(~low[k:])
                    gone.update(at[k : k + after[0] if len(after) else None].tolist())
    return sorted(gone)


def rough(seed: int) -> tuple[np.ndarray, np.random.Generator]:
    """Return depth along a cable with everything that may be wrong with it."""
    rng = np.random.default_rng(seed)
    depth = slope(seed, rng.uniform(-0.8, 0.8), rng.choice([0.0, 1e-4, 2e-3]))
    for _ in range(int(rng.integers(0, 4))):
        start = int(rng.integers(-3, N - 1))
        depth[max(start, 0) : start + int(rng.integers(1, 14))] += rng.uniform(-0.15, 0.15)
    depth[rng.random(N) < rng.choice([0.0, 0.2, 0.9])] = np.nan
    return depth, rng


@given(st.integers(0, 2**31))
def test_steps_agree_with_the_literal_twin(seed: int) -> None:
    depth, rng = rough(seed)
    depth *= rng.uniform(0.4, 1.6)
    slim, spacing, most = rng.uniform(0.005, 0.02, N), rng.uniform(0.003, 0.03), int(rng.integers(1, 13))
    most_at_end = int(rng.integers(0, 20))
    expected = literal_steps(depth, slim, spacing, most, most_at_end)
    assert struck(depth, most, slim, spacing, most_at_end) == expected


@given(st.integers(0, 2**31))
def test_ground_agrees_with_the_literal_twin(seed: int) -> None:
    depth, rng = rough(seed)
    ground = 1.0 + rng.uniform(-0.8, 0.8) * np.linspace(0.0, 1.0, N) + rng.uniform(0.0, 0.1)
    low = rng.random(N) < rng.choice([0.0, 0.1, 0.5])
    depth[low] = np.where(np.isnan(depth[low]), np.nan, ground[low])
    ground[rng.random(N) < 0.1] = np.nan
    scale = rng.uniform(0.4, 1.6)
    depth, ground = scale * depth, scale * ground
    slim, noise, spacing = rng.uniform(0.005, 0.02, N), rng.choice([1e-4, 4e-3]), rng.uniform(0.003, 0.03)
    assert grounded(depth, ground, slim, noise, spacing) == literal_ground(depth, ground, slim, noise, spacing)


class TestSteps:
    @given(st.integers(0, 2**31), st.floats(-0.8, 0.8), st.integers(5, 40), st.integers(1, 10), st.booleans())
    def test_a_stretch_between_two_steps_goes(self, seed: int, steep: float, start: int, n: int, nearer: bool) -> None:
        depth = slope(seed, steep)
        depth[start : start + n] += -0.06 if nearer else 0.06
        assert struck(depth) == list(range(start, start + n))

    @given(st.integers(0, 2**31), st.integers(10, 40), st.booleans())
    def test_so_it_does_with_a_hole_beside_it(self, seed: int, start: int, before: bool) -> None:
        depth = slope(seed, 0.2)
        depth[start : start + 6] -= 0.08
        depth[start - 4 : start if before else start - 4] = np.nan
        depth[start + 6 : start + (6 if before else 10)] = np.nan
        assert struck(depth) == list(range(start, start + 6))

    @given(st.integers(0, 2**31), st.floats(-0.8, 0.8))
    def test_what_is_only_steep_stays(self, seed: int, steep: float) -> None:
        depth = slope(seed, steep)
        depth[20:24] = np.nan
        assert struck(depth) == []

    @pytest.mark.parametrize("over", [0.01, 1.0, 2.0, 4.0, 8.0])
    @pytest.mark.parametrize("noise", [0.0, 1e-4, 1e-3])
    def test_a_cable_that_bends_steeply_towards_the_camera_stays(self, over: float, noise: float) -> None:
        for seed in range(20):
            depth = bend(2.5, over, 5 + 2 * seed, noise, seed)
            assert struck(depth) == []
            assert struck(depth[::-1]) == []

    @pytest.mark.parametrize("hole", [3, 6, 10])
    def test_a_steep_slope_across_a_hole_is_no_step(self, hole: int) -> None:
        for start in range(22, 40):
            depth = bend(2.5, 3.0)
            depth[start : start + hole] = np.nan
            assert struck(depth) == []
            assert struck(depth[::-1]) == []

    def test_a_long_stretch_stays(self) -> None:
        depth = slope(0, 0.1)
        depth[20:31] -= 0.05
        assert struck(depth, most=11) == list(range(20, 31))
        assert struck(depth, most=10) == []

    @pytest.mark.parametrize("off", [-0.06, 0.06])
    def test_a_step_on_stays_if_none_leads_back(self, off: float) -> None:
        depth = slope(0, 0.1)
        depth[30:] += off
        depth[34:] += off
        assert struck(depth) == []

    def test_between_two_wrong_stretches_what_goes_on_beyond_them_stays(self) -> None:
        # Whichever two steps are taken for a pair.
        depth = slope(0, 0.1)
        for start in (20, 24, 29, 33):
            depth[start : start + 2] += 0.05
        wrong = [20, 21, 24, 25, 29, 30, 33, 34]
        assert struck(depth) == wrong
        assert sorted(N - 1 - k for k in struck(depth[::-1])) == wrong

    def test_it_goes_on_if_it_comes_back_by_half_of_the_step(self) -> None:
        for back, gone in ((0.045, True), (0.03, False)):
            depth = slope(0, 0.1, 1e-5)
            depth[20:24] += 0.06
            depth[24:] += 0.06 - back
            assert (struck(depth) == [20, 21, 22, 23]) == gone

    def test_what_is_no_farther_off_than_a_radius_stays(self) -> None:
        depth = slope(0, 0.1, 1e-4)
        depth[20:24] -= 0.009
        assert struck(depth) == []
        assert struck(depth, slim=0.5 * SLIM) == [20, 21, 22, 23]

    def test_what_noise_does_stays(self) -> None:
        depth = slope(0, 0.1, 0.01)
        depth[20:24] -= 0.05
        assert struck(depth, slim=0.1 * SLIM) == []

    @pytest.mark.parametrize("n", [1, 3, 4])
    @pytest.mark.parametrize("off", [-0.08, 0.08])
    def test_a_few_sections_beyond_a_steep_step_at_an_end_go(self, n: int, off: float) -> None:
        depth = slope(0, 0.1)
        depth[:n] += off
        assert struck(depth) == list(range(n))
        assert struck(depth[::-1]) == list(range(N - n, N))

    @pytest.mark.parametrize("n", [5, 8])
    def test_half_as_many_as_a_stretch_may_have_stay(self, n: int) -> None:
        depth = slope(0, 0.1)
        depth[:n] += 0.08
        assert struck(depth) == []
        assert struck(depth[::-1]) == []

    def test_no_more_go_than_may_be_missing_at_an_end(self) -> None:
        depth = slope(0, 0.1)
        depth[2:5] += 0.08
        depth[:2] = np.nan
        for way in (1, -1):
            assert struck(depth[::way], most_at_end=4) == []
            assert len(struck(depth[::way], most_at_end=5)) == 3

    def test_beyond_a_step_that_is_no_steeper_than_a_cable_they_stay(self) -> None:
        depth = slope(0, 0.0, 1e-4)
        depth[:2] += 0.03  # more than a radius, but 2.5 times the way beside
        assert struck(depth) == []
        assert struck(depth[::-1]) == []

    def test_both_ends_and_a_stretch_between_go_together(self) -> None:
        depth = slope(0, 0.1)
        depth[:2] += 0.08
        depth[20:26] -= 0.08
        depth[57:] -= 0.08
        assert struck(depth) == [0, 1, *range(20, 26), 57, 58, 59]

    @pytest.mark.parametrize("seed", range(3))
    def test_the_other_way_round_the_same_goes(self, seed: int) -> None:
        depth = slope(seed, 0.3)
        depth[:3] -= 0.1
        depth[12:20] += 0.06
        depth[25:45] -= 0.08  # is too long
        assert struck(depth) == [0, 1, 2, *range(12, 20)]
        assert sorted(N - 1 - k for k in struck(depth[::-1])) == struck(depth)

    def test_so_it_does_where_a_stretch_begins_just_after_an_end(self) -> None:
        depth = slope(0, 0.1)
        depth[2:7] += 0.06
        assert sorted(N - 1 - k for k in struck(depth[::-1])) == struck(depth)

    @pytest.mark.parametrize("n", [0, 1, 5, 9])
    def test_a_handful_of_sections_stays(self, n: int) -> None:
        depth = np.full(N, np.nan)
        depth[:n] = np.linspace(1.0, 2.0, n)
        depth[3:4] -= 0.5 * (n > 3)
        assert struck(depth) == []


class TestGround:
    LEVEL = 1.1  # of the ground; the cable is 1 m away

    def cable(self, seed: int = 0) -> np.ndarray:
        return 1.0 + np.random.default_rng(seed).normal(0.0, NOISE, N)

    @given(st.integers(0, 2**31), st.integers(1, 50), st.integers(1, 40))
    def test_ground_that_a_step_leads_to_goes(self, seed: int, start: int, n: int) -> None:
        depth = self.cable(seed)
        depth[start : start + n] += 0.1
        assert grounded(depth, self.LEVEL) == list(range(start, min(start + n, N)))

    def test_so_it_does_beyond_a_hole_and_at_both_ends(self) -> None:
        depth = self.cable()
        depth[:6] += 0.1
        depth[40:] += 0.1
        depth[6] = depth[39] = np.nan
        assert grounded(depth, self.LEVEL) == [*range(6), *range(40, N)]

    @pytest.mark.parametrize("steep", [0.3, 1.0, 2.5])
    @pytest.mark.parametrize("seed", range(5))
    def test_a_cable_that_comes_down_to_the_ground_bit_by_bit_stays(self, steep: float, seed: int) -> None:
        down = 1.0 + steep * SPACING * np.clip(np.arange(N) - 20.0, 0.0, None)
        depth = np.minimum(down, self.LEVEL - 0.008) + np.random.default_rng(seed).normal(0.0, NOISE, N)
        assert (depth > self.LEVEL - 0.01).any()
        assert grounded(depth, self.LEVEL) == []
        assert grounded(depth[::-1], self.LEVEL) == []

    @pytest.mark.parametrize("steep", [0.3, 1.0, 2.5])
    @pytest.mark.parametrize("hole", [1, 4, 6])
    def test_its_slope_leads_on_across_a_hole(self, steep: float, hole: int) -> None:
        height = np.clip(steep * SPACING * (40.0 - np.arange(N)), 0.0, 0.5)
        depth = self.LEVEL - 0.008 - height
        depth[40 - hole : 40] = np.nan
        assert grounded(depth, self.LEVEL) == []
        assert grounded(depth[::-1], self.LEVEL) == []

    @given(st.integers(0, 2**31), st.floats(0.0, 0.009))
    def test_what_nowhere_stands_out_lies_on_the_ground_and_stays(self, seed: int, height: float) -> None:
        rng = np.random.default_rng(seed)
        depth = np.full(N, self.LEVEL - height)
        depth[rng.random(N) < 0.3] = self.LEVEL
        depth[rng.random(N) < 0.3] = np.nan
        assert grounded(depth, self.LEVEL) == []

    def test_what_stands_out_stays_however_it_steps(self) -> None:
        depth = self.cable()
        depth[20:30] += 0.05
        depth[40:44] -= 0.3
        assert grounded(depth, self.LEVEL) == []

    @given(st.integers(0, 2**31))
    def test_an_unknown_ground_changes_nothing(self, seed: int) -> None:
        assert grounded(rough(seed)[0], np.nan) == []

    def test_only_where_the_ground_is_known_anything_goes(self) -> None:
        depth = self.cable()
        depth[10:20] += 0.1
        depth[40:50] += 0.1
        ground = np.where(np.arange(N) < 30, self.LEVEL, np.nan)
        assert grounded(depth, ground) == list(range(10, 20))

    def test_a_stretch_that_a_step_leads_to_at_one_side_goes_as_a_whole(self) -> None:
        down = 1.0 + 1.0 * SPACING * np.clip(np.arange(N) - 10.0, 0.0, None)
        depth = np.minimum(down, self.LEVEL)
        depth[40:] = 1.0
        like = np.flatnonzero(np.abs(self.LEVEL - depth) < 0.01 * depth).tolist()
        assert grounded(depth, self.LEVEL) == like == list(range(like[0], 40))

    def test_the_noisier_depth_is_the_farther_off_it_may_be_the_ground(self) -> None:
        depth = self.cable()
        depth[20:30] = self.LEVEL - 0.05
        assert grounded(depth, self.LEVEL, noise=0.002) == []
        assert grounded(depth, self.LEVEL, noise=0.015) == []  # the ground's for all that is known, but no step
        depth[20:30] = self.LEVEL - 0.02
        assert grounded(depth, self.LEVEL, noise=0.002) == []
        assert grounded(depth, self.LEVEL, noise=0.008) == list(range(20, 30))

    @given(st.integers(0, 2**31))
    def test_the_other_way_round_the_same_goes(self, seed: int) -> None:
        depth, _ = rough(seed)
        ground = np.linspace(1.0, 1.1, N)
        turned = grounded(depth[::-1], ground[::-1])
        assert sorted(N - 1 - k for k in turned) == grounded(depth, ground)

    @pytest.mark.parametrize("known", [0, 1, 2])
    def test_a_few_sections_are_enough_and_none_is_too(self, known: int) -> None:
        depth = np.full(N, np.nan)
        depth[[10, 11][:known]] = [1.0, self.LEVEL][:known]
        assert grounded(depth, self.LEVEL) == ([11] if known == 2 else [])
