"""Skeleton to graph."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from drawings import random_masks
from hypothesis import given
from linking_examples import circle, cross, draw, graph_of

import dloftbs
from dloftbs import Config
from dloftbs.cleaning import clean
from dloftbs.data.graph import FREE, UNAVAILABLE, Graph
from dloftbs.skeleton import build_graph, skeletonize
from dloftbs_lab.synthetic import FreeEnd, draw_cable_mask

LINE = np.array([[20.0, 120.0], [380.0, 130.0]])


def ends_at(graph: Graph) -> list[int]:
    """Count the ends at each junction, spurs left out, sorted."""
    nodes = graph.nodes[~np.repeat(graph.spurs, 2)]
    return sorted(np.unique(nodes[nodes >= 0], return_counts=True)[1].tolist())


@pytest.mark.parametrize("width", [3.0, 7.0, 12.0, 40.0])
def test_a_cable_is_one_run_with_two_free_ends(width: float) -> None:
    crop, graph = graph_of(draw(LINE, width=width))
    assert (graph.branch_count, graph.loops) == (1, [])
    assert graph.nodes.tolist() == [FREE, FREE]
    assert graph.spans.tolist() == [[0, len(graph.points)]]
    assert graph.width == pytest.approx(width, abs=0.5)
    away = np.abs(crop.to_image(graph.points) @ (-10.0 / 360, 1.0) - (120.0 - 20 / 36)) / np.hypot(1, 1 / 36)
    inner = slice(int(width), -int(width))
    assert away[inner].max() < 0.6


@pytest.mark.parametrize("angle", [90, 60, 40])
def test_a_cross_is_one_junction_of_four_ends_that_point_at_it(angle: float) -> None:
    crop, graph = graph_of(draw(*cross(angle)))
    assert ends_at(graph) == [4]
    states = graph.end_states[graph.nodes >= 0]
    to_centre = np.array([200.0, 120.0]) - crop.to_image(states[:, :2])
    matrix, _ = crop.image_transform
    pointing = states[:, 2:4] @ matrix.T
    cosines = np.einsum("ij,ij->i", pointing, to_centre) / np.linalg.norm(to_centre, axis=1)
    assert cosines.min() > 0.97


def test_an_oblique_cross_is_one_junction_or_two_with_a_run_between() -> None:
    for angle in (10, 15, 20, 30):
        _, graph = graph_of(draw(*cross(angle)))
        assert ends_at(graph) in ([4], [3, 3])


def test_a_t_is_a_junction_of_three_ends() -> None:
    _, graph = graph_of(draw(LINE, [(200, 125), (210, 220)]))
    assert ends_at(graph) == [3]
    assert not graph.spurs.any()


def test_what_sticks_out_by_less_than_the_cable_is_wide_is_a_spur() -> None:
    _, graph = graph_of(draw(LINE) | draw([(200, 125), (201, 131)], width=3))
    assert ends_at(graph) in ([], [2])
    assert graph.spurs.sum() <= 1
    _, graph = graph_of(draw(LINE) | draw([(200, 125), (202, 145)], width=5))
    assert ends_at(graph) == [3]


def test_a_loop_is_a_loop_and_a_figure_eight_has_one_junction() -> None:
    _, ring = graph_of(draw(circle((200, 120), 80)))
    assert (ring.branch_count, len(ring.loops)) == (0, 1)
    a = np.linspace(0, 2 * np.pi, 600)
    _, eight = graph_of(draw(np.column_stack((200 + 150 * np.sin(a), 120 + 80 * np.sin(2 * a)))))
    assert eight.loops == []
    assert ends_at(eight) == [4]


def test_a_corner_that_no_cable_can_have_is_a_junction_of_two_ends() -> None:
    _, graph = graph_of(draw([(100, 200), (200, 30), (300, 200)]))
    assert graph.branch_count == 2
    assert ends_at(graph) == [2]
    _, smooth = graph_of(draw(circle((200, 160), 60, np.pi, 2 * np.pi)))
    assert (smooth.branch_count, ends_at(smooth)) == (1, [])


@pytest.mark.parametrize(("most", "branches"), [(1, 1), (2, 2), (1000, 2)])
def test_sharp_bends_make_no_more_branches_than_allowed(most: int, branches: int) -> None:
    crop = clean(draw([(100, 200), (200, 30), (300, 200)]), Config().cleaning)
    assert crop is not None
    graph, found = build_graph(crop, skeletonize(crop), most)
    assert graph is not None
    assert found == 1
    assert graph.branch_count == branches


def test_specks_and_what_was_swallowed_cannot_be_joined() -> None:
    mask = draw(LINE)
    mask[40:43, 200:203] = 1
    _, graph = graph_of(mask)
    assert graph.branch_count == 2
    assert sorted(graph.nodes.tolist()) == [UNAVAILABLE, UNAVAILABLE, FREE, FREE]


def test_round_and_cut_ends_differ() -> None:
    mask = draw(LINE, width=12)
    mask[:, 300:] = 0
    _, graph = graph_of(mask)
    assert graph.branch_count == 1
    flat, rounded = sorted(graph.end_roundness.tolist())
    assert flat < 0.1
    assert rounded > flat + 0.3


@pytest.mark.parametrize("slant", [-0.6, 0.6])
def test_the_end_that_a_slanting_cut_leaves_points_along_the_cable(slant: float) -> None:
    mask = draw([(20, 120), (380, 120)], width=13)
    yy, xx = np.indices(mask.shape)
    mask[xx > 250 + slant * (yy - 120)] = 0
    crop, graph = graph_of(mask)
    tips = crop.to_image(graph.end_states[:, :2])
    right = int(np.argmax(tips[:, 0]))
    ahead = crop.to_image(graph.end_states[:, :2] + graph.end_states[:, 2:4])[right] - tips[right]
    assert abs(np.degrees(np.arctan2(ahead[1], ahead[0]))) < 15.0
    assert abs(tips[right, 1] - 120.0) < 3.0
    assert graph.end_roundness[right] < 0.6


def test_more_runs_than_allowed_make_no_graph() -> None:
    crop = clean(draw(*cross(90)), Config().cleaning)
    assert crop is not None
    skeleton = skeletonize(crop)
    graph, branches = build_graph(crop, skeleton, 1000)
    assert graph is not None
    assert build_graph(crop, skeleton, branches)[0] is not None
    assert build_graph(crop, skeleton, branches - 1) == (None, branches)


@given(random_masks)
def test_every_graph_fits_together(mask: np.ndarray) -> None:
    crop = clean(mask, Config().replace({"cleaning.open_px": 1}).cleaning)
    if crop is None:
        return
    graph, _ = build_graph(crop, skeletonize(crop), 10_000)
    if graph is None:
        return
    n, total = graph.branch_count, len(graph.points)
    assert len(graph.pixels) == len(graph.radius) == total == graph.offsets[-1]
    assert graph.nodes.shape == graph.end_roundness.shape == (2 * n,)
    assert graph.end_states.shape == (2 * n, 6)
    assert graph.spurs.shape == (n,)
    assert (graph.nodes >= UNAVAILABLE).all()
    assert (graph.offsets[:n] <= graph.spans[:, 0]).all()
    assert (graph.spans[:, 0] <= graph.spans[:, 1]).all()
    assert (graph.spans[:, 1] <= graph.offsets[1 : n + 1]).all()
    assert np.isfinite(graph.points).all()
    assert np.isfinite(graph.end_states).all()
    assert (graph.radius > 0).all()
    size = np.linalg.norm(graph.end_states[:, 2:4], axis=1)
    assert (np.isclose(size, 1.0) | (size == 0.0)).all()


@pytest.mark.parametrize("seed", [0, 6, 7])
def test_the_strands_of_a_frayed_end_are_no_cables(seed: int) -> None:
    """Of a cable that comes near, as a camera sees it."""
    rng = np.random.default_rng(seed)
    line = np.column_stack((np.linspace(20.0, 380.0, 361), 120.0 + 15.0 * np.sin(np.linspace(0.0, 3.0, 361))))
    mask = draw_cable_mask(
        line, np.linspace(8.0, 16.0, 361), (240, 440), (FreeEnd("round"), FreeEnd.draw(rng, "frayed"))
    )
    assert len(dloftbs.detect(mask)) == 1


@pytest.mark.parametrize("tail", [20, 30, 50])
def test_short_tails_beyond_a_disc_are_cables(tail: int) -> None:
    """A disc over a crossing is what a hand or a connector looks like in a mask."""
    long, short = np.array([[40.0, 120.0], [360.0, 120.0]]), np.array([[0.0, -25.0 - tail], [0.0, 25.0 + tail]])
    mask = draw(long, np.array([200.0, 120.0]) + short)
    cv2.circle(mask, (200, 120), 25, 1, -1)
    assert len(dloftbs.detect(mask)) == 2


@pytest.mark.parametrize("tail", [14, 20])
def test_a_short_tail_beyond_a_hose_is_a_cable(tail: int) -> None:
    hose = draw(np.array([[20.0, 120.0], [380.0, 120.0]]), width=24.0)
    mask = hose | draw(np.array([[200.0, 20.0], [200.0, 132.0 + tail]]))
    assert max(detection.curve.sample(50)[:, 1].max() for detection in dloftbs.detect(mask)) > 125.0 + tail
