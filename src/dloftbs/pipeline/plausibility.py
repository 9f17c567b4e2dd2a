"""Input that is valid and hardly meant: inverted masks, photographs as masks, millimetres as metres."""

from __future__ import annotations

import cv2
import numpy as np

from dloftbs.config import DepthConfig, SegmentationConfig
from dloftbs.data.depth import unit_of
from dloftbs.support.arrays import AnyArray, as_bytes

GRID_PX = 8
"""Distance of the pixels that are looked at, px.

Source: by hand; 4,800 of 640 x 480 give the share to a percent.
"""

_MAX_SET = 0.5
"""Largest share of a frame that cables usually cover; more is worth a warning.

Source: by hand; ground shows between cables, which the method needs.
"""
_MAX_READABLE = 0.6
"""Largest share of a frame that is read as cables.

Source: measured; twice the largest share, 0.3, of 428 masks of photographs of cables.
"""
_STRIP_SIDES = 4.0
"""Ratio of the sides from which on an image is a crop along a cable, which fills it.

Source: geometry; the longest format of cameras is 32:9.
"""


def share_set(mask: AnyArray) -> float:
    """Return the share of a mask that is set."""
    return cv2.countNonZero(as_bytes(mask)) / mask.size if mask.size else 0.0


def doubt_mask(share: float, name: str = "") -> str | None:
    """Return why a mask, of which a share is set, is hardly one of cables; None if it may be."""
    if share <= _MAX_SET:
        return None
    what = f" of {name}" if name else ""
    return f"{100.0 * share:.0f} % of the mask{what} is set: inverted, a photograph, or too many colours?"


def refuse_mask(mask: AnyArray, share: float, *, segmented: bool) -> str | None:
    """Return why a mask, of which a share is set, cannot be read as cables; None if it can.

    Cables are lines on a ground. In a mask that is mostly set the ground is what is left between, and the middle line
    of the rest is no cable's. A crop along a cable is full as well, but long, with ground on both sides.
    """
    if share <= _MAX_READABLE or _is_along_cable(mask):
        return None
    remedy = (
        "the segmentation takes the ground for cable: narrow it (see dloftbs tune)"
        if segmented
        else "if it is inverted, turn it round (mask == 0); if it is a photograph or scores, threshold it"
    )
    return f"{100.0 * share:.3g} % of the mask is set, and cables cover at most {100.0 * _MAX_READABLE:.0f} %: {remedy}"


def grey_hint(image: AnyArray, config: SegmentationConfig) -> str:
    """Return the end of a reason why no colour is found in an image (H, W, 3), if the image has none."""
    if not all((part == part[..., :1]).all() for part in (image[::GRID_PX, ::GRID_PX], image)):
        return ""
    least = min((box.value[0] for box in config.hsv), default=0)
    if image.max(initial=0) < least:
        return f"; it is dark: the colour asks for a brightness of {least} or more"
    if_mask = "if it is a mask, leave the colour out, or say --kind mask"
    if config.hsv and all(box.saturation[0] > 0 for box in config.hsv):
        return (
            "; it is grey, and the colour asks for saturation: give a range of brightness, such as hsv='black' or "
            f"'0:179,0:255,0:60'; {if_mask}"
        )
    return f"; it is grey; {if_mask}"


def _is_along_cable(mask: AnyArray) -> bool:
    """Return True for a mask so long that a cable along it fills it, and clear along its two long sides."""
    along = mask if mask.shape[1] >= mask.shape[0] else mask.T
    rows, columns = along.shape
    return columns >= _STRIP_SIDES * rows and np.count_nonzero(along[[0, -1]]) <= columns


def unit_hint(depth: AnyArray, depth_unit_m: float, config: DepthConfig) -> str:
    """Return the end of a reason why depth says nothing, if most of it is farther than what is read."""
    depth = depth[::GRID_PX, ::GRID_PX]
    values = depth[np.isfinite(depth) & (depth > 0)]
    median_m = float(np.median(values)) * unit_of(depth, depth_unit_m) if values.size else 0.0
    if median_m <= config.range_m[1]:
        return ""
    found = f"; the median of the depth is {median_m:.4g} m, beyond lifting.max_depth_m ({config.range_m[1]:g} m)"
    if depth.dtype.kind == "f":
        return f"{found}: floating-point depth is taken for metres; is it in metres?"
    return f"{found}: is a count of the depth {1e3 * depth_unit_m:g} mm? Else set depth_unit_m (--depth-unit)"
