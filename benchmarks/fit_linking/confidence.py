"""How surely a joint of a margin is right: fitted to found joints that are judged by the true curves."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import numpy.typing as npt
from scipy.optimize import minimize
from scipy.spatial import cKDTree

from benchmarks.fit_linking.labels import BEFORE_WIDTHS, Ints, next_to
from benchmarks.fit_linking.readings import Floats
from benchmarks.fit_linking.scenes import Scene
from dloftbs import Config
from dloftbs.config import DepthConfig, LinkingConfig
from dloftbs.data.centerline import JointKind
from dloftbs.data.graph import Graph, branch_of, is_start
from dloftbs.data.mask_crop import MaskCrop
from dloftbs.evidence import EvidenceMap
from dloftbs.linking import link
from dloftbs.linking.joint_confidence import Gaps
from dloftbs.linking.matched_ends import EndMatching
from dloftbs.pipeline.stages import run_stages
from dloftbs_lab.evaluation.runner.joint_scores import judge_joints

EDGES = (0.0, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.99, 1.0)
_MIN_OFF_PX = 5.0  # of a curve from the cable that it lies on, or its width
_MAX_MARGIN = 50.0
_ROUNDING = 1e-9  # of a probability
_PULL = 0.1  # towards 0, nats per square of a coefficient: few gaps are wrong
_OF_A_SOURCE = 100.0  # gaps that each source counts for
_NETWORKS = 3.0  # times that networks' masks count, by hand: they have most of the objects
_CONFIG = Config().replace({"linking.min_gap_confidence": 0.0})

Kind = Literal["crossing", "gap", "cable"]


@dataclass(frozen=True)
class Claim:
    """A joint or a whole cable, its margin and cost in nats, the stated confidence, and whether it is right.

    If bounded, its odds are stated as at most those of the margin; not so where two cables share a branch. Of a gap,
    `seen` and `taper` are as `gap_log_odds` takes them; other joints have none.
    """

    source: str
    kind: Kind
    margin: float
    cost: float
    stated: float
    right: bool
    bounded: bool = False
    seen: float = 0.0
    taper: float = 0.0


def list_claims(scenes: Iterable[Scene]) -> Iterator[Claim]:
    """Yield the joints of some scenes, and the cables where their curves are known: a right one lies on one of them.

    All gaps count that cost less than two open ends. Of scenes without known curves, gaps alone are yielded: a right
    one has the same label on both sides.
    """
    for scene in scenes:
        run = run_stages(scene.frame, _CONFIG, None)
        if run.graph is None or run.crop is None:
            continue
        gaps = list(_list_gaps(scene, run.crop, run.graph))
        if scene.truth is None:
            yield from gaps if scene.labels is not None or len(scene.curves) == 1 else ()
            continue
        trees = [cKDTree(curve) for curve in scene.curves]
        for detection in run.detections:
            points = detection.curve.sample(max(int(detection.curve.length / 2.0), 20))
            off = min(float(tree.query(points)[0].max()) for tree in trees)
            right = off < max(detection.width_px, _MIN_OFF_PX)
            yield Claim(scene.source, "cable", np.inf, 0.0, detection.confidence, right)
        joints = [joint for detection in run.detections for joint in detection.joints]
        measured = {(gap.margin, gap.cost): gap for gap in gaps}
        for joint, row in zip(joints, judge_joints(0, run.detections, scene.truth, scene.frame.size), strict=True):
            gap = measured.get((joint.margin, joint.cost))
            if joint.kind is JointKind.CROSSING:
                bounded = joint.confidence <= 1.0 / (1.0 + np.exp(-joint.margin)) + _ROUNDING
                yield Claim(scene.source, "crossing", joint.margin, joint.cost, joint.confidence, row.right, bounded)
            elif gap is not None:  # else several joints with nothing between them
                yield replace(gap, right=row.right, stated=joint.confidence)


def _list_gaps(scene: Scene, crop: MaskCrop, graph: Graph) -> Iterator[Claim]:
    """Yield the gaps of a scene; right are those with the same label on both sides, or all where nothing has labels."""
    assert isinstance(_CONFIG.linking, LinkingConfig)
    matching = link(crop, graph, _CONFIG.linking, EvidenceMap.of(scene.frame, crop, DepthConfig())).matching
    places = np.rint(crop.to_image(matching.branches.points)).astype(np.int64)
    gaps = Gaps(matching, graph.width)
    for i, j in enumerate(matching.partner):
        if j < i or matching.is_crossing(i):
            continue
        margin, cost = matching.margin[i], matching.cost[i]
        sides = [_label_at(scene.labels, places, matching, end, graph.width) for end in (i, j)]
        seen, taper = gaps.describe(i, j)
        stated = gaps.confidence(i, j, margin)
        yield Claim(scene.source, "gap", margin, cost, stated, sides[0] == sides[1] > 0, True, seen, taper)


def _label_at(labels: npt.NDArray[np.uint8] | None, places: Ints, matching: EndMatching, end: int, width: float) -> int:
    """Return the most frequent label before an end, 0 for none; 1 where nothing has labels."""
    if labels is None:
        return 1
    start, stop = matching.branches.spans[branch_of(end)]
    x, y = next_to(places[start:stop], is_start(end), BEFORE_WIDTHS * width).T
    own = labels[y, x]
    return int(np.bincount(own[own > 0], minlength=1).argmax())


def fit_crossings(claims: Sequence[Claim]) -> Floats:
    """Return the log-odds that a crossing without margin and cost is right, and what a nat of either adds."""
    return fit_log_odds(_columns(claims), _right(claims), np.ones(len(claims)))


def fit_gaps(claims: Sequence[Claim]) -> Floats:
    """Return the log-odds of a gap, all else aside, and what a nat of margin and a unit of `seen` and `taper` add.

    Sources count alike, but for networks' masks.
    """
    counts = Counter(claim.source for claim in claims)
    weights = [_OF_A_SOURCE * (_NETWORKS if one.source == "networks" else 1.0) / counts[one.source] for one in claims]
    return fit_log_odds(_columns(claims), _right(claims), np.array(weights))


def _right(claims: Sequence[Claim]) -> npt.NDArray[np.bool_]:
    return np.array([claim.right for claim in claims])


def fit_log_odds(columns: Floats, right: npt.NDArray[np.bool_], weights: Floats) -> Floats:
    """Return the weights of columns whose sum is the log-odds of being right; all but the first are pulled to 0."""
    sign = np.where(right, 1.0, -1.0)

    def loss(line: Floats) -> float:
        return float(weights @ np.logaddexp(0.0, -sign * (columns @ line))) + _PULL * float(line[1:] @ line[1:])

    found: Floats = minimize(loss, np.zeros(columns.shape[1]), method="L-BFGS-B").x
    return found


def state(claims: Sequence[Claim], line: Floats) -> Floats:
    """Return the confidence that a line gives each joint, bounded by the margin where that of the linking is."""
    most = [claim.margin if claim.bounded else np.inf for claim in claims]
    stated: Floats = 1.0 / (1.0 + np.exp(-np.minimum(_columns(claims) @ line, most)))
    return stated


def _columns(claims: Sequence[Claim]) -> Floats:
    """Return the columns of crossings, or of gaps."""
    if claims[0].kind == "gap":
        return np.array([(1.0, min(one.margin, _MAX_MARGIN), one.seen, one.taper) for one in claims])
    return np.array([(1.0, min(one.margin, _MAX_MARGIN), one.cost) for one in claims])


def calibration_error(stated: Floats, right: npt.NDArray[np.bool_]) -> float:
    """Return the mean distance of the stated confidence from the share that is right, over bins."""
    bins = np.digitize(stated, EDGES[1:-1])
    own = [bins == k for k in range(len(EDGES) - 1) if (bins == k).any()]
    return float(sum(k.sum() * abs(stated[k].mean() - right[k].mean()) for k in own)) / len(stated)
