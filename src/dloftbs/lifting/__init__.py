"""Depth to the axis of each object, in metres."""

from __future__ import annotations

from dloftbs.lifting.axis import Lifted, lift
from dloftbs.lifting.beside import DepthDisplacement

__all__ = ["DepthDisplacement", "Lifted", "lift"]
