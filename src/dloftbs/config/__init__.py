"""The configuration: one frozen, validated section per stage, in the file of its room.

Every default of the package stands here, once.

Lengths in pixels end in ``_px``; the letters of the paper (Kicki, Szymko, Walas, ICRA 2023) stand in the docstrings.
"""

from __future__ import annotations

from dloftbs.config.cleaning import CleaningConfig
from dloftbs.config.config import Config, ConfigLike, choose_config
from dloftbs.config.fitting import FittingConfig
from dloftbs.config.lifting import FARTHEST_M, NEAREST_M, DepthConfig, LiftingConfig, PixelLiftingConfig
from dloftbs.config.linking import GreedyLinkingConfig, LinkingConfig, ObjectsConfig
from dloftbs.config.local_masks import BackgroundConfig, LocalConfig
from dloftbs.config.region import RegionConfig, Roi, RoiLike, read_roi
from dloftbs.config.section import Section
from dloftbs.config.segmentation import (
    HUE_MAX,
    Colour,
    HsvRange,
    NetworkConfig,
    PlaneConfig,
    SegmentationConfig,
    read_colour,
)
from dloftbs.config.skeleton import SegmentsConfig
from dloftbs.config.strokes import ColourConfig, ColourPicture, Stroke
from dloftbs.config.tracking import NearestTrackingConfig, TrackingConfig

__all__ = [
    "FARTHEST_M",
    "HUE_MAX",
    "NEAREST_M",
    "BackgroundConfig",
    "CleaningConfig",
    "Colour",
    "ColourConfig",
    "ColourPicture",
    "Config",
    "ConfigLike",
    "DepthConfig",
    "FittingConfig",
    "GreedyLinkingConfig",
    "HsvRange",
    "LiftingConfig",
    "LinkingConfig",
    "LocalConfig",
    "NearestTrackingConfig",
    "NetworkConfig",
    "ObjectsConfig",
    "PixelLiftingConfig",
    "PlaneConfig",
    "RegionConfig",
    "Roi",
    "RoiLike",
    "Section",
    "SegmentationConfig",
    "SegmentsConfig",
    "Stroke",
    "TrackingConfig",
    "choose_config",
    "read_colour",
    "read_roi",
]
