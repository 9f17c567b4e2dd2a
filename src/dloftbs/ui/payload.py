"""Curves of a result as the page draws them: points and places on them, no splines."""

from __future__ import annotations

from typing import Any

import numpy as np

from dloftbs.data.curve import BSplineCurve
from dloftbs.data.detection import Detection
from dloftbs.data.frame_result import FrameResult
from dloftbs.data.tracks import Track, TrackState
from dloftbs.viz.items import Item, items_of, outline_of
from dloftbs.viz.path import Path
from dloftbs.viz.style import Style, as_css

_SPACE_SAMPLES = 96
"""Number of points of a curve in space.

Source: by hand; smooth at the size of the panel that turns it.
"""
_STYLE = Style()


def describe(result: FrameResult) -> dict[str, Any]:
    """Return a result as plain values: its curves, and what is said about the frame."""
    items = items_of(result, _STYLE)
    objects: tuple[Track | Detection, ...] = result.tracks or result.detections
    return {
        "index": result.index,
        "size": [result.size[1], result.size[0]],
        "reason": result.reason,
        "roi": outline_list(result),
        "curves": [_curve(item, found) for item, found in zip(items, objects, strict=True)],
        "stages": [[stage, round(ms, 3)] for stage, ms in result.stage_ms.items()],
    }


def _curve(item: Item, found: Track | Detection) -> dict[str, Any]:
    points = Path.of(item.curve).points
    ends = getattr(found, "ends", None)
    return {
        "label": item.label,
        "colour": as_css(item.colour),
        "points": np.round(points, 1).reshape(-1).tolist(),
        "closed": item.curve.closed,
        "width_px": item.width_px,
        "inferred": [list(span) for span in item.inferred],
        "hidden": item.hidden,
        "below": list(item.below),
        "unordered": list(item.unordered),
        "crossed": list(item.crossed),
        "ends": None if ends is None else [end.value for end in ends],
        "state": found.state.value if isinstance(found, Track) else "detected",
        "confidence": found.confidence,
        "length": item.curve.length,
        "length_m": None if found.curve_3d is None else found.curve_3d.length,
        "space": None if found.curve_3d is None else _in_space(found.curve_3d),
        "inferred_space": [] if _is_hidden(found) else [list(span) for span in found.inferred_3d],
    }


def outline_list(result: FrameResult) -> list[list[float]] | None:
    """Return the corners of the region of interest that alone was read; None where all was."""
    outline = outline_of(result)
    corners: list[list[float]] | None = None if outline is None else outline.tolist()
    return corners


def _is_hidden(found: Track | Detection) -> bool:
    return isinstance(found, Track) and found.state is TrackState.HIDDEN


def _in_space(curve: BSplineCurve) -> list[float]:
    values: list[float] = np.round(curve.sample(_SPACE_SAMPLES), 4).reshape(-1).tolist()
    return values
