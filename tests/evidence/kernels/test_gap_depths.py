"""Depth before and between ends, against slow twins."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np
import pytest
from gap_scenes import is_clear
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.evidence.kernels.gap_depths import _metres_of, _spread, describe_depths, measure_swerves, sample_depths
from dloftbs.evidence.kernels.gap_pixels import lay_ways
from dloftbs.linking.kernels.evidence_weights import DEPTHS

SIZE = (80, 120)
UNIT, LOW, HIGH = 0.001, 0.1, 3.0
NOISE, SAG = 0.012, 0.05
FOCAL = 900.0

seeds = st.integers(0, 2**31)


class Scene:
    """Two straight cables across a table, cut by a stripe where something may lie over them, and holes in the depth."""

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng(seed)
        y, x = np.mgrid[: SIZE[0], : SIZE[1]]
        self.width = float(rng.uniform(2.0, 12.0))
        left, right = np.sort(rng.uniform(40.0, 90.0, 2))
        depth = rng.uniform(400.0, 900.0) + rng.uniform(-1.0, 1.0) * x
        self.mask = np.zeros(SIZE, dtype=np.uint8)
        runs = []
        for _ in range(2):
            row, slope = rng.uniform(15.0, 65.0), rng.uniform(-0.2, 0.2)
            cable = np.abs(y - row - slope * x) <= 0.5 * self.width
            depth[cable] -= rng.uniform(2.0, 40.0)
            self.mask |= (cable & ((x < left) | (x > right))).astype(np.uint8)
            points = np.stack((np.arange(SIZE[1], dtype=np.float64), row + slope * np.arange(SIZE[1])), axis=1)
            runs += [points[points[:, 0] < left], points[points[:, 0] > right]]
        depth[:, int(left) : int(rng.uniform(left, right)) + 1] += rng.choice([-200.0, -5.0, 0.0, 30.0])
        depth += rng.normal(0.0, rng.choice([0.0, 2.0]), SIZE)
        depth[rng.random(SIZE) < rng.choice([0.0, 0.3, 1.0], p=[0.5, 0.4, 0.1])] = 0.0
        self.depth = depth.astype(np.float32)
        self.points = np.concatenate(runs)
        bounds = np.cumsum([0, *map(len, runs)])
        self.spans = np.column_stack((bounds[:-1], bounds[1:]))
        self.free = rng.random(8) < 0.5
        tips = self.points[[bounds[e // 2] if e % 2 == 0 else bounds[e // 2 + 1] - 1 for e in range(8)]]
        angle = rng.uniform(-np.pi, np.pi, 8)
        self.states = np.column_stack((tips, np.cos(angle), np.sin(angle)))
        self.pairs = np.array([(1, 2), (5, 6), tuple(rng.integers(0, 8, 2))])

    def known(self) -> np.ndarray:
        asked = self.depth, UNIT, LOW, HIGH, self.mask
        return sample_depths(*asked, self.points, self.spans, self.free, self.width)

    def nine(self, x: float, y: float, reach: float) -> list[tuple[int, int]]:
        rows, columns = (
            np.clip(np.rint(v + reach * np.array([-1, 0, 1])), 0, most - 1).astype(int)
            for v, most in zip((y, x), SIZE, strict=True)
        )
        return [(row, column) for row in rows for column in columns]

    def metres(self, x: float, y: float) -> float | None:
        """Return the median depth of nine pixels, None if fewer than five have any."""
        around = self.nine(x, y, max(0.2 * self.width, 1.0))
        found = sorted(m for m in (float(self.depth[at]) * UNIT for at in around) if LOW <= m <= HIGH)
        return found[(len(found) - 1) // 2] if len(found) >= 5 else None

    def describe(self, depth: np.ndarray, known: np.ndarray, covered: np.ndarray, focal: float = FOCAL) -> np.ndarray:
        """Return what depth shows along the ways."""
        ways, steps = lay_ways(self.states, self.pairs, self.width)
        asked = depth, UNIT, LOW, HIGH, self.mask
        return describe_depths(*asked, known, self.pairs, ways, steps, self.lengths(), focal, self.width, covered)

    def lengths(self) -> np.ndarray:
        return np.hypot(*(self.states[self.pairs[:, 0], :2] - self.states[self.pairs[:, 1], :2]).T)

    def ground(self, x: float, y: float) -> float | None:
        return None if any(self.mask[at] for at in self.nine(x, y, 4.0)) else self.metres(x, y)


def literal_known(scene: Scene, end: int, beyond: float) -> tuple[float, float, float, float, float]:
    """Return depth at an end, height over the ground, slope outwards, scatter, and the line's spread beyond the end."""
    start, stop = scene.spans[end // 2]
    run = scene.points[start:stop] if end % 2 == 0 else scene.points[start:stop][::-1]
    last = int(min(8.0 * scene.width, len(run) - 1))
    line, heights = [], []
    for k in range(7):
        i = int((2.0 * scene.width if scene.free[end] else 4.0) + k * scene.width)
        if i >= last:
            break
        metres = scene.metres(*run[i])
        if metres is None:
            continue
        line.append((i, metres))
        way = run[min(i + max(int(scene.width), 2), last)] - run[i]
        way /= np.hypot(*way)
        for side in (-1.0, 1.0):
            ground = scene.ground(*(run[i] + side * (scene.width + 4.0) * np.array([-way[1], way[0]])))
            if ground is not None:
                heights.append(ground - metres)
    if not line:
        return np.nan, np.nan, np.nan, np.nan, np.nan
    slopes = sorted((b - a) / (j - i) for n, (i, a) in enumerate(line) for j, b in line[n + 1 :]) or [0.0]
    slope = slopes[(len(slopes) - 1) // 2]
    offsets = sorted(metres - slope * i for i, metres in line)
    heights.sort()
    places = np.array([i for i, _ in line], dtype=float)
    spread = np.nan
    if len(line) > 1:  # the hat matrix of a line of least squares
        columns, there = np.stack((np.ones(len(line)), places), axis=1), np.array([1.0, -beyond])
        spread = np.sqrt(there @ np.linalg.inv(columns.T @ columns) @ there)
    height = heights[(len(heights) - 1) // 2] if heights else np.nan
    level = offsets[(len(offsets) - 1) // 2]
    misses = sorted(abs(offset - level) for offset in offsets)
    scatter = misses[(len(misses) - 1) // 2] / 0.6745
    return level, height, -slope if len(line) > 1 else np.nan, scatter, spread


def literal_description(scene: Scene, known: np.ndarray, p: int, covered: np.ndarray, focal: float) -> list[float]:
    """Return the columns of a way between ends: the share that is rather ground, and how much rather."""
    pair, length = scene.pairs[p], scene.lengths()[p]
    ways, steps = lay_ways(scene.states, scene.pairs, scene.width)
    (one, first), (other, second) = known[pair, :2]
    heights = [height for height in (first, second) if not np.isnan(height)]
    stands, height = bool(heights), max(float(np.mean(heights)), 0.0) if heights else 0.0
    one, other = (other if np.isnan(one) else one), (one if np.isnan(other) else other)
    places, ratios = 0, []
    for k in range(1, steps[p]):
        x, y, dx, dy = ways[p, k]
        if not is_clear(scene.mask, scene.width, x, y):
            continue
        places += 1
        found, expected = scene.metres(x, y), np.maximum(one + (other - one) * k / steps[p], LOW)
        if covered[p, k] or found is None or np.isnan(expected):
            continue
        noise = cauchy(NOISE / 3.0 * expected**2)
        sagging = cauchy(np.hypot(NOISE / 3.0 * expected**2, SAG * length * expected / focal))
        ratio = sagging(min(found - expected - height, 0.0)) - sagging(max(found - expected, 0.0))
        aside = scene.width + 4.0
        sides = [scene.ground(x - side * aside * dy, y + side * aside * dx) for side in (1, -1)]
        grounds = [side for side in sides if side is not None]
        if stands and grounds and np.mean(grounds) > expected:
            stood = np.mean(grounds) - found
            ratio += noise(max(stood, 0.0)) - noise(min(stood - height, 0.0))
        ratios.append(ratio)
    if not ratios:
        return [0.0, 0.0]
    pairs = [0.5 * (a + b) for a, b in itertools.pairwise(ratios)]
    most = max(pairs) if pairs else ratios[0]
    more = [max(2.0 / (1.0 + np.exp(-ratio)) - 1.0, 0.0) for ratio in ratios]
    return [sum(more) / places, most * len(ratios) / places]


def cauchy(scale: float) -> Callable[[float], float]:
    """Return the logarithm of Cauchy's density."""
    return lambda x: float(-np.log(np.pi * scale * (1.0 + (x / scale) ** 2)))


@given(seeds)
def test_depths_at_ends_are_those_of_the_literal_twin(seed: int) -> None:
    scene = Scene(seed)
    known, beyond = scene.known(), float(np.random.default_rng(seed).uniform(0.0, 30.0))
    found = np.column_stack((known[:, [0, 1, 2, 4]], [_spread(row, beyond) for row in known]))
    np.testing.assert_allclose(found, [literal_known(scene, end, beyond) for end in range(8)], rtol=1e-9, atol=1e-12)


@given(seeds)
def test_the_description_of_ways_is_that_of_the_literal_twin(seed: int) -> None:
    scene, rng = Scene(seed), np.random.default_rng(seed)
    covered = (rng.random((len(scene.pairs), 25)) < rng.choice([0.0, 0.3])).astype(np.uint8)
    known, focal = scene.known(), rng.choice([FOCAL, np.inf])
    expected = [literal_description(scene, known, p, covered, focal) for p in range(len(scene.pairs))]
    np.testing.assert_allclose(scene.describe(scene.depth, known, covered, focal), expected, rtol=1e-9, atol=1e-12)


def across_a_gap(between: str, noise: float = 0.0, height: float = 0.04) -> np.ndarray:
    """Return the log-odds that a gap is hidden, in both directions, with a table of .7 m and a cable above it, m."""
    scene = Scene(0)
    y, x = np.mgrid[: SIZE[0], : SIZE[1]]
    cable, gap, scene.width = np.abs(y - 40) <= 4, (x > 45) & (x < 75), 8.0
    scene.mask = (cable & ~gap).astype(np.uint8)
    shown = {"table": ~cable | gap, "cable": ~cable, "cover": ~cable & ~gap}[between]
    depth = np.where(shown, 0.7, 0.7 - height)
    depth[gap & (between == "cover")] = 0.5
    scene.depth = (1000.0 * (depth + np.random.default_rng(0).normal(0.0, noise, SIZE))).astype(np.float32)
    scene.points = np.column_stack((np.concatenate((np.arange(46.0), np.arange(75.0, 120.0))), np.full(91, 40.0)))
    scene.spans, scene.free = np.array([(0, 46), (46, 91)]), np.ones(4, dtype=np.bool_)
    scene.states = np.array([(0, 40, -1, 0), (45, 40, 1, 0), (75, 40, -1, 0), (119, 40, 1, 0)], dtype=float)
    scene.pairs = np.array([(1, 2), (2, 1)])
    return scene.describe(scene.depth, scene.known(), np.zeros((2, 25), np.uint8)) @ DEPTHS


def test_the_table_in_a_gap_is_ground_and_a_cable_or_a_cover_is_none() -> None:
    for between, is_hidden in (("table", False), ("cable", True), ("cover", True)):
        one, other = across_a_gap(between)
        assert one == pytest.approx(other), "it is the same from either end"
        assert one > 0.0 if is_hidden else one < -2.0, between


def test_noise_is_no_ground() -> None:
    """A cable that does not stand out from its table looks the same as that."""
    assert (np.abs(across_a_gap("table", noise=0.002, height=0.0)) < 1.2).all()


def test_one_end_alone_may_show_the_ground_or_the_cable() -> None:
    scene = Scene(3)
    known = scene.known()
    known[:, 0], known[:, 1] = 0.6, 0.03
    covered = np.zeros((len(scene.pairs), 25), np.uint8)
    both = scene.describe(scene.depth, known, covered)
    known[scene.pairs[:2, 1], :2] = np.nan
    np.testing.assert_array_equal(scene.describe(scene.depth, known, covered)[:2], both[:2])


@pytest.mark.parametrize("depths", [(0.0, 0.0), (-0.1, 0.1)])
def test_lines_that_lead_behind_the_camera_are_no_error(depths: tuple[float, float]) -> None:
    scene = Scene(3)
    known = scene.known()
    known[scene.pairs[:, 0], 0], known[scene.pairs[:, 1], 0] = depths
    assert np.isfinite(scene.describe(scene.depth, known, np.zeros((len(scene.pairs), 25), np.uint8))).all()


@given(seeds)
def test_swerves_are_those_of_the_literal_twin(seed: int) -> None:
    rng = np.random.default_rng(seed)
    depths, heights = 0.7 + rng.normal(0.0, 0.02, 12), rng.choice([0.001, 0.003, 0.008, 0.1, np.nan], 12)
    scatter, slopes = rng.choice([0.0, 0.001, 0.01], 12), rng.normal(0.0, rng.choice([3e-4, 0.01]), 12)
    columns = depths, heights, slopes, rng.uniform(0.4, 0.7, 12), scatter, rng.uniform(5.0, 30.0, 12)
    known = np.column_stack((*columns, rng.uniform(0.01, 0.05, 12)))
    known[rng.integers(12), 2], known[rng.integers(12), 0] = np.nan, -0.1
    known[rng.integers(12)] = np.nan
    pairs, lengths = rng.integers(0, 12, (20, 2)), rng.uniform(0.0, 60.0, 20)
    focal, width = 900.0, 10.0
    expected = []
    for (i, j), length in zip(pairs, np.maximum(lengths, width), strict=True):
        (z, height, slope, *_), (other_z, other_height, other_slope, *_) = known[[i, j]]
        spread, other_spread = (np.hypot(known[e, 3], known[e, 6] * (known[e, 5] + 0.5 * length)) for e in (i, j))
        uneven = max(known[i, 4], known[j, 4])
        deviation = NOISE / 3.0 * (0.5 * (z + other_z)) ** 2
        # The line beyond one end meets that beyond the other half-way, but for this.
        jump = (other_z + 0.5 * length * other_slope) - (z + 0.5 * length * slope)
        excess = max(abs(jump) - deviation * np.hypot(spread, other_spread), 0.0)
        per_px = 0.5 * (z + other_z) / focal
        is_ground = any(h < max(2.0 * deviation, 0.5 * width * per_px) for h in (height, other_height))
        told = np.isfinite(jump) and min(z, other_z) > 0.0 and not is_ground and uneven <= deviation
        rise = 0.5 * (slope - other_slope) * length
        steep, even = (np.arctan2(z_there, length * per_px) for z_there in (rise + np.copysign(excess, jump), rise))
        expected.append(np.log(1.0 + ((steep - even) / 0.15) ** 2) if told else 0.0)
    np.testing.assert_allclose(measure_swerves(known, pairs, lengths, focal, width), expected, atol=1e-12)


@pytest.mark.parametrize(
    ("heights", "uneven", "tells"), [((0.1, 0.1), 0.0, True), ((0.1, 0.003), 0.0, False), ((0.1, 0.1), 0.02, False)]
)
def test_an_end_that_shows_the_ground_or_now_this_and_now_that_tells_no_swerve(
    heights: tuple[float, float], uneven: float, tells: bool
) -> None:
    known = np.array([[0.7, heights[0], 0.0, 0.6, 0.0, 20.0, 0.02], [0.75, heights[1], 0.0, 0.6, uneven, 20.0, 0.02]])
    (swerve,) = measure_swerves(known, np.array([[0, 1]]), np.array([20.0]), 900.0, 10.0)
    assert swerve > 2.0 if tells else swerve == 0.0


def test_a_steep_cable_swerves_by_the_angle_between_its_ways() -> None:
    """It leads away from the camera at 70 degrees, and at 80 across the gap; a level one would step by as much."""
    focal, width, length = 900.0, 10.0, 20.0
    slope, way = (np.tan(np.radians(angle)) / focal for angle in (70.0, 80.0))  # m per px, at a depth of 1 m
    steep, level = np.zeros((2, 2, 7))
    steep[:, 0], level[:, 0] = (1.0 + 0.5 * step * length * np.array([-1.0, 1.0]) for step in (way, way - slope))
    steep[:, 1], level[:, 1], steep[:, 2] = 0.5, 0.5, (slope, -slope)
    pair, lengths = np.array([[0, 1]]), np.array([length])
    (of_steep,), (of_level,) = (measure_swerves(ends, pair, lengths, focal, width) for ends in (steep, level))
    assert of_steep == pytest.approx(np.log1p((np.radians(10.0) / 0.15) ** 2))
    assert of_level > 4.0 * of_steep


def test_a_short_branch_says_little_of_a_long_way() -> None:
    """Two places a width apart show a slope that noise alone may have."""
    focal, width, pair = 900.0, 10.0, np.array([[0, 1]])
    ends = np.array([[1.0, 0.5, 0.0, 0.7, 0.0, 9.0, 0.14], [1.04, 0.5, 0.0, 0.7, 0.0, 9.0, 0.14]])
    assert measure_swerves(ends, pair, np.array([10.0]), focal, width)[0] > 1.0
    assert measure_swerves(ends, pair, np.array([100.0]), focal, width)[0] == 0.0


@given(seeds)
def test_whole_counts_are_read_as_they_are(seed: int) -> None:
    scene = Scene(seed)
    scene.depth = np.rint(scene.depth).clip(0.0).astype(np.uint16)
    known, covered = scene.known(), np.zeros((len(scene.pairs), 25), dtype=np.uint8)
    described = [scene.describe(depth, known, covered) for depth in (scene.depth, scene.depth.astype(np.float32))]
    scene.depth = scene.depth.astype(np.float32)
    np.testing.assert_array_equal(known, scene.known())
    np.testing.assert_array_equal(*described)


def test_the_middle_of_nine_depths_stands_in_the_middle_in_whatever_order() -> None:
    """A network that sorts all sequences of two values sorts any (Knuth): of these, the middle one."""
    for number in range(2**9):
        counts = np.array([1000.0 + (number >> k & 1) for k in range(9)], dtype=np.float32)
        assert _metres_of(counts, 1.0, 0.0, 1e4, np.empty(9)) == np.median(counts)
    rng = np.random.default_rng(0)
    for _ in range(100):
        counts = rng.choice([0.0, np.nan, 700.0, *rng.uniform(500.0, 900.0, 6)], 9).astype(np.float32)
        known = np.sort(counts[counts > 0.0])
        expected = known[(len(known) - 1) // 2] if len(known) >= 5 else np.nan
        np.testing.assert_equal(_metres_of(counts, 1.0, 1.0, 1e4, np.empty(9)), expected)
