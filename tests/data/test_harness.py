"""Harnesses: branch points, paths and routes, of drawn masks."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest
from builders import bent, detection_of, line

import dloftbs
from dloftbs import ConfigError, FrameResult, InputError
from dloftbs.config import LinkingConfig
from dloftbs.data.branch_point import BranchPoint
from dloftbs.data.harness import Harness, Route


def drawn(*lines: tuple[tuple[int, int], tuple[int, int], int]) -> np.ndarray:
    mask = np.zeros((480, 640), np.uint8)
    for start, stop, width in lines:
        cv2.line(mask, start, stop, 255, width)
    return mask


TRUNK = ((40, 240), (600, 240), 12)
TREE = drawn(TRUNK, ((200, 240), (300, 60), 12), ((400, 240), (500, 420), 12))


@pytest.fixture(scope="module")
def tree() -> FrameResult:
    return dloftbs.detect(TREE, branched=True)


def test_a_trunk_with_two_branches_is_one_harness_of_five_branches(tree: FrameResult) -> None:
    (harness,) = tree.harnesses
    assert len(harness.branches) == len(tree) == 5
    assert len(harness.ends) == 4
    assert sorted(round(point.position[0], -1) for point in tree.branch_points) == [200, 400]
    for point in tree.branch_points:
        assert len(point.members) == 3
        for number, end in point.members:
            assert np.allclose(tree[number].curve(float(end)), point.position, atol=1.5)


def test_a_path_leads_from_end_to_end_through_the_branch_points(tree: FrameResult) -> None:
    (harness,) = tree.harnesses
    left, right = (min(harness.ends, key=lambda end: np.hypot(*(tree[end[0]].curve(end[1]) - at))) for at in
                   ((40, 240), (600, 240)))  # fmt: skip
    path = harness.path(left, right)
    assert path.length == pytest.approx(560, abs=12)
    assert np.abs(path(np.linspace(0, 1, 50))[:, 1] - 240).max() < 2.5
    assert np.allclose(path.start, tree[left[0]].curve(left[1]))
    assert harness.path_3d(left, right) is None


def test_of_two_branches_between_the_same_points_a_path_takes_the_shorter() -> None:
    curves = (
        line((0.0, 100.0), (100.0, 100.0)),
        bent((100.0, 100.0), (150.0, 0.0), (200.0, 100.0)),
        line((100.0, 100.0), (200.0, 100.0)),
        line((200.0, 100.0), (300.0, 100.0)),
    )
    points = (
        BranchPoint((100.0, 100.0), ((0, 1), (1, 0), (2, 0)), 1.0),
        BranchPoint((200.0, 100.0), ((1, 1), (2, 1), (3, 0)), 1.0),
    )
    harness = Harness(tuple(detection_of(curve) for curve in curves), (0, 1, 2, 3), points)
    assert harness.path((0, 0), (3, 1)).length == pytest.approx(300.0, abs=1.0)
    assert harness.path((3, 1), (0, 0)).length == pytest.approx(300.0, abs=1.0)


def test_routes_lead_from_the_trunk_to_each_other_end(tree: FrameResult) -> None:
    (harness,) = tree.harnesses
    assert len(tree.routes) == len(harness.routes) == 3
    assert {route.harness for route in tree.routes} == {0}
    end = harness.ends[1]
    others = harness.routes(trunk=end)
    assert len(others) == 3
    assert all(route.width == pytest.approx(13, abs=1) for route in others)
    with pytest.raises(InputError, match=r"an end must be one of the harness's ends"):
        harness.routes(trunk=(99, 0))


def test_the_trunk_is_the_end_that_is_wider_than_all_others() -> None:
    result = dloftbs.detect(
        drawn(((40, 240), (320, 240), 24), ((320, 240), (600, 120), 12), ((320, 240), (600, 360), 12)), branched=True
    )
    (harness,) = result.harnesses
    assert harness.trunk is not None
    assert result[harness.trunk[0]].curve(harness.trunk[1])[0] < 60
    assert [route.ends[0] for route in result.routes] == [harness.trunk] * 2


def test_two_cables_that_cross_stay_two_of_one_route_each() -> None:
    result = dloftbs.detect(drawn(TRUNK, ((250, 60), (350, 420), 12)), branched=True)
    assert result.branch_points == ()
    assert [len(harness.branches) for harness in result.harnesses] == [1, 1]
    assert len(result.routes) == 2


def test_the_route_of_a_single_branch_leads_from_its_trunk() -> None:
    harness = Harness((detection_of(line((0.0, 0.0), (100.0, 0.0))),), (0,))
    assert harness.trunk == harness.routes[0].ends[0] == (0, 0)
    (back,) = harness.routes(trunk=(0, 1))
    assert back.ends == ((0, 1), (0, 0))
    assert np.allclose(back.curve.start, (100.0, 0.0))


def branches_of_routes(harness: Harness) -> list[list[int]]:
    return [[step.branch for step in steps] for steps in harness._routing.ways(harness.trunk)]


def test_the_route_of_a_lasso_leads_around_its_loop() -> None:
    mask = drawn(((290, 240), (600, 240), 12))
    cv2.circle(mask, (190, 240), 100, 255, 12)
    result = dloftbs.detect(mask, branched=True)
    (harness,) = result.harnesses
    (route,) = harness.routes
    tail, loop = sorted(harness.branches, key=lambda branch: result[branch].curve.length)
    assert harness.ends == (harness.trunk,)
    assert branches_of_routes(harness) == [[tail, loop]]
    assert route.ends[0] == harness.trunk
    assert route.ends[1] in result.branch_points[0].members
    assert route.curve.length == pytest.approx(harness.length, rel=0.02)


def test_a_single_end_before_two_branches_side_by_side_has_a_route_through_both() -> None:
    curves = (
        line((0.0, 100.0), (100.0, 100.0)),
        bent((100.0, 100.0), (150.0, 0.0), (200.0, 100.0)),
        bent((100.0, 100.0), (150.0, 200.0), (200.0, 100.0)),
    )
    points = (
        BranchPoint((100.0, 100.0), ((0, 1), (1, 0), (2, 0)), 1.0),
        BranchPoint((200.0, 100.0), ((1, 1), (2, 1)), 1.0),
    )
    harness = Harness(tuple(detection_of(curve) for curve in curves), (0, 1, 2), points)
    (steps,) = branches_of_routes(harness)
    assert steps[0] == 0
    assert sorted(steps) == [0, 1, 2]


def test_each_side_of_a_triangle_with_an_end_at_each_corner_is_on_a_route() -> None:
    corners, outer = ((320, 140), (200, 340), (440, 340)), ((320, 20), (60, 430), (580, 430))
    sides = [(a, b, 12) for a, b in zip(corners, corners[1:] + corners[:1], strict=True)]
    result = dloftbs.detect(drawn(*sides, *((a, b, 12) for a, b in zip(corners, outer, strict=True))), branched=True)
    (harness,) = result.harnesses
    assert (len(harness.branches), len(harness.ends)) == (6, 3)
    assert {branch for steps in branches_of_routes(harness) for branch in steps} == set(harness.branches)
    assert all(set(route.ends) <= set(harness.ends) for route in harness.routes)


def test_a_trunk_from_which_every_way_turns_back_has_the_straightest_one() -> None:
    curves = (
        line((0.0, 100.0), (100.0, 100.0)),
        line((100.0, 100.0), (0.0, 80.0)),
        line((100.0, 100.0), (0.0, 130.0)),
        line((100.0, 100.0), (200.0, 100.0)),
    )
    detections = tuple(detection_of(curve) for curve in curves)
    ahead = BranchPoint((100.0, 100.0), ((0, 1), (1, 0), (2, 0), (3, 0)), 1.0)
    only_back = BranchPoint((100.0, 100.0), ((0, 1), (1, 0), (2, 0)), 1.0)
    harness = Harness(detections, (0, 1, 2, 3), (ahead,))
    assert len(harness.routes(trunk=(0, 0))) == 3
    harness = Harness(detections, (0, 1, 2), (only_back,))
    assert (2, 1) in {end for route in harness.routes(trunk=(0, 0)) for end in route.ends}
    assert [route.ends for route in harness.routes(trunk=(0, 0)) if (0, 0) in route.ends] == [((0, 0), (2, 1))]


def test_without_the_switch_there_is_none_of_it() -> None:
    result = dloftbs.detect(TREE)
    assert (result.branch_points, result.harnesses, result.routes) == ((), (), ())
    assert "harnesses" not in result.to_dict()


def test_plain_values_lead_back_to_the_same_harnesses(tree: FrameResult) -> None:
    again = FrameResult.from_dict(tree.to_dict())
    assert again.to_dict()["harnesses"] == tree.to_dict()["harnesses"]
    assert again.branch_points == tree.branch_points


def test_the_edge_list_makes_a_graph_of_networkx(tree: FrameResult) -> None:
    networkx = pytest.importorskip("networkx")
    graph = networkx.MultiGraph(tree.harnesses[0].edges)
    assert (graph.number_of_nodes(), graph.number_of_edges()) == (6, 5)
    assert networkx.is_tree(graph)


def test_a_path_between_an_end_and_itself_or_a_wrong_one_is_refused(tree: FrameResult) -> None:
    harness = tree.harnesses[0]
    with pytest.raises(InputError, match="from one end to another"):
        harness.path(harness.ends[0], harness.ends[0])
    with pytest.raises(InputError, match=r"an end must be \(detection, end\)"):
        harness.path(3, harness.ends[0])  # type: ignore[arg-type]


def test_wrong_values_of_the_types_are_refused(tree: FrameResult) -> None:
    with pytest.raises(InputError, match=r"position_3d must be \(x, y, z\)"):
        BranchPoint((0.0, 0.0), (), 1.0, (1.0, 2.0))  # type: ignore[arg-type]
    with pytest.raises(InputError, match="members must be among the branches"):
        Harness(tree.detections, (0,), tree.branch_points)


def test_a_region_of_interest_moves_branch_points_with_the_rest() -> None:
    whole = dloftbs.detect(TREE, branched=True, roi=(20, 30, 600, 420))
    for point in whole.branch_points:
        for number, end in point.members:
            assert np.allclose(whole[number].curve(float(end)), point.position, atol=1.5)
    assert replace(whole.branch_points[0], id=3).to_dict()["id"] == 3


def test_a_known_number_of_objects_cannot_be_stated_beside_it() -> None:
    with pytest.raises(ConfigError, match="leave out one of them"):
        dloftbs.detect(TREE, branched=True, objects=2)
    with pytest.raises(ConfigError, match="branched must be true or false"):
        LinkingConfig(branched=1)  # type: ignore[arg-type]


def test_a_route_says_what_is_wrong_with_it(tree: FrameResult) -> None:
    curve = tree[0].curve
    with pytest.raises(InputError, match="ends must be two, got 1"):
        Route(curve, 12.0, 0, ((0, 1),))  # type: ignore[arg-type]
    with pytest.raises(InputError, match="end of an end"):
        Route(curve, 12.0, 0, ((0, 1), (1, 2)))
    with pytest.raises(InputError, match="width"):
        Route(curve, -1.0, 0, ((0, 1), (1, 0)))
