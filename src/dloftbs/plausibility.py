"""Input that is valid and hardly meant: inverted masks, photographs as masks, millimetres as metres."""

from __future__ import annotations

import logging

import numpy as np

from dloftbs._arrays import AnyArray
from dloftbs.config import DepthConfig

_log = logging.getLogger("dloftbs.pipeline")

_MOST_SET = 0.5
"""Largest share of a frame that cables cover.

Source: by hand; ground shows between them, which the method needs.
"""
_GRID_PX = 8
"""Distance of the pixels that are asked, px.

Source: by hand; 4,800 of 640 x 480 tell the share to a percent.
"""


def warn_of_mask(mask: AnyArray, name: str) -> bool:
    """Warn, and return True, if so much of a mask is set that it is hardly one of cables."""
    doubt = doubt_mask(mask, name)
    if doubt is not None:
        _log.warning("%s See `dloftbs tune --help`", doubt)
    return doubt is not None


def doubt_mask(mask: AnyArray, name: str = "") -> str | None:
    """Return why a mask is hardly one of cables: too much of it is set; None if it may be."""
    some = mask[::_GRID_PX, ::_GRID_PX]
    if np.count_nonzero(some) <= _MOST_SET * some.size:
        return None
    percent = 100.0 * np.count_nonzero(mask) / mask.size
    what = f" of {name}" if name else ""
    return f"{percent:.0f} % of the mask{what} is set: inverted, a photograph, or too many colours?"


def unit_hint(depth: AnyArray, config: DepthConfig) -> str:
    """Return the end of a reason why depth says nothing, if most of it would say something in millimetres."""
    if depth.dtype.kind != "f":
        return ""
    depth = depth[::_GRID_PX, ::_GRID_PX]
    values = depth[np.isfinite(depth) & (depth > 0.0)]
    if values.size == 0 or np.median(values) <= config.range_m[1]:
        return ""
    return (
        f"; the median of the depth is {np.median(values):.4g}, and floating-point depth is in metres: "
        "multiply millimetres by 0.001"
    )
