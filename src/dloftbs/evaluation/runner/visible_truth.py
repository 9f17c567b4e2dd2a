"""Visible part of the truth: an end behind a hand or out of the image is nobody's fault."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from dloftbs._arrays import FloatArray
from dloftbs.curve import BSplineCurve
from dloftbs.evaluation.curve_matching import CurveDistances, compare_curves
from dloftbs.evaluation.curves import curve_l3, length_error
from dloftbs.evaluation.runner.found import Curve, Found
from dloftbs.frame import Frame
from dloftbs.truth import Truth

_SAMPLES = 1000


def distances_of(found: Found, truth: Truth) -> tuple[CurveDistances, FloatArray]:
    """Return the L3 of every found curve from every true one: from its whole or its visible extent, the nearer one.

    The visible extent reaches from the first to the last point that is seen; hidden parts in between belong to it.
    An end that lies on another object is not seen, even if it is on top, since in a mask it does not show.

    Returns
    -------
    nearer : CurveDistances
    whole : numpy.ndarray, shape (true, found)
        The L3 from the whole curve in every case, as the paper defines it.
    """
    whole = compare_curves(found.curves, truth.curves)
    l3, forward = whole.l3.copy(), whole.forward.copy()
    lines = [curve.sample(_SAMPLES) for curve in truth.curves] if truth.visible_masks else []
    radii = [_radius(line, mask) for line, mask in zip(lines, truth.visible_masks, strict=True)]
    for i, points in enumerate(lines):
        seen = _seen(points, truth.visible_masks[i])
        others = [(lines[j], radii[j]) for j in range(len(lines)) if j != i]
        _lose_ends(seen, points, others)
        extent = _extent(points, seen, truth.curves[i])
        if extent is None:
            continue
        visible = compare_curves(found.curves, [extent])
        nearer = visible.l3[0] < l3[i]
        l3[i, nearer], forward[i, nearer] = visible.l3[0, nearer], visible.forward[0, nearer]
    return CurveDistances(l3, forward), whole.l3


def in_space(curve: Curve, true: Curve, number: int, truth: Truth, frame: Frame) -> tuple[float, float]:
    """Return the L3 in metres, and the share by which the length is off, of a curve from a true one in space.

    From the whole or the visible extent of `true`, which belongs to the object `number`, where the L3 is smaller.
    """
    whole = curve_l3(curve, true, directed=False), length_error(curve, true)
    if frame.camera is None or not truth.visible_masks:
        return whole
    points = true.sample(_SAMPLES) if isinstance(true, BSplineCurve) else true
    extent = _extent(points, _seen(frame.camera.project(points), truth.visible_masks[number]), true)
    if extent is None:
        return whole
    return min(whole, (curve_l3(curve, extent, directed=False), length_error(curve, extent)))


def visible_objects(truth: Truth) -> npt.NDArray[np.bool_]:
    """Return which objects show at all, shape (objects,)."""
    if not truth.visible_masks:
        return np.ones(len(truth.ids), np.bool_)
    return np.array([mask.any() for mask in truth.visible_masks], np.bool_)


def _extent(points: FloatArray, seen: npt.NDArray[np.bool_], curve: Curve) -> FloatArray | None:
    """Return the points from the first to the last that is seen, or None where this is the whole or nothing."""
    (where,) = np.nonzero(seen)
    if (
        (isinstance(curve, BSplineCurve) and curve.closed)
        or len(where) < 2
        or (where[0] == 0 and where[-1] == len(points) - 1)
    ):
        return None
    return points[where[0] : where[-1] + 1]


def _radius(line: FloatArray, mask: npt.NDArray[np.bool_]) -> float:
    """Return half the width of an object: the visible area over twice the visible length, px."""
    length = float(_seen(line, mask).mean() * np.linalg.norm(np.diff(line, axis=0), axis=1).sum())
    return float(mask.sum()) / (2.0 * length) if length > 0.0 else 0.0


def _lose_ends(seen: npt.NDArray[np.bool_], points: FloatArray, others: Sequence[tuple[FloatArray, float]]) -> None:
    """Take from `seen` (n,) the points from either end on that lie on other objects, lines (m, 2) px and radii px."""
    for order in (range(len(points)), range(len(points) - 1, -1, -1)):
        for i in order:
            if not any((np.linalg.norm(line - points[i], axis=1) <= radius).any() for line, radius in others):
                break
            seen[i] = False


def _seen(points_px: FloatArray, mask: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    # Beyond the field of a lens model, points have no place in the image.
    columns, rows = np.rint(np.where(np.isfinite(points_px), points_px, -1.0)).astype(int).T
    inside = (columns >= 0) & (rows >= 0) & (columns < mask.shape[1]) & (rows < mask.shape[0])
    seen: npt.NDArray[np.bool_] = np.zeros(len(points_px), np.bool_)
    seen[inside] = mask[rows[inside], columns[inside]]
    return seen
