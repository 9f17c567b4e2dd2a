"""Depth and colours tell which cables go on into which at junctions."""

from __future__ import annotations

import numpy as np
import pytest
from drawings import draw_cable
from linking_examples import graph_of

import dloftbs
from dloftbs import PinholeCamera
from dloftbs.data.graph import Graph, branch_of
from dloftbs.data.mask_crop import MaskCrop
from dloftbs.evidence import EvidenceMap
from dloftbs.linking.end_matching import match_ends
from dloftbs.linking.evidence_steps import EvidenceSteps, exchange_by_evidence
from dloftbs.linking.matched_ends import turn_costs
from dloftbs_lab.synthetic import DepthNoise

SIZE = (300, 420)
WIDTH = 12
CAMERA = PinholeCamera(600.0, 600.0, 210.0, 150.0)
TABLE_M = 0.9
NOISE = DepthNoise(depth_noise=1.0, hole_share=0.05, flying=0.5)
MIDDLE = (210.0, 155.0)
ARMS = [np.array([start, MIDDLE]) for start in ((40.0, 70.0), (40.0, 240.0), (380.0, 240.0), (380.0, 70.0))]
"""Two straight cables that cross, cut where they do."""
CROSSING, TOUCHING = (0.1, 0.15, 0.1, 0.15), (0.1, 0.15, 0.15, 0.1)
"""Heights of the arms over the table, m: they cross, or come near each other and part. The mask is the same."""
ACROSS = np.array([(210.0, 20.0), (212.0, 150.0), (205.0, 280.0)])
"""One that goes over the place where the two meet."""

seeds = pytest.mark.parametrize("seed", range(6))


def scene(heights_m: tuple[float, ...], seed: int, *, over: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Return the mask of the arms, and the depth, m, that a camera has; one more may lie over all."""
    rng = np.random.default_rng(seed)
    mask, depth = np.zeros(SIZE, bool), np.full(SIZE, TABLE_M, np.float32)
    lines = [*ARMS, ACROSS] if over else ARMS
    for line, height in zip(lines, (*heights_m, 0.2), strict=False):
        drawn = draw_cable(line, WIDTH, SIZE) > 0
        mask |= drawn
        depth[drawn] = TABLE_M - height
    return mask, NOISE.apply(depth, mask, rng).astype(np.float32)


def sides_of(found: dloftbs.FrameResult | tuple[dloftbs.Detection, ...]) -> set[frozenset[tuple[bool, bool]]]:
    """Return the quarters of the image in which the two ends of each object lie, of those from side to side."""
    quarters = set()
    for one in found:
        ends = one.curve(np.array([0.0, 1.0]))
        if np.ptp(ends[:, 0]) > 200.0:
            quarters.add(frozenset((bool(x > MIDDLE[0]), bool(y > MIDDLE[1])) for x, y in ends))
    return quarters


CROSSED = {frozenset({(False, False), (True, True)}), frozenset({(False, True), (True, False)})}
APART = {frozenset({(False, False), (True, False)}), frozenset({(False, True), (True, True)})}


@seeds
@pytest.mark.parametrize("over", [False, True])
@pytest.mark.parametrize(("heights", "expected"), [(CROSSING, CROSSED), (TOUCHING, APART)])
def test_depth_tells_what_the_mask_cannot(heights, expected, over, seed):
    mask, depth = scene(heights, seed, over=over)
    assert sides_of(dloftbs.detect(mask, depth=depth, camera=CAMERA)) == expected


def crowded(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Return mask and depth of arms that touch between two more cables; depth is known beyond these alone."""
    across = [np.array([(x, 20.0), (x + 2.0, 150.0), (x - 5.0, 280.0)]) for x in (170.0, 250.0)]
    mask, depth = np.zeros(SIZE, bool), np.full(SIZE, TABLE_M, np.float32)
    for line, height in zip([*ARMS, *across], (0.1, 0.3, 0.3, 0.1, 0.4, 0.5), strict=True):
        drawn = draw_cable(line, WIDTH, SIZE) > 0
        mask |= drawn
        depth[drawn] = TABLE_M - height
    depth = NOISE.apply(depth, mask, np.random.default_rng(seed)).astype(np.float32)
    depth[:, 176:244] = 0.0
    return mask, depth


@seeds
def test_branches_without_depth_take_it_from_the_next_ones(seed):
    mask, depth = crowded(seed)
    assert sides_of(dloftbs.detect(mask)) == CROSSED
    assert sides_of(dloftbs.detect(mask, depth=depth, camera=CAMERA)) == APART


@seeds
def test_exchanged_joints_have_the_cost_of_their_own_bending(seed):
    mask, depth = crowded(seed)
    crop, graph = graph_of(mask)
    evidence = EvidenceMap(crop, depth=depth, camera=CAMERA).at(graph)
    matching = match_ends(crop, graph, 20.0, evidence=evidence)
    before = list(matching.partner)
    exchange_by_evidence(graph, matching, EvidenceSteps(graph, matching, evidence))
    changed = [end for end, partner in enumerate(matching.partner) if partner != before[end]]
    assert len(changed) == 4
    for end in changed:
        pair = np.array([[end, matching.partner[end]]])
        through = turn_costs(matching.branches, pair, graph.width)
        assert matching.cost[end] == pytest.approx(float(through[0]))


@pytest.mark.parametrize("over", [False, True])
def test_the_mask_alone_reads_a_crossing(over):
    mask, _ = scene(TOUCHING, 0, over=over)
    assert sides_of(dloftbs.detect(mask)) == CROSSED


@seeds
def test_depth_without_a_camera_tells_nothing_of_crossings(seed):
    mask, depth = scene(TOUCHING, seed)
    assert sides_of(dloftbs.detect(mask, depth=depth)) == CROSSED


@seeds
def test_heights_within_a_cables_thickness_tell_nothing(seed):
    mask, depth = scene((0.010, 0.012, 0.012, 0.010), seed)
    assert sides_of(dloftbs.detect(mask, depth=depth, camera=CAMERA)) == CROSSED


@seeds
def test_the_same_height_everywhere_changes_nothing(seed):
    mask, depth = scene((0.1,) * 4, seed)
    alone, told = dloftbs.detect(mask), dloftbs.detect(mask, depth=depth, camera=CAMERA)
    assert [one.curve for one in told] == [one.curve for one in alone]


@seeds
def test_ground_that_is_taken_for_a_cable_tells_nothing(seed):
    """Thin cables whose pixels show the table, by a displaced depth, beside others that show their own."""
    mask, depth = scene((0.1, 0.0, 0.1, 0.1), seed)
    assert sides_of(dloftbs.detect(mask, depth=depth, camera=CAMERA)) == CROSSED


BESIDE = [
    np.array([(40.0, 110.0), (130.0, 147.0), (210.0, 147.0), (290.0, 147.0), (380.0, 110.0)]),
    np.array([(40.0, 190.0), (130.0, 153.0), (210.0, 153.0), (290.0, 153.0), (380.0, 190.0)]),
]
"""Two cables that lie over each other for long and part again, so that by the mask they rather touch than cross."""


@seeds
@pytest.mark.parametrize("crosses", [False, True])
def test_of_two_cables_over_each_other_neither_rises_nor_falls_by_much_along_the_way(crosses, seed):
    """By 16 cm along 14 widths."""
    mask, depth = np.zeros(SIZE, bool), np.full(SIZE, TABLE_M, np.float32)
    for height in (0.1, 0.26):
        for number, line in enumerate(BESIDE):
            for half, is_upper in ((line[:3], number == 1), (line[2:], (number == 1) != crosses)):
                drawn = draw_cable(half, WIDTH, SIZE) > 0
                mask |= drawn
                if is_upper == (height == 0.26):
                    depth[drawn] = TABLE_M - height
    depth = NOISE.apply(depth, mask, np.random.default_rng(seed)).astype(np.float32)
    assert sides_of(dloftbs.detect(mask, depth=depth, camera=CAMERA)) == (CROSSED if crosses else APART)


@seeds
@pytest.mark.parametrize("opening", [30.0, 60.0])
def test_a_cable_that_folds_back_away_from_the_camera_is_one(opening, seed):
    """Its tip is a branch of its own, or none; depth grows by a metre along it, and is steepest at the tip."""
    tip = np.array([380.0, 150.0])
    arms = [np.array([(40.0, 150.0 + side * opening), tip]) for side in (-1.0, 1.0)]
    mask, depth = np.zeros(SIZE, bool), np.full(SIZE, 2.5, np.float32)
    reach = np.hypot(*(np.indices(SIZE)[::-1] - tip[:, None, None]))
    for line, way in zip(arms, (-1.0, 1.0), strict=True):
        drawn = draw_cable(line, WIDTH, SIZE) > 0
        mask |= drawn
        depth[drawn] = 1.3 + way * 0.5 * np.sqrt(reach[drawn] / reach.max())
    depth = NOISE.apply(depth, mask, np.random.default_rng(seed)).astype(np.float32)
    assert len(dloftbs.detect(mask)) == 1
    assert len(dloftbs.detect(mask, depth=depth, camera=CAMERA)) == 1


ARRIVING = [
    np.array([(40.0, 90.0), (170.0, 146.0), (230.0, 147.0)]),
    np.array([(40.0, 210.0), (170.0, 154.0), (230.0, 153.0)]),
]
"""Two cables that come together and run beside each other; one of them goes on alone. The mask is the same for both."""
ALONE = np.array([(225.0, 150.0), (390.0, 150.0)])


@seeds
@pytest.mark.parametrize("lower", [False, True])
def test_of_two_cables_beside_each_other_the_one_at_the_same_depth_runs_on(lower, seed):
    heights = 0.1, 0.16
    mask, depth = np.zeros(SIZE, bool), np.full(SIZE, TABLE_M, np.float32)
    for line, height in zip([*ARRIVING, ALONE], (*heights, heights[lower]), strict=True):
        drawn = draw_cable(line, WIDTH, SIZE) > 0
        mask |= drawn
        depth[drawn] = TABLE_M - height
    depth = NOISE.apply(depth, mask, np.random.default_rng(seed)).astype(np.float32)
    found = dloftbs.detect(mask, depth=depth, camera=CAMERA)
    ends = [sorted(detection.curve(np.array([0.0, 1.0])).tolist()) for detection in found]
    assert len(ends) == 2
    (runs_on,) = [start for start, stop in ends if stop[0] > 380.0]
    assert (runs_on[1] > MIDDLE[1]) == lower


def depth_of(depth: np.ndarray, crop: MaskCrop, graph: Graph, end: int) -> float:
    """Return the median depth, m, along the branch of an end."""
    start, stop = graph.spans[branch_of(end)]
    columns, rows = np.rint(crop.to_image(graph.points[start:stop])).astype(int).T
    return float(np.median(depth[rows, columns]))


def test_depth_along_a_branch_tells_which_cable_goes_on_there_if_it_is_long_enough() -> None:
    mask, depth = scene(TOUCHING, 0)
    crop, graph = graph_of(mask)
    evidence = EvidenceMap(crop, depth=depth, camera=CAMERA).at(graph)
    (node,) = {node for node in graph.nodes.tolist() if node >= 0}
    high, low = (
        [
            end
            for end in np.flatnonzero(graph.nodes == node).tolist()
            if abs(depth_of(depth, crop, graph, end) - at) < 0.01
        ]
        for at in (TABLE_M - 0.15, TABLE_M - 0.1)
    )
    assert len(high) == len(low) == 2
    start, stop = graph.spans[high[0] // 2].tolist()
    at_start = high[0] % 2 == 0
    swerves = evidence.swerves_into([high[1], low[0]], (start, stop), at_start, np.full(2, 2.0 * WIDTH))
    assert swerves is not None
    assert swerves[0] == 0.0
    assert swerves[1] > 2.0
    short = (start, start + WIDTH // 2) if at_start else (stop - WIDTH // 2, stop)
    assert evidence.swerves_into([high[1], low[0]], short, at_start, np.full(2, 2.0 * WIDTH)) is None


RED, BLUE, GREEN, GROUND = (40, 40, 200), (200, 90, 30), (50, 160, 60), (90, 90, 90)


def painted(seed: int, *cables: tuple[np.ndarray, tuple[int, int, int]]) -> tuple[np.ndarray, np.ndarray]:
    """Return the mask of cables, each drawn over those before it, and a noisy image of them."""
    mask, image = np.zeros(SIZE, bool), np.full((*SIZE, 3), GROUND, np.float64)
    for line, colour in cables:
        drawn = draw_cable(line, WIDTH, SIZE) > 0
        mask |= drawn
        image[drawn] = colour
    image += np.random.default_rng(seed).normal(0.0, 8.0, image.shape)
    return mask, np.clip(image, 0.0, 255.0).astype(np.uint8)


@seeds
@pytest.mark.parametrize("crosses", [False, True])
def test_colours_tell_whether_two_cables_that_lie_over_each_other_cross(crosses, seed):
    upper, lower = BESIDE
    after = (BLUE, RED) if crosses else (RED, BLUE)
    halves = (upper[:3], RED), (lower[:3], BLUE), (upper[2:], after[0]), (lower[2:], after[1])
    mask, image = painted(seed, *halves)
    assert sides_of(dloftbs.detect(mask, image=image)) == (CROSSED if crosses else APART)


@seeds
def test_branches_too_short_to_show_a_colour_take_it_from_the_next_ones(seed):
    across = [np.array([(x, 20.0), (x + 2.0, 150.0), (x - 5.0, 280.0)]) for x in (170.0, 250.0)]
    arms = zip(ARMS, (RED, BLUE, BLUE, RED), strict=True)
    mask, image = painted(seed, *arms, *((line, GREEN) for line in across))
    assert sides_of(dloftbs.detect(mask)) == CROSSED
    assert sides_of(dloftbs.detect(mask, image=image)) == APART


@seeds
@pytest.mark.parametrize("lower", [False, True])
def test_of_two_cables_beside_each_other_the_one_of_the_same_colour_runs_on(lower, seed):
    mask, image = painted(seed, (ARRIVING[0], RED), (ARRIVING[1], BLUE), (ALONE, BLUE if lower else RED))
    found = dloftbs.detect(mask, image=image)
    ends = [sorted(detection.curve(np.array([0.0, 1.0])).tolist()) for detection in found]
    assert len(ends) == 2
    (runs_on,) = [start for start, stop in ends if stop[0] > 380.0]
    assert (runs_on[1] > MIDDLE[1]) == lower


@seeds
def test_cables_of_one_colour_are_read_by_the_mask(seed):
    mask, image = painted(seed, *((line, RED) for line in (*ARMS, ACROSS)))
    assert sides_of(dloftbs.detect(mask, image=image)) == sides_of(dloftbs.detect(mask)) == CROSSED
