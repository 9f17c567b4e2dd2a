"""Results of the stages on a frame, turned back into the image for pictures."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np

from dloftbs.data.centerline import Segment
from dloftbs.data.frame import Frame
from dloftbs.data.frame_result import FrameResult
from dloftbs.data.graph import Graph
from dloftbs.data.mask_crop import MaskCrop, Skeleton
from dloftbs.data.stage_trace import StageTrace
from dloftbs.support.arrays import AnyArray, FloatArray

Segments = tuple[tuple[Segment, ...], tuple[Segment, ...]]
"""Those that the linking looked at, and those too short for it."""


def trace_stages(
    frame: Frame,
    mask: AnyArray,
    crop: MaskCrop | None,
    skeleton: Skeleton | None,
    segments: Segments | None,
    result: FrameResult,
) -> StageTrace:
    """Gather the trace of one frame; stages that were not reached leave empty arrays."""
    cleaned = np.zeros(frame.size, dtype=np.bool_)
    if crop is None or skeleton is None or segments is None:
        nothing = np.empty((0, 2))
        return StageTrace(frame, mask != 0, cleaned, nothing, nothing, nothing, (), (), result)
    (x, y), (h, w) = crop.origin, crop.size
    cleaned[y : y + h, x : x + w] = crop.pixels[1 : h + 1, 1 : w + 1]

    def points(which: Any) -> FloatArray:
        return crop.to_image(skeleton.pixels_rc[which][:, ::-1].astype(np.float64))

    kept, short = segments
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


def graph_segments(crop: MaskCrop, graph: Graph) -> Segments:
    """Return the branches and loops of a graph as segments; its spurs are those too short."""
    points = crop.to_image(graph.points)
    runs = [Segment._unchecked(points[a:b], graph.radius[a:b]) for a, b in pairwise(graph.offsets.tolist())]
    short = graph.spurs.tolist() + [False] * len(graph.loops)
    return (
        tuple(run for run, is_short in zip(runs, short, strict=True) if not is_short),
        tuple(run for run, is_short in zip(runs, short, strict=True) if is_short),
    )
