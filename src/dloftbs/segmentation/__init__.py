"""Images to masks."""

from __future__ import annotations

from dloftbs.config import Stroke
from dloftbs.segmentation.background_difference import BackgroundSegmenter, median_background
from dloftbs.segmentation.colour_model import ColourModel
from dloftbs.segmentation.colour_ranges import HsvSegmenter
from dloftbs.segmentation.colour_samples import pixels_of
from dloftbs.segmentation.first_guess import suggest_mask
from dloftbs.segmentation.frame_segmenter import FrameSegmenter, Segmenter, make_segmenter
from dloftbs.segmentation.local import LocalSegmenter
from dloftbs.segmentation.stroke_bands import lies_along_band
from dloftbs.segmentation.stroke_validation import Expected, cross_validate

__all__ = [
    "BackgroundSegmenter",
    "ColourModel",
    "Expected",
    "FrameSegmenter",
    "HsvSegmenter",
    "LocalSegmenter",
    "Segmenter",
    "Stroke",
    "cross_validate",
    "lies_along_band",
    "make_segmenter",
    "median_background",
    "pixels_of",
    "suggest_mask",
]
