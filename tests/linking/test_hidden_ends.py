"""Ends inside of branches that two cables share: which cable ends there, and the gaps from there."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from linking_examples import coil, detect, distances, draw, hide, matching_of
from scipy.spatial import cKDTree

from dloftbs.data.graph import Graph
from dloftbs.linking.hidden_ends import link_hidden_ends
from dloftbs.linking.loops import open_loops
from dloftbs.linking.matched_ends import EndMatching
from dloftbs.linking.parallel_runs import separate_parallel_runs

HIDDEN = [(145, 170, 22), (150, 170, 18), (155, 160, 18), (155, 170, 14)]


def before_joining(mask: np.ndarray) -> tuple[Graph, EndMatching]:
    _, graph, matching = matching_of(mask)
    separate_parallel_runs(graph, matching)
    open_loops(graph, matching)
    return graph, matching


@pytest.mark.parametrize("disc", HIDDEN)
def test_a_cable_that_comes_to_lie_on_itself_unseen_is_one(disc: tuple[float, float, float]) -> None:
    graph, matching = before_joining(hide(draw(coil()), *disc))
    assert len(matching.chains()) == 2
    link_hidden_ends(graph, matching, 25.0)
    ((chain, is_loop),) = matching.chains()
    assert not is_loop
    joined = [end for end in chain if matching.partner[end] >= 0 and not matching.is_crossing(end)]
    assert joined
    assert all(matching.cost[end] > 0.0 and matching.margin[end] > 0.0 for end in joined)


@pytest.mark.parametrize("disc", HIDDEN)
@pytest.mark.parametrize("mirrored", [False, True])
def test_its_curve_is_that_of_the_cable(disc: tuple[float, float, float], mirrored: bool) -> None:
    mask, line = hide(draw(coil()), *disc), coil()
    if mirrored:
        mask, line = mask[:, ::-1], np.column_stack((mask.shape[1] - 1 - line[:, 0], line[:, 1]))
    (detection,) = detect(mask)
    away, _ = cKDTree(detection.curve.sample(500)).query(line)
    assert away.mean() < 1.0
    assert abs(detection.curve.length - np.hypot(*np.diff(line, axis=0).T).sum()) < 20.0


def test_gaps_that_are_too_long_stay_open() -> None:
    graph, matching = before_joining(hide(draw(coil()), *HIDDEN[0]))
    link_hidden_ends(graph, matching, 0.5)
    assert len(matching.chains()) == 2


@pytest.mark.parametrize(("cost", "chains"), [(0.0, 1), (50.0, 2)])
def test_evidence_against_a_gap_counts(cost: float, chains: int) -> None:
    graph, matching = before_joining(hide(draw(coil()), *HIDDEN[0]))
    steps = SimpleNamespace(costs=lambda pairs: np.full(len(pairs), cost))
    link_hidden_ends(graph, matching, 25.0, steps)  # type: ignore[arg-type]
    assert len(matching.chains()) == chains


def test_an_end_that_is_cheap_to_leave_open_stays_open() -> None:
    graph, matching = before_joining(hide(draw(coil()), *HIDDEN[0]))
    matching.branches.open_cost[:] = [0.0] * len(matching.branches.open_cost)
    link_hidden_ends(graph, matching, 25.0)
    assert len(matching.chains()) == 2


@pytest.mark.parametrize("width", [6.0, 9.0, 14.0])
@pytest.mark.parametrize("angle_deg", [20, 25, 30])
@pytest.mark.parametrize("bend_deg", [0, 25])
def test_of_two_cables_that_run_together_the_straighter_one_runs_on(
    width: float, angle_deg: float, bend_deg: float
) -> None:
    size = (320, 440)
    for turned in np.radians((7.0, 95.0, 170.0, 264.0)):
        along = np.linspace(-150.0, 150.0, 121)
        heading = turned + np.radians(bend_deg) * along / 300.0
        steps = np.column_stack((np.cos(heading), np.sin(heading))) * (along[1] - along[0])
        line = np.cumsum(steps, axis=0) - steps[:61].sum(axis=0) + (220.0, 160.0)
        branching = heading[60] + np.radians(angle_deg)
        beside = line[60] + 150.0 * np.array([(0.0, 0.0), (np.cos(branching), np.sin(branching))])
        found = detect(draw(line, beside, width=width, size=size))
        assert len(found) == 2
        assert distances(found, [line])[0] < 0.5 * width + 3.0, turned
