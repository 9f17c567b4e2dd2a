"""The order of the stages, from a frame to its curves.

Importing this module loads the compiled kernels, and compiles them if this machine has not done so yet.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from time import perf_counter

import numpy as np
import numpy.typing as npt

from dloftbs._arrays import AnyArray, check_depth, check_image, check_mask
from dloftbs.camera import PinholeCamera
from dloftbs.centerline import Centerline
from dloftbs.cleaning import clean
from dloftbs.config import (
    Config,
    GreedyLinkingConfig,
    LinkingConfig,
    NearestTrackingConfig,
    ObjectsConfig,
    PixelLiftingConfig,
    TrackingConfig,
)
from dloftbs.crossings import find_crossings
from dloftbs.curve import BSplineCurve
from dloftbs.errors import InputError
from dloftbs.evidence import EvidenceMap
from dloftbs.fitting import distinct_knots, fit, fit_with_knots
from dloftbs.frame import Crossing, Detection, Frame, FrameResult, StageTrace, Track
from dloftbs.graph import Graph
from dloftbs.inspection import trace_stages
from dloftbs.lifting import Lifted, lift
from dloftbs.linking import choose, link
from dloftbs.mask_crop import MaskCrop, Skeleton
from dloftbs.prior import TemporalPrior
from dloftbs.published import MIN_POINTS, NearestTracker, Walks, close, lift_pixels, link_segments, make_segments, walk
from dloftbs.segmentation import HsvSegmenter
from dloftbs.skeleton import build_graph, skeletonize
from dloftbs.tracking import Tracker

_SURE = 0.25  # by how much a reading must cost less than the one that follows the past, to count as clear
_MOST_OVERRULED, _ALONE = 2, 10  # frames

Segmenter = Callable[[npt.NDArray[np.uint8]], AnyArray]
"""Any function from an image (H, W, 3) BGR uint8 to a mask (H, W): a network, say."""

_KNOTS_PER_FREEDOM = 2.0


@dataclass
class StageRun:
    """Results of the stages on one frame, as far as they came, and the time that each took."""

    mask: AnyArray
    stage_ms: dict[str, float] = field(default_factory=dict)
    patch: MaskCrop | None = None
    skeleton: Skeleton | None = None
    walks: Walks | None = None
    graph: Graph | None = None
    overruled: float = 0.0
    detections: tuple[Detection, ...] = ()
    crossings: tuple[Crossing, ...] = ()
    dropped: tuple[Centerline, ...] = ()
    reason: str | None = None


class Pipeline:
    """From frames to curves, with identities and directions kept from frame to frame.

    A pipeline belongs to one thread; several pipelines do not disturb each other.

    Parameters
    ----------
    config : Config, optional
    segmenter : callable, optional
        From an image (H, W, 3) to a mask (H, W), in the place of `SegmentationConfig.hsv`.

    Examples
    --------
    >>> mask = np.zeros((100, 200), np.uint8)
    >>> mask[48:53, 20:180] = 255
    >>> result = Pipeline().process(Frame(mask=mask))
    >>> result.tracks[0].id, round(result.detections[0].width, 1)
    (1, 5.0)
    """

    def __init__(self, config: Config | None = None, *, segmenter: Segmenter | None = None) -> None:
        self._config = Config() if config is None else config
        if segmenter is None and self._config.segmentation.hsv:
            segmenter = HsvSegmenter(self._config.segmentation)
        self._segmenter = segmenter
        self._tracker = make_tracker(self._config.tracking)
        self._overruled = 0  # frames in a row of which the past was followed against the frame's own clear reading
        self._alone = 0  # frames that are yet to be read without the past

    @property
    def config(self) -> Config:
        """The configuration."""
        return self._config

    def process(self, frame: Frame) -> FrameResult:
        """Find the objects of one frame and follow them from the frames before.

        Raises
        ------
        InputError
            If the frame has no mask and there is neither a colour range nor a segmenter, or if the segmenter returns
            no mask of the frame's size.
        """
        since = perf_counter()
        expected = self._expected(frame.stamp)
        predicted_ms = 1e3 * (perf_counter() - since)
        run = run_stages(frame, self._config, self._segmenter, expected)
        self._heed(run.overruled)
        since = perf_counter()
        tracks = self._tracker.update(run.detections, frame.stamp, frame.size)
        run.stage_ms["tracking"] = predicted_ms + 1e3 * (perf_counter() - since)
        return _result(frame, run, tracks)

    def _expected(self, stamp: float | None) -> tuple[tuple[BSplineCurve, float], ...]:
        """Return the curves that ambiguous links are to follow, with how far they are to be trusted."""
        if self._alone > 0:
            self._alone -= 1
            return ()
        if isinstance(self._config.linking, GreedyLinkingConfig) or not isinstance(self._tracker, Tracker):
            return ()
        return tuple((known.curve, known.confidence) for known in self._tracker.predict(stamp))

    def _heed(self, overruled: float) -> None:
        """Leave the past aside for a while when frame after frame would have been read otherwise without it."""
        self._overruled = self._overruled + 1 if overruled > _SURE else 0
        if self._overruled >= _MOST_OVERRULED:
            self._overruled, self._alone = 0, _ALONE

    def detect(self, frame: Frame) -> FrameResult:
        """Find the objects of one frame by itself: the result has no tracks, and the pipeline's stay as they are.

        Raises
        ------
        InputError
            As `process`.
        """
        return _result(frame, run_stages(frame, self._config, self._segmenter), ())

    def reset(self) -> None:
        """Forget all tracks, as at the cut to another scene."""
        self._tracker.reset()
        self._overruled = self._alone = 0

    def trace(self, frame: Frame) -> StageTrace:
        """Run the stages on a frame and keep what each of them made; the tracks stay as they are.

        Raises
        ------
        InputError
            As `process`.
        """
        run = run_stages(frame, self._config, self._segmenter)
        return trace_stages(frame, run.mask, run.patch, run.skeleton, run.walks, run.graph, _result(frame, run, ()))


def make_tracker(config: TrackingConfig | NearestTrackingConfig) -> Tracker | NearestTracker:
    """Return the tracker that a configuration asks for."""
    return Tracker(config) if isinstance(config, TrackingConfig) else NearestTracker()


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
    frame: Frame, config: Config, segmenter: Segmenter | None, expected: Sequence[tuple[BSplineCurve, float]] = ()
) -> StageRun:
    """Take one frame through all stages but tracking.

    Where the default method finds links ambiguous, it follows the curves expected, each with its trust in 0..1.

    Raises
    ------
    InputError
        As `Pipeline.process`.
    """
    clock = _Clock()
    run = StageRun(_mask(frame, segmenter), clock.stage_ms)
    clock.lap("segmentation")
    run.patch = clean(run.mask, config.cleaning)
    clock.lap("cleaning")
    if run.patch is None:
        run.reason = _why_nothing_is_left(run.mask, config)
        return run
    run.skeleton = skeletonize(run.patch)
    clock.lap("skeleton")
    if isinstance(config.linking, GreedyLinkingConfig):
        lines = _link_as_published(run, run.patch, run.skeleton, config.linking, config.segments.max_segments, clock)
    else:
        lines = _link_by_bending(
            run, run.patch, run.skeleton, config.linking, config.segments.max_segments, clock, expected, frame.image
        )
    lines, run.dropped = choose(lines, config.linking)
    clock.lap("linking")
    if not lines:
        run.reason = run.reason or _why_too_short(config.linking)
        return run
    curves = [fit(line.points, line.u, line.closed, config.fitting, 2.0 * line.radius.mean()) for line in lines]
    clock.lap("fitting")
    run.detections = tuple(Detection.trusted(line, curve) for line, curve in zip(lines, curves, strict=True))
    run.crossings = find_crossings(run.detections, frame, config.lifting)
    clock.lap("crossings")
    run.detections = _lift(run.detections, run.crossings, run.patch, frame, config)
    clock.lap("lifting")
    return run


def _link_as_published(
    run: StageRun, patch: MaskCrop, skeleton: Skeleton, config: GreedyLinkingConfig, most: int, clock: _Clock
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
    lines = link_segments(patch, make_segments(patch, run.walks.open), config)
    return lines + [close(loop) for loop in make_segments(patch, run.walks.loops)]


def _link_by_bending(
    run: StageRun,
    patch: MaskCrop,
    skeleton: Skeleton,
    config: LinkingConfig,
    most: int,
    clock: _Clock,
    expected: Sequence[tuple[BSplineCurve, float]],
    image: AnyArray | None,
) -> list[Centerline]:
    """Return the centre lines of the default method; where there are none, the run says why."""
    run.graph, found = build_graph(patch, skeleton, most)
    clock.lap("segments")
    if run.graph is None:
        run.reason = _too_many(found, most)
        return []
    prior = TemporalPrior(expected, patch, run.graph.width) if expected else None
    evidence = None if image is None else EvidenceMap(image, patch)
    linking = link(patch, run.graph, config, evidence, prior)
    run.overruled = linking.matching.override
    return linking.centerlines


def detect(
    mask: npt.ArrayLike,
    config: Config | None = None,
    *,
    image: npt.ArrayLike | None = None,
    depth: npt.ArrayLike | None = None,
    camera: PinholeCamera | None = None,
) -> list[Detection]:
    """Find the objects in one mask, without memory.

    Parameters
    ----------
    mask : array_like, shape (H, W) or (H, W, 1), bool or any integer type
        Any non-zero is cable. Never changed.
    config : Config, optional
    image : array_like, shape (H, W, 3), uint8, optional
        BGR; tells what lies in gaps of the mask, and which cable is on top.
    depth : array_like, shape (H, W), optional
        See `Frame`.
    camera : PinholeCamera, optional

    Returns
    -------
    list of Detection
        Empty where there is nothing; `Pipeline.process` says why.

    Raises
    ------
    InputError
        If shapes or types are wrong or disagree.
    """
    frame = Frame(
        image=None if image is None else check_image(image),
        mask=check_mask(mask),
        depth=None if depth is None else check_depth(depth),
        camera=camera,
    )
    return list(run_stages(frame, Config() if config is None else config, None).detections)


def track(
    frames: Iterable[Frame], config: Config | None = None, *, segmenter: Segmenter | None = None
) -> Iterator[FrameResult]:
    """Follow the objects through a stream, one result a frame, as the frames come.

    Parameters
    ----------
    frames : iterable of Frame
        A source, as `dloftbs.sources.open` makes it, or any other.
    config, segmenter
        As `Pipeline` takes them.

    Yields
    ------
    FrameResult
    """
    pipeline = Pipeline(config, segmenter=segmenter)
    for frame in frames:
        yield pipeline.process(frame)


def _mask(frame: Frame, segmenter: Segmenter | None) -> AnyArray:
    if frame.mask is not None:
        return frame.mask
    if segmenter is None:
        raise InputError(
            "the frame has an image but no mask: set segmentation.hsv, pass a segmenter, or give the frame a mask"
        )
    assert frame.image is not None  # a frame has one or the other
    mask = check_mask(segmenter(frame.image))
    if mask.shape != frame.size:
        raise InputError(f"the segmenter's mask must have the frame's size {frame.size}, got {mask.shape}")
    return mask


def _lift(
    detections: tuple[Detection, ...], crossings: tuple[Crossing, ...], patch: MaskCrop, frame: Frame, config: Config
) -> tuple[Detection, ...]:
    """Return the detections with their curves in space, or with the reason why there is none."""
    depth, camera = frame.depth, frame.camera
    if depth is None or camera is None:
        why = "the frame has no depth" if depth is None else "the frame has depth, but no camera to turn it into metres"
        return tuple(Detection.trusted(d.centerline, d.curve, no_3d_reason=why) for d in detections)
    if isinstance(config.lifting, PixelLiftingConfig):
        knots = config.fitting.knots
        return tuple(_lift_as_published(detection, depth, camera, config.lifting, knots) for detection in detections)
    lifted = lift(detections, crossings, patch, depth, camera, config.lifting)
    return tuple(_fit_in_space(*one, config.fitting.knots) for one in zip(detections, lifted, strict=True))


def _lift_as_published(
    detection: Detection, depth: AnyArray, camera: PinholeCamera, config: PixelLiftingConfig, knots: int | None
) -> Detection:
    """Fit the curve in space to the pixels that have depth, by the parameter of the curve in the image."""
    line = detection.centerline
    points_m, seen = lift_pixels(line.points, depth, camera, config)
    if len(points_m) < MIN_POINTS:
        reason = f"only {len(points_m)} of {len(seen)} pixels of the centre line have depth"
        return replace(detection, no_3d_reason=reason)
    knots = knots or distinct_knots(detection.curve)  # what the curve in the image needed
    curve = fit_with_knots(points_m, line.u[seen], line.closed and bool(seen.all()), knots)
    return replace(detection, curve_3d=curve)


def _fit_in_space(detection: Detection, lifted: Lifted | str, knots: int | None) -> Detection:
    """Fit the curve in space to the points on the axis."""
    if isinstance(lifted, str):
        return replace(detection, no_3d_reason=lifted)
    if knots is None:  # what the curve in the image needed, or its depth does
        knots = max(distinct_knots(detection.curve), math.ceil(_KNOTS_PER_FREEDOM * lifted.depth_freedom))
    curve = fit_with_knots(lifted.points_m, lifted.u, detection.curve.closed, knots)
    return Detection.trusted(detection.centerline, detection.curve, curve, inferred_3d=lifted.inferred)


def _why_nothing_is_left(mask: AnyArray, config: Config) -> str:
    if not mask.any():
        return "the mask is empty"
    side = config.cleaning.open_px
    return f"nothing of the mask is left after the opening by {side} x {side} px"


def _why_too_short(config: ObjectsConfig) -> str:
    return (
        f"nothing is as long as linking.min_length_px = {config.min_length_px} and "
        f"linking.min_length_widths = {config.min_length_widths:g}"
    )


def _too_many(found: int, most: int) -> str:
    return f"{found} segments are more than segments.max_segments = {most}: this mask is noise"


def _result(frame: Frame, run: StageRun, tracks: tuple[Track, ...]) -> FrameResult:
    return FrameResult.trusted(
        run.detections,
        tracks,
        run.reason,
        frame.size,
        run.stage_ms,
        frame.index,
        frame.stamp,
        frame.name,
        run.crossings,
        run.dropped,
    )
