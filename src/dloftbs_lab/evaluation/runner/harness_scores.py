"""Branch points and branches of one frame against its truth, where true curves meet."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.optimize import linear_sum_assignment

from dloftbs.support.arrays import FloatArray
from dloftbs_lab.evaluation.curve_matching import Matching
from dloftbs_lab.truth import Truth

NODE = 1.0 / 128.0
"""Of the image's longer side: the largest distance of a branch point that is right, 10 px in HD."""
_SAME_PX = 0.01
_FAR = 1e6
_MIN_ENDS = 3


class HarnessScore(NamedTuple):
    """Scores of a frame's harnesses; all 0 where no true curves meet. Fields as in `finished_parts.FrameRow`."""

    nodes_true: int
    nodes_found: int
    nodes_right: int
    branches_right: int
    whole: bool


def score_harness(
    points: FloatArray, matching: Matching, truth: Truth, limit_px: float, node_px: float
) -> HarnessScore:
    """Score the branch points of a frame, and the branches with them.

    A branch is right if its curve is, and a branch point that is right lies at each end that has one.

    Parameters
    ----------
    points : numpy.ndarray, shape (n, 2)
        Branch points that were found, px.
    matching : Matching
        Of all curves.
    truth : Truth
    limit_px, node_px : float
        The largest L3 of a branch, and distance of a branch point, that are right.
    """
    if not truth.curves:
        return HarnessScore(0, 0, 0, 0, whole=False)
    ends = np.array([(curve.start, curve.end) for curve in truth.curves]).reshape(-1, 2)
    meets = np.hypot(*(ends[:, None] - ends).transpose(2, 0, 1)) < _SAME_PX
    is_node = meets.sum(axis=1) >= _MIN_ENDS
    first = meets.argmax(axis=1)  # of the ends at each place
    nodes = np.flatnonzero(is_node & (first == np.arange(len(ends))))
    if len(nodes) == 0:
        return HarnessScore(0, 0, 0, 0, whole=False)
    away = np.hypot(*(points[:, None] - ends[nodes]).transpose(2, 0, 1))
    near = np.where(away <= node_px, away, _FAR)  # as many right ones as there can be
    pairs = [(i, j) for i, j in zip(*linear_sum_assignment(near), strict=True) if away[i, j] <= node_px]
    right_nodes = {int(nodes[j]) for _, j in pairs}
    right = sum(
        pair.l3 <= limit_px
        and all(not is_node[end] or int(first[end]) in right_nodes for end in (2 * pair.true, 2 * pair.true + 1))
        for pair in matching.pairs
    )
    whole = right == len(truth.curves) and len(pairs) == len(nodes) == len(points) and not matching.redundant
    return HarnessScore(len(nodes), len(points), len(pairs), right, whole)
