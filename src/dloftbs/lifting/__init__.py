"""Depth to the axis of each object, in metres."""

from __future__ import annotations

from dloftbs.lifting.axis import Lifted, lift
from dloftbs.lifting.beside import DepthEdges

__all__ = ["DepthEdges", "Lifted", "lift"]
