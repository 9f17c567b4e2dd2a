"""Evaluation of any tracker's curves: the criteria of the paper and others like them.

For one curve there are `l1`, `l2`, `l3` and their parts on plain points (`metrics`), and `curve_l3`, `point_error`,
`endpoint_error` and `length_error` on curves (`curves`); for the several curves of a frame `match_curves` and, on label
images, `dice`; for a sequence `TrackingScorer`.

Whole runs are made of modules that bring sources and pictures with them, and are imported by name: `suites` has the
sequences, `runner` scores methods on them, `report` writes tables and pictures. The command is ``dloftbs evaluate``.
"""

from __future__ import annotations

from dloftbs_lab.evaluation.curve_matching import (
    CurveDistances,
    Matching,
    Pair,
    compare_curves,
    match_curves,
    match_distances,
)
from dloftbs_lab.evaluation.curves import PointError, curve_l3, endpoint_error, length_error, point_error
from dloftbs_lab.evaluation.identity_scores import TrackingScorer, TrackingScores
from dloftbs_lab.evaluation.instances import DiceScore, InstanceScore, dice
from dloftbs_lab.evaluation.metrics import f_distance, l1, l2, l3, l3_undirected, mmd

__all__ = [
    "CurveDistances",
    "DiceScore",
    "InstanceScore",
    "Matching",
    "Pair",
    "PointError",
    "TrackingScorer",
    "TrackingScores",
    "compare_curves",
    "curve_l3",
    "dice",
    "endpoint_error",
    "f_distance",
    "l1",
    "l2",
    "l3",
    "l3_undirected",
    "length_error",
    "match_curves",
    "match_distances",
    "mmd",
    "point_error",
]
