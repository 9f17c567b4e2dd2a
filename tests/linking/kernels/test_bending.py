"""What it costs to join two ends."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.linking.kernels.bending import (
    GAP_LENGTH,
    OPEN_CUT,
    OPEN_JUNCTION,
    OPEN_KINK,
    OPEN_ROUND,
    _bend,
    _outside,
    junction_costs,
    pair_costs,
    slant_costs,
    turn_costs,
)

WIDTH = 6.0
FULL = np.ones((200, 200), dtype=np.uint8)


def arm(x: float, y: float, direction_deg: float, curvature: float = 0.0, known: float = 1.0) -> list[float]:
    a = np.radians(direction_deg)
    return [x, y, np.cos(a), np.sin(a), curvature, known]


def on_circle(radius: float, start_deg: float, stop_deg: float, known: float = 1.0) -> np.ndarray:
    """Return the ends that face each other where a circle about (100, 100) is interrupted."""
    a, b = np.radians(start_deg), np.radians(stop_deg)
    return np.array([
        arm(100 + radius * np.cos(a), 100 + radius * np.sin(a), start_deg + 90, 1 / radius, known),
        arm(100 + radius * np.cos(b), 100 + radius * np.sin(b), stop_deg - 90, -1 / radius, known),
    ])  # fmt: skip


def test_an_arc_that_goes_on_bends_far_less_than_one_that_is_not_known_to() -> None:
    """The chord's angles are equal, so there is no swerve; most of the turn is extrapolated by the curvature."""
    for turn_deg in (5, 10, 20):
        radius = 60.0
        turn = np.radians(turn_deg)
        bend, length = _bend(on_circle(radius, 0, turn_deg), 0, 1, 20.0)
        assert length == pytest.approx(2 * radius * np.sin(turn / 2))
        assert bend == pytest.approx(0.25 * (turn - 0.7 * length / radius) ** 2, rel=1e-6)
        blind, _ = _bend(on_circle(radius, 0, turn_deg, known=0.0), 0, 1, 20.0)
        assert blind == pytest.approx(0.25 * turn**2)
        assert bend < 0.1 * blind


def test_straight_on_costs_nothing_to_bend() -> None:
    bend, length = _bend(np.array([arm(10, 20, 0), arm(50, 20, 180)]), 0, 1, WIDTH)
    assert bend == pytest.approx(0.0, abs=1e-12)
    assert length == 40.0


def test_a_step_aside_is_a_swerve_and_no_turn() -> None:
    bend, _ = _bend(np.array([arm(10, 20, 0), arm(30, 25, 180)]), 0, 1, WIDTH)
    assert bend == pytest.approx(3.0 * np.arctan2(5, 20) ** 2)


@pytest.mark.parametrize("aside", [-0.5, -0.3, 0.0, 0.3, 0.5])
@pytest.mark.parametrize("gap", [0.5, 1.0, 4.0])
def test_ends_that_are_cut_at_a_slant_lie_on_their_axes(gap: float, aside: float) -> None:
    """The tip of each lies up to half a width from the axis; what is more is a swerve."""
    along = np.array([np.cos(0.7), np.sin(0.7)])
    tip = gap * WIDTH * along + aside * WIDTH * np.array([-along[1], along[0]])
    direction = np.degrees(0.7)
    states = np.array([arm(0, 0, direction), arm(*tip, direction + 180)])
    pairs = np.array([[0, 1]])
    assert (turn_costs(states, pairs, WIDTH) - slant_costs(states, pairs, WIDTH)) == pytest.approx(GAP_LENGTH * gap)
    farther = states.copy()
    farther[1, :2] += np.sign(aside or 1.0) * WIDTH * np.array([-along[1], along[0]])
    assert (turn_costs(farther, pairs, WIDTH) - slant_costs(farther, pairs, WIDTH)) > 0.02 + GAP_LENGTH * gap


def test_a_right_angle_costs_what_the_formula_says() -> None:
    """Two ends of a plus, each 10 px from its centre: a turn of pi / 2 over a chord of 10 sqrt(2), and no swerve."""
    states = np.array([arm(90, 100, 0), arm(100, 90, 90)])
    turn = np.pi / 2
    length = 10 * np.sqrt(2)
    (cost,) = turn_costs(states, np.array([[0, 1]]), WIDTH)
    assert cost == pytest.approx(turn**2 / 4 * (2.0 * WIDTH / length + 0.4) + GAP_LENGTH * length / WIDTH)
    *_, costs = junction_costs(np.array([0, -1, 0, -1]), np.zeros(2, np.bool_), states[[0, 0, 1, 1]], WIDTH, FULL)
    assert costs[1] == costs[2] == pytest.approx(turn**2 / 4 * (1.5 * WIDTH / length + 1.0))


def test_a_promise_is_not_held_against_a_curve_that_turns_less() -> None:
    states = np.array([arm(10, 20, 0, 0.05), arm(30, 20, 180, -0.05)])
    assert _bend(states, 0, 1, WIDTH)[0] == pytest.approx(0.0, abs=1e-12)


def test_an_arm_without_direction_is_neither_good_nor_bad() -> None:
    states = np.array([arm(10, 20, 0), [30, 20, 0, 0, 0, 0]])
    assert _bend(states, 0, 1, WIDTH)[0] == 0.25


finite = st.floats(-80, 80, allow_nan=False)
angle = st.floats(0, 360)
curved = st.floats(-0.1, 0.1)
an_arm = st.builds(arm, finite, finite, angle, curved, st.sampled_from([0.0, 1.0]))


@given(an_arm, an_arm)
def test_both_ways_mirrored_and_turned_bend_the_same(one: list[float], two: list[float]) -> None:
    states = np.array([one, two])
    gap = np.linalg.norm(states[0, :2] - states[1, :2])
    if gap < 1e-3 or abs(gap - 1.0) < 1e-6:
        return
    bend, length = _bend(states, 0, 1, WIDTH)
    turned, mirrored = states.copy(), states.copy()
    turned[:, :4] = states[:, [1, 0, 3, 2]] * [-1, 1, -1, 1]
    mirrored[:, [0, 2, 4]] *= -1
    chord = complex(*(states[1, :2] - states[0, :2]))
    leaves, comes = (abs(np.angle(complex(*direction) / chord)) for direction in (states[0, 2:4], -states[1, 2:4]))
    if max(leaves, comes) > np.pi - 1e-6:
        return  # straight back: to turn left or right is as far
    for other in (_bend(states, 1, 0, WIDTH), _bend(turned, 0, 1, WIDTH), _bend(mirrored, 0, 1, WIDTH)):
        np.testing.assert_allclose(other, (bend, length), rtol=1e-6, atol=1e-9)


def test_a_way_over_background_is_outside() -> None:
    mask = FULL.copy()
    states = np.array([arm(20, 100, 0), arm(60, 100, 180)])
    assert _outside(mask, states, 0, 1) == 0.0
    mask[:, 30:50] = 0
    assert _outside(mask, states, 0, 1) == pytest.approx(0.5, abs=0.1)
    assert _outside(np.zeros_like(mask), states, 0, 1) == 1.0
    assert _outside(FULL, np.array([arm(-50, 100, 0), arm(-20, 100, 180)]), 0, 1) == 1.0


def plus_states() -> tuple[np.ndarray, np.ndarray]:
    """Return the nodes and end states of four branches that meet at a plus; their other ends are free."""
    nodes = np.array([0, -1] * 4)
    states = []
    for outwards in (0, 90, 180, 270):
        a = np.radians(outwards)
        states.append(arm(100 + 6 * np.cos(a), 100 + 6 * np.sin(a), outwards + 180))
        states.append(arm(100 + 60 * np.cos(a), 100 + 60 * np.sin(a), outwards))
    return nodes, np.array(states)


def test_a_junction_lists_its_ends_and_the_costs_of_all_pairs() -> None:
    nodes, states = plus_states()
    spur = np.array([False, False, True, True])
    first, members, starts, costs = junction_costs(nodes, spur, states, WIDTH, FULL)
    assert first.tolist() == [0, 4]
    assert members.tolist() == [0, 2, 4, 6]
    assert starts.tolist() == [0, 16]
    matrix = costs.reshape(4, 4)
    np.testing.assert_array_equal(matrix, matrix.T)
    assert np.diag(matrix).min() >= 1e3
    assert matrix[0, 2] == pytest.approx(0.0, abs=1e-9)
    assert 0.5 < matrix[0, 1] < 2.8
    assert matrix[2, 3] >= 1e3  # two spurs


def costs_of(
    nodes: np.ndarray, states: np.ndarray, **changes: object
) -> tuple[dict[tuple[int, int], float], np.ndarray]:
    given_ = {
        "end_id": np.arange(len(nodes)),
        "spur": np.zeros(len(nodes) // 2, np.bool_),
        "end_roundness": np.zeros(len(nodes)),
        "mask": FULL,
        "bordering": np.zeros(len(nodes), np.bool_),
        "corners": np.full(len(nodes), -1),
        "max_gap": 100.0,
        "least_bound": 0.0,
        "more": 0.0,
        **changes,
    }
    link_costs = junction_costs(nodes, given_["spur"], states, WIDTH, given_["mask"])
    rows, columns, costs, open_cost = pair_costs(
        nodes, given_["end_id"], given_["spur"], given_["end_roundness"], states, WIDTH, given_["mask"], *link_costs,
        given_["bordering"], given_["corners"], given_["max_gap"], given_["least_bound"],
        given_["more"],
    )  # fmt: skip
    assert (rows < columns).all()
    return dict(zip(zip(rows.tolist(), columns.tolist(), strict=True), costs.tolist(), strict=True)), open_cost


def test_open_ends_have_their_price() -> None:
    nodes, states = plus_states()
    _, open_cost = costs_of(nodes, states)
    assert open_cost.tolist() == [OPEN_JUNCTION, OPEN_CUT] * 4
    _, open_cost = costs_of(nodes, states, spur=np.array([True, False, False, False]))
    assert open_cost.tolist() == [0.0, 0.0] + [OPEN_JUNCTION, OPEN_CUT] * 3
    _, open_cost = costs_of(nodes[:4], states[:4])
    assert open_cost.tolist() == [OPEN_KINK, OPEN_CUT] * 2
    _, open_cost = costs_of(nodes, states, end_roundness=np.tile([0.0, 1.0, 0.0, 0.5], 2))
    assert open_cost.tolist() == pytest.approx(
        [OPEN_JUNCTION, OPEN_ROUND, OPEN_JUNCTION, 0.5 * (OPEN_ROUND + OPEN_CUT)] * 2
    )


def two_dashes(gap: float) -> tuple[np.ndarray, np.ndarray]:
    states = [arm(20, 100, 180), arm(60, 100, 0), arm(60 + gap, 100, 180), arm(110 + gap, 100, 0)]
    return np.full(4, -1), np.array(states)


def test_a_gap_costs_its_length() -> None:
    pairs, _ = costs_of(*two_dashes(24.0))
    assert pairs == {(1, 2): pytest.approx(GAP_LENGTH * 24 / WIDTH)}


def test_a_longer_gap_is_bridged_between_cut_ends_than_between_round_ones() -> None:
    gap = 0.5 * (OPEN_ROUND + OPEN_CUT) * 2 * WIDTH / GAP_LENGTH
    nodes, states = two_dashes(gap)
    assert len(costs_of(nodes, states, end_roundness=np.zeros(4), max_gap=1e3)[0]) == 1
    assert costs_of(nodes, states, end_roundness=np.ones(4), max_gap=1e3)[0] == {}


def test_costlier_pairs_are_listed_where_they_may_be() -> None:
    nodes, states = two_dashes((2 * OPEN_CUT + 0.3) * WIDTH / GAP_LENGTH)
    assert costs_of(nodes, states, max_gap=1e3)[0] == {}
    assert costs_of(nodes, states, max_gap=1e3, more=0.2)[0] == {}
    assert len(costs_of(nodes, states, max_gap=1e3, more=0.4)[0]) == 1


def test_a_gap_that_is_too_long_is_none() -> None:
    nodes, states = two_dashes(24.0)
    assert costs_of(nodes, states, max_gap=23.9)[0] == {}
    assert len(costs_of(nodes, states, max_gap=24.1)[0]) == 1


def test_what_cannot_be_joined_is_not() -> None:
    nodes, states = two_dashes(24.0)
    assert costs_of(np.array([-1, -2, -1, -1]), states)[0] == {}
    assert costs_of(nodes, states, end_id=np.array([0, 1, 1, 3]))[0] == {}
    assert costs_of(nodes, states, spur=np.array([False, True]))[0] == {}


def test_all_pairs_of_many_ends_are_listed() -> None:
    """More than the first room for them."""
    n = 60
    nodes = np.zeros(n, dtype=np.int64)
    turn = np.linspace(0, 360, n, endpoint=False)
    states = np.array([arm(100 + 5 * np.cos(np.radians(t)), 100 + 5 * np.sin(np.radians(t)), t + 180) for t in turn])
    pairs, open_cost = costs_of(nodes, states)
    *_, costs = junction_costs(nodes, np.zeros(n // 2, np.bool_), states, WIDTH, FULL)
    matrix = costs.reshape(n, n)
    expected = {
        (i, j): matrix[i, j] for i in range(n) for j in range(i + 1, n) if matrix[i, j] < open_cost[i] + open_cost[j]
    }
    assert len(pairs) > 4 * n + 16
    assert pairs == expected
