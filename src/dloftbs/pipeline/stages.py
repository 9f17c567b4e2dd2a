"""The order of the stages, from one frame to its curves, without memory."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from time import perf_counter

import numpy as np

from dloftbs.camera import PinholeCamera
from dloftbs.cleaning import clean
from dloftbs.config import Config, GreedyLinkingConfig, LinkingConfig, ObjectsConfig, PixelLiftingConfig
from dloftbs.crossings import find_crossings
from dloftbs.data.centerline import Centerline
from dloftbs.data.curve import BSplineCurve
from dloftbs.data.depth import ReadableDepth
from dloftbs.data.detection import NO_DEPTH, Crossing, Detection
from dloftbs.data.frame import Frame
from dloftbs.data.frame_region import Region
from dloftbs.data.graph import Graph
from dloftbs.data.mask_crop import MaskCrop, Skeleton
from dloftbs.data.prediction import Prediction
from dloftbs.errors import InputError
from dloftbs.evidence import EvidenceMap
from dloftbs.fitting import distinct_knots, fit, fit_with_knots, keep_to_mask
from dloftbs.lifting import DepthEdges, Lifted, lift
from dloftbs.linking import TemporalPrior, choose, link
from dloftbs.pipeline.plausibility import grey_hint, refuse_mask, share_set, unit_hint
from dloftbs.published import MIN_POINTS, Walks, close, holes_of, lift_pixels, link_segments, make_segments, walk
from dloftbs.segmentation import FrameSegmenter
from dloftbs.skeleton import build_graph, skeletonize
from dloftbs.support.arrays import LARGEST, AnyArray

_KNOTS_PER_FREEDOM = 2.0


@dataclass
class StageRun:
    """Results of the stages on one frame, as far as they came, the share of the mask that is set, and the times."""

    mask: AnyArray
    share: float
    stage_ms: dict[str, float] = field(default_factory=dict)
    crop: MaskCrop | None = None
    skeleton: Skeleton | None = None
    walks: Walks | None = None
    graph: Graph | None = None
    prior_override: float = 0.0
    detections: tuple[Detection, ...] = ()
    crossings: tuple[Crossing, ...] = ()
    dropped: tuple[Centerline, ...] = ()
    reason: str | None = None


def kernel_rooms(config: Config, frame: Frame) -> tuple[str, ...]:
    """Return the rooms with kernels that the stages enter on such a frame, in their order."""
    rooms = ["kernels", "cleaning", "skeleton"]
    if frame.mask is None:
        rooms.insert(0, "segmentation")
    if frame.image is not None or frame.depth is not None or frame.occluders is not None:
        rooms.append("evidence")
    rooms += ["published" if isinstance(config.linking, GreedyLinkingConfig) else "linking", "fitting"]
    rooms += ["crossings.kernels.intersections", "crossings.kernels.crossing_groups"]
    if frame.image is not None or frame.depth is not None:
        rooms.append("crossings.kernels.crossing_order")
    if frame.depth is not None:
        rooms += ["camera", "lifting"]
    return tuple(rooms)


class _Clock:
    """Books the time since the last lap to a stage."""

    def __init__(self) -> None:
        self.stage_ms: dict[str, float] = {}
        self._since = perf_counter()

    def lap(self, stage: str) -> None:
        now = perf_counter()
        self.stage_ms[stage] = 1e3 * (now - self._since)
        self._since = now


def run_stages(
    frame: Frame,
    config: Config,
    segmenter: FrameSegmenter | None,
    predicted: Sequence[Prediction] = (),
    depth_edges: DepthEdges | None = None,
    region: Region | None = None,
) -> StageRun:
    """Take one frame through all stages but tracking.

    Ambiguous links of the default method follow the predicted curves, and depth is read with what earlier frames tell
    of its edges, to which this one adds. A frame that was cut to a region of interest has no cable outside of it.

    Raises
    ------
    InputError
        As `Pipeline.process`.
    """
    clock = _Clock()
    mask = _mask(frame, segmenter)
    if region is not None:
        mask = region.clear_outside(mask)
    run = StageRun(mask, share_set(mask) / (1.0 if region is None else region.share), clock.stage_ms)
    clock.lap("segmentation")
    if isinstance(config.linking, LinkingConfig):
        run.reason = refuse_mask(mask, run.share, segmented=frame.mask is None)
        if run.reason is not None:
            return run
    run.crop = clean(run.mask, config.cleaning, region)
    clock.lap("cleaning")
    if run.crop is None:
        run.reason = _why_nothing_is_left(run.mask, config, frame)
        return run
    run.skeleton = skeletonize(run.crop)
    clock.lap("skeleton")
    if isinstance(config.linking, GreedyLinkingConfig):
        lines = _link_as_published(run, run.crop, run.skeleton, config.linking, config.segments.max_segments, clock)
    else:
        lines = _link_by_bending(run, run.crop, run.skeleton, config, config.linking, clock, predicted, frame)
    lines, run.dropped = choose(lines, config.linking)
    clock.lap("linking")
    if not lines:
        run.reason = run.reason or _why_too_short(config.linking)
        return run
    curves = [fit(line.points, line.u, line.closed, config.fitting, 2.0 * line.radius.mean()) for line in lines]
    if run.graph is not None:  # the published method believes in all its joints
        kept = [keep_to_mask(*one, run.crop, run.mask, config.fitting) for one in zip(lines, curves, strict=True)]
        lines, curves = [line for line, _ in kept], [curve for _, curve in kept]
    clock.lap("fitting")
    run.detections = tuple(Detection._unchecked(line, curve) for line, curve in zip(lines, curves, strict=True))
    run.crossings = find_crossings(run.detections, frame, config.lifting)
    clock.lap("crossings")
    run.detections = _lift(run.detections, run.crossings, run.crop, frame, config, depth_edges)
    clock.lap("lifting")
    return run


def _link_as_published(
    run: StageRun, crop: MaskCrop, skeleton: Skeleton, config: GreedyLinkingConfig, most: int, clock: _Clock
) -> list[Centerline]:
    """Return the centre lines of the published method; where there are none, the run says why."""
    run.walks = walk(skeleton, config)
    clock.lap("segments")
    found = len(run.walks.open) + len(run.walks.loops)
    if found > most:
        run.reason = _too_many(found, most)
        return []
    if found == 0:
        longest = max((len(short) for short in run.walks.short), default=0)
        run.reason = f"the longest segment has {longest} px, fewer than linking.min_length_px = {config.min_length_px}"
        return []
    lines = link_segments(crop, make_segments(crop, run.walks.open), config)
    return lines + [close(loop) for loop in make_segments(crop, run.walks.loops)]


def _link_by_bending(
    run: StageRun,
    crop: MaskCrop,
    skeleton: Skeleton,
    config: Config,
    linking: LinkingConfig,
    clock: _Clock,
    predicted: Sequence[Prediction],
    frame: Frame,
) -> list[Centerline]:
    """Return the centre lines of the default method; where there are none, the run says why."""
    run.graph, found = build_graph(crop, skeleton, config.segments.max_segments)
    clock.lap("segments")
    if run.graph is None:
        run.reason = _too_many(found, config.segments.max_segments)
        return []
    prior = TemporalPrior(predicted, crop, run.graph.width) if predicted else None
    evidence = EvidenceMap.of(frame, crop, config.lifting)
    linked = link(crop, run.graph, linking, evidence, prior)
    run.prior_override = linked.matching.override
    return linked.centerlines


def _mask(frame: Frame, segmenter: FrameSegmenter | None) -> AnyArray:
    if frame.mask is not None:
        return frame.mask
    if segmenter is None:
        raise InputError(
            "nothing says what in the image is cable: give its colour, such as hsv='170:10,80:255,60:255' for red, "
            "a segmenter, such as ColourModel.fit(image, strokes), or the frame a mask; "
            "if the image is a mask itself, pass one channel of it: image[..., 0]"
        )
    return segmenter(frame)


def _lift(
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
        why = NO_DEPTH if depth is None else "the frame has depth, but no camera to turn it into metres"
        return tuple(Detection._unchecked(d.centerline, d.curve, no_3d_reason=why) for d in detections)
    knots = config.fitting.knots
    if isinstance(config.lifting, PixelLiftingConfig):
        found = [_lift_as_published(detection, frame, camera, config.lifting, knots) for detection in detections]
    else:
        readable = ReadableDepth.of(depth, frame.depth_unit_m, config.lifting)
        lifted = lift(detections, crossings, crop, readable, camera, depth_edges)
        found = [_fit_in_space(*one, camera, knots) for one in zip(detections, lifted, strict=True)]
    if any(detection.curve_3d is None for detection in found) and (hint := unit_hint(depth, config.lifting)):
        found = [replace(d, no_3d_reason=f"{d.no_3d_reason}{hint}") if d.curve_3d is None else d for d in found]
    return tuple(found)


def _lift_as_published(
    detection: Detection, frame: Frame, camera: PinholeCamera, config: PixelLiftingConfig, knots: int | None
) -> Detection:
    """Fit the curve in space to the pixels that have depth, by the parameter of the curve in the image.

    It begins and ends where depth does: a cubic that is led on beyond its points goes anywhere.
    """
    line = detection.centerline
    assert frame.depth is not None  # the caller saw to it
    points_m, seen = lift_pixels(line.points, frame.depth, frame.depth_unit_m, camera, config)
    if len(points_m) < MIN_POINTS:
        reason = f"only {len(points_m)} of {len(seen)} pixels of the centre line have depth"
        return replace(detection, no_3d_reason=reason)
    knots = knots or distinct_knots(detection.curve)  # what the curve in the image needed
    whole = bool(seen.all())
    u = line.u[seen]
    closed = line.closed and whole
    if not closed and u[-1] > u[0]:
        u = (u - u[0]) / (u[-1] - u[0])
    curve = fit_with_knots(points_m, u, closed, knots)
    holes = () if whole else holes_of(u, detection.curve.length, detection.width_px)
    return _with_curve_3d(detection, curve, camera, holes)


def _fit_in_space(detection: Detection, lifted: Lifted | str, camera: PinholeCamera, knots: int | None) -> Detection:
    """Fit the curve in space to the points on the axis."""
    if isinstance(lifted, str):
        return replace(detection, no_3d_reason=lifted)
    if knots is None:  # what the curve in the image needed, or its depth does
        knots = max(distinct_knots(detection.curve), math.ceil(_KNOTS_PER_FREEDOM * lifted.depth_freedom))
    curve = fit_with_knots(lifted.points_m, lifted.u, detection.curve.closed, knots)
    return _with_curve_3d(detection, curve, camera, lifted.inferred)


def _with_curve_3d(
    detection: Detection, curve: BSplineCurve, camera: PinholeCamera, inferred: tuple[tuple[float, float], ...]
) -> Detection:
    """Return the detection with its curve in space, or with the reason why that is no curve that can be stored."""
    if not np.abs(curve.control_points).max() <= LARGEST:
        reason = f"by its depth and the camera it reaches farther than {LARGEST:g} m: check lifting.max_depth_m"
        return Detection._unchecked(detection.centerline, detection.curve, no_3d_reason=reason)
    return Detection._unchecked(detection.centerline, detection.curve, curve, None, inferred, camera)


def _why_nothing_is_left(mask: AnyArray, config: Config, frame: Frame) -> str:
    if mask.any():
        side = config.cleaning.open_px
        return f"nothing of the mask is left after the opening by {side} x {side} px"
    if frame.mask is not None:
        return "the mask is empty"
    if frame.image is None:
        return "the mask is empty: the segmentation finds no cable"
    hint = grey_hint(frame.image, config.segmentation)
    if not hint and not frame.name:  # an array of somebody's own
        hint = " (arrays are BGR: turn an RGB one by image[..., ::-1])"
    return f"the mask is empty: the segmentation finds no cable in the image{hint}"


def _why_too_short(config: ObjectsConfig) -> str:
    return (
        f"nothing is as long as linking.min_length_px = {config.min_length_px} and "
        f"linking.min_length_widths = {config.min_length_widths:g}"
    )


def _too_many(found: int, most: int) -> str:
    return f"{found} segments are more than segments.max_segments = {most}: this mask is noise"
