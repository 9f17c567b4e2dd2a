"""One frame's curves against its truth."""

from __future__ import annotations

import math
from collections.abc import Collection, Hashable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from dloftbs.data.frame import Frame
from dloftbs_lab.evaluation.curve_matching import CurveDistances, match_distances
from dloftbs_lab.evaluation.identity_scores import TrackingScorer, TrackingScores
from dloftbs_lab.evaluation.instances import dice
from dloftbs_lab.evaluation.runner.found import Found, samples
from dloftbs_lab.evaluation.runner.harness_scores import NODE, score_harness
from dloftbs_lab.evaluation.runner.known_frame import KnownFrame
from dloftbs_lab.evaluation.runner.mask_pixels import mean_width
from dloftbs_lab.evaluation.runner.space_scores import score_in_space
from dloftbs_lab.evaluation.runner.visible_truth import distances_of
from dloftbs_lab.truth import Truth

CLEAN_L3 = 1.0 / 256.0
"""Of the image's longer side: the largest L3 of an object in a clean frame, 5 px in HD."""
CLEAN_DICE = 0.8
"""The smallest DICE of an object in a clean frame, where nothing but masks is known."""
SURE = 0.9
"""Confidence from which a curve claims to be right."""
TRACK_GATE = 1.0 / 25.6
"""Of the image's longer side: the largest L3 at which a track can be that of an object, 50 px in HD."""


@dataclass(frozen=True, eq=False)
class Score:
    """Scores of the curves of a frame; a score without a value is None. Fields as in `finished_parts.FrameRow`.

    `distances` are of every true curve from every found one, None where the true curves are not known.
    """

    l1_px: float | None
    l2_px: float | None
    l3_px: float | None
    l3_whole_px: float | None
    l3_mm: float | None
    length_error: float | None
    dice: float | None
    missing: int
    redundant: int
    right: int
    clean: bool
    distances: CurveDistances | None
    l1_mm: float | None = None
    l2_mm: float | None = None
    l3_surface_mm: float | None = None
    sure: int = 0
    sure_wrong: int = 0
    nodes_true: int = 0
    nodes_found: int = 0
    nodes_right: int = 0
    branches_right: int = 0
    whole: bool = False


def score(found: Found, known: KnownFrame, tolerance_px: float | None = None) -> Score:
    """Score the curves of one frame.

    Parameters
    ----------
    found : Found
    known : KnownFrame
    tolerance_px : float, optional
        The largest L3 of an object that is right, `CLEAN_L3` of the image where it is left out.
    """
    l1_px, l2_px = _cover(found, known)
    if known.truth.ids and not known.truth.curves:
        return _by_masks(found, known.truth, known.frame, l1_px, l2_px)
    distances, whole = distances_of(found, known)
    # Without a gate, as in the paper: a curve far from its object shows in L3, and is not two errors more.
    matching = match_distances(distances)
    missing = sum(bool(known.visible[i]) for i in matching.unmatched_true)
    limit = CLEAN_L3 * max(known.frame.size) if tolerance_px is None else tolerance_px
    right = sum(bool(known.visible[pair.true]) for pair in matching.pairs if pair.l3 <= limit)
    space = score_in_space(found, matching, known)
    return Score(
        l1_px,
        l2_px,
        _or_none(matching.mean_l3),
        float(np.mean([whole[pair.true, pair.found] for pair in matching.pairs])) if matching.pairs else None,
        space.l3_mm,
        space.length_error,
        None,
        missing,
        matching.redundant,
        right,
        missing == matching.redundant == 0 and all(value <= limit for value in matching.l3),
        distances,
        space.l1_mm,
        space.l2_mm,
        space.l3_surface_mm,
        *_sure(found, {pair.found for pair in matching.pairs if pair.l3 <= limit}),
        **score_harness(found.branch_points, matching, known.truth, limit, NODE * max(known.frame.size))._asdict(),
    )


def _sure(found: Found, right: Collection[int]) -> tuple[int, int]:
    """Return the number of detections with a confidence of at least `SURE`, and of those among them that are wrong."""
    sure = [number for number, detection in enumerate(found.detections) if detection.confidence >= SURE]
    return len(sure), sum(number not in right for number in sure)


class IdentityScorer:
    """Scores the identities of a sequence, as long as the method gives any.

    Parameters
    ----------
    size : (int, int)
        ``(H, W)`` of the frames, px.
    """

    def __init__(self, size: tuple[int, int]) -> None:
        self._scorer = TrackingScorer(gate=TRACK_GATE * max(size))
        self._numbers: dict[Hashable, int] = {}
        self._known = True

    def add(self, found: Found, known: KnownFrame, distances: CurveDistances | None) -> None:
        """Count a frame."""
        if distances is None or (found.curves and found.ids is None):
            self._known = False
            return
        numbers = [self._numbers.setdefault(name, len(self._numbers)) for name in found.ids or ()]
        shown = np.flatnonzero(known.visible)
        ids = [known.truth.ids[i] for i in shown]
        self._scorer.add(ids, numbers, distances.l3[shown], distances.forward[shown])

    def scores(self) -> TrackingScores | None:
        """Return the scores, or None where the method has curves without identities."""
        return self._scorer.scores() if self._known else None


def _cover(found: Found, known: KnownFrame) -> tuple[float | None, float | None]:
    if known.pixels is None or known.pixels.is_empty or not found.curves:
        return None, None
    return known.pixels.l1(found.points), known.pixels.l2(found.points)


def _by_masks(found: Found, truth: Truth, frame: Frame, l1_px: float | None, l2_px: float | None) -> Score:
    assert truth.labels is not None  # a truth has curves or masks
    is_cable = frame.is_cable
    result = dice(_labels(found, truth.labels > 0 if is_cable is None else is_cable), truth.labels)
    missing, redundant = len(result.missing), len(result.redundant)
    # A curve that is hidden by another one in the picture of labels was found all the same.
    redundant += max(len(found.curves) - (len(truth.ids) - missing + redundant), 0)
    right = sum(one.dice >= CLEAN_DICE for one in result.instances)
    clean = missing == redundant == 0 and right == len(truth.ids)
    return Score(l1_px, l2_px, None, None, None, None, _or_none(result.mean), missing, redundant, right, clean, None)


def _labels(found: Found, mask: npt.NDArray[np.bool_]) -> npt.NDArray[np.int32]:
    """Give each pixel of a mask (H, W) to the nearest curve within a width of it; labels count curves from 1 on."""
    labels = np.zeros(mask.shape, np.int32)
    if found.curves:
        lines = [samples(curve) for curve in found.curves]
        owner = np.repeat(np.arange(1, len(lines) + 1), [len(line) for line in lines])
        rows, columns = np.nonzero(mask)
        distance, nearest = cKDTree(np.concatenate(lines)).query(np.column_stack((columns, rows)))
        labels[rows, columns] = np.where(distance <= mean_width(mask), owner[nearest], 0)
    return labels


def _or_none(value: float) -> float | None:
    return value if math.isfinite(value) else None
