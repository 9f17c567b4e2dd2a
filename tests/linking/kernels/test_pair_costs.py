"""Which pairs of ends may be joined, and what it costs."""

from __future__ import annotations

import numpy as np
import pytest
from tests.linking.kernels.test_joint_features import WIDTH, arm

from dloftbs.linking.kernels import joint_features as columns
from dloftbs.linking.kernels.evidence_weights import MAX_SEEN
from dloftbs.linking.kernels.joint_features import describe_pairs, prices
from dloftbs.linking.kernels.pair_costs import FOLD_COST, junction_costs, pair_costs
from dloftbs.linking.kernels.weights import JOINT, OPEN

OPEN_JUNCTION, OPEN_KINK, OPEN_FREE = OPEN[columns.OPEN_JUNCTION], OPEN[columns.OPEN_KINK], OPEN[columns.OPEN_FREE]
GAP_LENGTH, GAP_ROUND = JOINT[columns.GAP_LENGTH], JOINT[columns.GAP_ROUND]


def star_states(*outwards_deg: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the nodes and end states of branches that meet in one point, by directions; their other ends are free."""
    states = []
    for outwards in outwards_deg:
        a = np.radians(outwards)
        states.append(arm(100 + 6 * np.cos(a), 100 + 6 * np.sin(a), outwards + 180))
        states.append(arm(100 + 60 * np.cos(a), 100 + 60 * np.sin(a), outwards))
    return np.array([0, -1] * len(outwards_deg)), np.array(states)


def plus_states() -> tuple[np.ndarray, np.ndarray]:
    """Return the same of four branches that meet at a plus."""
    return star_states(0, 90, 180, 270)


def test_a_junction_lists_its_ends_and_the_costs_of_all_pairs() -> None:
    nodes, states = plus_states()
    spur = np.array([False, False, True, True])
    first, members, starts, costs = junction_costs(nodes, spur, np.full(8, -1), states, WIDTH)
    assert first.tolist() == [0, 4]
    assert members.tolist() == [0, 2, 4, 6]
    assert starts.tolist() == [0, 16]
    matrix = costs.reshape(4, 4)
    np.testing.assert_array_equal(matrix, matrix.T)
    assert np.diag(matrix).min() >= 1e3
    assert matrix[0, 2] == pytest.approx(0.0, abs=1e-9)
    assert matrix[0, 1] == pytest.approx(JOINT[columns.LINK_TURN] * np.pi**2 / 16)
    assert matrix[2, 3] >= 1e3  # two spurs


def test_a_link_costs_the_same_in_the_decision_and_wherever_links_are_listed() -> None:
    """Around a corner it is free, and no other one costs more than the fold that it may be, but for those of spurs."""
    nodes, states = star_states(0, 20, 40, 200)
    spur, corners = np.array([False, False, False, True]), np.full(8, -1)
    corners[[0, 4]] = 7
    pairs, _ = costs_of(nodes, states, spur=spur, corners=corners, more=1e3)
    _, members, _, costs = junction_costs(nodes, spur, corners, states, WIDTH)
    matrix = costs.reshape(4, 4)
    assert pairs[0, 4] == 0.0
    assert pairs[0, 2] == pairs[2, 4] == pytest.approx(FOLD_COST)
    for a, b in ((0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)):
        assert pairs[int(members[a]), int(members[b])] == pytest.approx(matrix[a, b])
    (only,), four = describe_pairs(states, np.array([[0, 2]]), nodes, np.zeros(8), WIDTH), np.full(4, -1)
    alone = junction_costs(nodes[:4], np.zeros(2, np.bool_), four, states[:4], WIDTH)[3][1]
    assert only @ JOINT > OPEN_KINK
    assert alone == pytest.approx(OPEN_KINK)


def costs_of(
    nodes: np.ndarray, states: np.ndarray, **changes: object
) -> tuple[dict[tuple[int, int], float], np.ndarray]:
    given_ = {
        "end_id": np.arange(len(nodes)),
        "spur": np.zeros(len(nodes) // 2, np.bool_),
        "end_roundness": np.zeros(len(nodes)),
        "bordering": np.zeros(len(nodes), np.bool_),
        "corners": np.full(len(nodes), -1),
        "max_gap": 100.0,
        "asked": False,
        "covers": False,
        "more": 0.0,
        **changes,
    }
    one, two, joints, opens = pair_costs(
        nodes, given_["end_id"], given_["spur"], given_["end_roundness"], states, WIDTH,
        given_["bordering"], given_["corners"], given_["max_gap"], given_["asked"],
        given_["covers"], given_["more"],
    )  # fmt: skip
    assert (one < two).all()
    costs = prices(joints, JOINT).tolist()
    return dict(zip(zip(one.tolist(), two.tolist(), strict=True), costs, strict=True)), prices(opens, OPEN)


def test_open_ends_have_their_price() -> None:
    nodes, states = plus_states()
    _, open_cost = costs_of(nodes, states)
    assert open_cost.tolist() == [OPEN_JUNCTION, OPEN_FREE] * 4
    _, open_cost = costs_of(nodes, states, spur=np.array([True, False, False, False]))
    assert open_cost.tolist() == [0.0, 0.0] + [OPEN_JUNCTION, OPEN_FREE] * 3
    _, open_cost = costs_of(nodes[:4], states[:4])
    assert open_cost.tolist() == [OPEN_KINK, OPEN_FREE] * 2


def two_dashes(gap: float) -> tuple[np.ndarray, np.ndarray]:
    states = [arm(20, 100, 180), arm(60, 100, 0), arm(60 + gap, 100, 180), arm(110 + gap, 100, 0)]
    return np.full(4, -1), np.array(states)


def test_a_gap_costs_its_length() -> None:
    pairs, _ = costs_of(*two_dashes(24.0))
    assert pairs == {(1, 2): pytest.approx(GAP_LENGTH * 24 / WIDTH)}


@pytest.mark.parametrize(("widths", "counts"), [(2.0, 0.0), (4.0, 0.0), (6.0, 0.5), (9.0, 1.0)])
def test_round_ends_speak_against_a_gap_that_is_no_break_of_the_mask(widths: float, counts: float) -> None:
    nodes, states = two_dashes(widths * WIDTH)
    roundness = np.array([1.0, 0.6, 0.8, 1.0])
    pairs, _ = costs_of(nodes, states, end_roundness=roundness, more=100.0)
    assert pairs[1, 2] == pytest.approx(GAP_LENGTH * widths + GAP_ROUND * counts * 1.4)


def test_costlier_pairs_are_listed_where_they_may_be() -> None:
    nodes, states = two_dashes((2 * OPEN_FREE + 0.3) * WIDTH / GAP_LENGTH)
    assert costs_of(nodes, states, max_gap=1e3)[0] == {}
    assert costs_of(nodes, states, max_gap=1e3, more=0.2)[0] == {}
    assert len(costs_of(nodes, states, max_gap=1e3, more=0.4)[0]) == 1


def test_what_evidence_may_still_join_is_listed() -> None:
    """It may say for a gap as much as it says at most, and that the ends have any shape."""
    at_most = (2 * OPEN_FREE + MAX_SEEN) / GAP_LENGTH * WIDTH
    for length, count in ((0.99 * at_most, 1), (1.01 * at_most, 0)):
        nodes, states = two_dashes(length)
        for roundness in (0.0, 1.0):
            ends = np.full(4, roundness)
            assert costs_of(nodes, states, max_gap=1e3, end_roundness=ends)[0] == {}
            assert len(costs_of(nodes, states, max_gap=1e3, end_roundness=ends, asked=True)[0]) == count


def test_a_covered_gap_is_listed_however_long_it_is() -> None:
    nodes, states = two_dashes(2.0 * (2 * OPEN_FREE + MAX_SEEN) / GAP_LENGTH * WIDTH)
    assert costs_of(nodes, states, max_gap=1e3, asked=True)[0] == {}
    assert (1, 2) in costs_of(nodes, states, max_gap=1e3, asked=True, covers=True)[0]


def test_a_gap_that_is_too_long_is_none() -> None:
    nodes, states = two_dashes(24.0)
    assert costs_of(nodes, states, max_gap=23.9)[0] == {}
    assert len(costs_of(nodes, states, max_gap=24.1)[0]) == 1


def test_what_cannot_be_joined_is_not() -> None:
    nodes, states = two_dashes(24.0)
    assert costs_of(np.array([-1, -2, -1, -1]), states)[0] == {}
    assert costs_of(nodes, states, end_id=np.array([0, 1, 1, 3]))[0] == {}
    assert costs_of(nodes, states, spur=np.array([False, True]))[0] == {}


def test_two_ends_that_others_leave_over_are_rather_one_cable_that_folds_back() -> None:
    """Two branches come in beside each other where another cable lies across; spurs fold no cable."""
    nodes, states = star_states(0, 80, 100, 180)
    pairs, open_cost = costs_of(nodes, states)
    assert pairs[2, 4] == pytest.approx(FOLD_COST)
    assert pairs[0, 6] == pytest.approx(0.0, abs=1e-9)
    assert pairs[0, 6] + pairs[2, 4] < open_cost[2] + open_cost[4]
    pairs, _ = costs_of(nodes, states, spur=np.array([False, True, False, False]))
    assert (2, 4) not in pairs


def test_all_pairs_of_many_ends_are_listed() -> None:
    """More than the first room for them."""
    n = 60
    nodes = np.zeros(n, dtype=np.int64)
    turn = np.linspace(0, 360, n, endpoint=False)
    states = np.array([arm(100 + 5 * np.cos(np.radians(t)), 100 + 5 * np.sin(np.radians(t)), t + 180) for t in turn])
    pairs, open_cost = costs_of(nodes, states)
    every = np.stack(np.triu_indices(n, 1), axis=1)
    links = np.minimum(prices(describe_pairs(states, every, nodes, np.zeros(n), WIDTH), JOINT), FOLD_COST)
    assert links.max() == FOLD_COST
    expected = dict(zip(map(tuple, every.tolist()), links.tolist(), strict=True))
    assert len(pairs) > 4 * n + 16
    assert pairs == pytest.approx(expected)
    assert 2.0 * open_cost.min() > FOLD_COST
