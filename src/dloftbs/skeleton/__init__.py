"""Mask crops to skeletons one pixel wide, and skeletons to graphs of branches."""

from __future__ import annotations

from dloftbs.skeleton.branch_graph import build_graph
from dloftbs.skeleton.thinning import skeletonize

__all__ = ["build_graph", "skeletonize"]
