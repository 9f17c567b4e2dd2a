"""Several pipelines on one stream, for objects that differ in colour, with identities across all of them."""

from __future__ import annotations

from collections.abc import Sequence
from time import perf_counter

from dloftbs.config import Config
from dloftbs.crossings import find_crossings
from dloftbs.frame import Frame
from dloftbs.frame_result import FrameResult
from dloftbs.pipeline import Pipeline, make_tracker


class PipelineGroup:
    """Pipelines that share a stream, and one tracker for all that they find.

    Parameters
    ----------
    configs : sequence of Config
        One for each pipeline, at least one. The first one's `lifting` and `tracking` hold for all objects together.
    """

    def __init__(self, configs: Sequence[Config]) -> None:
        self._pipelines = [Pipeline(config) for config in configs]
        self._lifting = configs[0].lifting
        self._tracker = make_tracker(configs[0].tracking)

    def process(self, frame: Frame) -> FrameResult:
        """Find the objects of one frame, their crossings and their tracks; the times of the pipelines add up.

        Raises
        ------
        InputError
            As `Pipeline.process`.
        """
        results = [pipeline.process(frame) for pipeline in self._pipelines]
        detections = tuple(detection for result in results for detection in result.detections)
        reason = None if detections else "; ".join(result.reason or "" for result in results)
        since = perf_counter()
        crossings = find_crossings(detections, frame, self._lifting)
        crossings_ms = 1e3 * (perf_counter() - since)
        since = perf_counter()
        tracks = self._tracker.update(detections, frame.stamp, frame.size)
        tracking_ms = 1e3 * (perf_counter() - since)
        stages = dict.fromkeys(stage for result in results for stage in result.stage_ms)
        stage_ms = {stage: sum(result.stage_ms.get(stage, 0.0) for result in results) for stage in stages}
        stage_ms["crossings"] = stage_ms.get("crossings", 0.0) + crossings_ms
        stage_ms["tracking"] = tracking_ms
        first = results[0]
        dropped = tuple(line for result in results for line in result.dropped)
        return FrameResult(
            detections, tracks, reason, first.size, stage_ms, first.index, first.stamp, first.name, crossings, dropped
        )
