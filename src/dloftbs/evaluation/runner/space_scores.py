"""One frame's curves in space against its truth there, and against the surface that the camera sees."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from dloftbs._arrays import FloatArray
from dloftbs.curve import BSplineCurve
from dloftbs.evaluation.curve_matching import Matching
from dloftbs.evaluation.metrics import l1, l2
from dloftbs.evaluation.runner.found import Curve, Found
from dloftbs.evaluation.runner.visible_truth import in_space
from dloftbs.frame import Frame
from dloftbs.truth import Truth

_MM_PER_M = 1e3
_SAMPLES = 1000
_LEAST_SINE = 1e-3  # between a curve and the line of sight, below which the surface in front has no place beside it


@dataclass(frozen=True)
class SpaceScore:
    """Scores in space; one without a value is None. Fields as in `finished_parts.FrameRow`."""

    l1_mm: float | None = None
    l2_mm: float | None = None
    l3_mm: float | None = None
    l3_surface_mm: float | None = None
    length_error: float | None = None


def score_in_space(
    found: Found, truth: Truth, matching: Matching, frame: Frame, radius_m: float | None = None
) -> SpaceScore:
    """Score the curves of a frame in space, those that are known there.

    Parameters
    ----------
    found : Found
    truth : Truth
    matching : Matching
        Of true and found objects.
    frame : Frame
    radius_m : float, optional
        Radius of the objects; without it nothing is said of their surface.
    """
    if not truth.curves_3d:
        return SpaceScore()
    pairs = [(found.curves_3d[pair.found], pair.true) for pair in matching.pairs]
    known = [(curve, true) for curve, true in pairs if curve is not None]
    if not known:
        return SpaceScore()
    off = [in_space(curve, truth.curves_3d[true], true, truth, frame) for curve, true in known]
    l3_m, length_error = np.mean(off, axis=0).tolist()
    surface_m = None
    if radius_m is not None:
        surfaces = [surface_line(truth.curves_3d[true].sample(_SAMPLES), radius_m) for _, true in known]
        surface_m = _mean(
            in_space(curve, line, true, truth, frame)[0] for (curve, true), line in zip(known, surfaces, strict=True)
        )
    cover = _cover(np.concatenate([_points(curve) for curve, _ in known]), frame)
    return SpaceScore(*cover, _MM_PER_M * l3_m, None if surface_m is None else _MM_PER_M * surface_m, length_error)


def surface_line(axis: FloatArray, radius_m: float) -> FloatArray:
    """Return the line on the surface of a round object that faces the camera, for points (n, 3) along its axis."""
    tangents = np.gradient(axis, axis=0)
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    towards = -axis / np.linalg.norm(axis, axis=1, keepdims=True)
    across = towards - (towards * tangents).sum(axis=1, keepdims=True) * tangents
    sine = np.linalg.norm(across, axis=1, keepdims=True)
    line: FloatArray = axis + radius_m * np.where(sine > _LEAST_SINE, across / np.maximum(sine, _LEAST_SINE), towards)
    return line


def _cover(points: FloatArray, frame: Frame) -> tuple[float | None, float | None]:
    """Return criteria 1 and 2 between the mask's pixels with depth, in space, and points of the curves, mm."""
    if frame.mask is None or frame.depth is None or frame.camera is None:
        return None, None
    rows, columns = np.nonzero((frame.mask > 0) & (frame.depth > 0))
    if not len(rows):
        return None, None
    pixels = np.column_stack((columns, rows)).astype(np.float64)
    depth = frame.depth[rows, columns]
    unit_m = frame.depth_unit_m if np.issubdtype(depth.dtype, np.integer) else 1.0
    cloud = frame.camera.deproject(pixels, unit_m * depth.astype(np.float64))
    return _MM_PER_M * l1(cloud, points), _MM_PER_M * l2(points, cloud)


def _points(curve: Curve) -> FloatArray:
    return curve.sample(_SAMPLES) if isinstance(curve, BSplineCurve) else curve


def _mean(values: Iterable[float]) -> float:
    return float(np.mean(list(values)))
