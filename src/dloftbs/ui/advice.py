"""Warnings as the page shows them: each names the control that helps."""

from __future__ import annotations

from dloftbs.config import Roi
from dloftbs.data.frame_region import Region
from dloftbs.pipeline.plausibility import doubt_mask, share_set
from dloftbs.pipeline.steadiness import Steadiness
from dloftbs.support.arrays import AnyArray


def doubt(mask: AnyArray, name: str = "", roi: Roi | None = None) -> str | None:
    """Return why a mask is hardly one of cables, and the control that takes ground out of it; None if it may be."""
    region = None if roi is None else Region(roi, mask.shape)
    share = share_set(mask) if region is None else share_set(region.cut(mask)) / region.share
    doubted = doubt_mask(share, name)
    return doubted and f"{doubted} Draw on the ground with Not cable, or narrow the hue ranges"


def mend_in_strip(steadiness: Steadiness) -> str | None:
    """Return the signs of a broken mask, and where on the page to mend it; None if there are none."""
    broken = steadiness.warning()
    return broken and f"{broken}; click on a yellow bar at the bottom, and mend the mask there"


def set_cables(steadiness: Steadiness) -> str | None:
    """Return the number of objects that nearly all frames have, as the field Cables takes it; None without one."""
    usual = steadiness.usual_number()
    return usual and f"{usual[1]}: set Cables to {usual[0]}"
