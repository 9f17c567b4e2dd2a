"""The steps of the published method that differ from the default's, to be read beside the paper."""

from __future__ import annotations

from dloftbs.pipeline.published.greedy_linking import close, link_segments
from dloftbs.pipeline.published.nearest_tracking import NearestTracker
from dloftbs.pipeline.published.pixel_lifting import MIN_POINTS, holes_of, lift_pixels
from dloftbs.pipeline.published.walks import Walks, make_segments, walk

__all__ = [
    "MIN_POINTS",
    "NearestTracker",
    "Walks",
    "close",
    "holes_of",
    "lift_pixels",
    "link_segments",
    "make_segments",
    "walk",
]
