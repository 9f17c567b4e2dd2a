"""Loops that come from a misread crossing."""

from __future__ import annotations

import numpy as np
import pytest
from linking_examples import circle, coil, draw, hide, matching_of

from dloftbs.graph import FREE, Branches, EndMatching, Graph
from dloftbs.linking.loops import _MOST_EXCHANGES, _exchanges, open_loops
from dloftbs.linking.parallel_runs import separate_parallel_runs


def loop_that_crosses_itself() -> np.ndarray:
    t = np.linspace(-1.35, 1.35, 400)
    return np.column_stack((200 + 132 * (t**3 - t), 30 + 170 * (1 - t**2 / 1.9)))


def misread(graph: Graph, matching: EndMatching) -> None:
    """Exchange the two joints of the only crossing, so that a loop comes apart from the rest."""
    i, k = sorted({min(i, j) for i, j in enumerate(matching.partner) if j >= 0})
    for one, other in ((i, k), (matching.partner[i], k)):
        matching.exchange(one, other)
        if any(is_loop for _, is_loop in matching.chains()):
            return
        matching.exchange(one, other)
    raise AssertionError("no exchange makes a loop")


def test_a_misread_crossing_is_put_right() -> None:
    _, graph, matching = matching_of(draw(loop_that_crosses_itself()))
    before = list(matching.partner)
    misread(graph, matching)
    assert sorted(is_loop for _, is_loop in matching.chains()) == [False, True]
    open_loops(graph, matching)
    assert matching.partner == before
    assert [is_loop for _, is_loop in matching.chains()] == [False]


def test_a_loop_that_only_a_gap_closes_is_opened_there() -> None:
    _, graph, matching = matching_of(draw(circle((200, 120), 80, 0.2, 2 * np.pi - 0.2)))
    matching.join(0, 1, 0.0, 1.0)
    open_loops(graph, matching)
    assert matching.partner == [-1, -1]
    assert [is_loop for _, is_loop in matching.chains()] == [False]


@pytest.mark.parametrize(
    ("x", "y", "radius", "misread"),
    [(150, 170, 18, True), (150, 180, 18, True), (255, 170, 22, True), (180, 180, 18, False), (240, 170, 22, False)],
)
def test_a_loop_whose_crossing_is_partly_hidden_is_put_into_the_cable_beside_it(
    x: float, y: float, radius: float, misread: bool
) -> None:
    mask = hide(draw(coil(40.0)), x, y, radius)
    _, graph, matching = matching_of(mask)
    separate_parallel_runs(graph, matching)
    assert any(is_loop for _, is_loop in matching.chains()) == misread
    open_loops(graph, matching)
    assert [is_loop for _, is_loop in matching.chains()] == [False]


def test_a_figure_eight_stays_closed() -> None:
    a = np.linspace(0, 2 * np.pi, 600)
    _, graph, matching = matching_of(draw(np.column_stack((200 + 150 * np.sin(a), 120 + 80 * np.sin(2 * a)))))
    before = list(matching.partner)
    open_loops(graph, matching)
    assert matching.partner == before
    assert [is_loop for _, is_loop in matching.chains()] == [True]


def test_a_loop_that_a_straight_cable_crosses_stays_a_loop() -> None:
    _, graph, matching = matching_of(draw(circle((200, 100), 70), [(20, 120), (380, 140)]))
    open_loops(graph, matching)
    assert sorted(is_loop for _, is_loop in matching.chains()) == [False, True]


def test_without_loops_nothing_changes() -> None:
    _, graph, matching = matching_of(draw([(20, 60), (380, 80)], [(200, 20), (210, 220)]))
    before = list(matching.partner)
    open_loops(graph, matching)
    assert matching.partner == before


def ring_beside_others(gaps: int, others: int) -> tuple[EndMatching, list[int]]:
    """Return a ring of so many branches, joined across gaps, beside so many pairs of joined branches."""
    count = gaps + 2 * others
    rng = np.random.default_rng(gaps)
    branches = Branches(
        points=np.zeros((count, 2)),
        radius=np.ones(count),
        branch_id=list(range(count)),
        nodes=[FREE] * (2 * count),
        open_cost=[3.0] * (2 * count),
        spans=[(k, k + 1) for k in range(count)],
        spurs=[False] * count,
        end_states=np.hstack((rng.uniform(0.0, 500.0, (2 * count, 2)), np.zeros((2 * count, 4)))),
        duplicate_of={},
    )
    stops = [*(range(1, 2 * gaps, 2)), *(range(2 * gaps + 1, 2 * count, 4))]
    starts = [*(range(2, 2 * gaps, 2)), 0, *(range(2 * gaps + 2, 2 * count, 4))]
    partner = [-1] * (2 * count)
    for one, other in zip(stops, starts, strict=True):
        partner[one], partner[other] = other, one
    matching = EndMatching(branches, partner, [0.0] * (2 * count), [0.0] * (2 * count), [-1] * (2 * count))
    (loop,) = [chain for chain, is_loop in matching.chains() if is_loop]
    return matching, loop


def test_all_exchanges_of_a_ring_with_few_gaps_are_tried() -> None:
    matching, loop = ring_beside_others(5, 20)
    options = np.concatenate(list(_exchanges(matching, loop)))
    joined = [end for end in range(10, len(matching.partner)) if matching.partner[end] >= 0]
    assert options.tolist() == [[end, other] for end in loop for other in joined]


def test_of_many_exchanges_those_with_the_nearest_ends_are_tried() -> None:
    matching, loop = ring_beside_others(80, 200)
    options = np.concatenate(list(_exchanges(matching, loop)))
    assert _MOST_EXCHANGES // 2 < len(options) < 2 * _MOST_EXCHANGES
    positions = matching.branches.end_states[:, :2]
    for end in loop:
        others = options[options[:, 0] == end, 1]
        left_out = [e for e in range(160, len(positions)) if matching.partner[e] >= 0 and e not in others]
        apart = np.abs(positions - positions[end]).max(axis=1)
        assert apart[others].max() <= apart[left_out].min()
