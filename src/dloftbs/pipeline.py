"""The stages on the frames of a stream, with the state that is kept from frame to frame."""

from __future__ import annotations

from time import perf_counter

from dloftbs.config import Config, NearestTrackingConfig, TrackingConfig
from dloftbs.evidence import OcclusionEvidence
from dloftbs.frame import Frame
from dloftbs.frame_result import FrameResult
from dloftbs.inspection import Segments, graph_segments, trace_stages
from dloftbs.lifting import DepthEdges
from dloftbs.published import NearestTracker, make_segments
from dloftbs.segmentation import HsvSegmenter
from dloftbs.stage_order import Segmenter, StageRun, run_stages
from dloftbs.stage_trace import StageTrace
from dloftbs.tracking import Tracker
from dloftbs.tracks import Track


class Pipeline:
    """Detection and tracking: from frames to curves, with identities and directions kept.

    A pipeline belongs to one thread; several pipelines are independent of each other.

    Parameters
    ----------
    config : Config, optional
    segmenter : callable, optional
        From an image (H, W, 3) to a mask (H, W), in the place of `SegmentationConfig.hsv`.

    Examples
    --------
    >>> import numpy as np
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
        self._depth_edges = DepthEdges()
        self._size: tuple[int, int] | None = None

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
        predicted = self._tracker.prior(frame.stamp)
        predicted_ms = 1e3 * (perf_counter() - since)
        if frame.size != self._size:  # another camera
            self._size = frame.size
            self._depth_edges.reset()
        run = run_stages(frame, self._config, self._segmenter, predicted, self._depth_edges)
        since = perf_counter()
        occlusion = OcclusionEvidence.of(frame, run.mask, self._config.lifting)
        tracks = self._tracker.update(
            run.detections, frame.stamp, frame.size, occlusion=occlusion, override=run.prior_override
        )
        run.stage_ms["tracking"] = predicted_ms + 1e3 * (perf_counter() - since)
        return _result(frame, run, tracks)

    def detect(self, frame: Frame) -> FrameResult:
        """Find the objects of one frame by itself: the result has no tracks, and the pipeline's stay as they are.

        Raises
        ------
        InputError
            As `process`.
        """
        return _result(frame, run_stages(frame, self._config, self._segmenter), ())

    def reset(self) -> None:
        """Forget all tracks and what is known of the depth camera, as at the cut to another scene."""
        self._tracker.reset()
        self._depth_edges.reset()

    def trace(self, frame: Frame) -> StageTrace:
        """Run the stages on a frame and keep what each of them made; the tracks stay as they are.

        Raises
        ------
        InputError
            As `process`.
        """
        run = run_stages(frame, self._config, self._segmenter)
        return trace_stages(frame, run.mask, run.crop, run.skeleton, _segments(run), _result(frame, run, ()))


def make_tracker(config: TrackingConfig | NearestTrackingConfig) -> Tracker | NearestTracker:
    """Return the tracker that a configuration asks for."""
    return Tracker(config) if isinstance(config, TrackingConfig) else NearestTracker()


def _result(frame: Frame, run: StageRun, tracks: tuple[Track, ...]) -> FrameResult:
    return FrameResult._unchecked(
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


def _segments(run: StageRun) -> Segments | None:
    """Return the segments of whichever method ran; None where the stages did not come so far."""
    if run.crop is None:
        return None
    if run.walks is not None:
        kept, short = run.walks.open + run.walks.loops, run.walks.short
        return tuple(make_segments(run.crop, kept)), tuple(make_segments(run.crop, short))
    return None if run.graph is None else graph_segments(run.crop, run.graph)
