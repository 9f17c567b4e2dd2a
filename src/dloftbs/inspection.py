"""Results of the stages on a frame, turned back into the image for pictures."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np

from dloftbs._arrays import AnyArray, FloatArray
from dloftbs.centerline import Segment
from dloftbs.frame import Frame, FrameResult, StageTrace
from dloftbs.graph import Graph
from dloftbs.mask_crop import MaskCrop, Skeleton
from dloftbs.published import Walks, make_segments


def trace_stages(
    frame: Frame,
    mask: AnyArray,
    crop: MaskCrop | None,
    skeleton: Skeleton | None,
    walks: Walks | None,
    graph: Graph | None,
    result: FrameResult,
) -> StageTrace:
    """Gather the trace of one frame; stages that were not reached leave empty arrays."""
    cleaned = np.zeros(frame.size, dtype=np.bool_)
    if crop is None or skeleton is None or (walks is None and graph is None):
        nothing = np.empty((0, 2))
        return StageTrace(frame, mask != 0, cleaned, nothing, nothing, nothing, (), (), result)
    (x, y), (h, w) = crop.origin, crop.size
    cleaned[y : y + h, x : x + w] = crop.pixels[1 : h + 1, 1 : w + 1]

    def points(which: Any) -> FloatArray:
        return crop.to_image(skeleton.pixels_rc[which][:, ::-1].astype(np.float64))

    kept, short = _segments(crop, walks, graph)
    return StageTrace(
        frame,
        mask != 0,
        cleaned,
        points(slice(None)),
        points(skeleton.is_endpoint),
        points(skeleton.is_branch_point),
        kept,
        short,
        result,
    )


def _segments(
    crop: MaskCrop, walks: Walks | None, graph: Graph | None
) -> tuple[tuple[Segment, ...], tuple[Segment, ...]]:
    """Return the segments that the linking looked at, and those that were too short for it."""
    if graph is None:
        assert walks is not None  # one method or the other has run
        return tuple(make_segments(crop, walks.open + walks.loops)), tuple(make_segments(crop, walks.short))
    points = crop.to_image(graph.points)
    runs = [Segment.trusted(points[a:b], graph.radius[a:b]) for a, b in pairwise(graph.offsets.tolist())]
    short = graph.spurs.tolist() + [False] * len(graph.loops)
    return (
        tuple(run for run, is_short in zip(runs, short, strict=True) if not is_short),
        tuple(run for run, is_short in zip(runs, short, strict=True) if is_short),
    )
