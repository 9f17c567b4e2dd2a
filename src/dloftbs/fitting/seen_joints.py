"""Gaps of curves, once they are fitted: where they leave the mask between two segments, nobody saw the object."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from dloftbs.data.centerline import Centerline, Joint, JointKind, Segment
from dloftbs.data.curve import BSplineCurve
from dloftbs.data.mask_crop import MaskCrop
from dloftbs.fitting.kernels.mask_contact import leaves_mask, lie_on_mask
from dloftbs.kernels.cubic_samples import sample_cubic
from dloftbs.support.arrays import FloatArray

_MIN_WIDTHS = 2.0
"""Length from which a joint is looked at, widths.

Source: geometry; on a shorter one the mask is half a width away at most, from where the points of its two sides lie.
"""

_MIN_SHARE = 0.1
"""Least share of a curve beside its joints by which its length is estimated, ratio.

Source: numerics; the length that follows diverges where there is nothing but joints.
"""

_SAMPLE_WIDTHS = 0.25
"""Distance of the points that are looked at, widths.

Source: by hand; the curve leaves the mask for longer, if at all.
"""

MIN_BESIDE_PX = 1.5
"""Distance beside the mask up to which a point counts as on it, px, where half a width is less.

Source: numerics; an edge is known to a pixel.
"""


def mark_unseen_joints(line: Centerline, curve: BSplineCurve, crop: MaskCrop) -> Centerline:
    """Return a centre line whose gaps are where the curve is beside the mask, not on it.

    A centre line ends half a width before the mask does, so a gap between two begins that much too early. A crossing
    joint has no points, so that the curve is free to bulge; across a blob that may be far. Where it leaves the mask by
    more than half a width, that is a gap.

    Parameters
    ----------
    line : Centerline
    curve : BSplineCurve
        Fitted to it.
    crop : MaskCrop

    Returns
    -------
    Centerline
        The same object where there is none.
    """
    spans = [joint.u[1] - joint.u[0] for joint in line.joints]
    widths = len(line.radius) / line.width_px / max(1.0 - sum(spans), _MIN_SHARE)  # the points are a pixel apart
    long = [k for k, span in enumerate(spans) if span * widths > _MIN_WIDTHS]
    joints = list(line.joints)
    for k, joint in enumerate(joints):
        if joint.kind is JointKind.GAP:
            joints[k] = _trimmed(joint, spans[k] * widths * line.width_px, curve, crop)
    for k in long:
        joint = joints[k]
        if joint.kind is JointKind.CROSSING:
            count = int(spans[k] * widths / _SAMPLE_WIDTHS) + 1
            points, _ = sample_cubic(curve.knots, curve.control_points, *joint.u, count)
            if not _is_on(points, crop, line.width_px):
                before, after = joints[k - 1].u[1] if k else 0.0, joints[k + 1].u[0] if k + 1 < len(joints) else 1.0
                step = spans[k] / len(points)
                first = _until_seen(joint.u[0], -step, before, line, curve, crop)
                last = _until_seen(joint.u[1], step, after, line, curve, crop)
                joints[k] = replace(joint, kind=JointKind.GAP, u=(first, last))
    if all(one is other for one, other in zip(joints, line.joints, strict=True)):
        return line
    return remade(line, line.segments, joints)


def remade(line: Centerline, segments: tuple[Segment, ...], joints: list[Joint]) -> Centerline:
    """Return a centre line with other segments and joints."""
    return Centerline._unchecked(
        segments,
        tuple(joints),
        line.closed,
        points=line.points,
        radius=line.radius,
        u=line.u,
        width_px=line.width_px,
        near_joints=line.near_joints,
        course_confidence=line.course_confidence,
        existence=line.existence,
        branch_ends=line.branch_ends,
    )


def _trimmed(joint: Joint, length_px: float, curve: BSplineCurve, crop: MaskCrop) -> Joint:
    """Return a gap from where the curve leaves the mask to where it is on it again; the same one if it stays on it."""
    low, high = joint.u
    count = max(math.ceil(length_px), 1) + 1  # a pixel apart
    points, _ = sample_cubic(curve.knots, curve.control_points, low, high, count)
    (x0, y0), last = crop.origin, len(points) - 1
    first_off, last_off = leaves_mask(points, crop.pixels, x0 - 1, y0 - 1)
    if last_off < 0:
        return joint
    share = (high - low) / last
    start = low if first_off == 0 else low + (first_off - 0.5) * share
    end = high if last_off == last else low + (last_off + 0.5) * share
    return replace(joint, u=(start, end))


def _until_seen(u: float, step: float, last: float, line: Centerline, curve: BSplineCurve, crop: MaskCrop) -> float:
    """Return the first parameter from one on at which the curve is on the mask again, and none beyond a last one."""
    while (last - u) * step > 0.0 and not _is_on(curve.spline(np.array([u])), crop, line.width_px):
        u = min(u + step, last) if step > 0.0 else max(u + step, last)
    return u


def _is_on(points: FloatArray, crop: MaskCrop, width: float) -> bool:
    (x0, y0), reach = crop.origin, max(0.5 * width, MIN_BESIDE_PX)
    return bool(lie_on_mask(points - np.array((x0 - 1.0, y0 - 1.0)), crop.pixels, reach).all())
