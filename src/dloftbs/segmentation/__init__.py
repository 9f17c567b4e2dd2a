"""Images to masks."""

from __future__ import annotations

from dloftbs.segmentation.colour_ranges import HsvSegmenter

__all__ = ["HsvSegmenter"]
