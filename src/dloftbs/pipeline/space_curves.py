"""Detections with their curves in space: what lifting finds, fitted."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from dloftbs.camera import PinholeCamera
from dloftbs.config import Config, PixelLiftingConfig
from dloftbs.data.curve import BSplineCurve
from dloftbs.data.depth import ReadableDepth
from dloftbs.data.detection import NO_DEPTH, Crossing, Detection
from dloftbs.data.frame import Frame
from dloftbs.data.mask_crop import MaskCrop
from dloftbs.fitting import distinct_knots, fit_with_knots
from dloftbs.lifting import DepthEdges, Lifted, lift
from dloftbs.pipeline.plausibility import unit_hint
from dloftbs.pipeline.published import MIN_POINTS, holes_of, lift_pixels
from dloftbs.support.arrays import LARGEST

_KNOTS_PER_FREEDOM = 2.0


def with_curves_in_space(
    detections: tuple[Detection, ...],
    crossings: tuple[Crossing, ...],
    crop: MaskCrop,
    frame: Frame,
    config: Config,
    depth_edges: DepthEdges | None,
) -> tuple[Detection, ...]:
    """Return the detections with their curves in space, or with the reason why there is none."""
    depth, camera = frame.depth, frame.camera
    if depth is None or camera is None:
        why = NO_DEPTH if depth is None else "the frame has depth, but no camera (camera=, --camera)"
        return tuple(Detection._unchecked(d.centerline, d.curve, no_3d_reason=why) for d in detections)
    knots = config.fitting.knots
    if isinstance(config.lifting, PixelLiftingConfig):
        found = [_lift_as_published(detection, frame, camera, config.lifting, knots) for detection in detections]
    else:
        readable = ReadableDepth.of(depth, frame.depth_unit_m, config.lifting)
        lifted = lift(detections, crossings, crop, readable, camera, depth_edges)
        found = [_fit_in_space(*one, camera, knots) for one in zip(detections, lifted, strict=True)]
    if any(detection.curve_3d is None for detection in found):
        hint = unit_hint(depth, frame.depth_unit_m, config.lifting)
        found = [replace(d, no_3d_reason=f"{d.no_3d_reason}{hint}") if d.curve_3d is None else d for d in found]
    return tuple(found)


def _lift_as_published(
    detection: Detection, frame: Frame, camera: PinholeCamera, config: PixelLiftingConfig, knots: int | None
) -> Detection:
    """Fit the curve in space to the pixels that have depth, by the parameter of the curve in the image.

    The curve covers only the interval with depth; extrapolated cubics diverge.
    """
    line = detection.centerline
    assert frame.depth is not None  # the caller saw to it
    points_m, seen = lift_pixels(line.points, frame.depth, frame.depth_unit_m, camera, config)
    if len(points_m) < MIN_POINTS:
        reason = f"only {len(points_m)} of {len(seen)} pixels of the centre line have depth"
        return replace(detection, no_3d_reason=reason)
    knots = knots or distinct_knots(detection.curve)  # what the curve in the image needed
    whole = bool(seen.all())
    u, share = line.u[seen], 1.0
    closed = line.closed and whole
    if not closed and u[-1] > u[0]:
        share = float(u[-1] - u[0])
        u = (u - u[0]) / share
    curve = fit_with_knots(points_m, u, closed, knots)
    holes = () if whole else holes_of(u, share * detection.curve.length, detection.width_px)
    return _with_curve_3d(detection, curve, camera, holes)


def _fit_in_space(detection: Detection, lifted: Lifted | str, camera: PinholeCamera, knots: int | None) -> Detection:
    """Fit the curve in space to the points on the axis."""
    if isinstance(lifted, str):
        return replace(detection, no_3d_reason=lifted)
    if knots is None:  # what the curve in the image needed, or its depth does
        knots = max(distinct_knots(detection.curve), math.ceil(_KNOTS_PER_FREEDOM * lifted.depth_freedom))
    curve = fit_with_knots(lifted.points_m, lifted.u, detection.curve.closed, knots)
    return _with_curve_3d(detection, curve, camera, lifted.inferred, lifted.std_per_m)


def _with_curve_3d(
    detection: Detection,
    curve: BSplineCurve,
    camera: PinholeCamera,
    inferred: tuple[tuple[float, float], ...],
    depth_std_per_m: float | None = None,
) -> Detection:
    """Return the detection with its curve in space, or with the reason why that is no curve that can be stored."""
    if not np.abs(curve.control_points).max() <= LARGEST:
        reason = f"by its depth and the camera it reaches farther than {LARGEST:g} m: check lifting.max_depth_m"
        return Detection._unchecked(detection.centerline, detection.curve, no_3d_reason=reason)
    return Detection._unchecked(detection.centerline, detection.curve, curve, None, inferred, camera, depth_std_per_m)
