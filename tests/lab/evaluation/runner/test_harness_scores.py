"""Scores of branches and branch points."""

from __future__ import annotations

import numpy as np
import pytest
from builders import line

from dloftbs_lab.evaluation import match_curves
from dloftbs_lab.evaluation.runner.harness_scores import HarnessScore, score_harness
from dloftbs_lab.truth import Truth

TRUE = (line((0, 0), (100, 0)), line((100, 0), (200, 0)), line((100, 0), (100, 90)))
TRUTH = Truth(TRUE, (), (0, 1, 2))
JOINT = np.array([[101.0, 1.0]])


def scored(points, found=TRUE, truth=TRUTH) -> HarnessScore:
    return score_harness(points, match_curves(found, truth.curves), truth, 5.0, 10.0)


def test_all_is_right():
    assert scored(JOINT) == HarnessScore(1, 1, 1, 3, whole=True)
    assert scored(JOINT, [curve.reversed() for curve in TRUE]).whole


@pytest.mark.parametrize(
    ("points", "found", "expected"),
    [
        (np.empty((0, 2)), TRUE, HarnessScore(1, 0, 0, 0, whole=False)),
        (JOINT + 20.0, TRUE, HarnessScore(1, 1, 0, 0, whole=False)),
        (np.concatenate((JOINT, JOINT + 50.0)), TRUE, HarnessScore(1, 2, 1, 3, whole=False)),
        (JOINT, TRUE[:2], HarnessScore(1, 1, 1, 2, whole=False)),
        (JOINT, (*TRUE, line((0, 60), (50, 60))), HarnessScore(1, 1, 1, 3, whole=False)),
    ],
    ids=["no point", "a point elsewhere", "a point too many", "a branch less", "a branch more"],
)
def test_what_is_wrong(points, found, expected):
    assert scored(points, found) == expected


def test_a_branch_point_far_off_costs_one_that_is_right_nothing():
    truth = Truth((*TRUE, line((0, 0), (0, 90)), line((0, 0), (-50, 0))), (), tuple(range(5)))
    assert scored(np.array([[91.0, 0.0], [400.0, 0.0]]), truth.curves, truth).nodes_right == 1


def test_as_many_branch_points_are_right_as_can_be():
    """One that is nearest to a point takes none from another, which only that point can be."""
    truth = Truth(
        (*TRUE, line((107, 0), (150, 90)), line((107, 0), (150, -90)), line((107, 0), (190, 20))), (), tuple(range(6))
    )
    assert scored(np.array([[94.0, 0.0], [101.0, 0.0]]), truth.curves, truth).nodes_right == 2


def test_curves_that_do_not_meet_have_no_score():
    truth = Truth(TRUE[:2], (), (0, 1))
    assert scored(JOINT, TRUE[:2], truth) == HarnessScore(0, 0, 0, 0, whole=False)
