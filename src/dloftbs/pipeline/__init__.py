"""The stages in their order, on one frame or on a stream: `Pipeline`."""

from __future__ import annotations

from dloftbs.pipeline.group import PipelineGroup
from dloftbs.pipeline.pipeline import Pipeline, make_tracker

__all__ = ["Pipeline", "PipelineGroup", "make_tracker"]
