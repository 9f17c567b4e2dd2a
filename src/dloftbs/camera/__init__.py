"""Pinhole cameras with lenses, their files, and depth registered to another camera."""

from __future__ import annotations

from dloftbs.camera.lens_models import LensModel
from dloftbs.camera.pinhole import PinholeCamera
from dloftbs.camera.registration import DepthRegistration

__all__ = ["DepthRegistration", "LensModel", "PinholeCamera"]
