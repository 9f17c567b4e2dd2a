"""Several pipelines on one stream, for objects that differ in colour, with ids that distinguish them."""

from __future__ import annotations

from collections.abc import Sequence
from time import perf_counter

from dloftbs.config import ConfigLike
from dloftbs.data.frame import Frame
from dloftbs.data.frame_result import FrameResult
from dloftbs.errors import InputError
from dloftbs.fitting import find_crossings
from dloftbs.pipeline.pipeline import Pipeline
from dloftbs.support.values import check_type, varied


class PipelineGroup:
    """Pipelines that share a stream; each tracks its own objects, so that those of two colours are never mixed up.

    Track k of pipeline j of n, both counted from 1, has the id ``(k - 1) n + j``. Each pipeline reads its own region of
    interest; the `roi` of a result is the one that all share, None where they differ. Harnesses and their branch points
    are not in the results: use one `Pipeline` for these.

    Parameters
    ----------
    configs : sequence of Config, path or dict
        One for each pipeline, at least one. The first one's `lifting` decides which of two objects is on top.

    Raises
    ------
    InputError, ConfigError
        If there is none; and as `Pipeline`.
    """

    def __init__(self, configs: Sequence[ConfigLike]) -> None:
        self._pipelines = [Pipeline(config) for config in configs]
        if not self._pipelines:
            raise InputError("a group of pipelines needs a configuration for each, at least one, got none")
        self._lifting = self._pipelines[0].config.lifting

    def process(self, frame: Frame) -> FrameResult:
        """Find the objects of one frame, their crossings and their tracks; the times of the pipelines add up.

        Raises
        ------
        InputError
            As `Pipeline.process`; if it is no `Frame`; or if it has a mask, in which all pipelines would find the same
            objects.
        """
        check_type("frame", frame, Frame)
        if len(self._pipelines) > 1 and frame.mask is not None:
            raise InputError(
                "pipelines in a group differ in what they take for cable, and the frame has a mask, which is the same "
                "for all: leave it out, or use one Pipeline"
            )
        results = [pipeline.process(frame) for pipeline in self._pipelines]
        detections = tuple(detection for result in results for detection in result.detections)
        # Of one that only has hidden tracks too, as where its mask has failed.
        reasons = [one.reason for one in results if one.reason and (one.tracks or not detections)]
        since = perf_counter()
        crossings = find_crossings(detections, frame, self._lifting)
        crossings_ms = 1e3 * (perf_counter() - since)
        tracks = tuple(
            varied(track, id=(track.id - 1) * len(results) + number + 1)
            for number, result in enumerate(results)
            for track in result.tracks
        )
        stages = dict.fromkeys(stage for result in results for stage in result.stage_ms)
        stage_ms = {stage: sum(result.stage_ms.get(stage, 0.0) for result in results) for stage in stages}
        stage_ms["crossings"] = stage_ms.get("crossings", 0.0) + crossings_ms
        first = results[0]
        dropped = tuple(one for result in results for one in result.dropped)
        regions = {result.roi for result in results}
        return FrameResult(
            detections,
            tracks,
            "; ".join(reasons) or None,
            first.size,
            stage_ms,
            first.index,
            first.stamp,
            first.name,
            crossings,
            dropped,
            roi=first.roi if len(regions) == 1 else None,
            diagnosis=tuple(dict.fromkeys(one for result in results for one in result.diagnosis)),
        )

    def reset(self) -> None:
        """Forget all tracks, as at the cut to another scene."""
        for pipeline in self._pipelines:
            pipeline.reset()
