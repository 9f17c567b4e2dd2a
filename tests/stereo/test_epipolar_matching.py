"""Matching of the detections of two views: confidences."""

from __future__ import annotations

import numpy as np
import pytest
from stereo_views import BENT, OTHER, masks, rig

from dloftbs.pipeline import Pipeline
from dloftbs.stereo.epipolar_matching import EVIDENCE, MOST_MEAN_COST, _confidence, match_views
from dloftbs.stereo.view_curves import curves_of_views


def test_assignments_that_are_as_good_share_the_probability():
    assert _confidence(np.full((2, 2), 0.1), 0, 1) == pytest.approx(0.5)
    assert _confidence(np.array([[0.1, 0.3], [0.3, 0.1]]), 0, 0) == pytest.approx(1 / (1 + np.exp(-0.2 * EVIDENCE)))
    alone = _confidence(np.array([[0.1]]), 0, 0)
    assert alone == pytest.approx(1 / (1 + np.exp(-0.5 * EVIDENCE * (MOST_MEAN_COST - 0.1))))


def test_evidence_of_earlier_moments_chooses_the_pairs_and_leaves_their_confidence():
    r = rig()
    views = masks(r, BENT, OTHER)
    found = [Pipeline().detect(view) for view in views]
    first, second = curves_of_views(found, views, r.cameras, [[None] * 2] * 2)
    pose, std = r._geometry.steps[0][1], r._geometry.epipolar_std(0)
    plain = match_views(first, second, pose, std)
    assert match_views(first, second, pose, std, None, np.eye(2) * -0.5) == plain
    against = np.array([[9.0 * any((i, j) == pair[:2] for pair in plain) for j in range(2)] for i in range(2)])
    assert not {pair[:2] for pair in match_views(first, second, pose, std, None, against)} & {
        pair[:2] for pair in plain
    }
