"""The order of the stages, from one frame to its curves, without memory."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from time import perf_counter
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from dloftbs.cleaning import clean, open_seams
from dloftbs.config import Config, GreedyLinkingConfig, LinkingConfig
from dloftbs.data.centerline import Centerline
from dloftbs.data.detection import Crossing, Detection
from dloftbs.data.dropped import Dropped
from dloftbs.data.frame import Frame
from dloftbs.data.frame_region import Region
from dloftbs.data.graph import Graph
from dloftbs.data.instance_labels import as_labels
from dloftbs.data.mask_crop import MaskCrop, Skeleton
from dloftbs.data.prediction import Prediction
from dloftbs.data.prompt import Prompt
from dloftbs.errors import InputError
from dloftbs.evidence import EvidenceMap
from dloftbs.fitting import find_crossings, fit, keep_to_mask
from dloftbs.kernels.shared.soft_masks import HALF
from dloftbs.lifting import DepthEdges
from dloftbs.linking import (
    TemporalPrior,
    choose,
    link,
    with_ends_that_go_on,
    with_expected,
    with_soft_existence,
    with_soft_widths,
)
from dloftbs.pipeline.mask_gate import MaskGate
from dloftbs.pipeline.nothing_found import too_many, why_nothing_is_left, why_too_short
from dloftbs.pipeline.plausibility import refuse_mask, share_set
from dloftbs.pipeline.published import Walks, close, link_segments, make_segments, walk
from dloftbs.pipeline.soft_mask import SURE, readings_of, sureness
from dloftbs.pipeline.space_curves import with_curves_in_space
from dloftbs.segmentation import FrameSegmenter
from dloftbs.skeleton import build_graph, skeletonize
from dloftbs.support.arrays import AnyArray
from dloftbs.support.mask_values import as_probability, kind_of, without_border


@dataclass(frozen=True)
class StageRun:
    """Results of the stages on one frame, as far as they came, the share of the mask that is set, and the times.

    `mask` is what was read of a probability, and the share that of what is at least one half; `taken_for` is what
    nobody but the mask's values says that it is. A mask that failed is evidence of nothing.
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
    taken_for: str = "binary"
    is_branched: bool = False
    has_failed: bool = False


class _Clock:
    """Books the time since the last lap to a stage."""

    def __init__(self) -> None:
        self.stage_ms: dict[str, float] = {}
        self._since = perf_counter()

    def lap(self, stage: str) -> None:
        now = perf_counter()
        self.stage_ms[stage] = self.stage_ms.get(stage, 0.0) + 1e3 * (now - self._since)
        self._since = now


class _Linked(NamedTuple):
    """Centre lines, or the reason why there are none, and what they were made of."""

    lines: list[Centerline]
    reason: str | None = None
    walks: Walks | None = None
    graph: Graph | None = None


class _Given(NamedTuple):
    """The mask of a frame, what it is besides, if it is that, and what its values alone say that it is."""

    mask: AnyArray
    soft: npt.NDArray[np.uint8] | None
    labels: npt.NDArray[np.uint16] | None
    taken_for: str


class _Task(NamedTuple):
    """A frame, how it is to be read, what its mask is besides, and the clock of the stages."""

    frame: Frame
    config: Config
    region: Region | None
    predicted: Sequence[Prediction]
    soft: npt.NDArray[np.uint8] | None
    labels: npt.NDArray[np.uint16] | None
    clock: _Clock

    def share_of(self, mask: AnyArray) -> float:
        """Return the share of the frame, or of its region of interest, that is set in a mask."""
        return share_set(mask) / (1.0 if self.region is None else self.region.share)

    def refusal_of(self, mask: AnyArray, share: float) -> str | None:
        """Return why a mask cannot be read as cables; None if it can, and by the published method always."""
        if not isinstance(self.config.linking, LinkingConfig):
            return None
        return refuse_mask(mask, share, segmented=self.frame.mask is None)


class _Reading(NamedTuple):
    """Objects of a mask, as centre lines, the stages that found them, and whether a lower limit has more to show."""

    run: StageRun
    lines: list[Centerline]
    is_more: bool = False


def kernel_rooms(config: Config, frame: Frame) -> tuple[str, ...]:
    """Return the rooms with kernels that the stages enter on such a frame, in their order."""
    rooms = ["kernels", "cleaning", "skeleton"]
    if frame.mask is None:
        colour = config.segmentation.colour
        by_pixels = colour is not None and any(picture.pixels for picture in colour.pictures)
        by_table = ["segmentation.kernels.colour_table", "segmentation.kernels.plane_heights"]
        rooms[:0] = ["segmentation"] if by_pixels else by_table
    if frame.image is not None or frame.depth is not None or frame.occluders is not None:
        rooms.append("evidence")
    rooms += ["pipeline.published" if isinstance(config.linking, GreedyLinkingConfig) else "linking", "fitting.kernels"]
    rooms += ["fitting.crossings.kernels.intersections", "fitting.crossings.kernels.crossing_groups"]
    if frame.image is not None or frame.depth is not None:
        rooms.append("fitting.crossings.kernels.crossing_order")
    if frame.depth is not None:
        rooms += ["camera", "lifting"]
    return tuple(rooms)


def run_stages(
    frame: Frame,
    config: Config,
    segmenter: FrameSegmenter | None,
    predicted: Sequence[Prediction] = (),
    depth_edges: DepthEdges | None = None,
    region: Region | None = None,
    prompt: Prompt | None = None,
    gate: MaskGate | None = None,
    taken_before: str = "binary",
) -> StageRun:
    """Take one frame through all stages but tracking.

    Ambiguous links of the default method follow the predicted curves, and depth is read with what earlier frames show
    of its edges, to which this one adds. A frame that was cut to a region of interest has no cable outside of it. In
    a mask that the gate of a stream refuses, nothing is looked for. A mask of which nobody says what it is may be what
    those before it were taken for.

    Raises
    ------
    InputError
        As `Pipeline.process`.
    """
    clock = _Clock()
    mask, soft, labels, taken_for = _given(frame, segmenter, config, prompt, taken_before)
    if region is not None:
        mask, soft = region.clear_outside(mask), None if soft is None else region.clear_outside(soft)
    raised = soft if soft is None else with_expected(soft, predicted)
    task = _Task(frame, config, region, predicted, raised, labels, clock)
    readings = iter([(HALF, mask)]) if raised is None else readings_of(raised)
    limit, part = next(readings)
    share = task.share_of(part)
    while gate is not None and gate.is_jump(share) and (lower := next(readings, None)) is not None:
        limit, part = lower
        share = task.share_of(part)
    clock.lap("segmentation")
    failure = None if gate is None else gate.refuse(share, frame.stamp, readable=task.refusal_of(part, share) is None)
    if failure is not None:
        run = StageRun(part, share, clock.stage_ms, reason=failure, has_failed=True)
        return replace(run, taken_for=taken_for)
    best = last = _read(part, limit, share, task)
    while last.is_more and sureness(best.lines) < SURE and (lower := next(readings, None)) is not None:
        clock.lap("segmentation")
        limit, part = lower
        last = _read(part, limit, task.share_of(part), task)
        best = max(best, last, key=lambda reading: sureness(reading.lines))
    is_branched = isinstance(config.linking, LinkingConfig) and config.linking.branched
    run = replace(best.run, share=share, taken_for=taken_for, is_branched=is_branched)
    lines = best.lines
    if not lines:
        return run
    assert run.crop is not None
    if soft is not None and raised is not None and isinstance(config.linking, LinkingConfig):
        lines = with_soft_existence(with_soft_widths(lines, raised), soft)
    curves = [fit(line.points, line.u, line.closed, config.fitting, 2.0 * line.radius.mean()) for line in lines]
    if run.graph is not None:  # the published method believes in all its joints
        kept = [keep_to_mask(*one, run.crop, run.mask, config.fitting) for one in zip(lines, curves, strict=True)]
        lines, curves = [line for line, _ in kept], [curve for _, curve in kept]
    clock.lap("fitting")
    detections = tuple(Detection._unchecked(line, curve) for line, curve in zip(lines, curves, strict=True))
    crossings = find_crossings(detections, frame, config.lifting)
    clock.lap("crossings")
    detections = with_curves_in_space(detections, crossings, run.crop, frame, config, depth_edges)
    clock.lap("lifting")
    return replace(run, detections=detections, crossings=crossings)


def _read(mask: AnyArray, limit: int, share: float, task: _Task) -> _Reading:
    """Find the objects of a mask, which of a probability is what is not below a limit."""
    frame, config, region, predicted, soft, labels, clock = task
    run = StageRun(mask, share, clock.stage_ms)
    refusal = task.refusal_of(mask, share)
    if refusal is not None:
        return _Reading(replace(run, reason=refusal), [])
    is_branched = isinstance(config.linking, LinkingConfig) and config.linking.branched
    may_show_more = soft is not None and isinstance(config.linking, LinkingConfig)
    is_published = isinstance(config.linking, GreedyLinkingConfig)
    pixels = mask if labels is None or is_published else open_seams(mask, labels)
    crop = clean(pixels, config.cleaning, region, branched=is_branched, enlarged=not is_published)
    clock.lap("cleaning")
    if crop is None:
        why = why_nothing_is_left(mask, config, frame, soft is not None)
        return _Reading(replace(run, reason=why), [], may_show_more)
    skeleton = skeletonize(crop)
    clock.lap("skeleton")
    is_more = False
    if isinstance(config.linking, GreedyLinkingConfig):
        linked = _link_as_published(crop, skeleton, config.linking, config.segments.max_segments, clock)
    else:
        linked = _link_by_bending(crop, skeleton, config.linking, task)
        if soft is not None:
            own, is_more = with_ends_that_go_on(linked.lines, soft, limit)
            linked = linked._replace(lines=own)
    lines, dropped = choose(linked.lines, config.linking, predicted)
    clock.lap("linking")
    reason = None if lines else linked.reason or why_too_short(config.linking)
    run = replace(
        run, crop=crop, skeleton=skeleton, walks=linked.walks, graph=linked.graph, dropped=dropped, reason=reason
    )
    return _Reading(run, lines, is_more or (may_show_more and not lines))


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


def _link_by_bending(crop: MaskCrop, skeleton: Skeleton, linking: LinkingConfig, task: _Task) -> _Linked:
    """Link the branches by the default method."""
    frame, config, _, predicted, soft, labels, clock = task
    graph, found = build_graph(crop, skeleton, config.segments.max_segments, branched=linking.branched)
    clock.lap("segments")
    if graph is None:
        return _Linked([], too_many(found, config.segments.max_segments))
    prior = TemporalPrior(predicted, crop, graph.width) if predicted else None
    evidence = EvidenceMap.of(frame, crop, config.lifting, soft, labels)
    linked = link(crop, graph, linking, evidence, prior)
    return _Linked(linked.centerlines, graph=graph)


def _given(
    frame: Frame, segmenter: FrameSegmenter | None, config: Config, prompt: Prompt | None, taken_before: str
) -> _Given:
    mask, kind = frame.mask, frame.mask_is
    if mask is None:
        if segmenter is None:
            raise InputError(
                "nothing says what in the image is cable: give its colour, such as hsv='170:10,80:255,60:255' for red, "
                "a segmenter, such as ColourModel.fit(image, strokes), or the frame a mask; "
                "if the image is a mask itself, pass one channel of it: image[..., 0]"
            )
        mask = segmenter(frame, prompt)
    if kind == "auto":
        kind = config.segmentation.mask_is
    is_told = kind != "auto" or mask.dtype.kind == "f"
    kind = kind_of(mask, taken_before) if kind == "auto" else kind
    is_soft = kind == "probability"
    labels = frame.instances
    if labels is None and kind == "labels":
        mask = without_border(mask)
        labels = as_labels(mask)
    return _Given(mask, as_probability(mask) if is_soft else None, labels, "binary" if is_told else kind)
