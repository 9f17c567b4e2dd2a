"""Paths from curve to curve: a slow twin, and what geometry says."""

from __future__ import annotations

import numpy as np
import pytest
from stereo_views import BENT, OTHER, beside

from dloftbs.stereo.kernels.epipolar_paths import MOST_COST, OPEN_COST, correspond, path_costs

ROTATION, SHIFT = np.eye(3), np.array([-0.1, 0.0, 0.0])
VARIANCE = (1.5 / 300.0) ** 2


def rays(axis: np.ndarray, pose: np.ndarray, count: int) -> np.ndarray:
    points = (axis[np.linspace(0, len(axis) - 1, count).astype(int)] - pose[:3, 3]) @ pose[:3, :3]
    return np.ascontiguousarray(points[:, :2] / points[:, 2:])


def widths(axis: np.ndarray, count: int) -> np.ndarray:
    return 0.006 / axis[np.linspace(0, len(axis) - 1, count).astype(int), 2]


def table(a, b, wide_a, wide_b):
    """Return the cost of each pair, term by term, for a shift along x alone."""
    halves = np.gradient(b, axis=0) * 0.5
    costs = np.empty((len(a), len(b)))
    for i, (x, y) in enumerate(a):
        for j, (p, q) in enumerate(b):
            off = max(abs(0.1 * (y - q)) - abs(0.1 * halves[j, 1]), 0.0)
            cost = min(off**2 / (2 * 0.1**2 * VARIANCE), MOST_COST)
            behind = p > x and (p - x) ** 2 + (q - y) ** 2 + (x * q - p * y) ** 2 > MOST_COST * VARIANCE
            unlike = (np.log(wide_b[j] / wide_a[i]) / 0.1) ** 2
            costs[i, j] = MOST_COST if behind else min(cost + unlike, MOST_COST)
    return costs


def slow(costs):
    """Return the mean cost of the best path, by trying all ways to each pair."""
    n, m = costs.shape
    total = np.empty((n, m))
    for i in range(n):
        for j in range(m):
            ways = [0.5 * OPEN_COST * (i + j) + costs[i, j]]
            if i and j:
                ways.append(total[i - 1, j - 1] + costs[i, j])
            if i:
                ways.append(total[i - 1, j] + 0.5 * costs[i, j] + 0.05)
            if j:
                ways.append(total[i, j - 1] + 0.5 * costs[i, j] + 0.05)
            total[i, j] = min(ways)
    open_a = total[:, -1] + 0.5 * OPEN_COST * np.arange(n)[::-1]
    open_b = total[-1] + 0.5 * OPEN_COST * np.arange(m)[::-1]
    return min(open_a.min(), open_b.min()) / (0.5 * (n + m))


@pytest.mark.parametrize(("first", "second"), [(BENT, BENT), (BENT, OTHER), (OTHER, BENT)])
def test_the_costs_are_those_of_the_slow_twin(first, second):
    a, b = rays(first, np.eye(4), 20), rays(second, beside(0.1), 17)
    wide_a, wide_b = widths(first, 20), widths(second, 17)
    forward, backward = path_costs(a, b, wide_a, wide_b, ROTATION, SHIFT, VARIANCE)
    costs = table(a, b, wide_a, wide_b)
    assert forward == pytest.approx(slow(costs))
    assert backward == pytest.approx(slow(costs[:, ::-1]))


def test_the_same_curve_costs_nothing_and_another_one_much():
    a, b, other = rays(BENT, np.eye(4), 30), rays(BENT, beside(0.1), 30), rays(OTHER, beside(0.1), 30)
    own, away = widths(BENT, 30), widths(OTHER, 30)
    forward, backward = path_costs(a, b, own, own, ROTATION, SHIFT, VARIANCE)
    assert forward < 0.1 < 1.0 < backward
    assert min(path_costs(a, other, own, away, ROTATION, SHIFT, VARIANCE)) > 10.0 * forward + 1.0


def test_points_on_the_path_have_the_depth_of_the_curve():
    a, b, wide = rays(BENT, np.eye(4), 40), rays(BENT, beside(0.1), 37), widths(BENT, 40)
    wide_b = np.full(37, wide.mean())
    start, depths, weights, partners = correspond(a, b, wide, wide_b, ROTATION, SHIFT, VARIANCE)
    assert start < 3
    assert (np.diff(partners) >= -1e-9).mean() > 0.9
    true = BENT[np.linspace(0, len(BENT) - 1, 40).astype(int), 2][start : start + len(depths)]
    sure = weights > 0.25 * weights.max()
    assert np.abs(1.0 / depths[sure] - true[sure]).max() < 0.02


def test_a_part_has_its_partners_in_the_whole():
    a, b, wide = rays(BENT, np.eye(4), 40)[12:].copy(), rays(BENT, beside(0.1), 40), widths(BENT, 40)
    start, depths, _, partners = correspond(a, b, wide[12:].copy(), wide, ROTATION, SHIFT, VARIANCE)
    assert (start, len(depths)) == (0, 28)
    assert np.abs(partners - np.arange(12, 40)).max() < 3.0
