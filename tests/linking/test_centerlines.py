"""EndMatching to centre lines."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from drawings import mask_from_text, random_masks
from hypothesis import given
from linking_examples import beside, circle, cross, draw, linked, matching_of

import dloftbs
from dloftbs import Centerline, Config, JointKind
from dloftbs.cleaning import clean
from dloftbs.kernels.polyline_lengths import lay_out
from dloftbs.linking import centerlines
from dloftbs.linking.centerlines import assemble
from dloftbs.linking.end_matching import match_ends
from dloftbs.linking.loops import open_loops
from dloftbs.linking.parallel_runs import separate_parallel_runs
from dloftbs.skeleton import build_graph, skeletonize

LINE = np.array([[20.0, 120.0], [380.0, 130.0]])


def lines_of(mask: np.ndarray) -> list[Centerline]:
    return assemble(*linked(mask), 1.5, {})


def steps(line: Centerline) -> np.ndarray:
    return np.linalg.norm(np.diff(line.points, axis=0), axis=1)


def test_a_cable_is_one_segment_from_end_to_end() -> None:
    (line,) = lines_of(draw(LINE))
    assert (len(line.segments), line.joints, line.closed) == (1, (), False)
    ends = line.points[[0, -1]] if line.points[0, 0] < 200 else line.points[[-1, 0]]
    assert np.linalg.norm(ends - LINE, axis=1).max() < 4.0
    assert steps(line).max() < 2.0
    np.testing.assert_allclose(np.median(line.radius), 3.5, atol=0.2)


def test_a_crossing_is_a_joint_on_both_cables() -> None:
    lines = lines_of(draw(*cross(60)))
    assert len(lines) == 2
    for line in lines:
        assert [joint.kind for joint in line.joints] == [JointKind.CROSSING]
        (joint,) = line.joints
        first = len(line.segments[0])
        assert joint.u == (line.u[first - 1], line.u[first])
        length = steps(line).sum()
        assert 3.0 < (joint.u[1] - joint.u[0]) * length < 30.0
        assert 0.0 < joint.margin < math.inf
        assert 0.5 < joint.confidence <= 1.0


def test_a_loop_of_a_few_points_is_none() -> None:
    """It has no room for a periodic cubic."""
    mask = np.zeros((12, 40), np.uint8)
    mask[5:8, 5:8] = mask[5:8, 20:23] = 1
    crop, graph, matching = matching_of(mask)
    assert len(matching.partner) == 4
    for one, other in ((0, 2), (1, 3)):
        matching.partner[one], matching.partner[other] = other, one
    assert [is_loop for _, is_loop in matching.chains()] == [True]
    assert assemble(crop, graph, matching, 0.0, {}) == []


def test_the_next_best_choice_is_told_as_places() -> None:
    lines = lines_of(draw(*cross(60)))
    assert len(lines) == 2
    for line in lines:
        (joint,) = line.joints
        assert joint.alternatives != (None, None)
        for place in joint.alternatives:
            if place is not None:
                assert np.linalg.norm(np.array(place) - (200, 120)) < 25
        # Run the other way, they are told the other way round.
        assert line.reversed().joints[0].alternatives == joint.alternatives[::-1]


def test_a_gap_is_a_joint_of_its_own_kind() -> None:
    mask = draw(LINE)
    mask[:, 186:214] = 0
    (line,) = lines_of(mask)
    (joint,) = line.joints
    assert joint.kind is JointKind.GAP
    assert (joint.u[1] - joint.u[0]) * steps(line).sum() == pytest.approx(29, abs=4)


def test_a_longer_gap_is_less_sure() -> None:
    confidences = []
    for half in (10, 30, 50):
        mask = draw(LINE)
        mask[:, 200 - half : 200 + half] = 0
        (line,) = lines_of(mask)
        confidences.append(line.joints[0].confidence)
    assert confidences == sorted(confidences, reverse=True)
    assert confidences[0] - confidences[2] > 0.02


def test_a_spur_divides_no_cable() -> None:
    (line,) = lines_of(draw(LINE) | draw([(200, 125), (202, 133)], width=4))
    assert line.joints == ()
    assert steps(line).max() < 12.0  # what the spur distorts is left out


def test_a_kink_is_no_joint() -> None:
    (line,) = lines_of(draw([(100, 200), (200, 30), (300, 200)]))
    assert line.joints == ()
    assert steps(line).sum() == pytest.approx(2 * np.hypot(100, 170), abs=14)


def test_loops_come_last_and_have_no_joints() -> None:
    lines = lines_of(draw(circle((120, 100), 60), [(250, 40), (380, 60)]))
    assert [line.closed for line in lines] == [False, True]
    assert all(len(line.segments) == 1 for line in lines)
    assert lines[1].u[-1] < 1.0


def test_cables_side_by_side_run_through_without_jumps() -> None:
    for crosses in (False, True):
        lines = lines_of(draw(*beside(70, 7, crosses)))
        assert len(lines) == 2
        for line in lines:
            assert {joint.kind for joint in line.joints} == {JointKind.CROSSING}
            assert steps(line).max() < 25.0
            assert np.ptp(line.points[:, 0]) > 320


@given(random_masks)
def test_every_centre_line_fits_together(mask: np.ndarray) -> None:
    crop = clean(mask, Config().replace({"cleaning.open_px": 1}).cleaning)
    if crop is None:
        return
    graph, _ = build_graph(crop, skeletonize(crop), 10_000)
    if graph is None:
        return
    matching = match_ends(crop, graph, 25.0)
    separate_parallel_runs(graph, matching)
    open_loops(graph, matching)
    for line in assemble(crop, graph, matching, 1.5, {}):
        assert len(line.joints) == len(line.segments) - 1
        assert len(line.points) == len(line.radius) == len(line.u)
        assert len(line.points) >= 2
        assert np.isfinite(line.points).all()
        assert (line.points > -1.5).all()
        assert (line.points < np.array(mask.shape[::-1]) + 0.5).all()
        assert (line.radius > 0.0).all()
        assert (np.diff(line.u) >= 0.0).all()
        for joint in line.joints:
            assert joint.cost >= 0.0
            assert joint.margin >= 0.0
            assert 0.0 < joint.confidence <= 1.0


LETTERS = """
.......#..........
......#.##........
.....#...#........
.....#...#........
.....#...#........
.....#..#.........
....#...#.........
....#.##..........
....#.............
...#..............
..................
..................
..................
.............#..#.
.............#...#
..............##.#
.............#..##
..................
.......#..##......
.......#...#......
.......#...#......
........####......
.......#...#......
.......#...#......
.......#...#......
........###.......
..................
.###........###...
#...#..........#..
#...#........#..#.
#...#.......#.#.#.
#...#.......#...#.
#...#.......#...##
.#..#.......######
.###..............
"""
"""At the bottom right, a cable ends in a junction, in a branch that is too short to have points of its own."""


def test_every_span_of_points_lies_within_its_branch(monkeypatch: pytest.MonkeyPatch) -> None:
    spans: list[np.ndarray] = []

    def spy(points: np.ndarray, radius: np.ndarray, given: np.ndarray, *rest: Any) -> Any:
        spans.append(given)
        return lay_out(points, radius, given, *rest)

    monkeypatch.setattr(centerlines, "lay_out", spy)
    for letters in (mask_from_text(LETTERS), mask_from_text(LETTERS).T):
        dloftbs.detect(np.pad(letters, 3))
    given = np.concatenate(spans)
    assert len(given) > 10
    for first, last, step in given.tolist():
        assert (last - first) * step >= 0
