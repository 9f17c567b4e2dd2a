"""Masks to mask crops: bounding box, morphology, orientation."""

from __future__ import annotations

from dloftbs.cleaning.morphology import clean
from dloftbs.cleaning.seams import open_seams

__all__ = ["clean", "open_seams"]
