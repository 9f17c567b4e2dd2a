"""Objects of a rig from the detections of its views: where each is in space, and why some are not."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from dloftbs.data.curve import BSplineCurve
from dloftbs.data.detection import Detection
from dloftbs.data.frame_result import FrameResult
from dloftbs.stereo.rig_result import Members, RigObject
from dloftbs.stereo.space_fit import STD_SAMPLES, SpaceCurve, fit_in_space
from dloftbs.stereo.space_layout import lay_out
from dloftbs.stereo.view_curves import ViewCurve
from dloftbs.stereo.view_groups import Costs, Group, RigGeometry, group_detections
from dloftbs.support.arrays import AnyArray, frozen
from dloftbs.support.values import unchecked

_MOST_RESIDUAL_STDS = 2.0
"""Distance of a curve's projections from what the views show beyond which it is not in space, standard deviations of
the epipolar constraint.

Source: by hand; 3 px where the rig states no errors.
"""

_NO_PARTNER = "no other view shows a curve that fits it: it is seen in one view alone, or differently in the others"


class RigObjects(NamedTuple):
    """Objects of one moment, and for each the group of detections that made it."""

    objects: tuple[RigObject, ...]
    groups: tuple[Group, ...]


def associate(
    results: Sequence[FrameResult],
    curves: Sequence[Sequence[ViewCurve]],
    geometry: RigGeometry,
    extra: Costs,
    carried: Costs,
) -> RigObjects:
    """Return the objects of one moment, those in space first.

    Parameters
    ----------
    results : sequence of FrameResult
        Of each view.
    curves : sequence of sequence of ViewCurve
        The same detections.
    geometry : RigGeometry
    extra, carried : mapping of (int, int) to numpy.ndarray
        Costs of other evidence between the detections of two views, of this moment and of earlier ones; see
        `match_views`.
    """
    found = []
    for group in group_detections(curves, geometry, extra, carried):
        if len(group.matches) < 2:
            found.append((_alone(group, results, geometry), group))
        else:
            found.append((_object(group, _in_space(group, results, geometry), geometry), group))
    found.sort(key=lambda made: made[0].curve_3d is None)
    return RigObjects(tuple(one for one, _ in found), tuple(group for _, group in found))


def _row(group: Group, views: int) -> Members:
    return tuple(group.matches[view].second if view in group.matches else None for view in range(views))


def _pieces(group: Group, views: int) -> tuple[tuple[int, ...], ...]:
    return tuple(tuple(group.pieces.get(view, ())) for view in range(views))


def _in_space(group: Group, results: Sequence[FrameResult], geometry: RigGeometry) -> SpaceCurve | None:
    """Fit the curve in space of a group, in the frame of its reference view."""
    first = _reference(group)
    layout = lay_out(group, first, geometry)
    if layout is None:
        return None
    counts = [
        len(results[view].detections[number].curve.control_points)
        for view, pieces in group.pieces.items()
        for number in pieces
    ]
    return fit_in_space(
        layout.nodes, layout.inverse_depths, layout.weights, layout.sights, geometry.rotations[first],
        geometry.shifts[first], geometry.focals_px, max(counts), geometry.errors, first,
        closed=group.curves[first].closed,
    )  # fmt: skip


def _reference(group: Group) -> int:
    """Return the view along whose curve the one in space is laid: one that shows a loop closed, else the first."""
    loops = [view for view, curve in group.curves.items() if curve.closed]
    return min(loops or group.curves)


def _object(group: Group, fitted: SpaceCurve | None, geometry: RigGeometry) -> RigObject:
    """Return the object that a group of two views or more is."""
    views = len(geometry.cameras)
    row, pieces = _row(group, views), _pieces(group, views)
    confidence = math.prod(match.confidence for match in group.matches.values())
    if fitted is None:
        reason = "its views agree on no curve in front of the cameras"
        return RigObject(row, None, reason, confidence=confidence, pieces=pieces)
    first = _reference(group)
    if not fitted.residual_px <= _MOST_RESIDUAL_STDS * geometry.epipolar_std(first) * geometry.focals_px[first]:
        reason = f"its views disagree: the best curve in space lies {fitted.residual_px:.1f} px beside what they show"
        return RigObject(row, None, reason, confidence=confidence, pieces=pieces)
    curve = _in_first(fitted.curve, first, geometry)
    unknown = ~fitted.shown | (fitted.std_m > fitted.width_m)
    spans = _spans_of(unknown)
    return unchecked(
        RigObject,
        members=row,
        curve_3d=curve,
        no_3d_reason=None,
        _fitted_inferred_3d=spans,
        width_m=fitted.width_m,
        confidence=confidence,
        std_m=frozen(fitted.std_m),
        pieces=pieces,
    )


def _alone(group: Group, results: Sequence[FrameResult], geometry: RigGeometry) -> RigObject:
    """Return the object that one view shows alone, in space if depth says where."""
    ((view, curve),) = group.curves.items()
    row, pieces = _row(group, len(results)), _pieces(group, len(results))
    detection: Detection = results[view].detections[group.matches[view].second]
    if detection.curve_3d is None:
        return RigObject(row, None, curve.problem or _NO_PARTNER, pieces=pieces)
    std = detection.curve_3d_std(detection.curve_3d.u_at(np.linspace(0.0, 1.0, STD_SAMPLES)))
    placed = _in_first(detection.curve_3d, view, geometry)
    return RigObject(row, placed, None, detection.inferred_3d, detection.width_m, 1.0, std, pieces)


def _in_first(curve: BSplineCurve, view: int, geometry: RigGeometry) -> BSplineCurve:
    """Return a curve in a view's frame in that of the first camera."""
    if view == 0:
        return curve
    pose = geometry.steps[0][view]
    return curve.transformed(pose.rotation.T, -pose.rotation.T @ pose.shift)


def _spans_of(flags: AnyArray) -> tuple[tuple[float, float], ...]:
    """Return the intervals of a spline's own parameter that flagged samples cover, each to halfway to the next one."""
    if not flags.any():
        return ()
    edges = np.flatnonzero(np.diff(np.concatenate(([False], flags, [False]))))
    bounds = np.clip((edges - 0.5) / (STD_SAMPLES - 1), 0.0, 1.0).tolist()
    return tuple(zip(bounds[::2], bounds[1::2], strict=True))
