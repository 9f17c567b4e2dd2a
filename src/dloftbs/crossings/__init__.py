"""Crossings of objects with each other and themselves, and which of the two is on top."""

from __future__ import annotations

from dloftbs.crossings.curve_crossings import find_crossings

__all__ = ["find_crossings"]
