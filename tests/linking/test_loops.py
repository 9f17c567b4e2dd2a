"""Rings that come from a misread crossing, and a number of cables that is known."""

from __future__ import annotations

import numpy as np
import pytest
from linking_examples import circle, coil, draw, hide, pairing_of

from dloftbs.graph import Graph, Pairing
from dloftbs.linking.loops import join_unclear, open_rings
from dloftbs.linking.parallel_runs import settle_lanes


def loop_that_crosses_itself() -> np.ndarray:
    t = np.linspace(-1.35, 1.35, 400)
    return np.column_stack((200 + 132 * (t**3 - t), 30 + 170 * (1 - t**2 / 1.9)))


def misread(graph: Graph, pairing: Pairing) -> None:
    """Exchange the two joints of the only crossing, so that a ring comes apart from the rest."""
    i, k = sorted({min(i, j) for i, j in enumerate(pairing.partner) if j >= 0})
    for one, other in ((i, k), (pairing.partner[i], k)):
        pairing.exchange(one, other)
        if any(is_ring for _, is_ring in pairing.chains()):
            return
        pairing.exchange(one, other)
    raise AssertionError("no exchange makes a ring")


def test_a_misread_crossing_is_put_right() -> None:
    _, graph, pairing = pairing_of(draw(loop_that_crosses_itself()))
    before = list(pairing.partner)
    misread(graph, pairing)
    assert sorted(is_ring for _, is_ring in pairing.chains()) == [False, True]
    open_rings(graph, pairing)
    assert pairing.partner == before
    assert [is_ring for _, is_ring in pairing.chains()] == [False]


def test_a_ring_that_only_a_gap_closes_is_opened_there() -> None:
    _, graph, pairing = pairing_of(draw(circle((200, 120), 80, 0.2, 2 * np.pi - 0.2)))
    pairing.join(0, 1)
    open_rings(graph, pairing)
    assert pairing.partner == [-1, -1]
    assert [is_ring for _, is_ring in pairing.chains()] == [False]


@pytest.mark.parametrize(("x", "radius"), [(165, 18), (180, 18), (225, 18), (240, 22)])
def test_a_ring_whose_crossing_is_hidden_is_put_into_the_cable_beside_it(x: float, radius: float) -> None:
    mask = hide(draw(coil(40.0)), x, 180.0 if radius == 18 and x != 165 else 170.0, radius)
    _, graph, pairing = pairing_of(mask)
    settle_lanes(graph, pairing)
    assert any(is_ring for _, is_ring in pairing.chains())
    open_rings(graph, pairing)
    assert [is_ring for _, is_ring in pairing.chains()] == [False]


def test_a_figure_eight_stays_closed() -> None:
    a = np.linspace(0, 2 * np.pi, 600)
    _, graph, pairing = pairing_of(draw(np.column_stack((200 + 150 * np.sin(a), 120 + 80 * np.sin(2 * a)))))
    before = list(pairing.partner)
    open_rings(graph, pairing)
    assert pairing.partner == before
    assert [is_ring for _, is_ring in pairing.chains()] == [True]


def test_a_ring_that_a_straight_cable_crosses_stays_a_ring() -> None:
    _, graph, pairing = pairing_of(draw(circle((200, 100), 70), [(20, 120), (380, 140)]))
    open_rings(graph, pairing)
    assert sorted(is_ring for _, is_ring in pairing.chains()) == [False, True]


def test_without_rings_nothing_changes() -> None:
    _, graph, pairing = pairing_of(draw([(20, 60), (380, 80)], [(200, 20), (210, 220)]))
    before = list(pairing.partner)
    open_rings(graph, pairing)
    assert pairing.partner == before


# Gaps of eight widths: round ends nearly bridge them.
DASHES = [[(10, 100), (100, 104)], [(158, 108), (230, 112)], [(288, 114), (395, 118)]]


@pytest.mark.parametrize("objects", [1, 2, 3, 7])
def test_what_was_nearly_joined_is_joined_until_there_are_so_many(objects: int) -> None:
    _, graph, pairing = pairing_of(draw(*DASHES))
    assert len(pairing.chains()) == 3
    assert len(pairing.nearly) == 2
    join_unclear(graph, pairing, objects)
    assert len(pairing.chains()) == min(objects, 3)
    assert all(pairing.partner[j] == i for i, j in enumerate(pairing.partner) if j >= 0)
    joints = [i for i, j in enumerate(pairing.partner) if j >= 0]
    assert len(joints) == 2 * (3 - min(objects, 3))
    assert all(pairing.cost[i] > 0.0 and pairing.margin[i] == 0.0 and pairing.other[i] == -1 for i in joints)


def test_what_is_clearly_apart_is_not_joined() -> None:
    far = [[(10, 40), (150, 42)], [(10, 120), (150, 122)], [(10, 200), (150, 204)]]
    _, graph, pairing = pairing_of(draw(*far))
    assert pairing.nearly == []
    join_unclear(graph, pairing, 1)
    assert len(pairing.chains()) == 3


def test_two_cables_are_not_joined_to_make_room_for_a_speck() -> None:
    _, graph, pairing = pairing_of(draw(*DASHES[:2], [(300, 200), (312, 203)]))
    before = list(pairing.partner)
    join_unclear(graph, pairing, 2)
    assert pairing.partner == before
