"""Pinhole cameras with lenses, their files, and depth registered to another camera."""

from __future__ import annotations

from dloftbs.camera.lens_models import LensModel
from dloftbs.camera.pinhole import CameraLike, PinholeCamera, as_camera
from dloftbs.camera.poses import as_pose, inverse_of, is_rotation, read_pose, rotation_about
from dloftbs.camera.registration import DepthRegistration
from dloftbs.camera.rig_files import read_rig

__all__ = [
    "CameraLike",
    "DepthRegistration",
    "LensModel",
    "PinholeCamera",
    "as_camera",
    "as_pose",
    "inverse_of",
    "is_rotation",
    "read_pose",
    "read_rig",
    "rotation_about",
]
