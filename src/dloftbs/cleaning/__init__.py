"""Masks to mask crops: bounding box, morphology, orientation."""

from __future__ import annotations

from dloftbs.cleaning.morphology import clean

__all__ = ["clean"]
