"""Segments to centre lines."""

from __future__ import annotations

import math

import numpy as np
import pytest
from drawings import draw_cable, wave

from dloftbs import Centerline, Config, JointKind
from dloftbs.cleaning import clean
from dloftbs.config import GreedyLinkingConfig
from dloftbs.pipeline.published import make_segments, walk
from dloftbs.pipeline.published.greedy_linking import link_segments, ratio_test
from dloftbs.skeleton import skeletonize

SIZE = (240, 400)


def link_mask(mask: np.ndarray, **changes: float) -> list[Centerline]:
    patch = clean(mask, Config.paper().cleaning)
    assert patch is not None
    config = GreedyLinkingConfig(**{"max_cost": 8.0, **changes})
    return link_segments(patch, make_segments(patch, walk(skeletonize(patch), config).open), config)


def line(*points: tuple[float, float], width: int = 7) -> np.ndarray:
    return draw_cable(np.array(points, dtype=float), width, SIZE)


@pytest.mark.parametrize(
    ("cost", "margin", "confidence"),
    [(1.0, 3.0, 0.75), (2.0, 2.0, 0.5), (2.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 2.0, 1.0), (5.0, math.inf, 1.0)],
)
def test_confidence_is_the_ratio_of_the_next_best_choice(cost: float, margin: float, confidence: float) -> None:
    assert ratio_test(cost, margin) == confidence


def test_a_cable_with_two_gaps_is_one() -> None:
    mask = draw_cable(wave(SIZE, 1.0), 7, SIZE)
    mask[:, 120:150] = 0
    mask[:, 250:290] = 0
    (centerline,) = link_mask(mask)
    assert [joint.kind for joint in centerline.joints] == [JointKind.GAP] * 2
    xs = [segment.points[:, 0].mean() for segment in centerline.segments]
    assert xs == sorted(xs) or xs == sorted(xs, reverse=True)


def test_points_run_on_without_jumping_back() -> None:
    mask = draw_cable(wave(SIZE, 1.0), 7, SIZE)
    mask[:, 120:150] = 0
    (centerline,) = link_mask(mask)
    steps = np.linalg.norm(np.diff(centerline.points, axis=0), axis=1)
    assert sorted(steps)[-2] < 2.0
    assert 28 < steps.max() < 60


def test_joints_cover_the_span_of_u_between_their_segments() -> None:
    mask = line((20, 120), (380, 120))
    mask[:, 180:230] = 0
    (centerline,) = link_mask(mask)
    (joint,) = centerline.joints
    first = len(centerline.segments[0])
    assert joint.u == (centerline.u[first - 1], centerline.u[first])
    share = (joint.u[1] - joint.u[0]) * np.linalg.norm(np.diff(centerline.points, axis=0), axis=1).sum()
    assert share == pytest.approx(50, abs=8)


def test_a_crossing_goes_straight_on_and_knows_that_it_is_one() -> None:
    crossing = link_mask(line((20, 30), (380, 210)) | line((20, 210), (380, 30)))
    assert len(crossing) == 2
    for centerline in crossing:
        assert [joint.kind for joint in centerline.joints] == [JointKind.CROSSING]
        first, last = centerline.points[0], centerline.points[-1]
        assert abs(first[0] - last[0]) > 300
        assert abs(first[1] - last[1]) > 130


def test_the_threshold_leaves_far_pieces_apart() -> None:
    mask = line((20, 60), (150, 60)) | line((250, 60), (380, 60))
    assert len(link_mask(mask, max_cost=8.0)) == 1
    assert len(link_mask(mask, max_cost=4.0)) == 2
    assert len(link_mask(mask, max_cost=0.0)) == 2


def test_parallel_cables_stay_apart() -> None:
    assert len(link_mask(line((20, 50), (380, 50)) | line((20, 180), (380, 180)))) == 2


def test_nothing_to_link() -> None:
    patch = clean(line((20, 50), (380, 50)), Config.paper().cleaning)
    assert patch is not None
    assert link_segments(patch, [], GreedyLinkingConfig()) == []
