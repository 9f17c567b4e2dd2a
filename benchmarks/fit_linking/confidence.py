"""How surely a joint of a margin is right: fitted to found joints that are judged by the true curves."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt
from scipy.optimize import minimize
from scipy.spatial import cKDTree

from benchmarks.fit_linking.readings import Floats
from benchmarks.fit_linking.scenes import Scene
from dloftbs import Config
from dloftbs.centerline import JointKind
from dloftbs.evaluation.runner.joint_scores import judge_joints
from dloftbs.stage_order import run_stages

EDGES = (0.0, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.99, 1.0)
_LEAST_OFF_PX = 5.0  # of a curve from the cable that it lies on, or its width
_MOST_MARGIN = 50.0
_ROUNDING = 1e-9  # of a probability

Kind = Literal["crossing", "gap", "cable"]


@dataclass(frozen=True)
class Claim:
    """A joint or a whole cable, its margin and cost in nats, the stated confidence, and whether it is right.

    If bounded, its odds are stated as at most those of the margin; not so where two cables share a branch.
    """

    source: str
    kind: Kind
    margin: float
    cost: float
    stated: float
    right: bool
    bounded: bool = False


def list_claims(scenes: Iterable[Scene]) -> Iterator[Claim]:
    """Yield the joints of some scenes, and the cables: a right one lies on one true curve."""
    config = Config()
    for scene in scenes:
        if scene.truth is None:
            continue
        detections = run_stages(scene.frame, config, None).detections
        trees = [cKDTree(curve) for curve in scene.curves]
        for detection in detections:
            points = detection.curve.sample(max(int(detection.curve.length / 2.0), 20))
            off = min(float(tree.query(points)[0].max()) for tree in trees)
            right = off < max(detection.width_px, _LEAST_OFF_PX)
            yield Claim(scene.source, "cable", np.inf, 0.0, detection.confidence, right)
        joints = [joint for detection in detections for joint in detection.joints]
        for joint, row in zip(joints, judge_joints(0, detections, scene.truth, scene.frame.size), strict=True):
            kind: Kind = "gap" if joint.kind is JointKind.GAP else "crossing"
            bounded = joint.confidence <= 1.0 / (1.0 + np.exp(-joint.margin)) + _ROUNDING
            yield Claim(scene.source, kind, joint.margin, joint.cost, joint.confidence, row.right, bounded)


def fit_line(claims: Sequence[Claim]) -> Floats:
    """Return the log-odds that a joint without margin and cost is right, and what a nat of either adds."""
    columns = _columns(claims)
    sign = np.where([claim.right for claim in claims], 1.0, -1.0)

    def loss(line: Floats) -> float:
        return float(np.logaddexp(0.0, -sign * (columns @ line)).sum())

    found: Floats = minimize(loss, np.zeros(3), method="L-BFGS-B").x
    return found


def state(claims: Sequence[Claim], line: Floats) -> Floats:
    """Return the confidence that a line gives each joint, bounded by the margin where that of the linking is."""
    most = [claim.margin if claim.bounded else np.inf for claim in claims]
    stated: Floats = 1.0 / (1.0 + np.exp(-np.minimum(_columns(claims) @ line, most)))
    return stated


def _columns(claims: Sequence[Claim]) -> Floats:
    return np.array([(1.0, min(claim.margin, _MOST_MARGIN), claim.cost) for claim in claims])


def calibration_error(stated: Floats, right: npt.NDArray[np.bool_]) -> float:
    """Return the mean distance of the stated confidence from the share that is right, over bins."""
    bins = np.digitize(stated, EDGES[1:-1])
    own = [bins == k for k in range(len(EDGES) - 1) if (bins == k).any()]
    return float(sum(k.sum() * abs(stated[k].mean() - right[k].mean()) for k in own)) / len(stated)
