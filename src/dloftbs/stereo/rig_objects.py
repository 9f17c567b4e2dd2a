"""Objects of a rig from the detections of its views: who is who, where each is in space, and why some are not."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from dloftbs.camera import PinholeCamera
from dloftbs.data.curve import spans_by_length
from dloftbs.data.frame_result import FrameResult
from dloftbs.stereo.epipolar_matching import EPIPOLAR_STD_PX, Match, match_views
from dloftbs.stereo.kernels.epipolar_paths import find_path
from dloftbs.stereo.rig_result import RigObject
from dloftbs.stereo.space_fit import STD_SAMPLES, Pose, RigErrors, Sight, SpaceCurve, fit_in_space, partners_on
from dloftbs.stereo.view_curves import NODES, ViewCurve, rough_length, view_curves
from dloftbs.support.arrays import AnyArray, FloatArray

_MOST_RESIDUAL_PX = 3.0
"""Distance of a curve's projections from what the views show beyond which it is not in space, px.

Source: by hand; twice the standard deviation of the epipolar constraint.
"""


_NO_PARTNER = "no other view shows a curve that fits it: it is seen in one view alone, or differently in the others"


class RigGeometry(NamedTuple):
    """Cameras of the views of one moment.

    Parameters
    ----------
    cameras : tuple of PinholeCamera
    steps : tuple of tuple of Pose
        From the frame of each view to that of each.
    errors : RigErrors
    focals_px : tuple of float
    """

    cameras: tuple[PinholeCamera, ...]
    steps: tuple[tuple[Pose, ...], ...]
    errors: RigErrors
    focals_px: tuple[float, ...]

    def epipolar_std(self, view: int) -> float:
        """Return the standard deviation of a right pair's distance from the epipolar constraint, of rays."""
        rotation, pixel = math.radians(self.errors.rotation_std_deg), self.errors.pixel_std / self.focals_px[view]
        return math.sqrt((EPIPOLAR_STD_PX / self.focals_px[view]) ** 2 + rotation**2 + 2.0 * pixel**2)


class RigObjects(NamedTuple):
    """Objects of one moment, and for each the matches that made it, by view."""

    objects: tuple[RigObject, ...]
    matches: tuple[dict[int, Match], ...]


def curves_of_views(
    results: Sequence[FrameResult], masks: Sequence[AnyArray], cameras: Sequence[PinholeCamera]
) -> list[list[ViewCurve]]:
    """Return the curves of each view, all with the same distance between their nodes as rays."""
    focals = [math.sqrt(camera.fx * camera.fy) for camera in cameras]
    longest = [
        max((rough_length(one) for one in result.detections), default=0.0) / focal
        for result, focal in zip(results, focals, strict=True)
    ]
    spacing = max(longest) / NODES
    return [
        view_curves(result.detections, mask, camera, max(spacing * focal, 1.0))
        for result, mask, camera, focal in zip(results, masks, cameras, focals, strict=True)
    ]


def associate(
    results: Sequence[FrameResult],
    curves: Sequence[Sequence[ViewCurve]],
    geometry: RigGeometry,
    extra: dict[tuple[int, int], FloatArray],
) -> RigObjects:
    """Return the objects of one moment, those in space first.

    Parameters
    ----------
    results : sequence of FrameResult
        Of each view.
    curves : sequence of sequence of ViewCurve
        The same detections.
    geometry : RigGeometry
    extra : dict of (int, int) to numpy.ndarray
        Costs of other evidence between the detections of two views; see `match_views`.
    """
    groups = _groups(curves, geometry, extra)
    placed: list[tuple[RigObject, dict[int, Match]]] = []
    alone: list[tuple[RigObject, dict[int, Match]]] = []
    for members in groups:
        if len(members) < 2:
            ((view, match),) = members.items()
            reason = curves[view][match.second].problem or _NO_PARTNER
            one = RigObject(_row(members, len(results)), None, reason)
            alone.append((one, members))
            continue
        curve = _in_space(members, results, curves, geometry)
        made = _object(members, curve, results, geometry)
        (placed if made.curve_3d is not None else alone).append((made, members))
    found = placed + alone
    return RigObjects(tuple(one for one, _ in found), tuple(members for _, members in found))


def _row(members: dict[int, Match], views: int) -> tuple[int | None, ...]:
    return tuple(members[view].second if view in members else None for view in range(views))


def _groups(
    curves: Sequence[Sequence[ViewCurve]], geometry: RigGeometry, extra: dict[tuple[int, int], FloatArray]
) -> list[dict[int, Match]]:
    """Return for each object its detections by view; the first view that shows it is the one that others match."""
    groups: list[dict[int, Match]] = [{0: Match(i, i, False, 0.0, 1.0)} for i in range(len(curves[0]))]
    for view in range(1, len(curves)):
        free = list(range(len(curves[view])))
        for first in range(view):
            own = [group for group in groups if min(group) == first and view not in group]
            rows, columns = [group[first].second for group in own], list(free)
            costs = extra.get((first, view))
            matches = match_views(
                [curves[first][i] for i in rows],
                [curves[view][j] for j in columns],
                geometry.steps[first][view],
                geometry.epipolar_std(first),
                None if costs is None else costs[np.ix_(rows, columns)],
            )
            for match in matches:
                number = columns[match.second]
                own[match.first][view] = match._replace(first=rows[match.first], second=number)
                free.remove(number)
        groups += [{view: Match(j, j, False, 0.0, 1.0)} for j in free]
    return groups


def _in_space(
    members: dict[int, Match],
    results: Sequence[FrameResult],
    curves: Sequence[Sequence[ViewCurve]],
    geometry: RigGeometry,
) -> SpaceCurve | None:
    """Fit the curve in space of the detections of several views, in the frame of the first of these."""
    first, *others = sorted(members)
    a = curves[first][members[first].second]
    last = len(a.nodes) - 1
    low, high = last, 0
    paired = []
    for view in others:
        b, pose = curves[view][members[view].second], geometry.steps[first][view]
        path = find_path(
            a.nodes, b.nodes, a.widths, b.widths, pose.rotation, pose.shift,
            geometry.epipolar_std(first) ** 2, members[view].backwards,
        )  # fmt: skip
        depths, weights, partners = partners_on(a.nodes, b.nodes, pose, path, members[view].backwards)
        start = int(path[0, 0])
        low, high = min(low, start), max(high, int(path[-1, 0]))
        paired.append((view, b, start, depths, weights, partners))
    if high <= low:
        return None
    inverse_depths, total = np.zeros(high - low + 1), np.zeros(high - low + 1)
    sights = [Sight(first, a, (a.places * last - low) / (high - low))]
    for view, b, start, depths, weights, partners in paired:
        own = slice(start - low, start - low + len(depths))
        inverse_depths[own] += weights * depths
        total[own] += weights
        at = (np.arange(len(partners)) + start - low) / (high - low)
        order = np.argsort(partners, kind="stable")
        places = b.places * (len(b.nodes) - 1)
        t = np.interp(places, partners[order], at[order], left=-1.0, right=-1.0)
        sights.append(Sight(view, b, t))
    known = total > 0.0
    inverse_depths[known] /= total[known]
    count = max(len(results[view].detections[members[view].second].curve.control_points) for view in members)
    rotations = np.stack([pose.rotation for pose in geometry.steps[first]])
    shifts = np.stack([pose.shift for pose in geometry.steps[first]])
    return fit_in_space(
        a.nodes[low : high + 1], inverse_depths, total, sights, rotations, shifts, geometry.focals_px, count,
        geometry.errors, first,
    )  # fmt: skip


def _object(
    members: dict[int, Match],
    fitted: SpaceCurve | None,
    results: Sequence[FrameResult],
    geometry: RigGeometry,
) -> RigObject:
    row = _row(members, len(results))
    confidence = math.prod(match.confidence for match in members.values())
    if fitted is None:
        reason = "its views agree on no curve in front of the cameras"
        return RigObject(row, None, reason, confidence=confidence)
    if not fitted.residual_px <= _MOST_RESIDUAL_PX:
        reason = f"its views disagree: the best curve in space lies {fitted.residual_px:.1f} px beside what they show"
        return RigObject(row, None, reason, confidence=confidence)
    first = min(members)
    curve = fitted.curve
    if first > 0:
        pose = geometry.steps[0][first]
        curve = curve.transformed(pose.rotation.T, -pose.rotation.T @ pose.shift)
    unknown = ~fitted.shown | (fitted.std_m > fitted.width_m)
    spans = spans_by_length(curve, _spans_of(unknown))
    return RigObject._unchecked(row, curve, None, spans, fitted.width_m, confidence, fitted.std_m)


def _spans_of(flags: AnyArray) -> tuple[tuple[float, float], ...]:
    """Return the intervals of 0..1 that flagged samples cover, each to halfway to the next one."""
    if not flags.any():
        return ()
    edges = np.flatnonzero(np.diff(np.concatenate(([False], flags, [False])).astype(np.int8)))
    bounds = np.clip((edges - 0.5) / (STD_SAMPLES - 1), 0.0, 1.0)
    return tuple((float(low), float(high)) for low, high in zip(bounds[::2], bounds[1::2], strict=True))
