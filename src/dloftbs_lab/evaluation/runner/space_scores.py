"""One frame's curves in space against its truth there, and against the surface that the camera sees."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from dloftbs.support.arrays import FloatArray
from dloftbs_lab.evaluation.curve_matching import Matching
from dloftbs_lab.evaluation.curves import length_of
from dloftbs_lab.evaluation.runner.found import Found
from dloftbs_lab.evaluation.runner.known_frame import KnownFrame
from dloftbs_lab.evaluation.runner.visible_truth import in_space
from dloftbs_lab.evaluation.traces import SAMPLES, trace_of

_MM_PER_M = 1e3
_SAMPLES = 1000


@dataclass(frozen=True)
class SpaceScore:
    """Scores in space; one without a value is None. Fields as in `finished_parts.FrameRow`."""

    l1_mm: float | None = None
    l2_mm: float | None = None
    l3_mm: float | None = None
    l3_surface_mm: float | None = None
    length_error: float | None = None


def score_in_space(found: Found, matching: Matching, known_frame: KnownFrame) -> SpaceScore:
    """Score the curves of a frame in space, those that are known there.

    Parameters
    ----------
    found : Found
    matching : Matching
        Of true and found objects.
    known_frame : KnownFrame
        Without a radius of its objects nothing is said of their surface.
    """
    if not known_frame.truth.curves_3d:
        return SpaceScore()
    pairs = [(found.curves_3d[pair.found], pair.true) for pair in matching.pairs]
    known = [(curve, true) for curve, true in pairs if curve is not None]
    if not known:
        return SpaceScore()
    traces = [trace_of("found", curve, SAMPLES) for curve, _ in known]
    lines = [(trace, length_of(curve, trace), true) for trace, (curve, true) in zip(traces, known, strict=True)]
    off = [in_space(trace, length_m, known_frame.axes[true]) for trace, length_m, true in lines]
    l3_m, length_error = np.mean(off, axis=0).tolist()
    surface_m = None
    if known_frame.radius_m is not None:
        surface_m = _mean(in_space(trace, length_m, known_frame.surfaces[true])[0] for trace, length_m, true in lines)
    cover = _cover(np.concatenate([trace.resampled(_SAMPLES) for trace in traces]), known_frame)
    return SpaceScore(*cover, _MM_PER_M * l3_m, None if surface_m is None else _MM_PER_M * surface_m, length_error)


def _cover(points: FloatArray, known: KnownFrame) -> tuple[float | None, float | None]:
    """Return criteria 1 and 2 between the mask's pixels with depth, in space, and points of the curves, mm."""
    if known.cloud is None:
        return None, None
    from_cloud, _ = cKDTree(points, balanced_tree=False).query(known.cloud.points)
    from_points, _ = known.cloud.tree.query(points)
    return _MM_PER_M * float(from_cloud.mean()), _MM_PER_M * float(from_points.mean())


def _mean(values: Iterable[float]) -> float:
    return float(np.mean(list(values)))
