"""What is measured of a joint, and what it costs."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numba import njit

from dloftbs.linking.kernels.joint_features import (
    GAP_ENERGY,
    GAP_LENGTH,
    GAP_ROUND,
    LINK_TURN,
    bend_between,
    describe_pairs,
    prices,
)
from dloftbs.linking.kernels.pair_costs import junction_costs
from dloftbs.linking.kernels.weights import JOINT

bend_between = njit(bend_between)

WIDTH = 6.0


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
        bend, length = bend_between(on_circle(radius, 0, turn_deg), 0, 1, 20.0)
        assert length == pytest.approx(2 * radius * np.sin(turn / 2))
        assert bend == pytest.approx(0.25 * (turn - 0.7 * length / radius) ** 2, rel=1e-6)
        blind, _ = bend_between(on_circle(radius, 0, turn_deg, known=0.0), 0, 1, 20.0)
        assert blind == pytest.approx(0.25 * turn**2)
        assert bend < 0.1 * blind


def test_a_step_of_a_pixel_costs_a_line_of_one_pixel_nothing() -> None:
    """Else the dash after the next one, over a longer gap, costs less than the next one."""
    step = np.array([arm(10, 20, 0), arm(13, 21, 180)])
    assert bend_between(step, 0, 1, 1.0)[0] == pytest.approx(0.0, abs=1e-12)
    steps = np.array([arm(10, 20, 0), arm(13, 22, 180)])
    assert bend_between(steps, 0, 1, 1.0)[0] > 0.05


@pytest.mark.parametrize(("width", "longest"), [(1.0, 12.0), (2.9, 12.0), (5.0, 20.0)])
def test_the_shape_of_ends_tells_nothing_where_a_gap_may_be_a_break_of_the_mask(width: float, longest: float) -> None:
    pairs, nodes, roundness = np.array([(0, 1)]), np.full(2, -1), np.full(2, 0.65)
    for length, counts in ((longest, 0.0), (1.5 * longest, 0.65), (2.0 * longest, 1.3), (5.0 * longest, 1.3)):
        states = np.array([arm(10, 20, 0), arm(10 + length, 20, 180)])
        (row,) = describe_pairs(states, pairs, nodes, roundness, width)
        assert row[GAP_ROUND] == pytest.approx(counts)


def test_straight_on_costs_nothing_to_bend() -> None:
    bend, length = bend_between(np.array([arm(10, 20, 0), arm(50, 20, 180)]), 0, 1, WIDTH)
    assert bend == pytest.approx(0.0, abs=1e-12)
    assert length == 40.0


def test_a_step_aside_is_a_swerve_and_no_turn() -> None:
    bend, _ = bend_between(np.array([arm(10, 20, 0), arm(30, 25 + WIDTH / 2, 180)]), 0, 1, WIDTH)
    assert bend == pytest.approx(3.0 * np.arctan2(5, 20) ** 2)


@pytest.mark.parametrize("aside", [-0.5, -0.3, 0.0, 0.3, 0.5])
@pytest.mark.parametrize("gap", [0.5, 1.0, 4.0])
def test_ends_that_are_cut_at_a_slant_lie_on_their_axes(gap: float, aside: float) -> None:
    """The tip of each lies up to half a width from the axis; what is more is a swerve."""
    along = np.array([np.cos(0.7), np.sin(0.7)])
    tip = gap * WIDTH * along + aside * WIDTH * np.array([-along[1], along[0]])
    direction = np.degrees(0.7)
    states = np.array([arm(0, 0, direction), arm(*tip, direction + 180)])
    assert bend_between(states, 0, 1, WIDTH)[0] == pytest.approx(0.0, abs=1e-12)
    farther = states.copy()
    farther[1, :2] += np.sign(aside or 1.0) * WIDTH * np.array([-along[1], along[0]])
    assert bend_between(farther, 0, 1, WIDTH)[0] > 0.01


def test_a_right_angle_costs_what_the_formula_says() -> None:
    """Two ends of a plus, each 10 px from its centre: a turn of pi / 2 over a chord of 10 sqrt(2), and no swerve."""
    states = np.array([arm(90, 100, 0), arm(100, 90, 90)])
    turn = np.pi / 2
    length = 10 * np.sqrt(2)
    bend = turn**2 / 4
    pair, roundness = np.array([[0, 1]]), np.zeros(2)
    joints = [describe_pairs(states, pair, nodes, roundness, WIDTH) for nodes in np.array([[-1, -1], [0, 0]])]
    costs = prices(np.concatenate(joints), JOINT)
    gap = JOINT[GAP_ENERGY] * WIDTH / length * bend + JOINT[GAP_LENGTH] * length / WIDTH
    assert costs == pytest.approx([gap, JOINT[LINK_TURN] * bend])
    nodes, spur = np.array([0, -1, 0, -1, 0, -1]), np.zeros(3, np.bool_)
    *_, costs = junction_costs(nodes, spur, np.full(6, -1), states[[0, 0, 1, 1, 1, 1]], WIDTH)
    assert costs[1] == costs[3] == pytest.approx(JOINT[LINK_TURN] * bend)


def test_a_promise_is_not_held_against_a_curve_that_turns_less() -> None:
    states = np.array([arm(10, 20, 0, 0.05), arm(30, 20, 180, -0.05)])
    assert bend_between(states, 0, 1, WIDTH)[0] == pytest.approx(0.0, abs=1e-12)


def test_an_arm_without_direction_is_neither_good_nor_bad() -> None:
    states = np.array([arm(10, 20, 0), [30, 20, 0, 0, 0, 0]])
    assert bend_between(states, 0, 1, WIDTH)[0] == 0.25


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
    bend, length = bend_between(states, 0, 1, WIDTH)
    turned, mirrored = states.copy(), states.copy()
    turned[:, :4] = states[:, [1, 0, 3, 2]] * [-1, 1, -1, 1]
    mirrored[:, [0, 2, 4]] *= -1
    chord = complex(*(states[1, :2] - states[0, :2]))
    leaves, comes = (abs(np.angle(complex(*direction) / chord)) for direction in (states[0, 2:4], -states[1, 2:4]))
    if max(leaves, comes) > np.pi - 1e-6:
        return  # straight back: to turn left or right is as far
    for other in (
        bend_between(states, 1, 0, WIDTH),
        bend_between(turned, 0, 1, WIDTH),
        bend_between(mirrored, 0, 1, WIDTH),
    ):
        np.testing.assert_allclose(other, (bend, length), rtol=1e-6, atol=1e-9)


def test_pairs_at_one_junction_are_links_and_others_gaps_by_their_roundness() -> None:
    states = np.array([arm(0, 0, 10), arm(60, 0, 170), arm(200, 30, 180), arm(9, 1, 190)])
    nodes, roundness = np.array([0, -1, -1, 0]), np.array([0.0, 0.5, 0.25, 1.0])
    pairs = np.array([(0, 3), (0, 1), (1, 2)])
    joints = describe_pairs(states, pairs, nodes, roundness, WIDTH)
    gaps = np.array([False, True, True])
    assert (joints[:, GAP_LENGTH] > 0.0).tolist() == gaps.tolist()
    np.testing.assert_allclose(joints[1:, GAP_ROUND], [0.5, 0.75])  # both longer than any break of a mask
    without = joints.copy()
    without[:, GAP_ROUND] = 0.0
    np.testing.assert_array_equal(without, describe_pairs(states, pairs, nodes, np.zeros(4), WIDTH))
