"""Matching of the detections of one view with those of another, each with its direction there."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.special import expit

from dloftbs.stereo.curve_parts import unrolled
from dloftbs.stereo.kernels.epipolar_paths import OPEN_COST, path_costs
from dloftbs.stereo.space_fit import Pose
from dloftbs.stereo.view_curves import ViewCurve
from dloftbs.support.arrays import FloatArray

EPIPOLAR_STD_PX = 1.5
"""Standard deviation of the distance of a right pair of points from the epipolar constraint, px.

Source: by hand; a rig that is wrong by 0.1 degree at a focal length of 900 px.
"""

MOST_MEAN_COST = 1.5
"""Mean cost of the points of two curves beyond which they are two objects, squared standard deviations.

Source: by hand; right pairs have less than 1 by definition, and a point that is left open 2.
"""

EVIDENCE = 10.0
"""Number of independent points of a curve, by which a mean cost becomes evidence.

Source: by hand; neighbouring nodes share their errors.
"""


class Match(NamedTuple):
    """Two detections that are one object.

    Parameters
    ----------
    first, second : int
        In each view.
    backwards : bool
        Whether the second one runs the other way.
    cost : float
        Mean cost of a point without other evidence, squared standard deviations.
    confidence : float
        Probability of the match against the best assignment without it, by what is seen at this moment alone.
    """

    first: int
    second: int
    backwards: bool
    cost: float
    confidence: float


def match_views(
    first: Sequence[ViewCurve],
    second: Sequence[ViewCurve],
    pose: Pose,
    std: float,
    extra: FloatArray | None = None,
    carried: FloatArray | None = None,
) -> list[Match]:
    """Return the pairs of the assignment with the least cost in all.

    Parameters
    ----------
    first, second : sequence of ViewCurve
    pose : Pose
        From the first view to the second.
    std : float
        Standard deviation of a distance from the epipolar constraint, of rays.
    extra : numpy.ndarray, shape (len(first), len(second)), optional
        Costs of other evidence of this moment.
    carried : numpy.ndarray, shape (len(first), len(second)), optional
        Costs of the evidence of earlier moments. Confidences leave them out, so that no moment counts twice.
    """
    if not first or not second:
        return []
    costs = np.full((len(first), len(second), 2), math.inf)
    for i, a in enumerate(first):
        for j, b in enumerate(second):
            if a.problem is None and b.problem is None:
                costs[i, j] = np.array(pair_costs(a, b, pose, std)) / (0.5 * (len(a.nodes) + len(b.nodes)))
    best = costs.min(axis=2)
    if extra is not None:
        best = best + extra
    gains = np.minimum((best if carried is None else best + carried) - MOST_MEAN_COST, 0.0)
    rows, columns = linear_sum_assignment(gains)
    return [
        Match(i, j, bool(costs[i, j, 1] < costs[i, j, 0]), float(costs[i, j].min()), _confidence(best, i, j))
        for i, j in zip(rows.tolist(), columns.tolist(), strict=True)
        if gains[i, j] < 0.0
    ]


def pair_costs(a: ViewCurve, b: ViewCurve, pose: Pose, std: float) -> tuple[float, float]:
    """Return the cost of all points of two curves that are one object, and of the second one run backwards.

    Parameters
    ----------
    a, b : ViewCurve
    pose, std
        As for `match_views`.

    Returns
    -------
    (float, float)
        Squared standard deviations; each point that has no partner has half of `OPEN_COST`.
    """
    more = 0
    # A loop may begin anywhere: its partner is somewhere on two turns of it, of which one is left over.
    if b.closed:
        more = len(b.nodes) - 1
        b = unrolled(b, 0, more)
    elif a.closed:
        more = len(a.nodes) - 1
        a = unrolled(a, 0, more)
    forward, backward = path_costs(a.nodes, b.nodes, a.widths, b.widths, pose.rotation, pose.shift, std**2)
    count, surplus = 0.5 * (len(a.nodes) + len(b.nodes)), 0.5 * OPEN_COST * more
    return max(forward * count - surplus, 0.0), max(backward * count - surplus, 0.0)


def _confidence(costs: FloatArray, i: int, j: int) -> float:
    """Return the probability of a pair, with all others at their best, against the best assignment without it."""
    gains = np.minimum(costs - MOST_MEAN_COST, 0.0)
    others = np.delete(np.delete(gains, i, axis=0), j, axis=1)
    gains[i, j] = 0.0
    better = _least_sum(gains) - (float(costs[i, j]) - MOST_MEAN_COST + _least_sum(others))
    return float(expit(0.5 * EVIDENCE * better))


def _least_sum(gains: FloatArray) -> float:
    """Return the sum of the best assignment."""
    return float(gains[linear_sum_assignment(gains)].sum())
