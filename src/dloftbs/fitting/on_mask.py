"""Curves that are kept to the mask, once they are fitted: where one leaves it, nobody saw the object."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np

from dloftbs.config import FittingConfig
from dloftbs.data.centerline import Centerline, Joint, JointKind, Segment
from dloftbs.data.curve import BSplineCurve
from dloftbs.data.mask_crop import MaskCrop
from dloftbs.fitting.kernels.mask_contact import lie_on_mask, stays_on_mask
from dloftbs.fitting.seen_joints import MIN_BESIDE_PX, mark_unseen_joints, remade
from dloftbs.fitting.spline_fit import distinct_knots, fit, fit_with_knots
from dloftbs.kernels.cubic_samples import sample_cubic
from dloftbs.support.arrays import AnyArray, FloatArray, frozen
from dloftbs.support.values import unchecked

_STEP_WIDTHS = 0.5
"""Distance of the points that are looked at first, widths.

Source: bounds time; they have to lie nearer to the mask by half of it.
"""

_FINE_PX = 0.1
"""Distance of the points that are looked at where one of these lies beside the mask, px.

Source: numerics; an edge is known to a pixel.
"""

_FINER = (2, 4, 8)
"""Numbers of knots that are tried for a curve that leaves the mask, in those that it has.

Source: by hand; the last one leaves about a knot a pixel of a cable that is as wide as the thinnest ones.
"""

_Span = tuple[float, float]


def keep_to_mask(
    line: Centerline, curve: BSplineCurve, crop: MaskCrop, mask: AnyArray, config: FittingConfig
) -> tuple[Centerline, BSplineCurve]:
    """Return a centre line and its curve, of which all that is said to be seen lies on the mask.

    Gaps are first placed where the curve is beside the mask (`mark_unseen_joints`). A curve that leaves the mask by
    more than half a width elsewhere, as around sharp bends, gets more knots, unless their number is given, and follows
    straight lines where the centre line has no points. It gets none where the centre line leaves the mask, too. Where
    it leaves the mask all the same, there is a gap; a loop is opened there.

    Parameters
    ----------
    line : Centerline
    curve : BSplineCurve
        Fitted to it.
    crop : MaskCrop
        Of the cleaned mask.
    mask : numpy.ndarray, shape (H, W), bool or integer
        As it was given: in a hole that the cleaning filled, nothing is seen.
    config : FittingConfig

    Returns
    -------
    line : Centerline
    curve : BSplineCurve
        The same object where it lies on the mask.
    """
    pixels = mask.view(np.uint8) if mask.dtype in (np.bool_, np.uint8) else (mask != 0).view(np.uint8)
    marked = mark_unseen_joints(line, curve, crop) if line.joints else line
    if _is_seen(marked, curve, pixels):
        return marked, curve
    off = _spans_off(marked, curve, pixels)
    if off and config.knots is None:
        points, u = _filled(line)
        for times in _FINER if _are_seen(marked, points, u, pixels) else ():
            finer = fit_with_knots(points, u, line.closed, times * distinct_knots(curve))
            again = mark_unseen_joints(line, finer, crop) if line.joints else line
            if not _spans_off(again, finer, pixels):
                return again, finer
    if off and marked.closed:
        opened = _opened(marked, off[0])
        refitted = fit(opened.points, opened.u, False, config, 2.0 * float(opened.radius.mean()))
        return keep_to_mask(opened, refitted, crop, mask, config)
    for span in off:
        marked = _with_gap(marked, span)
    return marked, curve


def _filled(line: Centerline) -> tuple[FloatArray, FloatArray]:
    """Return the points of a centre line and their parameters, with a straight line of points over each junction."""
    points, u = line.points, line.u
    if line.closed:
        points, u = np.concatenate((points, points[:1])), np.append(u, 1.0)
    steps = np.hypot(*np.diff(points, axis=0).T)
    extra = []
    for k in np.flatnonzero(steps > max(0.5 * line.width_px, MIN_BESIDE_PX)).tolist():
        middle = 0.5 * (u[k] + u[k + 1])
        if any(low <= middle <= high for low, high in _seen(line)):
            extra.append(np.linspace(u[k], u[k + 1], math.ceil(steps[k]) + 1)[1:-1])
    own = np.sort(np.concatenate((line.u, *extra)))
    return np.stack([np.interp(own, u, column) for column in points.T], axis=1), own


def _are_seen(line: Centerline, points: FloatArray, u: FloatArray, mask: AnyArray) -> bool:
    """Return whether points with these parameters lie on the mask or beside it where they are said to be seen."""
    seen = np.logical_or.reduce([(low <= u) & (u <= high) for low, high in _seen(line)])
    return bool(lie_on_mask(points[seen], mask, _reach(line)).all())


def _opened(line: Centerline, span: _Span) -> Centerline:
    """Return a loop as an open centre line that begins and ends at an interval of the parameter."""
    at = int(np.searchsorted(line.u, 0.5 * (span[0] + span[1])))
    points, radius = frozen(np.roll(line.points, -at, axis=0)), frozen(np.roll(line.radius, -at))
    segment = Segment.cut(points, radius, 0, len(points))
    return Centerline._unchecked(
        (segment,), (), False, course_confidence=line.course_confidence, existence=line.existence
    )


def _seen(line: Centerline) -> list[_Span]:
    """List the intervals of the parameter that lie in no gap."""
    if not line.joints:
        return [(0.0, 1.0)]
    ends = [0.0, *(u for joint in line.joints if joint.kind is JointKind.GAP for u in joint.u), 1.0]
    return [(low, high) for low, high in zip(ends[::2], ends[1::2], strict=True) if low < high]


def _reach(line: Centerline) -> float:
    return max(0.5 * line.width_px, MIN_BESIDE_PX)


def _is_seen(line: Centerline, curve: BSplineCurve, mask: AnyArray) -> bool:
    """Return, by few points, whether all that is said to be seen surely lies on the mask or beside it."""
    step, reach, seen = max(_STEP_WIDTHS * line.width_px, 1.0), _reach(line), _seen(line)
    per_u = len(line.points) / step / max(sum(high - low for low, high in seen), 0.1)
    for low, high in seen:
        count = math.ceil((high - low) * per_u) + 2
        points, _ = sample_cubic(curve.knots, curve.control_points, low, high, count)
        if not stays_on_mask(points, mask, reach):
            return False
    return True


def _spans_off(line: Centerline, curve: BSplineCurve, mask: AnyArray) -> list[_Span]:
    """List the intervals of the parameter that are said to be seen, but lie neither on the mask nor beside it."""
    reach, found = _reach(line) - 0.5 * _FINE_PX, []  # so that what lies between two points is near enough, too
    for low, high in _seen(line):
        count = max(math.ceil((high - low) * curve.length / _FINE_PX), 8) + 1
        points, _ = sample_cubic(curve.knots, curve.control_points, low, high, count)
        on = lie_on_mask(points, mask, reach)
        step = (high - low) / (count - 1)
        edges = np.flatnonzero(np.diff(np.concatenate(([True], on, [True])).astype(np.int8)))
        for first, stop in edges.reshape(-1, 2).tolist():
            found.append((max(low + (first - 1) * step, low), min(low + stop * step, high)))
    return found


def _with_gap(line: Centerline, span: _Span) -> Centerline:
    """Return an open centre line with a gap over an interval of the parameter, which no gap covers.

    A gap that it touches grows by it, a crossing that it touches becomes it; else the segment is cut in two.
    """
    joints = list(line.joints)
    for k, joint in enumerate(joints):
        if joint.u[0] <= span[1] and span[0] <= joint.u[1]:
            over = (min(joint.u[0], span[0]), max(joint.u[1], span[1]))
            joints[k] = replace(joint, kind=JointKind.GAP, u=over if joint.kind is JointKind.GAP else span)
            return remade(line, line.segments, joints)
    k = sum(joint.u[0] < span[0] for joint in joints)
    low = sum(map(len, line.segments[:k]))
    high = low + len(line.segments[k])
    if high - low < 2:  # too short to be cut: the gap beside it takes it in
        beside = min(k, len(joints) - 1)
        over = (min(joints[beside].u[0], span[0]), max(joints[beside].u[1], span[1]))
        joints[beside] = replace(joints[beside], kind=JointKind.GAP, u=over)
        return remade(line, line.segments, joints)
    at = min(max(int(np.searchsorted(line.u, 0.5 * (span[0] + span[1]))), low + 1), high - 1)
    halves = [Segment.cut(line.points, line.radius, a, b) for a, b in pairwise((low, at, high))]
    joints.insert(k, unchecked(Joint, kind=JointKind.GAP, u=span, cost=0.0, margin=math.inf))
    return remade(line, (*line.segments[:k], *halves, *line.segments[k + 1 :]), joints)
