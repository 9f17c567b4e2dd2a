"""Graph to matching."""

from __future__ import annotations

import numpy as np
import pytest
from drawings import random_masks
from hypothesis import given
from linking_examples import beside, cross, draw, graph_of, matching_of

import dloftbs
from dloftbs import Config
from dloftbs.cleaning import clean
from dloftbs.data.graph import UNAVAILABLE, Graph
from dloftbs.data.mask_crop import MaskCrop
from dloftbs.data.prediction import Prediction
from dloftbs.linking.end_matching import PRIOR_BONUS, match_ends
from dloftbs.linking.kernels.joint_features import OPEN_JUNCTION
from dloftbs.linking.kernels.weights import OPEN
from dloftbs.linking.matched_ends import EndMatching
from dloftbs.linking.temporal_prior import TemporalPrior
from dloftbs.skeleton import build_graph, skeletonize

LINE = np.array([[20.0, 120.0], [380.0, 130.0]])


def joined(matching: EndMatching) -> list[tuple[int, int]]:
    return [(i, j) for i, j in enumerate(matching.partner) if j > i]


def turns(graph: Graph, matching: EndMatching) -> list[float]:
    """Return by how many degrees each joint turns."""
    out = graph.end_states[:, 2:4]
    return [float(np.degrees(np.arccos(np.clip(-out[i] @ out[j], -1, 1)))) for i, j in joined(matching)]


@pytest.mark.parametrize("angle", [90, 60, 45])
def test_a_cross_is_gone_straight_through(angle: float) -> None:
    _, graph, matching = matching_of(draw(*cross(angle)))
    assert len(joined(matching)) == 2
    assert max(turns(graph, matching)) < 12
    assert all(matching.is_crossing(i) for i, _ in joined(matching))
    assert len(matching.chains()) == 2
    assert matching.branches.duplicate_of == {}


def test_the_stem_of_a_t_stays_open() -> None:
    _, graph, matching = matching_of(draw(LINE, [(200, 125), (210, 220)]))
    assert len(joined(matching)) == 1
    assert max(turns(graph, matching)) < 12
    assert matching.branches.duplicate_of == {}
    ((i, _),) = joined(matching)
    assert 1.2 < matching.margin[i] < 2 * OPEN[OPEN_JUNCTION]
    assert matching.alternative[i] >= 0


@pytest.mark.parametrize(("gap_widths", "is_bridged"), [(2.0, True), (4.0, True), (5.0, True), (7.0, False)])
def test_a_gap_is_bridged_up_to_the_longest(gap_widths: float, is_bridged: bool) -> None:
    mask = draw(LINE)
    half = int(3.5 * gap_widths)
    mask[:, 200 - half : 200 + half] = 0
    _, _, matching = matching_of(mask, max_gap_widths=6.0)
    assert len(joined(matching)) == is_bridged
    assert not any(matching.is_crossing(i) for i, _ in joined(matching))


def test_a_longer_gap_costs_more_and_is_less_sure() -> None:
    costs, margins = [], []
    for half in (7, 30, 60):
        mask = draw(LINE)
        mask[:, 200 - half : 200 + half] = 0
        _, _, matching = matching_of(mask)
        ((i, _),) = joined(matching)
        costs.append(matching.cost[i])
        margins.append(matching.margin[i])
    assert costs == sorted(costs)
    assert margins == sorted(margins, reverse=True)


def test_dashes_are_joined_in_order_and_parallel_cables_are_not() -> None:
    dashes = [[(x, 120 + x / 30), (x + 40, 120 + (x + 40) / 30)] for x in range(20, 340, 65)]
    _, _, matching = matching_of(draw(*dashes))
    ((chain, is_loop),) = matching.chains()
    assert len(chain) == len(dashes)
    assert not is_loop
    _, _, matching = matching_of(draw([(20, 60), (380, 60)], [(20, 90), (380, 90)]))
    assert joined(matching) == []


def test_a_gap_beside_a_crossing_does_not_steal_its_ends() -> None:
    """A third cable ends right before the crossing, in line with one of the ends."""
    mask = draw(*cross(90), [(205, 20), (230, 20)])
    _, graph, matching = matching_of(mask)
    crossing = [(i, j) for i, j in joined(matching) if matching.is_crossing(i)]
    assert len(crossing) == 2
    assert max(turns(graph, matching)) < 12


@pytest.mark.parametrize("crosses", [False, True])
def test_a_run_that_two_cables_share_is_listed_twice(crosses: bool) -> None:
    _, graph, matching = matching_of(draw(*beside(70, 7, crosses)))
    assert len(matching.branches.duplicate_of) % 2 == 0
    assert len(matching.branches.duplicate_of) >= 2
    for copy, branch in matching.branches.duplicate_of.items():
        assert matching.branches.duplicate_of[branch] == copy
        assert matching.branches.branch_id[copy] == matching.branches.branch_id[branch]
        a, b = matching.branches.spans[copy]
        c, d = matching.branches.spans[branch]
        np.testing.assert_array_equal(matching.branches.points[a:b], matching.branches.points[c:d])
    assert len(matching.branches.points) > len(graph.points)
    assert len(matching.chains()) == 2
    assert all(
        matching.partner[end] >= 0 for branch in matching.branches.duplicate_of for end in (2 * branch, 2 * branch + 1)
    )


def test_three_ends_alike_leave_no_sure_choice() -> None:
    ends = [(200 + 100 * np.cos(a), 120 + 100 * np.sin(a)) for a in 0.2 + np.arange(3) * 2 * np.pi / 3]
    _, _, matching = matching_of(draw(*[[(200, 120), end] for end in ends]))
    assert len(joined(matching)) == 1
    ((i, j),) = joined(matching)
    assert matching.margin[i] < 0.6
    rest = ({0, 1, 2, 3, 4, 5} - {i, j}) & {end for end in range(6) if matching.branches.nodes[end] >= 0}
    assert {matching.alternative[i], matching.alternative[j]} & rest


@given(random_masks)
def test_partners_are_mutual_and_joints_are_worth_it(mask: np.ndarray) -> None:
    crop = clean(mask, Config().replace({"cleaning.open_px": 1}).cleaning)
    if crop is None:
        return
    graph, _ = build_graph(crop, skeletonize(crop), 10_000)
    if graph is None:
        return
    matching = match_ends(crop, graph, 25.0)
    most = 2 * OPEN.max()
    for i, j in enumerate(matching.partner):
        if j >= 0:
            assert matching.partner[j] == i != j
            assert UNAVAILABLE not in (matching.branches.nodes[i], matching.branches.nodes[j])
            assert 0.0 <= matching.cost[i] == matching.cost[j] < most
            assert 0.0 <= matching.margin[i] == matching.margin[j] <= most
            assert matching.alternative[i] != j
    visited = [end // 2 for chain, _ in matching.chains() for end in chain]
    assert len(visited) == len(set(visited))


def test_the_graph_stays_as_it_is() -> None:
    crop, graph = graph_of(draw(*beside(70, 7, True)))
    before = {name: np.copy(value) for name, value in graph._asdict().items()}
    match_ends(crop, graph, 25.0)
    for name, value in graph._asdict().items():
        np.testing.assert_array_equal(value, before[name])


def straight_and_bent(straight_widths: float, bent_widths: float) -> np.ndarray:
    """Return a straight cable and one that turns by 100 degrees, each with a gap in its middle, cut vertically."""
    corner, arm = np.array([200, 110]), 140 * np.array([np.cos(np.radians(50)), np.sin(np.radians(50))])
    straight, bent = draw([(20, 30), (380, 30)]), draw([corner + arm * (-1, 1), corner, corner + arm])
    for mask, widths in ((straight, straight_widths), (bent, bent_widths)):
        half = int(3.5 * widths)
        mask[:, 200 - half : 200 + half] = 0
    return straight | bent


@pytest.mark.parametrize(("straight_widths", "is_bridged"), [(0.0, False), (1.5, False), (4.0, False), (8.0, True)])
def test_a_sure_gap_makes_others_as_long_likely(straight_widths: float, is_bridged: bool) -> None:
    _, _, matching = matching_of(straight_and_bent(straight_widths, 8.0))
    assert len(joined(matching)) == (straight_widths > 0.0) + is_bridged


def test_short_gaps_between_pieces_are_joined_before_a_long_one_over_them() -> None:
    mask = draw([(20, 30), (380, 30)], [(20, 120), (380, 120)])
    mask[:60, 160:240] = 0
    mask[60:, 160:185] = mask[60:, 215:240] = 0
    _, _, matching = matching_of(mask)
    assert len(joined(matching)) == 3
    assert len(matching.chains()) == 2


def test_a_sure_gap_elsewhere_does_not_outrank_ground_in_sight() -> None:
    mask = straight_and_bent(8.0, 8.0)
    image = np.full((*mask.shape, 3), 90, dtype=np.uint8)
    image[mask != 0] = 200
    assert len(dloftbs.detect(mask)) == 2
    image[:60, 172:228] = (20, 160, 30)  # the straight cable is hidden, the bent one has ground in its gap
    assert len(dloftbs.detect(mask, image=image)) == 3


def fork(extra: float) -> list[list[tuple[float, float]]]:
    """Return a cable that ends before a gap and two beyond it, of which the second is the worse continuation."""
    return [[(20, 120), (180, 120)], [(205, 129), (380, 160)], [(205, 111 - extra), (380, 60 - extra)]]


def prior_along(points: list[tuple[float, float]], crop: MaskCrop, graph: Graph, trust: float = 1.0) -> TemporalPrior:
    (seen,) = dloftbs.detect(draw(points))
    return TemporalPrior([Prediction(seen.curve, trust)], crop, graph.width)


@pytest.mark.parametrize("extra", [0, 7])
def test_where_two_continuations_are_about_alike_the_prior_decides(extra: float) -> None:
    crop, graph = graph_of(draw(*fork(extra)))
    alone = match_ends(crop, graph, 25.0)
    start, lower, upper = fork(extra)
    follow_lower = match_ends(crop, graph, 25.0, prior_along([*start, *lower], crop, graph))
    follow_upper = match_ends(crop, graph, 25.0, prior_along([*start, *upper], crop, graph))
    assert len(joined(follow_lower)) == len(joined(follow_upper)) == 1
    assert joined(follow_lower) != joined(follow_upper)
    follows, overrules = sorted((follow_lower, follow_upper), key=lambda found: joined(found) != joined(alone))
    assert joined(follows) == joined(alone)
    assert follows.cost == alone.cost
    assert follows.margin == alone.margin
    for i, j in joined(overrules):
        assert overrules.cost[i] == overrules.cost[j] > 0.0
        assert -PRIOR_BONUS < overrules.margin[i] == overrules.margin[j] < 0.0


def test_a_prior_of_little_weight_does_not() -> None:
    crop, graph = graph_of(draw(*fork(7)))
    start, _, upper = fork(7)
    prior = prior_along([*start, *upper], crop, graph, trust=0.2)
    assert joined(match_ends(crop, graph, 25.0, prior)) == joined(match_ends(crop, graph, 25.0))


def test_the_prior_does_not_bend_a_clear_crossing() -> None:
    crop, graph = graph_of(draw(*cross(90)))
    wrong = prior_along([(60, 120), (190, 120), (200, 130), (200, 220)], crop, graph)
    assert joined(match_ends(crop, graph, 25.0, wrong)) == joined(match_ends(crop, graph, 25.0))
