"""Objects of a frame as detections of supervision."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import numpy as np

from dloftbs.data.curve_pixels import curve_mask
from dloftbs.data.frame_result import FrameResult
from dloftbs.errors import InputError
from dloftbs.sinks._seen import CATEGORY, seen_objects


def supervision_detections(result: FrameResult) -> Any:
    """Return a result as `FrameResult.to_supervision` says."""
    try:
        supervision = import_module("supervision")
    except ImportError as error:
        raise InputError("detections of supervision need it: pip install 'dloftbs[supervision]'") from error
    pairs = [(seen, curve_mask(seen.curve, seen.width_px, result.size, seen.spans)) for seen in seen_objects(result)]
    pairs = [(seen, mask) for seen, mask in pairs if mask.any()]
    rows = [seen.row for seen, _ in pairs]
    masks = np.stack([mask for _, mask in pairs]) if pairs else np.zeros((0, *result.size), np.bool_)
    in_space = [np.nan if row.curve_3d is None else row.curve_3d.length for row in rows]
    return supervision.Detections(
        xyxy=np.array([_box(mask) for mask in masks], np.float64).reshape(-1, 4),
        mask=masks,
        confidence=np.array([row.source.confidence for row in rows], np.float64),
        class_id=np.zeros(len(rows), np.int64),
        tracker_id=np.array([row.track_id for row in rows], np.int64) if result.tracks else None,
        data={
            "class_name": np.array([CATEGORY] * len(rows)),
            "length_px": np.array([row.curve.length for row in rows], np.float64),
            "length_m": np.array(in_space, np.float64),
        },
    )


def _box(mask: Any) -> tuple[int, int, int, int]:
    """Return left, top, right and bottom of a mask that is not empty; the last two lie beyond its pixels."""
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    return columns[0], rows[0], columns[-1] + 1, rows[-1] + 1
