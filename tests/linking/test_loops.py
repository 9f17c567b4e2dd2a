"""Loops that come from a misread crossing."""

from __future__ import annotations

import numpy as np
import pytest
from linking_examples import circle, coil, detect, draw, hide, matching_of

from dloftbs.data.graph import FREE, Graph
from dloftbs.linking.loops import _MAX_EXCHANGES, _exchanges, close_rings, open_loops
from dloftbs.linking.matched_ends import Branches, EndMatching
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
    assert _MAX_EXCHANGES // 2 < len(options) < 2 * _MAX_EXCHANGES
    positions = matching.branches.end_states[:, :2]
    for end in loop:
        others = options[options[:, 0] == end, 1]
        left_out = [e for e in range(160, len(positions)) if matching.partner[e] >= 0 and e not in others]
        apart = np.abs(positions - positions[end]).max(axis=1)
        assert apart[others].max() <= apart[left_out].min()


@pytest.mark.parametrize("apart", [60.0, 75.0, 130.0, 180.0])
@pytest.mark.parametrize("width", [3.0, 7.0, 11.0])
def test_rings_that_cross_stay_two_rings(apart: float, width: float) -> None:
    """At a small angle too, where one closed curve through both would bend little more."""
    middle = 200.0 - apart / 2.0
    mask = draw(circle((middle, 120), 100), circle((middle + apart, 120), 100), width=width)
    assert [found.curve.closed for found in detect(mask)] == [True, True]


def rings_under_each_other(width: float, clear: float) -> np.ndarray:
    """Draw two rings that cross at two places; each is cut where it lies under the other one."""
    middles, radius = ((130.0, 120.0), (260.0, 120.0)), 90.0
    rows, columns = np.indices((240, 400))
    rings = [np.abs(np.hypot(columns - x, rows - y) - radius) for x, y in middles]
    for below, above, side in ((0, 1, rows < 120), (1, 0, rows > 120)):
        rings[below] = np.where(side & (rings[above] < 0.5 * width + clear), np.inf, rings[below])
    return (np.minimum(*rings) <= 0.5 * width).astype(np.uint8)


@pytest.mark.parametrize("width", [4.0, 7.0, 11.0])
@pytest.mark.parametrize("clear", [2.0, 4.0])
def test_rings_with_gaps_under_each_other_are_closed(width: float, clear: float) -> None:
    found = detect(rings_under_each_other(width, clear))
    assert [one.curve.closed for one in found] == [True, True]
    assert [one.curve.length for one in found] == pytest.approx([2 * np.pi * 90.0] * 2, rel=0.02)


@pytest.mark.parametrize("others", [[], [[(20, 20), (380, 30)]], [[(20, 120), (240, 120)]]])
def test_a_cable_whose_ends_face_each_other_in_sight_stays_open(others: list[list[tuple[int, int]]]) -> None:
    _, graph, matching = matching_of(draw(circle((200, 120), 80, 0.25, 2 * np.pi - 0.25), *others))
    before = list(matching.partner)
    close_rings(graph, matching)
    assert matching.partner == before


def test_rings_on_both_sides_of_a_gap_do_not_lie_over_it() -> None:
    """From the points of the one to those of the other there is no cable."""
    rows, columns = np.indices((300, 400))
    away = np.hypot(columns - 200.0, rows - 150.0)
    mask = (np.abs(away - 100.0) <= 4.0) & ~((columns > 200) & (np.abs(rows - 150.0) < 12.0))
    for x in (278.0, 322.0):
        mask |= np.abs(np.hypot(columns - x, rows - 150.0) - 9.0) <= 1.5
    _, graph, matching = matching_of(mask.astype(np.uint8))
    before = list(matching.partner)
    close_rings(graph, matching)
    assert matching.partner == before


def test_a_cable_whose_end_touches_itself_stays_open() -> None:
    """A lasso, as the figures 6 and 9."""
    six = np.concatenate((np.linspace((130, 20), (130, 140), 60), circle((190, 140), 60, np.pi, -0.9 * np.pi)))
    found = detect(draw(six))
    assert [one.curve.closed for one in found] == [False]


@pytest.mark.parametrize("width", [4.0, 7.0, 11.0])
@pytest.mark.parametrize("slope", [-0.5, 0.0, 0.5])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_ring_whose_gap_starts_at_the_edge_of_the_cable_over_it_is_closed(
    width: float, slope: float, side: float
) -> None:
    """The cable over it then has its junction there."""
    rows, columns = np.indices((300, 400))
    beside = (rows - 150.0 - slope * (columns - 200.0)) / np.hypot(1.0, slope)
    ring = np.abs(np.hypot(columns - 200.0, rows - 150.0) - 90.0) <= 0.5 * width
    slit = (columns < 200) & (side * beside > 0.0) & (side * beside < 0.5 * width + 4.0)
    line = (np.abs(beside) <= 0.5 * width) & (abs(columns - 200) < 160)
    found = detect(((ring & ~slit) | line).astype(np.uint8))
    assert sorted(one.curve.closed for one in found) == [False, True]
    assert max(one.curve.length for one in found) == pytest.approx(2 * np.pi * 90.0, rel=0.02)
