"""Objects of a frame as detections of supervision."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import cv2
import numpy as np

from dloftbs.data.curve_pixels import curve_mask
from dloftbs.data.frame_result import FrameResult
from dloftbs.errors import InputError
from dloftbs.sinks._seen import CATEGORY, seen_objects
from dloftbs.support.arrays import as_bytes


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
    boxes = [cv2.boundingRect(as_bytes(mask)) for mask in masks]
    in_space = [np.nan if row.curve_3d is None else row.curve_3d.length for row in rows]
    return supervision.Detections(
        xyxy=np.array([(x, y, x + width, y + height) for x, y, width, height in boxes], np.float64).reshape(-1, 4),
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
