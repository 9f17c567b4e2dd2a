"""Depth to the axis of each object, in metres."""

from __future__ import annotations

from dloftbs.lifting.axis import Lifted, lift

__all__ = ["Lifted", "lift"]
