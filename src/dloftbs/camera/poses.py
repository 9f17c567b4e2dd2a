"""Poses: rotations and translations of one frame in another, as matrices (4, 4)."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from dloftbs.errors import InputError, source_errors
from dloftbs.support.arrays import FloatArray, as_float_array, as_vector
from dloftbs.support.documents import parse_yaml, read_text
from dloftbs.support.values import check_path, shown

_ROTATION_TOLERANCE = 1e-3
"""Largest entry of R R^T - 1 of a rotation that was written with few digits, a share of 1.

Source: by hand; four digits.
"""

POSE_FORMS = "a matrix (4, 4), or translation_m (3,) with rotation (3, 3), quaternion_xyzw (4,) or rpy (3,) in radians"
_ROTATIONS = ("rotation", "quaternion_xyzw", "rpy")
POSE_KEYS = ("translation_m", *_ROTATIONS)


def as_pose(name: str, value: npt.ArrayLike | Mapping[str, Any]) -> FloatArray:
    """Return the pose of one frame in another as a matrix (4, 4): ``p_other = pose @ p``.

    Parameters
    ----------
    name : str
        For messages.
    value : array_like, shape (4, 4), or mapping
        A mapping has `translation_m` (3,), or a rotation, or both: `rotation` (3, 3), `quaternion_xyzw` (4,), or `rpy`
        (3,), angles in radians about the fixed axes x, y and z, in this order.

    Raises
    ------
    InputError
        If it is none of these, or its rotation is none.
    """
    if isinstance(value, Mapping):
        return _pose_of(name, value)
    pose = as_float_array(name, value)
    if pose.shape != (4, 4):
        raise InputError(f"{name} must be {POSE_FORMS}, got shape {pose.shape}")
    if not np.allclose(pose[3], (0.0, 0.0, 0.0, 1.0), rtol=0.0, atol=_ROTATION_TOLERANCE):
        raise InputError(f"the last row of {name} must be 0 0 0 1, got {pose[3].tolist()}")
    return _with_rotation(name, pose[:3, :3], pose[:3, 3])


def read_pose(path: str | Path) -> FloatArray:
    """Read a pose from a YAML or JSON file that holds what `as_pose` takes; return its matrix (4, 4).

    Raises
    ------
    SourceError
        If the file cannot be read, or holds something else.
    """
    place = check_path("path", path)
    with source_errors(place, InputError):
        documents = parse_yaml(read_text(place))
        if len(documents) != 1:
            raise InputError(f"a pose must be {POSE_FORMS}, got {len(documents)} documents")
        return as_pose("a pose", documents[0])


def pose_of(rotation: FloatArray, translation_m: npt.ArrayLike) -> FloatArray:
    """Return a pose (4, 4) of its rotation (3, 3) and its translation (3,)."""
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation, translation_m
    return pose


def is_rotation(matrix: FloatArray) -> bool:
    """Return whether a matrix (3, 3) is a rotation, but for the few digits that it may be written with."""
    off = float(np.abs(matrix @ matrix.T - np.eye(3)).max())
    return off <= _ROTATION_TOLERANCE and bool(np.linalg.det(matrix) >= 0.0)


def inverse_of(pose: FloatArray) -> FloatArray:
    """Return the inverse of a pose (4, 4)."""
    rotation = pose[:3, :3].T
    return pose_of(rotation, -rotation @ pose[:3, 3])


def rotation_about(axis: FloatArray, angle: float) -> FloatArray:
    """Return the rotation (3, 3) by an angle, radians, about a unit vector (3,)."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    rotation: FloatArray = np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross
    return rotation


def _pose_of(name: str, given: Mapping[str, Any]) -> FloatArray:
    unknown = [str(key) for key in given if key not in POSE_KEYS]
    rotations = [key for key in _ROTATIONS if key in given]
    if unknown or not given or len(rotations) > 1:
        raise InputError(f"{name} must be {POSE_FORMS}, got {shown(dict(given))}")
    translation = as_vector(f"translation_m of {name}", given.get("translation_m", (0.0, 0.0, 0.0)), 3)
    rotation = np.eye(3)
    match rotations:
        case ["rotation"]:
            rotation = as_float_array(f"rotation of {name}", given["rotation"])
            if rotation.shape != (3, 3):
                raise InputError(f"rotation of {name} must have shape (3, 3), got {rotation.shape}")
        case ["quaternion_xyzw"]:
            rotation = _of_quaternion(name, as_vector(f"quaternion_xyzw of {name}", given["quaternion_xyzw"], 4))
        case ["rpy"]:
            angles = as_vector(f"rpy of {name}", given["rpy"], 3)
            roll, pitch, yaw = (rotation_about(axis, angle) for axis, angle in zip(np.eye(3), angles, strict=True))
            rotation = yaw @ pitch @ roll
    return _with_rotation(name, rotation, translation)


def _of_quaternion(name: str, quaternion: FloatArray) -> FloatArray:
    """Return the rotation of a quaternion x, y, z, w."""
    norm = float(np.linalg.norm(quaternion))
    if abs(norm - 1.0) > _ROTATION_TOLERANCE:
        raise InputError(f"quaternion_xyzw of {name} must have the length 1, got {norm:g}")
    sine = float(np.linalg.norm(quaternion[:3]))
    if sine == 0.0:
        return np.eye(3)
    return rotation_about(quaternion[:3] / sine, 2.0 * float(np.arctan2(sine, quaternion[3])))


def _with_rotation(name: str, rotation: FloatArray, translation: FloatArray) -> FloatArray:
    if not is_rotation(rotation):
        raise InputError(f"the rotation of {name} must be one, R R^T = 1 and det R = 1, got {rotation.tolist()}")
    return pose_of(rotation, translation)
