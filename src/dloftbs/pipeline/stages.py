"""The order of the stages, from one frame to its curves, without memory."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from time import perf_counter
from typing import NamedTuple

from dloftbs.cleaning import clean
from dloftbs.config import Config, GreedyLinkingConfig, LinkingConfig
from dloftbs.crossings import find_crossings
from dloftbs.data.centerline import Centerline
from dloftbs.data.detection import Crossing, Detection
from dloftbs.data.dropped import Dropped
from dloftbs.data.frame import Frame
from dloftbs.data.frame_region import Region
from dloftbs.data.graph import Graph
from dloftbs.data.mask_crop import MaskCrop, Skeleton
from dloftbs.data.prediction import Prediction
from dloftbs.errors import InputError
from dloftbs.evidence import EvidenceMap
from dloftbs.fitting import fit, keep_to_mask
from dloftbs.lifting import DepthEdges
from dloftbs.linking import TemporalPrior, choose, link
from dloftbs.pipeline.mask_gate import MaskGate
from dloftbs.pipeline.nothing_found import too_many, why_nothing_is_left, why_too_short
from dloftbs.pipeline.plausibility import refuse_mask, share_set
from dloftbs.pipeline.soft_mask import above_half, is_probability
from dloftbs.pipeline.space_curves import with_curves_in_space
from dloftbs.published import Walks, close, link_segments, make_segments, walk
from dloftbs.segmentation import FrameSegmenter
from dloftbs.skeleton import build_graph, skeletonize
from dloftbs.support.arrays import AnyArray


@dataclass(frozen=True)
class StageRun:
    """Results of the stages on one frame, as far as they came, the share of the mask that is set, and the times.

    A soft mask was given as a probability, and is cable where that is at least one half. A mask that failed is evidence
    of nothing.
    """

    mask: AnyArray
    share: float
    stage_ms: dict[str, float]
    crop: MaskCrop | None = None
    skeleton: Skeleton | None = None
    walks: Walks | None = None
    graph: Graph | None = None
    detections: tuple[Detection, ...] = ()
    crossings: tuple[Crossing, ...] = ()
    dropped: tuple[Dropped, ...] = ()
    reason: str | None = None
    is_soft: bool = False
    has_failed: bool = False


class _Linked(NamedTuple):
    """Centre lines, or the reason why there are none, and what they were made of."""

    lines: list[Centerline]
    reason: str | None = None
    walks: Walks | None = None
    graph: Graph | None = None


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
    gate: MaskGate | None = None,
) -> StageRun:
    """Take one frame through all stages but tracking.

    Ambiguous links of the default method follow the predicted curves, and depth is read with what earlier frames show
    of its edges, to which this one adds. A frame that was cut to a region of interest has no cable outside of it. In
    a mask that the gate of a stream refuses, nothing is looked for.

    Raises
    ------
    InputError
        As `Pipeline.process`.
    """
    clock = _Clock()
    mask = _mask(frame, segmenter)
    is_soft = is_probability(mask)
    if is_soft:
        mask = above_half(mask)
    if region is not None:
        mask = region.clear_outside(mask)
    share = share_set(mask) / (1.0 if region is None else region.share)
    run = StageRun(mask, share, clock.stage_ms, is_soft=is_soft)
    clock.lap("segmentation")
    unreadable = None
    if isinstance(config.linking, LinkingConfig):
        unreadable = refuse_mask(mask, run.share, segmented=frame.mask is None)
    failure = None if gate is None else gate.refuse(run.share, frame.stamp, readable=unreadable is None)
    if unreadable is not None or failure is not None:
        return replace(run, reason=failure or unreadable, has_failed=failure is not None)
    crop = clean(mask, config.cleaning, region)
    clock.lap("cleaning")
    if crop is None:
        return replace(run, reason=why_nothing_is_left(mask, config, frame))
    skeleton = skeletonize(crop)
    clock.lap("skeleton")
    if isinstance(config.linking, GreedyLinkingConfig):
        linked = _link_as_published(crop, skeleton, config.linking, config.segments.max_segments, clock)
    else:
        linked = _link_by_bending(crop, skeleton, config, config.linking, clock, predicted, frame)
    lines, dropped = choose(linked.lines, config.linking, predicted)
    clock.lap("linking")
    run = replace(
        run,
        crop=crop,
        skeleton=skeleton,
        walks=linked.walks,
        graph=linked.graph,
        dropped=dropped,
    )
    if not lines:
        return replace(run, reason=linked.reason or why_too_short(config.linking))
    curves = [fit(line.points, line.u, line.closed, config.fitting, 2.0 * line.radius.mean()) for line in lines]
    if run.graph is not None:  # the published method believes in all its joints
        kept = [keep_to_mask(*one, crop, mask, config.fitting) for one in zip(lines, curves, strict=True)]
        lines, curves = [line for line, _ in kept], [curve for _, curve in kept]
    clock.lap("fitting")
    detections = tuple(Detection._unchecked(line, curve) for line, curve in zip(lines, curves, strict=True))
    crossings = find_crossings(detections, frame, config.lifting)
    clock.lap("crossings")
    detections = with_curves_in_space(detections, crossings, crop, frame, config, depth_edges)
    clock.lap("lifting")
    return replace(run, detections=detections, crossings=crossings)


def _link_as_published(
    crop: MaskCrop, skeleton: Skeleton, config: GreedyLinkingConfig, most: int, clock: _Clock
) -> _Linked:
    """Link the segments by the published method."""
    walks = walk(skeleton, config)
    clock.lap("segments")
    found = len(walks.open) + len(walks.loops)
    if found > most:
        return _Linked([], too_many(found, most), walks)
    if found == 0:
        longest = max((len(short) for short in walks.short), default=0)
        reason = f"the longest segment has {longest} px, fewer than linking.min_length_px = {config.min_length_px}"
        return _Linked([], reason, walks)
    lines = link_segments(crop, make_segments(crop, walks.open), config)
    return _Linked(lines + [close(loop) for loop in make_segments(crop, walks.loops)], None, walks)


def _link_by_bending(
    crop: MaskCrop,
    skeleton: Skeleton,
    config: Config,
    linking: LinkingConfig,
    clock: _Clock,
    predicted: Sequence[Prediction],
    frame: Frame,
) -> _Linked:
    """Link the branches by the default method."""
    graph, found = build_graph(crop, skeleton, config.segments.max_segments)
    clock.lap("segments")
    if graph is None:
        return _Linked([], too_many(found, config.segments.max_segments))
    prior = TemporalPrior(predicted, crop, graph.width) if predicted else None
    evidence = EvidenceMap.of(frame, crop, config.lifting)
    linked = link(crop, graph, linking, evidence, prior)
    return _Linked(linked.centerlines, graph=graph)


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
