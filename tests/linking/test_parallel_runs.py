"""Runs that two cables share."""

from __future__ import annotations

import copy

import numpy as np
import pytest
from linking_examples import beside, cross, dense, draw, matching_of
from scipy.spatial import cKDTree

import dloftbs
from dloftbs.data.mask_crop import MaskCrop
from dloftbs.data.prediction import Prediction
from dloftbs.linking.matched_ends import EndMatching
from dloftbs.linking.parallel_runs import separate_parallel_runs
from dloftbs.linking.temporal_prior import TemporalPrior


def sides_of_ends(crop: MaskCrop, matching: EndMatching) -> list[tuple[bool, bool]]:
    """Return for each cable, from left to right, whether its ends lie in the lower half of the image."""
    found = []
    for chain, _ in matching.chains():
        at = []
        for end in (chain[0], chain[-1] ^ 1):
            start, stop = matching.branches.spans[end // 2]
            at.append(crop.to_image(matching.branches.points[[start if end % 2 == 0 else stop - 1]])[0])
        found.append(tuple(y > 120 for _, y in sorted(map(tuple, at))))
    return sorted(found)


def test_where_crossing_and_touching_are_about_alike_the_prior_decides() -> None:
    """The crossing is too short for the mask alone to show it."""
    cables = beside(7 * 5, 7, True)
    crop, graph, matching = matching_of(draw(*cables))
    before = [detection for cable in cables for detection in dloftbs.detect(draw(cable))]
    assert len(before) == 2
    prior = TemporalPrior([Prediction(detection.curve, 1.0) for detection in before], crop, graph.width)
    separate_parallel_runs(graph, matching, prior)
    assert sides_of_ends(crop, matching) == [(False, True), (True, False)]
    assert min(matching.margin) < 0.0


def test_the_prior_does_not_exchange_what_clearly_touches() -> None:
    touching = beside(7 * 15, 7, False)
    crop, graph, matching = matching_of(draw(*touching))
    wrong = [dloftbs.detect(draw(cable))[0] for cable in beside(7 * 15, 7, True)]
    separate_parallel_runs(
        graph, matching, TemporalPrior([Prediction(seen.curve, 0.2) for seen in wrong], crop, graph.width)
    )
    assert sides_of_ends(crop, matching) == [(False, False), (True, True)]
    assert min(matching.margin) >= 0.0


SHORT = pytest.mark.xfail(strict=True, raises=AssertionError, reason="a crossing in a short bundle is read as a touch")


@pytest.mark.parametrize(
    ("length_widths", "crosses"),
    [(5, False), (10, False), (15, False), pytest.param(5, True, marks=SHORT), (10, True), (15, True)],
)
def test_cables_side_by_side_come_out_on_their_own_side(length_widths: int, crosses: bool) -> None:
    cables = beside(7 * length_widths, 7, crosses)
    crop, graph, matching = matching_of(draw(*cables))
    separate_parallel_runs(graph, matching)
    assert sides_of_ends(crop, matching) == ([(False, True), (True, False)] if crosses else [(False,) * 2, (True,) * 2])


@pytest.mark.parametrize("crosses", [False, True])
def test_each_duplicate_lies_in_its_own_axis_and_is_as_wide_as_one_cable(crosses: bool) -> None:
    cables = beside(70, 7, crosses)
    crop, graph, matching = matching_of(draw(*cables))
    separate_parallel_runs(graph, matching)
    trees = [cKDTree(dense(cable)) for cable in cables]
    assert matching.branches.duplicate_of
    for run, other in matching.branches.duplicate_of.items():
        if run > other:
            continue
        for one in (run, other):
            start, stop = matching.branches.spans[one]
            np.testing.assert_allclose(matching.branches.radius[start:stop], 0.5 * graph.width)
            away = np.min(
                [tree.query(crop.to_image(matching.branches.points[start:stop]))[0] for tree in trees], axis=0
            )
            assert np.median(away) < 1.0
        a, b = (matching.branches.points[slice(*matching.branches.spans[one])] for one in (run, other))
        apart = np.linalg.norm(a - b, axis=1)
        assert np.median(apart) == pytest.approx(7.0, abs=1.2)


def contents(matching: EndMatching) -> list[dict[str, object]]:
    """Return a copy of all that a matching and its branches hold."""
    return copy.deepcopy([matching.branches._asdict(), {**vars(matching), "branches": None}])


def test_where_nothing_is_shared_nothing_changes() -> None:
    _, graph, matching = matching_of(draw(*cross(60)))
    before = contents(matching)
    separate_parallel_runs(graph, matching)
    np.testing.assert_equal(contents(matching), before)


def test_the_other_cables_and_the_graph_keep_their_points() -> None:
    _, graph, matching = matching_of(draw(*beside(70, 7, True), [(30, 225), (370, 230)]))
    shared = np.zeros(len(matching.branches.points), dtype=bool)
    for run in matching.branches.duplicate_of:
        shared[slice(*matching.branches.spans[run])] = True
    points, graph_points = matching.branches.points.copy(), graph.points.copy()
    separate_parallel_runs(graph, matching)
    assert (matching.branches.points[shared] != points[shared]).any()
    assert (~shared).any()
    np.testing.assert_array_equal(matching.branches.points[~shared], points[~shared])
    np.testing.assert_array_equal(graph.points, graph_points)
    assert all(matching.partner[j] == i for i, j in enumerate(matching.partner) if j >= 0)


@pytest.mark.parametrize("crosses", [False, True])
def test_where_cables_change_partners_both_ends_of_a_joint_agree_on_its_cost(crosses: bool) -> None:
    for length in (10, 15, 20):
        _, graph, matching = matching_of(draw(*beside(7 * length, 7, crosses)))
        separate_parallel_runs(graph, matching)
        for end, partner in enumerate(matching.partner):
            assert partner < 0 or matching.cost[end] == matching.cost[partner]
