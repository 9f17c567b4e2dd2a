"""Metres without depth: curves in space from two cameras or more, or from one that moves."""

from __future__ import annotations

from dloftbs.stereo.rig import CameraRig
from dloftbs.stereo.rig_result import RigObject, RigResult, RigTrack
from dloftbs.stereo.stereo_pipeline import StereoPipeline

__all__ = ["CameraRig", "RigObject", "RigResult", "RigTrack", "StereoPipeline"]
