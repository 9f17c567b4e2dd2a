"""Masks to mask crops: bounding box, morphology, orientation."""

from __future__ import annotations

from dloftbs.cleaning.morphology import clean
from dloftbs.cleaning.slits import close_slits

__all__ = ["clean", "close_slits"]
