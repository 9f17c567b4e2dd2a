"""End states of branches, clear spans, and the shapes of free ends."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numba import njit

from dloftbs.linking.kernels.joint_features import bend_between
from dloftbs.linking.kernels.wide_stretches import wide_reach
from dloftbs.skeleton.kernels.branch_ends import UNTOLD, clear_spans, describe_ends, measure_roundness

bend_between = njit(bend_between)

FREE = -1


@given(st.integers(0, 10**6))
def test_spans_go_from_the_first_to_the_last_clear_point(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 5))
    lengths = rng.integers(1, 30, n)
    offsets = np.cumsum([0, *lengths])
    points = np.cumsum(rng.uniform(-1, 1, (offsets[-1], 2)), axis=0)
    centres, radii = points[rng.integers(0, len(points), 3)] + rng.uniform(-2, 2, (3, 2)), rng.uniform(0, 6, 3)
    nodes = rng.integers(-1, 3, 2 * n)
    spans = clear_spans(nodes, centres, radii, points, np.full(len(points), 3.0), offsets, 6.0)
    for branch in range(n):
        a, b = offsets[branch : branch + 2]
        clear = [
            [node < 0 or np.linalg.norm(points[i] - centres[node]) >= radii[node] for i in range(a, b)]
            for node in nodes[2 * branch : 2 * branch + 2]
        ]
        start = next((i for i in range(b - a) if clear[0][i]), b - a)
        stop = next((i + 1 for i in range(b - a - 1, start - 1, -1) if clear[1][i]), start)
        if start >= stop:
            assert spans[branch].tolist() == [(a + b) // 2] * 2
        else:
            assert spans[branch].tolist() == [a + start, a + stop]


def states_of(
    points: np.ndarray, nodes: tuple[int, int], radius: float, width: float, half: np.ndarray | None = None
) -> np.ndarray:
    """Return both end states of one branch, whose junctions are where it starts and stops."""
    half = np.full(len(points), 0.5 * width) if half is None else half
    offsets = np.array([0, len(points)])
    centres, radii = np.array([points[0], points[-1]]), np.array([radius, radius])
    where = np.array(nodes)
    spans = clear_spans(where, centres, radii, points, half, offsets, width)
    return describe_ends(where, centres, radii, points, half, offsets, spans, width)


@pytest.mark.parametrize(
    ("narrow", "cut"),
    [(0, 0), (1, 1), (10, 10), (25, 25), (26, 0), (40, 0)],  # what is narrow for 2.2 widths or more is a narrow cable
)
@pytest.mark.parametrize("node", [FREE, 0])
def test_what_tapers_at_a_free_end_is_left_out(narrow: int, cut: int, node: int) -> None:
    points = np.column_stack((np.arange(100.0), np.zeros(100)))
    half = np.full(100, 6.0)
    half[:narrow] = 4.0
    half[100 - narrow :] = 4.0
    for back in (False, True):
        nodes = np.array([FREE, node] if back else [node, FREE])
        far = np.array([[-100.0, 0.0]])  # a junction that lies far from both ends
        spans = clear_spans(nodes, far, np.array([1.0]), points, half, np.array([0, 100]), 12.0)
        free = cut, 0 if node == 0 else cut
        assert spans.tolist() == [[free[0], 100 - free[1]] if back else [free[1], 100 - free[0]]]


@given(st.floats(0, 2 * np.pi), st.sampled_from([3.0, 6.0, 15.0, 40.0]))
def test_a_straight_run_points_out_of_both_ends(angle: float, width: float) -> None:
    along = np.array([np.cos(angle), np.sin(angle)])
    points = np.arange(0.0, 12 * width)[:, None] * along
    states = states_of(points, (0, 1), 0.6 * width, width)
    np.testing.assert_allclose(states[:, 2:4], [-along, along], atol=1e-9)
    np.testing.assert_allclose(states[:, 4], 0.0, atol=1e-9)
    assert states[:, 5].tolist() == [1.0, 1.0]
    first = np.linalg.norm(states[0, :2])
    assert 0.6 * width - 1e-9 <= first <= 0.6 * width + 1.0 + 1e-9


@pytest.mark.parametrize("width", [8.0, 12.0, 30.0])
def test_where_another_cable_widens_the_mask_a_branch_tells_no_direction(width: float) -> None:
    """Before a junction at a small angle the axis of both turns aside, as far as the mask is wider."""
    length = int(12 * width)
    before = np.maximum(3.0 * width - np.arange(length), 0.0)  # px to the end of the stretch
    points = np.column_stack((np.arange(float(length)), 0.2 * before))
    half = 0.5 * width + 0.2 * before
    seen = states_of(points, (0, FREE), 0.0, width, half)
    assert np.degrees(np.arctan2(seen[0, 3], -seen[0, 2])) == pytest.approx(0.0, abs=6.0)
    unseen = states_of(points, (0, FREE), 0.0, width)  # nothing shows it without the width
    assert np.degrees(np.arctan2(unseen[0, 3], -unseen[0, 2])) == pytest.approx(11.3, abs=1.0)


@pytest.mark.parametrize("width", [4.0, 10.0, 40.0])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_an_arc_is_known_by_its_curvature(width: float, side: float) -> None:
    """Through a gap in a circle, the ends of the rest of it bend hardly more than extrapolated."""
    radius = 5 * width
    angle = np.linspace(0.3, 2 * np.pi - 0.3, int(2 * np.pi * radius))
    points = np.column_stack((radius * np.cos(angle), side * radius * np.sin(angle)))
    states = states_of(points, (FREE, FREE), 0.0, width)
    # Outwards from its start the circle is followed backwards.
    share = states[:, 4] * radius * [-side, side]  # of the few points of a thin end only a part is believed
    assert (share > (0.85 if width >= 10 else 0.4)).all()
    assert (share < 1.1).all()
    tangents = np.array([np.sin(0.3), -side * np.cos(0.3)]), np.array([np.sin(0.3), side * np.cos(0.3)])
    np.testing.assert_allclose(states[:, 2:4], tangents, atol=0.06 if width >= 10 else 0.12)
    bend, _ = bend_between(states, 0, 1, width)
    straight = states.copy()
    straight[:, 5] = 0.0
    assert bend < (0.4 if width >= 10 else 0.6) * bend_between(straight, 0, 1, width)[0]


def test_noise_is_not_taken_for_a_bend() -> None:
    rng = np.random.default_rng(1)
    width = 4.0
    points = np.column_stack((np.arange(60.0), 0.3 * rng.standard_normal(60)))
    states = states_of(points, (0, 1), 3.0, width)
    assert np.abs(states[:, 4] * width).max() < 0.15
    assert np.abs(states[:, 3]).max() < 0.25


def test_a_short_run_points_from_end_to_end_and_has_no_known_bend() -> None:
    points = np.column_stack((np.arange(6.0), np.zeros(6)))
    states = states_of(points, (0, 1), 2.0, 8.0)
    np.testing.assert_allclose(states[:, 2:4], [[-1, 0], [1, 0]])
    assert states[:, 4:].tolist() == [[0.0, 0.0], [0.0, 0.0]]


def test_one_point_has_no_direction() -> None:
    states = states_of(np.array([[3.0, 4.0]]), (FREE, FREE), 0.0, 5.0)
    assert states.tolist() == [[3.0, 4.0, 0.0, 0.0, 0.0, 0.0]] * 2


def reach_of(radii: list[float], width: float = 4.0) -> list[int]:
    spans = np.array([[0, len(radii)]])
    return wide_reach(spans, np.array(radii), width)[0].tolist()


def test_the_reach_of_two_cables_ends_where_one_is_left() -> None:
    assert reach_of([4.0] * 10 + [2.0] * 30) == [10, 0]
    assert reach_of([2.0] * 30 + [4.0] * 10) == [0, 10]
    assert reach_of([2.0] * 40) == [0, 0]
    assert reach_of([4.0] * 40) == [40, 40]


def test_a_short_narrow_place_does_not_end_the_reach() -> None:
    """Where two cables cross, they are as narrow as one."""
    assert reach_of([4.0] * 10 + [2.0] + [4.0] * 10 + [2.0] * 30) == [21, 0]
    assert reach_of([4.0] * 10 + [2.0] * 9 + [4.0] * 10 + [2.0] * 30)[0] == 10


def test_the_mean_width_of_each_branch() -> None:
    spans = np.array([[0, 4], [6, 8], [9, 9]])
    radii = np.arange(12.0)
    assert wide_reach(spans, radii, 5.0)[1].tolist() == [3.0, 13.0, 5.0]


def bar_with_end(kind: str, width: int, angle: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Draw a bar that ends in the middle of the picture; return it, its centre line from there on, and the end."""
    size = 12 * width
    yy, xx = np.indices((size, size), dtype=float)
    along = np.array([np.cos(angle), np.sin(angle)])
    u = (xx - size / 2) * along[0] + (yy - size / 2) * along[1]
    v = -(xx - size / 2) * along[1] + (yy - size / 2) * along[0]
    r = width / 2
    bar = (np.abs(v) <= r) & (u > -4 * width)
    distance = np.hypot(u, v)
    mask = {
        "round": bar & ((u <= 0) | (distance <= r)),
        "flat": bar & (u <= r),
        "slanting": bar & (u <= r + 0.5 * v),
        "hollow": bar & (u <= r) & (np.hypot(u - r, v) > r),
    }[kind]
    tip = size / 2 - 0.2 * width * along
    line = tip - np.arange(3 * width)[:, None] * along
    return mask.astype(np.uint8), line, np.array([[*tip, *along, 0.0, 1.0]])


def cap_of(mask: np.ndarray, line: np.ndarray, arm: np.ndarray, width: float, node: int = FREE) -> float:
    """Return the roundness of the first end of a branch."""
    nodes, spans = np.array([node, -2]), np.array([[0, len(line)]])
    end_roundness = measure_roundness(nodes, line, spans, np.concatenate((arm, arm)), mask, width)
    assert end_roundness[1] == UNTOLD
    return float(end_roundness[0])


@pytest.mark.parametrize("width", [7, 12, 40])
@pytest.mark.parametrize("angle", [0.0, 0.6, np.pi / 4, 2.5])
def test_round_flat_and_hollow_ends_are_told_apart(width: int, angle: float) -> None:
    end_roundness = {}
    for kind in ("round", "flat", "slanting", "hollow"):
        end_roundness[kind] = cap_of(*bar_with_end(kind, width, angle), width)
    assert all(0.0 <= cap <= 1.0 for cap in end_roundness.values())
    assert end_roundness["hollow"] <= end_roundness["flat"] < end_roundness["round"] - 0.3
    assert end_roundness["slanting"] < end_roundness["round"] - 0.3
    if width >= 12:  # in thinner ones a pixel is too much of the radius
        slack = 0.35 if width < 40 else 0.15
        assert end_roundness["round"] > 1.0 - slack
        assert max(end_roundness["flat"], end_roundness["hollow"], end_roundness["slanting"]) < slack


def test_of_ends_that_are_not_free_and_of_short_and_thin_ones_nothing_is_told() -> None:
    mask, line, arm = bar_with_end("round", 12, 0.0)
    assert cap_of(mask, line, arm, 12.0) > UNTOLD
    assert cap_of(mask, line, arm, 12.0, node=0) == UNTOLD
    assert cap_of(mask, line, arm, 12.0, node=-2) == UNTOLD
    assert cap_of(mask, line[:10], arm, 12.0) == UNTOLD
    assert cap_of(*bar_with_end("flat", 4, 0.0), 4.0) == UNTOLD


@pytest.mark.parametrize("turn", [-0.4, 0.4])
def test_a_bent_cable_with_a_round_end_is_round(turn: float) -> None:
    width = 12
    radius = width / abs(turn)
    away = np.arange(4.0 * width) / radius  # rad, from the tip
    line = np.column_stack((150 - radius * np.sin(away), 150 + np.sign(turn) * radius * (1 - np.cos(away))))
    yy, xx = np.indices((300, 300))
    mask = np.zeros((300, 300), np.uint8)
    for x, y in line:
        mask[np.hypot(xx - x, yy - y) <= width / 2] = 1
    arm = np.array([[*line[0], 1.0, 0.0, turn / width, 1.0]])
    assert cap_of(mask, line, arm, width) > 0.7
    cut = mask.copy()
    cut[np.hypot(xx - 168, yy - 150) < 30] = 0
    assert cap_of(cut, line[12:], arm, width) < 0.3
